"""Answers of a cluster, and types of queries."""

from __future__ import annotations

from collections.abc import Sequence
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


@dataclass(frozen=True)
class FoundBody:
    """A body of the world."""

    id: int
    name: str
    properties: world_pb2.BodyProperties  # proto/world.proto has its fields

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

    def relative_to(self, sector: SectorLike, sector_size: float) -> Floats:
        """Positions [n, 3] in metres from the centre of `sector`; see `tessera.relative_to()`."""
        return relative_to(self.sectors, self.local, sector, sector_size)


@dataclass(frozen=True, eq=False)
class JointStates(_Rows):
    """The states of joints at the end of a tick, ascending by id; row n of every array is of joint `ids[n]`."""

    positions: Floats  # [n, 2], by axis, rad or m; not a number where the joint has no such axis
    rates: Floats  # [n, 2], rad/s or m/s; likewise


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


def to_ray_hits(results: Sequence[query_pb2.RayHits]) -> RayHits:
    """The first hit of each."""
    found = [(place, result.hits[0]) for place, result in enumerate(results) if result.hits]
    rows = np.array([place for place, _ in found], dtype=np.intp)
    count = len(results)

    def scattered(values: Any, fill: Any, kind: type[np.generic], width: int) -> NDArray[Any]:
        array = np.full((count, width), fill, dtype=kind)
        array[rows] = np.array(values, dtype=kind).reshape(-1, width)
        return array

    numbers = []
    sectors = []
    for _, hit in found:
        local, normal, sector = hit.position.local, hit.normal, hit.position.sector
        numbers.append((local.x, local.y, local.z, normal.x, normal.y, normal.z, hit.distance))
        sectors.append((sector.i, sector.j, sector.k))
    values = scattered(numbers, np.nan, np.float64, 7)
    distances = values[:, 6].copy()
    distances[np.isnan(distances)] = np.inf
    return RayHits(
        ids=scattered([hit.body for _, hit in found], 0, np.uint64, 1)[:, 0],
        distances=distances,
        sectors=scattered(sectors, 0, np.int64, 3),
        local=values[:, 0:3],
        normals=values[:, 3:6],
    )


def to_body_states(tick: int, message: query_pb2.BodyColumns) -> BodyStates:
    packed = packed_fields(message)
    sectors = np.array([(one.i, one.j, one.k) for one in message.sectors], dtype=np.int64).reshape(-1, 3)
    return BodyStates(
        tick=tick,
        ids=numbers_of(packed, "ids", np.uint64),
        sectors=sectors[varints_of(packed, "sector").astype(np.intp)],
        local=numbers_of(packed, "positions", np.float64, 3),
        orientations=numbers_of(packed, "orientations", np.float64, 4),
        linear_velocities=numbers_of(packed, "linear_velocities", np.float64, 3),
        angular_velocities=numbers_of(packed, "angular_velocities", np.float64, 3),
        asleep=varints_of(packed, "asleep").astype(np.bool_),
    )


def to_joint_states(tick: int, message: query_pb2.JointColumns) -> JointStates:
    packed = packed_fields(message)
    ids = numbers_of(packed, "ids", np.uint64)
    axes = varints_of(packed, "axes")
    is_there = np.arange(2) < axes[:, np.newaxis]
    columns = []
    for name in ("positions", "rates"):
        columns.append(np.full(is_there.shape, np.nan))
        columns[-1][is_there] = numbers_of(packed, name, np.float64)
    return JointStates(tick, ids, *columns)
