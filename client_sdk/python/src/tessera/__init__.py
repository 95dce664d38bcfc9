"""Client of a Tessera cluster: rigid bodies in worlds of any size.

    with tessera.Cluster(servers=2) as cluster, cluster.connect() as client:
        client.load("worlds/tower.sdf")
        client.apply_impulse("tower::box_9", (20, 0, 0))
        path = client.trajectory("tower::box_9", ticks=120)
        print(path.relative_to()[-1, 0])

Units: m, kg, s, rad, N. Positions are a sector and a displacement from its centre, exact at any distance.
"""

from tessera._proto.world_pb2 import Shape
from tessera.body import Body, Motion, Surface
from tessera.client import BodyName, BodyStream, Catalogue, Client, ContactStream, DivergenceStream, Status
from tessera.cluster import Cluster
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
    Phase,
    Trajectory,
)
from tessera.joint import Axis, Drive, DriveMode, Joint, JointType, Mimic
from tessera.position import WorldPosition, relative_to
from tessera.results import (
    Added,
    FoundBody,
    FoundFrame,
    FoundJoint,
    HashAt,
    LoadSummary,
    Neighbour,
    RayHit,
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
)
from tessera.stream import Stream
from tessera.world import CentralGravity, Precision, SeamPolicy, Settings, World

__all__ = [
    "Aborted",
    "Added",
    "AlreadyExists",
    "Axis",
    "Body",
    "BodyFrame",
    "BodyName",
    "BodyStream",
    "Cancelled",
    "Catalogue",
    "CentralGravity",
    "Client",
    "Cluster",
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
    "FailedPrecondition",
    "FoundBody",
    "FoundFrame",
    "FoundJoint",
    "HashAt",
    "InvalidArgument",
    "Joint",
    "JointType",
    "LoadSummary",
    "Mimic",
    "Motion",
    "Neighbour",
    "NotFound",
    "OutOfRange",
    "PermissionDenied",
    "Phase",
    "Precision",
    "RayHit",
    "Region",
    "ResourceExhausted",
    "SeamPolicy",
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
    "compound",
    "convex_hull",
    "cylinder",
    "ellipsoid",
    "height_field",
    "moments_of",
    "plane",
    "relative_to",
    "sphere",
    "triangle_mesh",
]
