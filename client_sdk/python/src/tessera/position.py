"""Lossless positions of any size: a sector and a small displacement.

The sector (i, j, k), three 64-bit integers, has its centre at (i, j, k) * L metres from the world's origin;
L is the sector size of the world. A displacement is in metres from there, along the world's axes. No
position is ever one floating-point number: differences are taken with `relative_to()`, integers first.
"""

from __future__ import annotations

import operator
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tessera._proto import world_pb2

Floats: TypeAlias = NDArray[np.float64]
Integers: TypeAlias = NDArray[np.int64]
Sector: TypeAlias = tuple[int, int, int]
Vector: TypeAlias = tuple[float, float, float]
Quaternion: TypeAlias = tuple[float, float, float, float]  # x y z w
VectorLike: TypeAlias = Sequence[float] | Floats
SectorLike: TypeAlias = Sequence[int] | Integers

ORIGIN: Sector = (0, 0, 0)
IDENTITY = (0.0, 0.0, 0.0, 1.0)  # a rotation, x y z w


@dataclass(frozen=True)
class WorldPosition:
    """A point: `local` metres from the centre of `sector`, along the world's axes.

    `local` may have any finite size; the cluster converts it to the sector that contains the point.
    """

    local: Vector = (0.0, 0.0, 0.0)
    sector: Sector = ORIGIN
    frame: int = 0  # that the sector belongs to: the world's, or the n-th that moves (Settings.frames)


PositionLike: TypeAlias = WorldPosition | VectorLike
"""A point; three numbers alone are metres from the centre of sector (0, 0, 0)."""


def relative_to(sectors: ArrayLike, local: ArrayLike, sector: SectorLike, sector_size: float) -> Floats:
    """The displacement of points from the centre of `sector`, in metres.

    `sectors` is [..., 3] of 64-bit integers and `local` [..., 3] in metres. Sector indices are subtracted
    as integers before anything is rounded, so points near `sector` keep full precision, wherever in the world
    it is.
    """
    whole = _difference(np.asarray(sectors, dtype=np.int64), np.asarray(sector, dtype=np.int64))
    metres = whole * np.longdouble(sector_size) + np.asarray(local, dtype=np.float64)
    return metres.astype(np.float64)


def _difference(a: Integers, b: Integers) -> NDArray[Any]:
    """a - b, even if that needs 65 bits."""
    up, down = (x.astype(np.uint64).astype(np.longdouble) for x in (a - b, b - a))
    return np.where(a >= b, up, -down)


def to_vector(message: world_pb2.Vector3) -> Vector:
    return (message.x, message.y, message.z)


def to_quaternion(message: world_pb2.Quaternion) -> Quaternion:
    return (message.x, message.y, message.z, message.w)


def vector_fields(vector: VectorLike, name: str) -> dict[str, float]:
    """Those of a Vector3: faster than a message where that is a part of another one."""
    x, y, z = numbers(vector, 3, name)
    return {"x": x, "y": y, "z": z}


def vector_message(vector: VectorLike, name: str) -> world_pb2.Vector3:
    return world_pb2.Vector3(**vector_fields(vector, name))


def quaternion_message(quaternion: VectorLike, name: str) -> world_pb2.Quaternion:
    x, y, z, w = numbers(quaternion, 4, name)
    return world_pb2.Quaternion(x=x, y=y, z=z, w=w)


def sector_message(sector: SectorLike) -> world_pb2.SectorIndex:
    try:
        i, j, k = (operator.index(index) for index in sector)
    except (TypeError, ValueError) as error:
        raise ValueError(f"sector: {tuple(sector)} must be three whole numbers") from error
    return world_pb2.SectorIndex(i=i, j=j, k=k)


def to_sector(message: world_pb2.SectorIndex) -> Sector:
    return (message.i, message.j, message.k)


def to_position(message: world_pb2.WorldPosition) -> WorldPosition:
    return WorldPosition(to_vector(message.local), to_sector(message.sector), message.sector.frame)


def position_message(position: PositionLike) -> world_pb2.WorldPosition:
    point = position if isinstance(position, WorldPosition) else WorldPosition(_triple(position))
    sector = sector_message(point.sector)
    sector.frame = operator.index(point.frame)
    return world_pb2.WorldPosition(sector=sector, local=vector_message(point.local, "position"))


def world_pose_message(position: PositionLike, orientation: VectorLike | None) -> world_pb2.WorldPose:
    """Without an orientation where there is none."""
    turned = None if orientation is None else quaternion_message(orientation, "orientation")
    return world_pb2.WorldPose(position=position_message(position), orientation=turned)


def pose_message(position: VectorLike, orientation: VectorLike) -> world_pb2.Pose:
    return world_pb2.Pose(
        position=vector_message(position, "position"),
        orientation=quaternion_message(orientation, "orientation"),
    )


def numbers(values: VectorLike, count: int, name: str) -> list[float]:
    """`values` as that many floats. ValueError, naming the field, if they are not."""
    result = [float(value) for value in values]
    if len(result) != count:
        raise ValueError(f"{name}: {count} numbers are expected, not {len(result)}")
    return result


def _triple(values: VectorLike) -> Vector:
    x, y, z = numbers(values, 3, "position")
    return (x, y, z)
