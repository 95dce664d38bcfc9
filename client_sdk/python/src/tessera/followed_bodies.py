"""Bodies around one that moves: streams of regions, one after the other."""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor

import numpy as np

from tessera._proto import tessera_pb2
from tessera.errors import DeadlineExceeded, NotFound, TesseraError
from tessera.frame import BodyFrame
from tessera.known_bodies import KnownBodies
from tessera.position import Vector, WorldPosition, relative_to
from tessera.results import Region
from tessera.stream import Stream

# What regions have more than what is wanted: of the largest half size, and the way of the body in the time that it
# may take to open another one; or so many times its way while the last one was opened; up to so many of the largest
# half size.
MARGIN = 0.5
AHEAD_S = 1.0
WAYS = 3.0
MARGIN_MAX = 16.0


class _Area:
    """A stream of all bodies of a region, and the last frame of it that was read."""

    def __init__(
        self, centre: WorldPosition, margin: float, stream: Stream[tessera_pb2.BodyBatch, BodyFrame]
    ) -> None:
        self.centre = centre
        self.margin = margin
        self.stream = stream
        self.frame: BodyFrame | None = None

    def read_to(self, tick: int, deadline: float | None) -> BodyFrame:
        """The frame of a tick, or of the first one after it that the stream has."""
        while self.frame is None or self.frame.tick < tick:
            self.frame = self.stream.next(_left(deadline))
        return self.frame


class FollowedBodies(Stream[tessera_pb2.BodyBatch, BodyFrame]):
    """Servers stream a region that is larger than what is wanted by a margin; the exact box is cut out here, at
    each tick, around where the body is. Once the body has gone half of the margin, a stream of the region
    around it takes the place of the other, at a tick that both have: no tick is lost.
    """

    def __init__(
        self,
        leader: Stream[tessera_pb2.BodyBatch, BodyFrame],
        half_size: Vector,
        complete: bool,
        open_area: Callable[[Region], Stream[tessera_pb2.BodyBatch, BodyFrame]],
        timeout: float | None,
    ) -> None:
        """`leader` streams the body that is followed, `open_area` subscribes to the bodies of a region, both in
        complete frames. NotFound if there is no such body.
        """
        self._leader = leader
        self._half_size = np.array(half_size, dtype=np.float64)
        self._open_area = open_area
        self._opener = ThreadPoolExecutor(1)
        self._opening: Future[_Area] | None = None
        self._coming: _Area | None = None
        self._unmatched = 0  # ticks that only one of the streams has
        self._way = 0.0  # m, that the body went until the last area that was opened was of use
        self._has_ended = False
        try:
            self._frame: BodyFrame | None = leader.next(timeout)
            if len(self._frame) == 0:
                raise NotFound("follow: there is no such body")
            self._place = self._frame
            self._area = self._open()
        except TesseraError:
            leader.cancel()
            raise
        self._shown = KnownBodies(self._frame.sector_size, complete)

    def next(self, timeout: float | None = None) -> BodyFrame:
        """As that of other streams."""
        deadline = None if timeout is None else time.monotonic() + timeout
        while True:
            if self._frame is None:
                self._frame = self._leader.next(_left(deadline))
                if len(self._frame) > 0:
                    self._place = self._frame
                self._look_for_next_area()
            self._change_area_where_ready(self._frame.tick)
            around = self._area.read_to(self._frame.tick, deadline)
            leader, self._frame = self._frame, None
            if around.tick == leader.tick:
                return self._cut(leader, around)
            self._unmatched += 1

    @property
    def skipped(self) -> int:
        """The number of ticks so far that are missing."""
        return self._leader.skipped + self._unmatched

    def cancel(self) -> None:
        """Ends the stream."""
        self._has_ended = True
        self._leader.cancel()
        self._area.stream.cancel()
        self._opener.shutdown(wait=False)

    def _open(self) -> _Area:
        """The region around where the body is."""
        largest = float(self._half_size.max())
        speed = float(np.linalg.norm(self._place.linear_velocities[0]))
        margin = min(max(MARGIN * largest + AHEAD_S * speed, WAYS * self._way), MARGIN_MAX * largest)
        half = self._half_size + margin
        centre = self._here()
        region = Region(centre, (float(half[0]), float(half[1]), float(half[2])))
        area = _Area(centre, margin, self._open_area(region))
        if self._has_ended:
            area.stream.cancel()
        return area

    def _look_for_next_area(self) -> None:
        """A region that cannot be had now is asked for again."""
        if self._opening or self._coming or self._has_ended:
            return
        if self._gone_from(self._area.centre) > self._area.margin / 2:
            self._opened_from = self._here()
            self._opening = self._opener.submit(self._open)

    def _change_area_where_ready(self, tick: int) -> None:
        try:
            if self._opening and self._opening.done():
                opened, self._opening = self._opening, None
                self._coming = opened.result()
            if self._coming and self._is_better(self._coming, tick):
                self._area.stream.cancel()
                self._way = self._gone_from(self._opened_from)
                self._area, self._coming = self._coming, None
        except DeadlineExceeded:
            pass  # it has nothing of that tick yet, or could not be opened in time
        except TesseraError:
            self._coming = None

    def _is_better(self, area: _Area, tick: int) -> bool:
        """Whether it can take over. With a budget, a stream has all bodies of its region after some ticks; it is used
        before where the present one lacks more, since what is wanted reaches beyond its region.
        """
        frame = area.read_to(tick, time.monotonic())
        return frame.tick == tick and (frame.deferred == 0 or self._gone_from(area.centre) > area.margin)

    def _here(self) -> WorldPosition:
        """Where the body is."""
        i, j, k = (int(index) for index in self._place.sectors[0])
        x, y, z = (float(metres) for metres in self._place.local[0])
        moving = 0 if self._place.frames is None else int(self._place.frames[0])
        return WorldPosition((x, y, z), (i, j, k), moving)

    def _gone_from(self, place: WorldPosition) -> float:
        """How far the body is from there along any axis, m."""
        away = self._place.relative_to(place.sector)[0] - np.array(place.local)
        return float(np.abs(away).max())

    def _cut(self, leader: BodyFrame, around: BodyFrame) -> BodyFrame:
        """What is in the exact box."""
        away = np.abs(
            relative_to(around.sectors, around.local, self._place.sectors[0], around.sector_size)
            - self._place.local[0]
        )
        is_wanted = (away <= self._half_size).all(axis=1) & ~np.isin(around.ids, self._place.ids)
        return self._shown.replace(leader.tick, [around, leader], [is_wanted, np.full(len(leader), True)])


def _left(deadline: float | None) -> float | None:
    return None if deadline is None else max(0.0, deadline - time.monotonic())
