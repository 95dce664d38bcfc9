"""Answers of a cluster, and types of queries."""

from __future__ import annotations

from dataclasses import dataclass

from tessera._proto import world_pb2
from tessera.body import Motion
from tessera.position import PositionLike, Quaternion, Vector, VectorLike, WorldPosition


@dataclass(frozen=True)
class LoadSummary:
    """The summary of a load."""

    bodies: int
    sectors: int  # with a body that can move
    servers: int


@dataclass(frozen=True)
class Added:
    """A new body or joint."""

    id: int
    tick: int  # the first that it takes part in


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


@dataclass(frozen=True)
class Region:
    """A box along the world's axes."""

    centre: PositionLike
    half_size: VectorLike  # m
