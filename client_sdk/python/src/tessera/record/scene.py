"""Messages for drawing tools: moving frames, and shapes that are fixed to them.

Of Foxglove's well-known schemas, `SceneUpdate` has the shapes once, each locked to the frame named after its
body, and `FrameTransforms` moves the frames tick by tick. A `SceneUpdate` per tick would repeat all shapes.
Besides, tools can follow a frame and measure from it, but not from a shape.

All positions are relative to the centre of one sector, because such tools have a single floating-point number
per coordinate: positions near that sector keep full precision, distant ones are rounded.
"""

from __future__ import annotations

import colorsys
from collections.abc import Iterable, Mapping
from typing import Any

from tessera._proto import query_pb2, world_pb2
from tessera.frame import BodyFrame
from tessera.position import Sector, SectorLike
from tessera.record.schema import FrameTransforms, SceneEntityDeletion, SceneUpdate
from tessera.record.surface import surface_of
from tessera.record.topics import NANOSECONDS

STATIC_COLOUR = (0.55, 0.55, 0.55)
TRIGGER_OPACITY = 0.2
GOLDEN_RATIO = 0.618034  # neighbours get colours far from each other


def frame_of(sector: SectorLike) -> str:
    """The name of the frame at the centre of a sector."""
    i, j, k = sector
    return f"sector {i},{j},{k}"


def transforms(frame: BodyFrame, names: Mapping[int, str], sector: Sector, time: int) -> Any:
    """Where the frames of bodies are at `time` ns; bodies without a name are left out."""
    result = FrameTransforms()
    parent = frame_of(sector)
    seconds, nanos = divmod(time, NANOSECONDS)
    places = frame.relative_to(sector).tolist()
    for body, place, turn in zip(frame.ids.tolist(), places, frame.orientations.tolist()):
        if body not in names:
            continue
        transform = result.transforms.add(parent_frame_id=parent, child_frame_id=names[body])
        transform.timestamp.seconds, transform.timestamp.nanos = seconds, nanos
        to, by = transform.translation, transform.rotation
        to.x, to.y, to.z = place
        by.x, by.y, by.z, by.w = turn
    return result


def scene(
    bodies: Iterable[query_pb2.FoundBodies.Found], shapes: Mapping[int, world_pb2.Shape], time: int
) -> Any:
    """The shapes of all bodies, which replace all previous ones."""
    result = SceneUpdate()
    seconds, nanos = divmod(time, NANOSECONDS)
    deletion = result.deletions.add(type=SceneEntityDeletion.ALL)
    deletion.timestamp.seconds, deletion.timestamp.nanos = seconds, nanos
    for body in bodies:
        entity = result.entities.add(frame_id=body.name, id=body.name, frame_locked=True)
        entity.timestamp.CopyFrom(deletion.timestamp)
        colour = _colour(body)
        for part in shapes[body.properties.shape].parts:
            is_trigger = body.properties.trigger or part.material.trigger
            _draw(entity, part, {**colour, "a": TRIGGER_OPACITY} if is_trigger else colour)
    return result


def _colour(body: query_pb2.FoundBodies.Found) -> dict[str, float]:
    red, green, blue = STATIC_COLOUR
    if body.properties.motion != world_pb2.MOTION_STATIC:
        red, green, blue = colorsys.hls_to_rgb(body.id * GOLDEN_RATIO % 1, 0.6, 0.7)
    return {"r": red, "g": green, "b": blue, "a": 1.0}


def _draw(entity: Any, part: world_pb2.Shape.Part, colour: Mapping[str, float]) -> None:
    """Adds one part of a shape to the entity of its body."""
    geometry = part.geometry
    kind = geometry.WhichOneof("kind")
    if kind == "box":
        size = geometry.box.size
        _add(entity.cubes, part.pose, colour, (size.x, size.y, size.z))
    elif kind == "sphere":
        _add(entity.spheres, part.pose, colour, (2 * geometry.sphere.radius,) * 3)
    elif kind == "ellipsoid":
        radii = geometry.ellipsoid.radii
        _add(entity.spheres, part.pose, colour, (2 * radii.x, 2 * radii.y, 2 * radii.z))
    elif kind == "cylinder":
        _add_cylinder(entity, part.pose, colour, geometry.cylinder.radius, geometry.cylinder.length)
    elif kind == "capsule":
        radius, length = geometry.capsule.radius, geometry.capsule.length
        _add_cylinder(entity, part.pose, colour, radius, length)
        for end in (-length / 2, length / 2):
            ball = _add(entity.spheres, part.pose, colour, (2 * radius,) * 3)
            _shift_along_z(ball.pose, end)
    elif kind != "ground":  # which has no end, and is known to servers alone
        surface = surface_of(geometry)
        triangles = _add(entity.triangles, part.pose, colour)
        for x, y, z in surface.points.tolist():
            triangles.points.add(x=x, y=y, z=z)
        triangles.indices.extend(surface.triangles.ravel().tolist())


def _add(
    primitives: Any,
    pose: world_pb2.Pose,
    colour: Mapping[str, float],
    size: tuple[float, float, float] | None = None,
) -> Any:
    primitive = primitives.add(color=colour)
    at, turn = pose.position, pose.orientation
    place, by = primitive.pose.position, primitive.pose.orientation
    place.x, place.y, place.z = at.x, at.y, at.z
    by.x, by.y, by.z, by.w = turn.x, turn.y, turn.z, turn.w
    if not pose.HasField("orientation"):
        by.w = 1.0
    if size is not None:
        primitive.size.x, primitive.size.y, primitive.size.z = size
    return primitive


def _add_cylinder(
    entity: Any, pose: world_pb2.Pose, colour: Mapping[str, float], radius: float, length: float
) -> None:
    cylinder = _add(entity.cylinders, pose, colour, (2 * radius, 2 * radius, length))
    cylinder.bottom_scale = cylinder.top_scale = 1.0


def _shift_along_z(pose: Any, distance: float) -> None:
    """Moves a pose along its own z."""
    q = pose.orientation
    pose.position.x += distance * 2 * (q.x * q.z + q.w * q.y)
    pose.position.y += distance * 2 * (q.y * q.z - q.w * q.x)
    pose.position.z += distance * (1 - 2 * (q.x * q.x + q.y * q.y))
