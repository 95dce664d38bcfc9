"""Positions of joints, from a stream of the states of their bodies."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tessera._proto import tessera_pb2

from tessera.errors import InvalidArgument
from tessera.frame import BodyFrame, Ids
from tessera.joint import JointType
from tessera.position import (
    IDENTITY,
    ORIGIN,
    Floats,
    Integers,
    Vector,
    relative_to,
    to_quaternion,
    to_sector,
    to_vector,
)
from tessera.results import FoundJoint
from tessera.rotation import inverse, product, turned
from tessera.stream import Stream


@dataclass(frozen=True, eq=False)
class JointFrame:
    """Joints at one tick, in the order in which they were given; those whose bodies are gone are left out."""

    tick: int
    ids: Ids  # [n]
    positions: Floats  # [n, 2], by axis, rad or m; not a number where the joint has no such axis
    rates: Floats  # [n, 2], rad/s or m/s; likewise
    gaps: Floats  # [n], m between the two frames of the joint, in the directions that are not free
    twists: Floats  # [n], rad, likewise
    asleep: NDArray[np.bool_]  # [n], whether the child sleeps

    def __len__(self) -> int:
        return len(self.ids)


_WORLD = np.zeros(1, dtype=np.uint64)

JointStream: TypeAlias = Stream[tessera_pb2.BodyBatch, JointFrame]


@dataclass(frozen=True)
class _Side:
    """What joints need to know of their parents, or of their children."""

    bodies: Ids  # [n], 0: the world
    anchors: Integers  # [n, 3], sectors that the frame is in where it is on the world
    positions: Floats  # [n, 3], of the joint frame in the body frame
    orientations: Floats  # [n, 4]
    centres: Floats  # [n, 3], of mass, in the body frame

    def rows(self, frame: BodyFrame) -> NDArray[np.intp]:
        """Those of its bodies; one after the last for the world, -1 for those that are not there."""
        rows = np.searchsorted(frame.ids, self.bodies)
        is_there = np.append(frame.ids, np.uint64(0))[rows] == self.bodies
        return np.where(self.bodies == 0, len(frame), np.where(is_there, rows, -1))


@dataclass(frozen=True)
class _Placed:
    """Joint frames in the world."""

    positions: Floats  # [n, 3], relative to the centres of sectors near them
    orientations: Floats  # [n, 4]
    origins: Floats  # [n, 3], of the body frames
    velocities: Floats  # [n, 3], of the origins
    spins: Floats  # [n, 3]

    def velocity_at(self, points: Floats) -> Floats:
        result: Floats = self.velocities + np.cross(self.spins, points - self.origins)
        return result


class WatchedJoints:
    """Joints whose bodies are streamed."""

    def __init__(self, joints: Iterable[FoundJoint]) -> None:
        """InvalidArgument if there are none."""
        found = list(joints)
        if not found:
            raise InvalidArgument("joints: there must be at least one to watch")
        properties = [joint.joint.properties for joint in found]
        anchors = np.array([to_sector(each.anchor) for each in properties], dtype=np.int64)

        def side(bodies: list[int], poses: list[Any], centres: list[Vector]) -> _Side:
            return _Side(
                np.array(bodies, dtype=np.uint64),
                anchors,
                np.array([to_vector(pose.position) for pose in poses]),
                np.array([to_quaternion(pose.orientation) for pose in poses]),
                np.array(centres, dtype=np.float64),
            )

        self._ids = np.array([joint.id for joint in found], dtype=np.uint64)
        self._types = np.array([each.type for each in properties])
        self._parents = side(
            [each.parent for each in properties],
            [each.in_parent for each in properties],
            [joint.parent_centre for joint in found],
        )
        self._children = side(
            [each.child for each in properties],
            [each.in_child for each in properties],
            [joint.child_centre for joint in found],
        )

    @property
    def bodies(self) -> Ids:
        """Those that determine the positions, ascending."""
        bodies: Ids = np.setdiff1d(np.union1d(self._parents.bodies, self._children.bodies), _WORLD)
        return bodies

    def frame(self, bodies: BodyFrame) -> JointFrame:
        """The joints at the tick of a frame that has all their bodies that exist."""
        parents, children = self._parents.rows(bodies), self._children.rows(bodies)
        here = np.flatnonzero((parents >= 0) & (children >= 0))
        near = bodies.sectors[children[here]]  # numbers are small there, anywhere in the world
        a = _placed(self._parents, parents, here, bodies, near)
        b = _placed(self._children, children, here, bodies, near)
        positions, rates, gaps, twists = _states(self._types[here], a, b)
        return JointFrame(
            bodies.tick, self._ids[here], positions, rates, gaps, twists, bodies.asleep[children[here]]
        )


def _placed(
    side: _Side, rows: NDArray[np.intp], here: NDArray[np.intp], bodies: BodyFrame, near: Integers
) -> _Placed:
    """The joint frames of the joints `here`, relative to the centres of the sectors `near` [n, 3]."""

    def of_bodies(array: NDArray[Any], world: ArrayLike) -> NDArray[Any]:
        extended = np.concatenate([array, np.array([world], dtype=array.dtype)])
        result: NDArray[Any] = extended[rows[here]]
        return result

    on_world = (side.bodies[here] == 0)[:, np.newaxis]
    sectors = np.where(on_world, side.anchors[here], of_bodies(bodies.sectors, ORIGIN))
    origins = relative_to(sectors, of_bodies(bodies.local, ORIGIN), near, bodies.sector_size)
    turns = of_bodies(bodies.orientations, IDENTITY)
    spins = of_bodies(bodies.angular_velocities, ORIGIN)
    of_centres = of_bodies(bodies.linear_velocities, ORIGIN)
    return _Placed(
        positions=origins + turned(turns, side.positions[here]),
        orientations=product(turns, side.orientations[here]),
        origins=origins,
        velocities=of_centres - np.cross(spins, turned(turns, side.centres[here])),
        spins=spins,
    )


def _states(types: NDArray[Any], a: _Placed, b: _Placed) -> tuple[Floats, Floats, Floats, Floats]:
    """Positions, rates, gaps and twists of joints, from their frames on parents and children."""
    x, y, z = (turned(a.orientations, axis) for axis in np.eye(3))
    child_x, child_y = (turned(b.orientations, axis) for axis in np.eye(3)[:2])
    apart = b.positions - a.positions
    turn = product(inverse(a.orientations), b.orientations)
    spin = b.spins - a.spins
    flow = b.velocity_at(b.positions) - a.velocity_at(b.positions)
    turns = (types == JointType.REVOLUTE) | (types == JointType.SCREW)
    slides = types == JointType.PRISMATIC
    is_universal = types == JointType.UNIVERSAL
    is_along_x = slides | (types == JointType.SCREW)

    angle = 2 * np.arctan2(turn[:, 0], turn[:, 3])
    first = np.select(
        [turns, slides, is_universal],
        [
            angle - 2 * np.pi * np.rint(angle / (2 * np.pi)),
            _dot(x, apart),
            np.arctan2(_dot(z, child_y), _dot(y, child_y)),
        ],
        np.nan,
    )
    second = np.where(is_universal, np.arctan2(-_dot(np.cross(x, child_y), child_x), _dot(x, child_x)), np.nan)
    first_rate = np.select([turns | is_universal, slides], [_dot(x, spin), _dot(x, flow)], np.nan)
    second_rate = np.where(is_universal, _dot(child_y, spin), np.nan)
    across = apart - x * np.where(is_along_x, _dot(x, apart), 0)[:, np.newaxis]
    twists = np.select(
        [turns, is_universal, types == JointType.BALL],
        [
            np.arctan2(np.linalg.norm(np.cross(x, child_x), axis=1), _dot(x, child_x)),
            np.abs(np.arcsin(np.clip(_dot(x, child_y), -1, 1))),
            0,
        ],
        2 * np.arctan2(np.linalg.norm(turn[:, :3], axis=1), np.abs(turn[:, 3])),
    )
    return (
        np.stack([first, second], axis=1),
        np.stack([first_rate, second_rate], axis=1),
        np.linalg.norm(across, axis=1),
        twists,
    )


def _dot(a: Floats, b: Floats) -> Floats:
    result: Floats = (a * b).sum(axis=1)
    return result
