"""Many bodies as arrays: of one tick (`BodyFrame`), or over time (`Trajectory`)."""

from __future__ import annotations

import enum
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from tessera._proto import query_pb2, tessera_pb2, world_pb2
from tessera.position import (
    ORIGIN,
    Floats,
    Integers,
    Quaternion,
    SectorLike,
    Vector,
    WorldPosition,
    relative_to,
    to_position,
    to_vector,
)
from tessera.results import FoundFrame
from tessera.rotation import product, turned

Ids: TypeAlias = NDArray[np.uint64]


@dataclass(frozen=True, eq=False)
class BodyFrame:
    """Bodies at one tick, ascending by id; row n of every array is of body `ids[n]`.

    In a stream, those that have changed since the frame before: that are awake, have fallen asleep, have been
    moved, or are new to the stream; the first frame has all. If it is complete, those of each frame are all.
    """

    tick: int
    ids: Ids  # [n]
    sectors: Integers  # [n, 3]
    local: Floats  # [n, 3], m from the centre of the sector, of the body frame
    orientations: Floats  # [n, 4], body frame to world axes, x y z w
    linear_velocities: Floats  # [n, 3], of the centre of mass, m/s, world axes
    angular_velocities: Floats  # [n, 3], rad/s, world axes
    asleep: NDArray[np.bool_]  # [n]
    sector_size: float  # m, of the world
    # [n], of the sectors: 0 is the world's, n the n-th of Settings.frames; None if all are the world's
    frames: NDArray[np.uint32] | None = None
    # Of earlier frames of a stream: bodies that were removed or no longer match what it is of; ascending.
    gone: Ids = field(default_factory=lambda: np.empty(0, dtype=np.uint64))
    deferred: int = 0  # bodies of a stream that have changed and are told later: its budget

    def __len__(self) -> int:
        return len(self.ids)

    def row(self, body: int) -> int:
        """The row of the body with this id. KeyError if it is not in the frame."""
        row = int(np.searchsorted(self.ids, np.uint64(body)))
        if row == len(self.ids) or self.ids[row] != body:
            raise KeyError(body)
        return row

    def of(self, bodies: Iterable[int]) -> BodyFrame:
        """The frame of these bodies only, in this order. KeyError if one is not in the frame."""
        rows = [self.row(body) for body in bodies]
        return replace(
            self,
            ids=self.ids[rows],
            sectors=self.sectors[rows],
            local=self.local[rows],
            orientations=self.orientations[rows],
            linear_velocities=self.linear_velocities[rows],
            angular_velocities=self.angular_velocities[rows],
            asleep=self.asleep[rows],
            frames=None if self.frames is None else self.frames[rows],
        )

    def pose_of(self, frame: FoundFrame) -> tuple[WorldPosition, Quaternion]:
        """The position and orientation (to world axes) of a frame that is fixed to one of the bodies.

        KeyError if its body is not in the frame.
        """
        row = self.row(frame.body)
        turn = self.orientations[row]
        x, y, z = self.local[row] + turned(turn, np.array(frame.position))
        qx, qy, qz, qw = product(turn, np.array(frame.orientation))
        i, j, k = (int(index) for index in self.sectors[row])
        moving = 0 if self.frames is None else int(self.frames[row])
        position = WorldPosition((float(x), float(y), float(z)), (i, j, k), moving)
        return position, (float(qx), float(qy), float(qz), float(qw))

    def relative_to(self, sector: SectorLike = ORIGIN) -> Floats:
        """Positions [n, 3] in metres from the centre of `sector`; see `tessera.relative_to()`."""
        return relative_to(self.sectors, self.local, sector, self.sector_size)


@dataclass(frozen=True, eq=False)
class Trajectory:
    """The same bodies over several ticks; entry [t, n] of every array is of body `ids[n]` at `ticks[t]`."""

    ids: Ids  # [n]
    ticks: NDArray[np.uint64]  # [t]
    time: Floats  # [t], s of simulation
    sectors: Integers  # [t, n, 3]
    local: Floats  # [t, n, 3], m from the centre of the sector, of the body frame
    orientations: Floats  # [t, n, 4], x y z w
    linear_velocities: Floats  # [t, n, 3], of the centre of mass, m/s
    angular_velocities: Floats  # [t, n, 3], rad/s
    asleep: NDArray[np.bool_]  # [t, n]
    sector_size: float  # m

    def relative_to(self, sector: SectorLike | None = None) -> Floats:
        """Positions [t, n, 3] in metres from the centre of `sector`, by default the sector where the
        first body began.
        """
        origin = self.sectors[0, 0] if sector is None else sector
        return relative_to(self.sectors, self.local, origin, self.sector_size)


class Phase(enum.IntEnum):
    """The phase of a contact in a tick."""

    BEGIN = query_pb2.Contact.BEGIN
    PERSIST = query_pb2.Contact.PERSIST
    END = query_pb2.Contact.END


@dataclass(frozen=True)
class ContactPoint:
    """A point of a contact."""

    offset: Vector  # m, from the position of the contact, on b
    depth: float  # m, > 0 where the bodies overlap
    impulse: float  # N s, along the normal


@dataclass(frozen=True)
class Contact:
    """A patch of contact of two bodies, `a` < `b`: points that share a normal.

    The phase is that of the pair. A pair that begins or goes on has a contact for each of its patches; its end
    is one contact, without a patch. With `trigger`, there is no contact: `b` overlaps a trigger of `a`, which
    may have the higher id, and nothing else is set.
    """

    phase: Phase
    a: int
    b: int
    position: WorldPosition  # the deepest point, on b; not set for END
    normal: Vector  # on b, pointing to a
    impulse: float  # N s, on a along the normal, of all points
    friction: Vector = (0.0, 0.0, 0.0)  # N s, on a, in the world's axes
    points: tuple[ContactPoint, ...] = ()
    trigger: bool = False


@dataclass(frozen=True)
class ContactFrame:
    """The contacts of one tick, ascending by (a, b), then the events of triggers, likewise."""

    tick: int
    contacts: Sequence[Contact]


@dataclass(frozen=True)
class FoundContacts:
    """Where bodies touch others, as the last tick left it."""

    tick: int
    contacts: Sequence[Contact]  # ascending by (a, b); patches of a pair in one order; all PERSIST
    truncated: bool  # there are more


class DivergenceKind(enum.IntEnum):
    """Why a body was stopped."""

    POSITION = tessera_pb2.Divergence.POSITION  # not finite
    VELOCITY = tessera_pb2.Divergence.VELOCITY  # not finite, or its joints have no solution
    SPEED = tessera_pb2.Divergence.SPEED  # above 1e6 m/s
    SECTOR = tessera_pb2.Divergence.SECTOR  # beyond the last sector
    ENERGY = tessera_pb2.Divergence.ENERGY  # its joints have put in more than half of what they hold


@dataclass(frozen=True, order=True)
class Divergence:
    """A body that diverged in a tick, and was stopped there: DivergenceKind says why."""

    tick: int
    body: int
    kind: DivergenceKind
    joint: int  # of its joints, the one whose error is largest; 0: none


@dataclass(frozen=True)
class DivergenceFrame:
    """The bodies that diverged in one tick, ascending by (body, kind); of each server, the first 64."""

    tick: int
    divergences: Sequence[Divergence]


@dataclass(frozen=True, eq=False)
class ProgramSample:
    """What a program publishes."""

    body: int
    program: int  # its place on the body
    kind: str
    stopped: bool  # by a fault, which `Client.programs()` tells
    values: Floats  # [v], its state; `Client.programs()` names them in this order
    tick: int  # at whose end they were so: at most that of the frame


@dataclass(frozen=True, eq=False)
class ProgramFrame:
    """The programs of bodies on which any has changed since the frame before, ascending by (body, program); of all in
    the first frame, and again of some that have changed servers.
    """

    tick: int
    programs: Sequence[ProgramSample]


@dataclass(frozen=True, eq=False)
class SeamFrame:
    """Copies of bodies in sectors other than their homes, where contact with them is imminent, and awake islands across
    borders, at one tick.
    """

    tick: int
    clones: Ids  # [c], of bodies, ascending; those of one body ascend by sector
    sectors: Integers  # [c, 3], that they are copied to
    servers: Ids  # [c], the nodes that host these
    islands: Ids  # [m], ascending: the smallest id of all bodies of each
    bodies: Sequence[Ids]  # m, of each island those in the region, ascending


@dataclass(frozen=True)
class Columns:
    """States of bodies, a row a body."""

    ids: Ids  # [n]
    sectors: Integers  # [n, 3]
    motion: Floats  # [n, 13]: position, orientation, both velocities
    asleep: NDArray[np.bool_]  # [n]
    frames: NDArray[np.uint32]  # [n]

    def rows(self, which: NDArray[np.bool_] | NDArray[np.intp]) -> Columns:
        return Columns(*(getattr(self, column.name)[which] for column in fields(Columns)))


def body_frame(tick: int, batch: tessera_pb2.BodyBatch, sector_size: float) -> BodyFrame:
    """The bodies of a batch, body by body or in columns, ascending by id."""
    columns = columns_of(batch)
    return frame_of(tick, columns.rows(np.argsort(columns.ids)), sector_size)


def frame_of(tick: int, columns: Columns, sector_size: float, gone: Ids | None = None) -> BodyFrame:
    """The frame of bodies that ascend by id."""
    motion = columns.motion
    return BodyFrame(
        tick=tick,
        ids=columns.ids,
        sectors=columns.sectors,
        local=motion[:, 0:3],
        orientations=motion[:, 3:7],
        linear_velocities=motion[:, 7:10],
        angular_velocities=motion[:, 10:13],
        asleep=columns.asleep,
        sector_size=sector_size,
        frames=columns.frames if columns.frames.any() else None,
        gone=np.empty(0, dtype=np.uint64) if gone is None else gone,
    )


def columns_in(frame: BodyFrame) -> Columns:
    """The bodies of a frame."""
    motion = [frame.local, frame.orientations, frame.linear_velocities, frame.angular_velocities]
    frames = np.zeros(len(frame), dtype=np.uint32) if frame.frames is None else frame.frames
    return Columns(frame.ids, frame.sectors, np.hstack(motion), frame.asleep, frames)


def columns_of(part: tessera_pb2.BodyBatch) -> Columns:
    """The bodies of a batch in its order."""
    if part.bodies:
        states = part.bodies
        return Columns(
            np.array([state.id for state in states], dtype=np.uint64),
            np.array([_sector(state.pose.position.sector) for state in states], dtype=np.int64),
            np.array([_motion(state) for state in states], dtype=np.float64),
            np.array([state.asleep for state in states], dtype=np.bool_),
            np.array([state.pose.position.sector.frame for state in states], dtype=np.uint32),
        )
    columns = part.columns
    sectors = np.array([_sector(sector) for sector in columns.sectors], dtype=np.int64).reshape(-1, 3)
    frames = np.array([sector.frame for sector in columns.sectors], dtype=np.uint32)
    places = np.array(columns.sector, dtype=np.intp)
    vectors = (
        (columns.positions, 3),
        (columns.orientations, 4),
        (columns.linear_velocities, 3),
        (columns.angular_velocities, 3),
    )
    return Columns(
        np.array(columns.ids, dtype=np.uint64),
        sectors[places],
        np.hstack([np.array(column, dtype=np.float64).reshape(-1, width) for column, width in vectors]),
        np.array(columns.asleep, dtype=np.bool_),
        frames[places],
    )


def body_batch(frame: BodyFrame) -> tessera_pb2.BodyBatch:
    """The bodies of a frame as a message, body by body."""
    batch = tessera_pb2.BodyBatch(tick=frame.tick)
    columns = columns_in(frame)
    rows = zip(frame.ids.tolist(), frame.sectors.tolist(), columns.motion.tolist(), frame.asleep.tolist())
    moving = columns.frames.tolist()
    for n, (body, (i, j, k), motion, asleep) in enumerate(rows):
        px, py, pz, qx, qy, qz, qw, vx, vy, vz, wx, wy, wz = motion
        state = batch.bodies.add(id=body, asleep=asleep)
        sector, local = state.pose.position.sector, state.pose.position.local
        sector.i, sector.j, sector.k, sector.frame = i, j, k, moving[n]
        local.x, local.y, local.z = px, py, pz
        turn = state.pose.orientation
        turn.x, turn.y, turn.z, turn.w = qx, qy, qz, qw
        v, w = state.linear_velocity, state.angular_velocity
        v.x, v.y, v.z = vx, vy, vz
        w.x, w.y, w.z = wx, wy, wz
    return batch


def _sector(sector: world_pb2.SectorIndex) -> tuple[int, int, int]:
    return sector.i, sector.j, sector.k


def _motion(state: tessera_pb2.BodyState) -> tuple[float, ...]:
    p, q = state.pose.position.local, state.pose.orientation
    v, w = state.linear_velocity, state.angular_velocity
    return (p.x, p.y, p.z, q.x, q.y, q.z, q.w, v.x, v.y, v.z, w.x, w.y, w.z)


def contact_frame(tick: int, parts: Iterable[tessera_pb2.ContactBatch]) -> ContactFrame:
    """Likewise for contacts."""
    contacts = [to_contact(contact) for part in parts for contact in part.contacts]
    # A contact ends before it begins anew.
    return ContactFrame(tick, sorted(contacts, key=lambda c: (c.trigger, c.a, c.b, c.phase is not Phase.END)))


def to_found_contacts(tick: int, message: query_pb2.FoundContacts) -> FoundContacts:
    return FoundContacts(tick, [to_contact(contact) for contact in message.contacts], message.truncated)


def divergence_frame(tick: int, parts: Iterable[tessera_pb2.DivergenceBatch]) -> DivergenceFrame:
    """Likewise for bodies that diverged."""
    return DivergenceFrame(
        tick, sorted(to_divergence(message) for part in parts for message in part.divergences)
    )


def to_divergence(message: tessera_pb2.Divergence) -> Divergence:
    return Divergence(message.tick, message.body, DivergenceKind(message.kind), message.joint)


def program_frame(tick: int, parts: Iterable[tessera_pb2.ProgramBatch]) -> ProgramFrame:
    """Likewise for programs. Of one that is told twice, the later sample counts."""
    known = {
        (sample.body, sample.program): sample
        for part in sorted(parts, key=lambda part: part.tick)
        for sample in _programs_of(part)
    }
    return ProgramFrame(tick, [known[place] for place in sorted(known)])


def _programs_of(part: tessera_pb2.ProgramBatch) -> Iterator[ProgramSample]:
    values = np.array(part.values, dtype=np.float64)
    ends = np.cumsum(np.array(part.counts, dtype=np.int64))
    rows = zip(part.bodies, part.programs, part.kind, part.stopped, np.split(values, ends[:-1]))
    for body, program, kind, stopped, own in rows:
        yield ProgramSample(body, program, part.kinds[kind], stopped, own, part.tick)


def seam_frame(tick: int, parts: Sequence[tessera_pb2.SeamBatch]) -> SeamFrame:
    """The clones of all servers, and islands, each with its bodies of all servers."""
    clones = sorted(
        (clone.body, _sector(clone.sector), part.node) for part in parts for clone in part.clones
    )
    islands: dict[int, list[int]] = {}
    for part in parts:
        for island in part.islands:
            islands.setdefault(island.id, []).extend(island.bodies)
    return SeamFrame(
        tick=tick,
        clones=np.array([body for body, _, _ in clones], dtype=np.uint64),
        sectors=np.array([sector for _, sector, _ in clones], dtype=np.int64).reshape(-1, 3),
        servers=np.array([server for _, _, server in clones], dtype=np.uint64),
        islands=np.array(sorted(islands), dtype=np.uint64),
        bodies=[np.array(sorted(islands[island]), dtype=np.uint64) for island in sorted(islands)],
    )


def trajectory(frames: Sequence[BodyFrame], time_step: float) -> Trajectory:
    """Frames of the same bodies, at least one, along an axis of time."""
    ticks = np.array([frame.tick for frame in frames], dtype=np.uint64)
    return Trajectory(
        ids=frames[0].ids,
        ticks=ticks,
        time=ticks * time_step,
        sectors=np.stack([frame.sectors for frame in frames]),
        local=np.stack([frame.local for frame in frames]),
        orientations=np.stack([frame.orientations for frame in frames]),
        linear_velocities=np.stack([frame.linear_velocities for frame in frames]),
        angular_velocities=np.stack([frame.angular_velocities for frame in frames]),
        asleep=np.stack([frame.asleep for frame in frames]),
        sector_size=frames[0].sector_size,
    )


def to_contact(contact: query_pb2.Contact) -> Contact:
    return Contact(
        Phase(contact.phase),
        contact.a,
        contact.b,
        to_position(contact.position),
        to_vector(contact.normal),
        contact.impulse,
        to_vector(contact.friction),
        tuple(
            ContactPoint((x, y, z), depth, impulse)
            for x, y, z, depth, impulse in zip(
                contact.points[0::3],
                contact.points[1::3],
                contact.points[2::3],
                contact.depths,
                contact.impulses,
            )
        ),
        contact.trigger,
    )
