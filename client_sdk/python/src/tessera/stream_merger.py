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
class _Server(Generic[Part]):
    parts: deque[Part] = field(default_factory=deque)  # that were not read
    last: int = -1  # tick that it has pushed


@dataclass
class _Epoch(Generic[Part]):
    number: int = 0
    size: int = 0  # the number of servers that take part
    servers: defaultdict[int, _Server[Part]] = field(default_factory=lambda: defaultdict(_Server))  # by node

    def all_have_told(self) -> bool:
        return 0 < self.size <= len(self.servers) and all(
            server.last >= 0 for server in self.servers.values()
        )


class StreamMerger(Generic[Part]):
    """Servers push their parts of ticks, ascending within an epoch; one reader gets whole ticks, each once,
    in order. Safe to use from any thread.
    """

    def __init__(self) -> None:
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
                self._newest = _Epoch(source.epoch, source.servers)
                self._changed.notify_all()
            self._changed.wait_for(
                lambda: self._end
                or source.epoch < self._newest.number
                or len(self._newest.servers[part.node].parts) < FRAMES_QUEUED_MAX
            )
            if self._end:
                return False
            epoch = self._epoch if source.epoch == self._epoch.number else self._newest
            if source.epoch < epoch.number:
                return True
            server = epoch.servers[part.node]
            if part.tick > max(server.last, self._merged):
                server.parts.append(part)
            server.last = max(server.last, part.tick)
            if self._newest is not self._epoch and self._newest.all_have_told():
                self._begin_newest()
            self._changed.notify_all()
            return True

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
        for server in self._epoch.servers.values():
            while server.parts and server.parts[0].tick <= self._merged:
                server.parts.popleft()

    def _take(self) -> tuple[int, list[Part]] | None:
        return self._ready.popleft() if self._ready else self._take_merged()

    def _take_merged(self) -> tuple[int, list[Part]] | None:
        """The earliest tick that all servers have; earlier ticks that only some have are dropped."""
        if not self._epoch.all_have_told():
            return None
        queues = [server.parts for server in self._epoch.servers.values()]
        while all(queues):
            ticks = [parts[0].tick for parts in queues]
            if min(ticks) == max(ticks):
                return self._merge([parts.popleft() for parts in queues])
            for parts, tick in zip(queues, ticks):
                if tick < max(ticks):
                    parts.popleft()
                    self._skipped += 1
            self._changed.notify_all()
        return None

    def _merge(self, parts: list[Part]) -> tuple[int, list[Part]]:
        is_whole = not any(part.source.first for part in parts)
        if not is_whole and self._merged >= 0:
            self._skipped += 1
        self._merged = parts[0].tick
        self._changed.notify_all()
        return self._merged, parts if is_whole else []
