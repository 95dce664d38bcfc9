"""Client of a Tessera cluster: rigid bodies in worlds of any size.

    with tessera.Cluster(servers=2) as cluster, cluster.connect() as client:
        client.load("worlds/tower.sdf")
        client.apply_impulse("tower::box_9", (20, 0, 0))
        path = client.trajectory("tower::box_9", ticks=120)
        print(path.relative_to()[-1, 0])

Units: m, kg, s, rad, N. Positions are a sector and a displacement from its centre, exact at any distance.
"""

from tessera import commands, queries
from tessera._proto.command_pb2 import Command
from tessera._proto.world_pb2 import Shape
from tessera.body import Body, Motion, Program, Surface
from tessera.body_streams import BodyStream
from tessera.client import Client, ContactStream, DivergenceStream, ProgramStream, SeamStream, Status
from tessera.cluster import Cluster
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
from tessera.joint_stream import JointFrame, JointStream
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
from tessera.stream import Stream
from tessera.world import CentralGravity, Precision, SeamPolicy, Settings, World

__all__ = [
    "Aborted",
    "Added",
    "AlreadyExists",
    "Answers",
    "Applied",
    "Axis",
    "Body",
    "BodyDistance",
    "BodyFrame",
    "BodyName",
    "BodyStates",
    "BodyStream",
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
    "DataLoss",
    "DeadlineExceeded",
    "Divergence",
    "DivergenceFrame",
    "DivergenceKind",
    "DivergenceStream",
    "Drive",
    "DriveMode",
    "Dynamics",
    "FailedPrecondition",
    "FoundBody",
    "FoundContacts",
    "FoundFrame",
    "FoundJoint",
    "FoundProgram",
    "HashAt",
    "InvalidArgument",
    "Joint",
    "JointFrame",
    "JointName",
    "JointStates",
    "JointStream",
    "JointType",
    "LoadSummary",
    "Mimic",
    "Motion",
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
    "Shape",
    "Status",
    "Stream",
    "Surface",
    "TesseraError",
    "Trajectory",
    "Unavailable",
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
