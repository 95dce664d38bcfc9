"""Frames of bodies, made from what servers tell of changes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from tessera._proto import tessera_pb2
from tessera.frame import BodyFrame, Columns, Ids, columns_in, columns_of, frame_of
from tessera.packed_bodies import BodyUnpacker


@dataclass
class _Bodies:
    """States of bodies, ascending by id, a row a body."""

    columns: Columns
    servers: Ids  # [n], the nodes that have told of them

    @property
    def ids(self) -> Ids:
        return self.columns.ids

    def rows(self, which: NDArray[np.bool_] | NDArray[np.intp]) -> _Bodies:
        return _Bodies(self.columns.rows(which), self.servers[which])


def _joined(parts: list[_Bodies]) -> _Bodies:
    """Ascending by id; of one id, in the order of the parts."""
    columns = Columns(
        *(np.concatenate([getattr(part.columns, f.name) for part in parts]) for f in fields(Columns))
    )
    both = _Bodies(columns, np.concatenate([part.servers for part in parts]))
    return both.rows(np.argsort(both.ids, kind="stable"))


@dataclass
class _Told:
    """What one server has told since the last frame."""

    bodies: _Bodies
    gone: Ids
    whole: bool


class _Reader:
    """Reads what one server tells, in its order."""

    def __init__(self, server: int, unpacker: BodyUnpacker) -> None:
        self._server = server
        self._unpacker = unpacker

    def read(self, parts: Iterable[tessera_pb2.BodyBatch]) -> _Told:
        """Of several parts, the later ones count."""
        told: _Told | None = None
        for part in parts:
            now = self._read(part)
            if told is None or now.whole:
                told = now
                continue
            is_old = np.isin(told.bodies.ids, np.concatenate([now.bodies.ids, now.gone]))
            gone = np.union1d(np.setdiff1d(told.gone, now.bodies.ids), now.gone)
            told = _Told(_joined([told.bodies.rows(~is_old), now.bodies]), gone, told.whole)
        assert told is not None
        return told

    def _read(self, part: tessera_pb2.BodyBatch) -> _Told:
        if part.whole:
            self._unpacker.clear()
        self._unpacker.forget(part.gone)
        columns = self._unpacker.read(part.packed) if part.HasField("packed") else columns_of(part)
        bodies = _Bodies(columns, np.full(len(columns.ids), self._server, dtype=np.uint64))
        return _Told(bodies, np.array(part.gone, dtype=np.uint64), part.whole)


class KnownBodies:
    """The bodies of a stream as they were told last."""

    def __init__(
        self, sector_size: float, complete: bool, precision: float = 0, velocity_precision: float = 0
    ) -> None:
        """With `complete`, frames have all bodies, otherwise those that have changed. The precisions are those
        of the request.
        """
        self._precisions = (precision, velocity_precision)
        self._readers: dict[int, _Reader] = {}  # by node
        self._sector_size = sector_size
        self._complete = complete
        nothing = columns_of(tessera_pb2.BodyBatch())
        self._known = _Bodies(nothing, np.empty(0, dtype=np.uint64))
        self._servers: set[int] = set()  # of the last tick
        # Two servers told of them at one tick, between which they moved: the one that is not in `_known`.
        self._also_at: dict[int, int] = {}

    def take(self, tick: int, parts: Iterable[tessera_pb2.BodyBatch]) -> BodyFrame:
        """The frame of the next tick, from the parts of all servers, also those that were left out before.
        What servers tell again without need is not in it.
        """
        by_server: dict[int, list[tessera_pb2.BodyBatch]] = {}
        for part in parts:
            by_server.setdefault(part.node, []).append(part)
        told = {server: self._reader(server).read(list_of) for server, list_of in by_server.items()}
        frame = self._frame(tick, self._lost(told), [by.bodies for by in told.values()])
        return replace(frame, deferred=sum(parts_of[-1].deferred for parts_of in by_server.values()))

    def replace(
        self, tick: int, frames: Sequence[BodyFrame], rows: Sequence[NDArray[np.bool_]]
    ) -> BodyFrame:
        """The frame of the next tick, of which these rows of these frames are all bodies."""
        parts = [
            _Bodies(columns_in(frame).rows(which), np.zeros(int(which.sum()), dtype=np.uint64))
            for frame, which in zip(frames, rows)
        ]
        return self._frame(tick, np.full(len(self._known.ids), True), parts)

    def _frame(self, tick: int, lost: NDArray[np.bool_], parts: list[_Bodies]) -> BodyFrame:
        """`lost` are the known bodies that are gone unless the parts have them."""
        news = self._without_doubles(_joined([self._known.rows(lost & False), *parts]))
        lost &= ~np.isin(self._known.ids, news.ids)
        gone = self._known.ids[lost]
        known = self._known.rows(~lost)
        changed = news.rows(~self._repeats(known, news))
        self._known = _joined([known.rows(~np.isin(known.ids, news.ids)), news])
        shown = self._known if self._complete else changed
        return frame_of(tick, shown.columns, self._sector_size, gone)

    def _reader(self, server: int) -> _Reader:
        if server not in self._readers:
            self._readers[server] = _Reader(server, BodyUnpacker(*self._precisions))
        return self._readers[server]

    def _lost(self, told: dict[int, _Told]) -> NDArray[np.bool_]:
        """Of the known bodies, those that are gone unless a server tells of them."""
        servers = set(told)
        known = self._known
        lost = np.zeros(len(known.ids), dtype=np.bool_)
        if servers != self._servers:
            lost |= ~np.isin(known.servers, np.array(sorted(servers), dtype=np.uint64))
            self._servers = servers
        for server, by in told.items():
            here = known.servers == server
            if by.whole:
                lost |= here
            if len(by.gone) > 0:
                lost |= here & np.isin(known.ids, by.gone)
        for body, other in list(self._also_at.items()):
            row = int(np.searchsorted(known.ids, np.uint64(body)))
            has_other = other not in told or body not in told[other].gone
            if not has_other:
                del self._also_at[body]
            elif lost[row]:
                del self._also_at[body]
                lost[row] = False
                known.servers[row] = other
        return lost

    def _without_doubles(self, news: _Bodies) -> _Bodies:
        """Each body once, although two servers may tell of it."""
        for body in [body for body in self._also_at if np.isin(np.uint64(body), news.ids)]:
            del self._also_at[body]
        is_double = np.append(False, news.ids[1:] == news.ids[:-1])
        for row in np.flatnonzero(is_double):
            self._also_at[int(news.ids[row])] = int(news.servers[row])
        return news.rows(~is_double) if is_double.any() else news

    @staticmethod
    def _repeats(known: _Bodies, news: _Bodies) -> NDArray[np.bool_]:
        """Which of the news are of bodies that sleep as they did."""
        repeats = np.isin(news.ids, known.ids) & news.columns.asleep
        new = news.columns.rows(repeats)
        old = known.columns.rows(np.searchsorted(known.ids, new.ids))
        repeats[repeats] = (
            old.asleep & (old.frames == new.frames) & (old.sectors == new.sectors).all(axis=1) & (old.motion == new.motion).all(axis=1)
        )
        return repeats
