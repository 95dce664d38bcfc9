"""Streams of a cluster, tick by tick.

Every server streams the contents of its sectors; the parts of one tick are merged into one frame. A body that
changes servers is in each frame exactly once.
"""

from __future__ import annotations

import threading
import time
import weakref
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from types import TracebackType
from typing import Any, Generic, Protocol, TypeVar

import grpc

from tessera.errors import (
    Aborted,
    Cancelled,
    DeadlineExceeded,
    ResourceExhausted,
    TesseraError,
    Unavailable,
    from_grpc,
)

FRAMES_QUEUED_MAX = 256  # per server, which waits while it is that far ahead of the reader


class Batch(Protocol):
    """One server's part of one tick."""

    @property
    def tick(self) -> int:
        ...


Part = TypeVar("Part", bound=Batch)
Frame = TypeVar("Frame")


class StreamMerger(Generic[Part]):
    """Merges the parts of ticks of several sources.

    Sources push their parts, ascending by tick; one reader gets whole ticks. Safe to use from any thread.
    """

    def __init__(self, sources: int) -> None:
        self._changed = threading.Condition()
        self._parts: list[deque[tuple[Part, bool]]] = [deque() for _ in range(sources)]
        self._last: list[int | None] = [None] * sources
        self._end: TesseraError | None = None
        self._skipped = 0

    def push(self, source: int, part: Part, is_whole: bool = True) -> bool:
        """Waits while the source is too far ahead. `is_whole` is false if the source does not have the
        complete tick: then the frame is empty. False once the stream has ended.
        """
        with self._changed:
            last = self._last[source]
            if last is not None and part.tick <= last:
                self._finish(Aborted("the world was unloaded or replaced"))
            self._changed.wait_for(lambda: self._end or len(self._parts[source]) < FRAMES_QUEUED_MAX)
            if self._end:
                return False
            self._last[source] = part.tick
            self._parts[source].append((part, is_whole))
            self._changed.notify_all()
            return True

    def end(self, error: TesseraError) -> None:
        """Only the first end counts. Whole ticks that have arrived can still be read."""
        with self._changed:
            self._finish(error)

    def wait_for_all(self, timeout: float | None) -> None:
        """Waits until every source has pushed something."""
        with self._changed:
            told = self._changed.wait_for(lambda: self._end or None not in self._last, timeout)
            if None not in self._last:
                return
            if told and self._end:
                raise self._end
            raise DeadlineExceeded("not every server has answered the subscription in time")

    def next(self, timeout: float | None) -> tuple[int, list[Part]]:
        """The next tick that all sources have pushed, and its parts."""
        deadline = None if timeout is None else time.monotonic() + timeout
        with self._changed:
            while not self._ready():
                if self._end:
                    raise self._end
                left = None if deadline is None else deadline - time.monotonic()
                if left is not None and left <= 0:
                    raise DeadlineExceeded("no tick was complete in time")
                self._changed.wait(left)
            return self._take()

    @property
    def skipped(self) -> int:
        with self._changed:
            return self._skipped

    def _finish(self, error: TesseraError) -> None:
        self._end = self._end or error
        self._changed.notify_all()

    def _ready(self) -> bool:
        """Whether all sources have the same tick in front; ticks that only some have are dropped."""
        while all(self._parts):
            ticks = [parts[0][0].tick for parts in self._parts]
            if min(ticks) == max(ticks):
                return True
            for parts, tick in zip(self._parts, ticks):
                if tick < max(ticks):
                    parts.popleft()
                    self._skipped += 1
            self._changed.notify_all()
        return False

    def _take(self) -> tuple[int, list[Part]]:
        front = [parts.popleft() for parts in self._parts]
        self._changed.notify_all()
        tick = front[0][0].tick
        return tick, [part for part, _ in front] if all(whole for _, whole in front) else []


class Stream(Generic[Part, Frame]):
    """A subscription; iterating over it waits for frame after frame.

    At most 256 ticks per server are buffered here, and some thousands at the server; a reader that falls
    further behind loses the subscription (ResourceExhausted). For one reading thread; any thread may call
    `cancel()`. It ends with `cancel()` or with the end of a `with` block.
    """

    def __init__(
        self,
        addresses: Sequence[str],
        open_at: Callable[[grpc.Channel], Any],
        read: Callable[[int, list[Part]], Frame],
        *,
        first_is_whole: bool,
        timeout: float | None,
    ) -> None:
        """Subscribes with `open_at` at every server and waits until all have answered; `read` makes a frame
        from the parts of a tick. DeadlineExceeded, Unavailable.
        """
        self._merger: StreamMerger[Part] = StreamMerger(len(addresses))
        self._read = read
        channels = [
            grpc.insecure_channel(address, [("grpc.max_receive_message_length", -1)]) for address in addresses
        ]
        for source, (address, channel) in enumerate(zip(addresses, channels)):
            arguments = (self._merger, source, address, open_at(channel), first_is_whole)
            threading.Thread(target=_listen, args=arguments, daemon=True).start()
        self._finalizer = weakref.finalize(self, _cancel, self._merger, channels)
        try:
            self._merger.wait_for_all(timeout)
        except TesseraError:
            self.cancel()
            raise

    def next(self, timeout: float | None = None) -> Frame:
        """The next tick that all servers have streamed; waits at most `timeout` s, by default indefinitely.

        Raises DeadlineExceeded if none is complete in time (call again). Any other error ends the stream for
        good: Unavailable, naming the server, if one was lost, Cancelled after `cancel()`, Aborted if the
        world was unloaded or replaced.
        """
        return self._read(*self.next_parts(timeout))

    def next_parts(self, timeout: float | None = None) -> tuple[int, list[Part]]:
        """As `next()`, but returns the tick and each server's part of it, as messages."""
        return self._merger.next(timeout)

    def __iter__(self) -> Iterator[Frame]:
        while True:
            try:
                yield self.next()
            except Cancelled:
                return

    @property
    def skipped(self) -> int:
        """The number of ticks so far that only some of the servers streamed."""
        return self._merger.skipped

    def cancel(self) -> None:
        """Ends the stream."""
        self._finalizer()

    def __enter__(self) -> Stream[Part, Frame]:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.cancel()


def _listen(merger: StreamMerger[Part], source: int, address: str, call: Any, is_whole: bool) -> None:
    """Passes on the messages of a server, until it or the reader ends."""
    why = TesseraError("it ended the stream")
    try:
        for batch in call:
            if not merger.push(source, batch, is_whole):
                break
            is_whole = True
    except grpc.RpcError as error:
        why = from_grpc(error)
    call.cancel()
    kind = ResourceExhausted if isinstance(why, ResourceExhausted) else Unavailable
    merger.end(kind(f"sector server at {address}: {why}"))


def _cancel(merger: StreamMerger[Any], channels: Sequence[grpc.Channel]) -> None:
    merger.end(Cancelled("the stream was cancelled"))
    for channel in channels:
        channel.close()
