"""Rigid bodies in worlds of any size: in this process, or on a cluster.

    simulation = tessera.Simulation("worlds/tower.sdf")
    simulation.step(60)
    print(simulation.hash())

    with tessera.Cluster(servers=2) as cluster, cluster.connect() as client:
        client.load("worlds/tower.sdf")
        client.apply_impulse("tower::box_9", (20, 0, 0))
        path = client.trajectory("tower::box_9", ticks=120)
        print(path.relative_to()[-1, 0])

Units: m, kg, s, rad, N. Positions are a sector and a displacement from its centre, exact at any distance.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from tessera import commands, queries
from tessera._proto.command_pb2 import Command
from tessera._proto.world_pb2 import Shape
from tessera.any_client import AnyClient, Balance, Status
from tessera.body import Body, Motion, Program, Surface
from tessera.commands import PlacedBody, PlacedJoint
from tessera.errors import (
    Aborted,
    AlreadyExists,
    Cancelled,
    DataLoss,
    DeadlineExceeded,
    FailedPrecondition,
    InvalidArgument,
    NotFound,
    OutOfRange,
    PermissionDenied,
    ResourceExhausted,
    TesseraError,
    Unavailable,
)
from tessera.frame import (
    BodyFrame,
    Contact,
    ContactFrame,
    ContactPoint,
    Divergence,
    DivergenceFrame,
    DivergenceKind,
    FoundContacts,
    Phase,
    ProgramFrame,
    ProgramSample,
    SeamFrame,
    Trajectory,
)
from tessera.joint import Axis, Drive, DriveMode, Joint, JointType, Mimic
from tessera.mechanics import Mechanics, Sums
from tessera.position import WorldPosition, relative_to
from tessera.queries import Answers, Catalogue, Query
from tessera.references import BodyName, JointName
from tessera.results import (
    Added,
    Applied,
    BodyDistance,
    BodyStates,
    Dynamics,
    FoundBody,
    FoundFrame,
    FoundJoint,
    FoundProgram,
    HashAt,
    JointStates,
    LoadSummary,
    Neighbour,
    RayHit,
    RayHits,
    Region,
)
from tessera.shape import (
    box,
    bounding_radius,
    capsule,
    compound,
    convex_hull,
    cylinder,
    ellipsoid,
    height_field,
    moments_of,
    plane,
    sphere,
    triangle_mesh,
    trigger,
)
from tessera.simulation import Simulation
from tessera.vector_env import Box, Copy, CopyState, EnvState, VectorEnv
from tessera.world import CentralGravity, FrameKey, MovingFrame, Precision, SeamPolicy, Settings, World

if TYPE_CHECKING:
    from tessera.body_streams import BodyStream
    from tessera.client import Client
    from tessera.cluster import Cluster
    from tessera.joint_stream import JointFrame, JointStream
    from tessera.stream import ContactStream, DivergenceStream, ProgramStream, SeamStream, Stream

# What needs gRPC, whose import takes as long as all others: loaded when it is first used.
_LATER = {
    "BodyStream": "body_streams",
    "Client": "client",
    "Cluster": "cluster",
    "ContactStream": "stream",
    "DivergenceStream": "stream",
    "JointFrame": "joint_stream",
    "JointStream": "joint_stream",
    "ProgramStream": "stream",
    "SeamStream": "stream",
    "Stream": "stream",
}


def __getattr__(name: str) -> Any:
    if name not in _LATER:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_LATER[name]}"), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *_LATER})


__all__ = [
    "Aborted",
    "Added",
    "AlreadyExists",
    "Answers",
    "AnyClient",
    "Applied",
    "Axis",
    "Balance",
    "Body",
    "BodyDistance",
    "BodyFrame",
    "BodyName",
    "BodyStates",
    "BodyStream",
    "Box",
    "Cancelled",
    "Catalogue",
    "CentralGravity",
    "Client",
    "Cluster",
    "Command",
    "Contact",
    "ContactFrame",
    "ContactPoint",
    "ContactStream",
    "Copy",
    "CopyState",
    "DataLoss",
    "DeadlineExceeded",
    "Divergence",
    "DivergenceFrame",
    "DivergenceKind",
    "DivergenceStream",
    "Drive",
    "DriveMode",
    "Dynamics",
    "EnvState",
    "FailedPrecondition",
    "FoundBody",
    "FoundContacts",
    "FoundFrame",
    "FoundJoint",
    "FoundProgram",
    "FrameKey",
    "HashAt",
    "InvalidArgument",
    "Joint",
    "JointFrame",
    "JointName",
    "JointStates",
    "JointStream",
    "JointType",
    "LoadSummary",
    "Mechanics",
    "Mimic",
    "Motion",
    "MovingFrame",
    "Neighbour",
    "NotFound",
    "OutOfRange",
    "PermissionDenied",
    "Phase",
    "PlacedBody",
    "PlacedJoint",
    "Precision",
    "Program",
    "ProgramFrame",
    "ProgramSample",
    "ProgramStream",
    "Query",
    "RayHit",
    "RayHits",
    "Region",
    "ResourceExhausted",
    "SeamFrame",
    "SeamPolicy",
    "SeamStream",
    "Settings",
    "Simulation",
    "Shape",
    "Status",
    "Stream",
    "Sums",
    "Surface",
    "TesseraError",
    "Trajectory",
    "Unavailable",
    "VectorEnv",
    "World",
    "WorldPosition",
    "bounding_radius",
    "box",
    "capsule",
    "commands",
    "compound",
    "convex_hull",
    "cylinder",
    "ellipsoid",
    "height_field",
    "moments_of",
    "plane",
    "queries",
    "relative_to",
    "sphere",
    "triangle_mesh",
    "trigger",
]
