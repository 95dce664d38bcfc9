"""Message types in recordings: for each, a set of files with which any reader can decode it.

Those of Foxglove come from a descriptor and not from a module, so that packages that register messages of the
same names can be imported as well.
"""

from __future__ import annotations

from importlib.resources import files
from typing import Any

from google.protobuf import descriptor_pb2, message_factory


def definition_of(kind: Any) -> bytes:
    """The FileDescriptorSet of a message class, with all imports of its file."""
    result = descriptor_pb2.FileDescriptorSet()
    named: set[str] = set()

    def add(file: Any) -> None:
        if file.name in named:
            return
        named.add(file.name)
        for other in file.dependencies:
            add(other)
        file.CopyToProto(result.file.add())

    add(kind.DESCRIPTOR.file)
    definition: bytes = result.SerializeToString()
    return definition


_FOXGLOVE = descriptor_pb2.FileDescriptorSet.FromString(
    files("tessera._proto").joinpath("foxglove.binpb").read_bytes()
)
_MESSAGES = message_factory.GetMessages(_FOXGLOVE.file)

FrameTransforms = _MESSAGES["foxglove.FrameTransforms"]
SceneEntity = _MESSAGES["foxglove.SceneEntity"]
SceneEntityDeletion = _MESSAGES["foxglove.SceneEntityDeletion"]
SceneUpdate = _MESSAGES["foxglove.SceneUpdate"]
LaserScan = _MESSAGES["foxglove.LaserScan"]
PackedElementField = _MESSAGES["foxglove.PackedElementField"]
PointCloud = _MESSAGES["foxglove.PointCloud"]
LocationFix = _MESSAGES["foxglove.LocationFix"]
