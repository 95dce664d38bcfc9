"""Answers of a cluster, and types of queries."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from tessera._proto import command_pb2, query_pb2, world_pb2
from tessera.body import Motion
from tessera.columns import numbers_of, packed_fields, varints_of
from tessera.position import (
    Floats,
    Integers,
    PositionLike,
    Quaternion,
    SectorLike,
    Vector,
    VectorLike,
    WorldPosition,
    relative_to,
    to_position,
    to_vector,
)
from tessera.references import IdsLike, id_list

Ids: TypeAlias = NDArray[np.uint64]


@dataclass(frozen=True)
class LoadSummary:
    """The summary of a load."""

    bodies: int
    sectors: int  # with a body that can move
    servers: int


@dataclass(frozen=True)
class Added:
    """What a command has made. Ids of bodies, and of joints, follow each other in the order of the model."""

    tick: int  # the first that it takes part in
    bodies: range  # ids
    joints: range
    command: int = 0  # its place in the list

    @property
    def id(self) -> int:
        """That of the first body, or else of the first joint."""
        return (self.bodies or self.joints)[0]


@dataclass(frozen=True)
class Applied:
    """What commands did."""

    tick: int  # at whose beginning they take effect; 0: there were neither commands nor ticks
    created: Sequence[Added]  # by those that made bodies or joints, in their order


@dataclass(frozen=True)
class HashAt:
    """The hash of a world's state: equal states have equal hashes, on any number of servers."""

    tick: int
    hash: str  # 32 hexadecimal digits
    programs: str = ""  # likewise, of the numbers of all programs; "": there are none


@dataclass(frozen=True)
class FoundProgram:
    """A program of a body, with its numbers by their names."""

    body: int
    body_name: str
    program: int  # its place on the body
    kind: str
    parameters: dict[str, float]
    inputs: dict[str, float]
    values: dict[str, float]  # its state, as its last run left it
    fault: str  # why it was stopped; "": it runs
    name: str = ""  # of the program


def to_found_programs(message: query_pb2.FoundPrograms) -> list[FoundProgram]:
    def numbers(named: Iterable[world_pb2.NamedNumber]) -> dict[str, float]:
        return {number.name: number.value for number in named}

    return [
        FoundProgram(
            found.body,
            found.name,
            found.program,
            found.kind,
            numbers(found.parameters),
            numbers(found.inputs),
            numbers(found.values),
            found.fault,
            found.program_name,
        )
        for found in message.programs
    ]


@dataclass(frozen=True)
class FoundBody:
    """A body of the world."""

    id: int
    name: str
    properties: world_pb2.BodyProperties  # proto/world.proto has its fields
    user_data: bytes = b""
    owner: str = ""  # who may command it by requests with this owner; "": nobody in particular

    @property
    def motion(self) -> Motion:
        return Motion(self.properties.motion)


@dataclass(frozen=True)
class FoundJoint:
    """A joint of the world."""

    id: int
    name: str
    parent: str  # name of the body; empty: the world
    child: str
    joint: world_pb2.Joint  # with its latest drives; proto/world.proto has its fields
    # Centres of mass, in the body frames: the velocities of a BodyFrame are of these points.
    parent_centre: Vector = (0.0, 0.0, 0.0)
    child_centre: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class FoundFrame:
    """A frame that is fixed to a body; `BodyFrame.pose_of()` has its pose."""

    name: str
    body: int
    body_name: str
    position: Vector  # m, in the body frame
    orientation: Quaternion  # frame to body frame, x y z w


@dataclass(frozen=True)
class Neighbour:
    """A body near a probe."""

    id: int
    name: str
    distance: float  # m, between the surfaces; 0 if they overlap


@dataclass(frozen=True)
class RayHit:
    """The first hit of a ray."""

    id: int
    name: str
    distance: float  # m
    position: WorldPosition
    normal: Vector


@dataclass(frozen=True, eq=False)
class RayHits:
    """The first hits of n rays, in their order."""

    ids: Ids  # [n], 0 where nothing is hit
    distances: Floats  # [n], m; infinite where nothing is hit, and what follows is not a number, or 0
    sectors: Integers  # [n, 3]
    local: Floats  # [n, 3], m from the centre of the sector
    normals: Floats  # [n, 3], world axes

    def __len__(self) -> int:
        return len(self.ids)

    @property
    def hit(self) -> NDArray[np.bool_]:
        """Whether anything is [n]."""
        hit: NDArray[np.bool_] = self.ids != 0
        return hit

    def relative_to(self, sector: SectorLike, sector_size: float) -> Floats:
        """Positions [n, 3] in metres from the centre of `sector`; see `tessera.relative_to()`."""
        return relative_to(self.sectors, self.local, sector, sector_size)


@dataclass(frozen=True, eq=False)
class _Rows:
    """Arrays of what has an id, ascending by id: row n of every array is of `ids[n]`."""

    tick: int
    ids: Ids  # [n]

    def __len__(self) -> int:
        return len(self.ids)

    def of(self: Rows, ids: IdsLike) -> Rows:
        """The rows of these ids only, in this order. KeyError if there is none of one."""
        wanted = np.array(id_list(ids), dtype=np.uint64)
        rows = np.searchsorted(self.ids, wanted)
        is_there = rows < len(self.ids)
        is_there[is_there] = self.ids[rows[is_there]] == wanted[is_there]
        if not is_there.all():
            raise KeyError(int(wanted[~is_there][0]))
        arrays = {f.name: getattr(self, f.name)[rows] for f in fields(self) if f.name != "tick"}
        return replace(self, **arrays)


Rows = TypeVar("Rows", bound=_Rows)


@dataclass(frozen=True, eq=False)
class BodyStates(_Rows):
    """The states of bodies at the end of a tick, ascending by id; row n of every array is of body `ids[n]`."""

    sectors: Integers  # [n, 3]
    local: Floats  # [n, 3], m from the centre of the sector, of the body frame
    orientations: Floats  # [n, 4], body frame to world axes, x y z w
    linear_velocities: Floats  # [n, 3], of the centre of mass, m/s, world axes
    angular_velocities: Floats  # [n, 3], rad/s, world axes
    asleep: NDArray[np.bool_]  # [n]
    frames: NDArray[np.uint32]  # [n], of the sectors: 0 is the world's, n the n-th of Settings.frames

    def relative_to(self, sector: SectorLike, sector_size: float) -> Floats:
        """Positions [n, 3] in metres from the centre of `sector`; see `tessera.relative_to()`."""
        return relative_to(self.sectors, self.local, sector, sector_size)


@dataclass(frozen=True, eq=False)
class JointStates(_Rows):
    """The states of joints at the end of a tick, ascending by id; row n of every array is of joint `ids[n]`."""

    positions: Floats  # [n, 2], by axis, rad or m; not a number where the joint has no such axis
    rates: Floats  # [n, 2], rad/s or m/s; likewise
    # [n, 2], N m or N, likewise, and all of them if not asked for: what drive, spring, damping, friction and limit
    # gave, together; positive where they push to larger positions. The mean over the last tick in which the joint
    # was awake.
    efforts: Floats
    # [n, 6], if asked for: the force (N), then the torque (N m, about the origin of the joint frame on the child)
    # with which the joint acts on its child, efforts included, along the axes of that frame. Mean likewise.
    reactions: Floats


@dataclass(frozen=True)
class BodyDistance:
    """How near two bodies come to each other."""

    distance: float  # m; < 0 where convex parts overlap: how far one would have to move along the normal, at most
    on_a: WorldPosition  # on the surfaces
    on_b: WorldPosition
    normal: Vector  # of unit length, from b to a


@dataclass(frozen=True, eq=False)
class Dynamics:
    """The dynamics of an assembly: `mass_matrix @ accelerations + bias = efforts`.

    Degrees of freedom [d] are, in this order: of a floating base, its velocity and angular velocity along the world's
    axes; then the rates of the axes of `joints`, or, of a ball joint, the angular velocity of its child relative to
    its parent, along the axes of the joint frame on the parent. Arrays that were not asked for are empty, and all of
    them are where a body of the assembly is not there.
    """

    tick: int
    base: int  # the body that floats: that with the lowest id; 0: it hangs on the world, or on a body
    joints: Ids  # [j], from the base on, each after that of its parent, else ascending
    freedoms: Integers  # [j], of each joint, 0 to 3
    velocities: Floats  # [d]
    bias: Floats  # [d], without which nothing accelerates: gravity (not what frames add), Coriolis; N m or N
    efforts: Floats  # [d], for the accelerations that were given
    mass_matrix: Floats  # [d, d]
    jacobians: Floats  # [points, 6, d]: the velocity of the point, then the angular velocity; world axes


@dataclass(frozen=True)
class Region:
    """A box along the world's axes."""

    centre: PositionLike
    half_size: VectorLike  # m


def to_applied(message: command_pb2.Applied) -> Applied:
    return Applied(
        message.tick,
        [
            Added(
                message.tick,
                range(made.first_body, made.first_body + made.bodies),
                range(made.first_joint, made.first_joint + made.joints),
                made.command,
            )
            for made in message.created
        ],
    )


def to_ray_hits(message: query_pb2.HitColumns) -> RayHits:
    packed = packed_fields(message)
    ids = numbers_of(packed, "bodies", np.uint64)
    hit = ids != 0
    table = np.array([(one.i, one.j, one.k) for one in message.sectors] or [(0, 0, 0)], dtype=np.int64)
    sectors = table[varints_of(packed, "sector").astype(np.intp)]
    return RayHits(
        ids=ids,
        distances=np.where(hit, numbers_of(packed, "distances", np.float64), np.inf),
        sectors=np.where(hit[:, np.newaxis], sectors, 0),
        local=np.where(hit[:, np.newaxis], numbers_of(packed, "positions", np.float64, 3), np.nan),
        normals=np.where(hit[:, np.newaxis], numbers_of(packed, "normals", np.float64, 3), np.nan),
    )


def to_body_states(tick: int, message: query_pb2.BodyColumns) -> BodyStates:
    packed = packed_fields(message)
    sectors = np.array([(one.i, one.j, one.k) for one in message.sectors], dtype=np.int64).reshape(-1, 3)
    frames = np.array([one.frame for one in message.sectors], dtype=np.uint32)
    places = varints_of(packed, "sector").astype(np.intp)
    return BodyStates(
        tick=tick,
        ids=numbers_of(packed, "ids", np.uint64),
        sectors=sectors[places],
        local=numbers_of(packed, "positions", np.float64, 3),
        orientations=numbers_of(packed, "orientations", np.float64, 4),
        linear_velocities=numbers_of(packed, "linear_velocities", np.float64, 3),
        angular_velocities=numbers_of(packed, "angular_velocities", np.float64, 3),
        asleep=varints_of(packed, "asleep").astype(np.bool_),
        frames=frames[places],
    )


def to_joint_states(tick: int, message: query_pb2.JointColumns) -> JointStates:
    packed = packed_fields(message)
    ids = numbers_of(packed, "ids", np.uint64)
    axes = varints_of(packed, "axes")
    is_there = np.arange(2) < axes[:, np.newaxis]
    columns = {}
    for name in ("positions", "rates", "efforts"):
        columns[name] = np.full(is_there.shape, np.nan)
        if name in packed or name != "efforts":
            columns[name][is_there] = numbers_of(packed, name, np.float64)
    reactions = numbers_of(packed, "reactions", np.float64, 6)
    if len(reactions) != len(ids):
        reactions = np.full((len(ids), 6), np.nan)
    return JointStates(tick, ids, reactions=reactions, **columns)


def to_distance(message: query_pb2.Distance) -> BodyDistance | None:
    if message.beyond:
        return None
    places = to_position(message.on_a), to_position(message.on_b)
    return BodyDistance(message.distance, *places, to_vector(message.normal))


def to_dynamics(tick: int, message: query_pb2.Dynamics) -> Dynamics:
    freedoms = len(message.velocities)
    has_matrix = len(message.mass_matrix) > 0
    return Dynamics(
        tick=tick,
        base=message.base,
        joints=np.array(message.joints, dtype=np.uint64),
        freedoms=np.array(message.freedoms, dtype=np.int64),
        velocities=np.array(message.velocities),
        bias=np.array(message.bias),
        efforts=np.array(message.efforts),
        mass_matrix=np.array(message.mass_matrix).reshape((freedoms, freedoms) if has_matrix else (0, 0)),
        jacobians=np.array(message.jacobians).reshape((-1, 6, freedoms) if message.jacobians else (0, 6, freedoms)),
    )
