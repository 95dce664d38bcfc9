"""Merges the parts of ticks that several servers stream."""

from __future__ import annotations

import threading
from collections import defaultdict, deque
from dataclasses import dataclass, field
from typing import Generic, Protocol, TypeVar

from tessera.errors import Aborted, DeadlineExceeded, ResourceExhausted, TesseraError

FRAMES_QUEUED_MAX = 256  # per server, which waits while it is that far ahead of the reader
READY_MAX = 16 * FRAMES_QUEUED_MAX  # ticks of earlier epochs


class Source(Protocol):
    """Where a part comes from: StreamSource in proto/tessera.proto."""

    @property
    def load(self) -> int:
        ...

    @property
    def epoch(self) -> int:
        ...

    @property
    def servers(self) -> int:
        ...

    @property
    def first(self) -> bool:
        ...

    @property
    def since(self) -> int:
        ...


class Batch(Protocol):
    """One server's part of one tick."""

    @property
    def tick(self) -> int:
        ...

    @property
    def node(self) -> int:
        ...

    @property
    def source(self) -> Source:
        ...


Part = TypeVar("Part", bound=Batch)


@dataclass
class _Period(Generic[Part]):
    """Ticks of the same servers."""

    size: int = 0  # the number of servers that take part
    # What was not read, of the servers that have told something, by node.
    queues: defaultdict[int, deque[Part]] = field(default_factory=lambda: defaultdict(deque))

    def all_have_told(self) -> bool:
        return 0 < self.size <= len(self.queues)


@dataclass
class _Epoch(Generic[Part]):
    number: int = 0
    periods: dict[int, _Period[Part]] = field(default_factory=dict)  # by their first ticks
    # The tick that a server has told last, and the first tick of its period, by node. Between two ticks it may tell
    # of a tick again, in a later period.
    last: defaultdict[int, tuple[int, int]] = field(default_factory=lambda: defaultdict(lambda: (-1, -1)))
    ended: set[int] = field(default_factory=set)  # nodes
    # Parts that were not merged, by node, since that server's last one that was.
    left_out: defaultdict[int, list[Part]] = field(default_factory=lambda: defaultdict(list))
    earliest: int = 0  # of the periods that may still come

    def all_have_told(self) -> bool:
        return any(period.all_have_told() for period in self.periods.values())

    def queued(self, node: int) -> int:
        return sum(len(period.queues[node]) for period in self.periods.values() if node in period.queues)

    def is_over(self, since: int) -> bool:
        """Whether nothing more comes of that period: those of its servers that stay tell of later ones, and
        the others have ended.
        """
        later = [period for first, period in sorted(self.periods.items()) if first > since]
        if not later or not later[0].all_have_told():
            return False
        return all(
            node in self.ended or any(node in period.queues for period in later)
            for node in self.periods[since].queues
        )


class StreamMerger(Generic[Part]):
    """Servers push their parts of ticks, ascending within an epoch; one reader gets whole ticks, each once,
    in order. Where servers join and leave, a tick is whole once those have told of it that take part in it.
    Safe to use from any thread.
    """

    def __init__(self, of_changes: bool = False) -> None:
        """If parts tell `of_changes`, those that are left out come before the server's next part."""
        self._of_changes = of_changes
        self._changed = threading.Condition()
        self._load: int | None = None
        self._epoch: _Epoch[Part] = _Epoch()  # the last of which all servers have told
        self._newest = self._epoch
        self._ready: deque[tuple[int, list[Part]]] = deque()  # of earlier epochs
        self._merged = -1  # the last tick that was whole
        self._end: TesseraError | None = None
        self._skipped = 0

    def push(self, part: Part) -> bool:
        """Waits while the server is too far ahead of the reader. False once the stream has ended."""
        source = part.source
        with self._changed:
            if self._load not in (None, source.load):
                self._finish(Aborted("the world was unloaded or replaced"))
            self._load = source.load
            if source.epoch > self._newest.number:
                self._newest = _Epoch(source.epoch)
                self._changed.notify_all()
            self._changed.wait_for(
                lambda: self._end
                or source.epoch < self._newest.number
                or self._newest.queued(part.node) < FRAMES_QUEUED_MAX
            )
            if self._end:
                return False
            epoch = self._epoch if source.epoch == self._epoch.number else self._newest
            if source.epoch < epoch.number:
                return True
            if source.since < epoch.earliest:
                self._leave_out(epoch, part)
                return True
            epoch.ended.discard(part.node)
            period = epoch.periods.setdefault(source.since, _Period(source.servers))
            queue = period.queues[part.node]
            last_tick, last_since = epoch.last[part.node]
            is_later = part.tick > last_tick or source.since > last_since
            if is_later:
                epoch.last[part.node] = (part.tick, source.since)
            if is_later and part.tick > self._merged:
                queue.append(part)
            else:
                self._leave_out(epoch, part)
            if self._newest is not self._epoch and self._newest.all_have_told():
                self._begin_newest()
            self._changed.notify_all()
            return True

    def ended(self, node: int) -> None:
        """Nothing more comes from that server, unless it begins anew."""
        with self._changed:
            for epoch in (self._epoch, self._newest):
                epoch.ended.add(node)
            self._changed.notify_all()

    def end(self, error: TesseraError) -> None:
        """Only the first end counts. Whole ticks that have arrived can still be read."""
        with self._changed:
            self._finish(error)

    def wait_for_all(self, timeout: float | None) -> None:
        """Waits until every server of the world has pushed something."""
        with self._changed:
            self._changed.wait_for(lambda: self._end or self._epoch.all_have_told(), timeout)
            if not self._epoch.all_have_told():
                raise self._end or DeadlineExceeded("not every server has answered the subscription in time")

    def next(self, timeout: float | None) -> tuple[int, list[Part]]:
        """The next tick that all servers have pushed, and its parts: none if a server does not have all of
        its part.
        """
        with self._changed:
            found = self._changed.wait_for(lambda: self._take() or self._end, timeout)
            if isinstance(found, tuple):
                return found
            raise found or DeadlineExceeded("no tick was complete in time")

    @property
    def skipped(self) -> int:
        with self._changed:
            return self._skipped

    def _finish(self, error: TesseraError) -> None:
        self._end = self._end or error
        self._changed.notify_all()

    def _begin_newest(self) -> None:
        """The world was set back: what the servers have told of ticks that are not whole will come again.

        A server that stays has sent all of the earlier epoch before it tells of this one, while others may
        overtake it.
        """
        while merged := self._take_merged():
            self._ready.append(merged)
        if len(self._ready) > READY_MAX:
            self._finish(ResourceExhausted("the reader is too far behind"))
        self._epoch = self._newest
        for period in self._epoch.periods.values():
            for queue in period.queues.values():
                while queue and queue[0].tick <= self._merged:
                    self._leave_out(self._epoch, queue.popleft())

    def _take(self) -> tuple[int, list[Part]] | None:
        return self._ready.popleft() if self._ready else self._take_merged()

    def _take_merged(self) -> tuple[int, list[Part]] | None:
        epoch = self._epoch
        while epoch.periods:
            since = min(epoch.periods)
            if merged := self._take_merged_of(since):
                return merged
            if not epoch.is_over(since):
                return None
            for queue in epoch.periods.pop(since).queues.values():
                self._skipped += sum(part.tick >= since for part in queue)
                for part in queue:
                    self._leave_out(epoch, part)
            epoch.earliest = min(epoch.periods)
        return None

    def _take_merged_of(self, since: int) -> tuple[int, list[Part]] | None:
        """The earliest tick of a period that all its servers have; earlier ticks that only some have are
        dropped.
        """
        period = self._epoch.periods[since]
        if not period.all_have_told():
            return None
        queues = list(period.queues.values())
        while all(queues):
            ticks = [parts[0].tick for parts in queues]
            if min(ticks) == max(ticks):
                return self._merge([parts.popleft() for parts in queues])
            for parts, tick in zip(queues, ticks):
                if tick < max(ticks):
                    self._leave_out(self._epoch, parts.popleft())
                    # What a server that joined told of the tick before is not missed.
                    self._skipped += tick >= since
            self._changed.notify_all()
        return None

    def _leave_out(self, epoch: _Epoch[Part], part: Part) -> None:
        if self._of_changes:
            epoch.left_out[part.node].append(part)

    def _merge(self, parts: list[Part]) -> tuple[int, list[Part]]:
        is_whole = not any(part.source.first for part in parts)
        if not is_whole and self._merged >= 0:
            self._skipped += 1
        self._merged = parts[0].tick
        self._changed.notify_all()
        with_earlier = [each for part in parts for each in (*self._epoch.left_out.pop(part.node, ()), part)]
        return self._merged, with_earlier if is_whole else []
