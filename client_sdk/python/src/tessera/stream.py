"""Streams of a cluster, tick by tick.

Every server streams the contents of its sectors; the parts of one tick are merged into one frame. A body that
changes servers is in each frame exactly once. Where the world moves to other servers, so do the streams.
"""

from __future__ import annotations

import secrets
import threading
import time
import weakref
from collections.abc import Callable, Iterator
from copy import deepcopy
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Generic, TypeAlias, TypeVar

import grpc

from tessera._proto import tessera_pb2, tessera_pb2_grpc
from tessera.errors import (
    Aborted,
    Cancelled,
    InvalidArgument,
    ResourceExhausted,
    TesseraError,
    Unavailable,
)
from tessera.frame import ContactFrame, DivergenceFrame, ProgramFrame, SeamFrame
from tessera.grpc_errors import from_grpc
from tessera.keys import Keys
from tessera.stream_merger import Part, StreamMerger

COORDINATOR_MISSED_MAX_S = 15.0  # when a stream asks it where the world is
STATUS_TIMEOUT_S = 2.0
ASK_AGAIN_S = 0.1
FAREWELL_S = 5.0

AskStatus: TypeAlias = Callable[[float], tessera_pb2.StatusReply]
"""Asks the coordinator where the world is, with a timeout in s."""

Gateway: TypeAlias = Callable[[], str]
"""The address of the gateway that the last status came through."""

_SERVER_HEADER = "tessera-server"  # proto/server_header.h

Frame = TypeVar("Frame")


class Stream(Generic[Part, Frame]):
    """A subscription; iterating over it waits for frame after frame.

    It goes on with the world after the loss of servers or of the coordinator: each tick comes once, in order.

    At most 256 ticks per server are buffered here, and some thousands at the server; a reader that falls
    further behind loses the subscription (ResourceExhausted). For one reading thread; any thread may call
    `cancel()`. It ends with `cancel()` or with the end of a `with` block.
    """

    def __init__(
        self,
        method: str,
        request: Any,
        read: Callable[[int, list[Part]], Frame],
        status: tessera_pb2.StatusReply,
        ask_status: AskStatus,
        gateway: Gateway,
        keys: Keys,
        timeout: float | None,
        of_changes: bool = False,
    ) -> None:
        """Subscribes with a method of service Streams at every server that takes part in the world, and waits
        until all have answered; `read` makes a frame from the parts of a tick. If they tell `of_changes`, those
        of ticks that are left out come with the next tick. DeadlineExceeded, Unavailable.
        """
        self._merger: StreamMerger[Part] = StreamMerger(of_changes)
        self._read = read
        follower = _Follower(self._merger, method, request, status, ask_status, gateway, keys)
        self._finalizer = weakref.finalize(self, follower.end, Cancelled("the stream was cancelled"))
        try:
            self._merger.wait_for_all(timeout)
        except TesseraError:
            self.cancel()
            raise

    def next(self, timeout: float | None = None) -> Frame:
        """The next tick that all servers have streamed; waits at most `timeout` s, by default indefinitely.

        Raises DeadlineExceeded if none is complete in time (call again). Any other error ends the stream for
        good: Unavailable if the world has failed, or if no coordinator answers for 5 s when a server is lost,
        Cancelled after `cancel()`, Aborted if the world was unloaded or replaced.
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


ContactStream: TypeAlias = Stream[tessera_pb2.ContactBatch, ContactFrame]
DivergenceStream: TypeAlias = Stream[tessera_pb2.DivergenceBatch, DivergenceFrame]
ProgramStream: TypeAlias = Stream[tessera_pb2.ProgramBatch, ProgramFrame]
SeamStream: TypeAlias = Stream[tessera_pb2.SeamBatch, SeamFrame]


@dataclass
class _Reader:
    channel: grpc.Channel
    has_ended: bool = False
    unwanted_since: float | None = None

    def may_stay(self, is_wanted: bool) -> bool:
        """Whether to read on: what a server that has left the world has yet to send is waited for, for a
        while.
        """
        if is_wanted:
            self.unwanted_since = None
            return True
        self.unwanted_since = self.unwanted_since or time.monotonic()
        return time.monotonic() - self.unwanted_since < FAREWELL_S


class _Follower(Generic[Part]):
    """Keeps a gRPC stream open to each server that takes part in the world, until `end()`."""

    def __init__(
        self,
        merger: StreamMerger[Part],
        method: str,
        request: Any,
        status: tessera_pb2.StatusReply,
        ask_status: AskStatus,
        gateway: Gateway,
        keys: Keys,
    ) -> None:
        self._merger = merger
        self._keys = keys
        self._method = method
        self._request = deepcopy(request)
        self._request.subscription = secrets.randbits(64) | 1
        self._load = status.load
        self._ask_status = ask_status
        self._gateway = gateway
        self._changed = threading.Condition()  # its lock guards the following
        self._readers: dict[str, _Reader] = {}  # by address
        self._last_end = ""
        self._looks_again = False
        self._has_ended = False
        self._follow(status)
        threading.Thread(target=self._follow_world, daemon=True).start()

    def end(self, error: TesseraError) -> None:
        """Only the first end counts."""
        self._merger.end(error)
        with self._changed:
            self._has_ended = True
            for reader in self._readers.values():
                reader.channel.close()
            self._changed.notify_all()

    def _follow_world(self) -> None:
        """Asks where the world is whenever that may have changed."""
        missed_since: float | None = None
        while self._awaits_change():
            try:
                is_followed = self._follow(self._ask_status(STATUS_TIMEOUT_S))
                missed_since = None
            except (TesseraError, ValueError) as error:  # ValueError: the client was closed
                is_followed = False
                missed_since = missed_since or time.monotonic()
                if time.monotonic() - missed_since >= COORDINATOR_MISSED_MAX_S:
                    self.end(Unavailable(str(error)))
            with self._changed:
                self._looks_again = self._looks_again or not is_followed
                # The world, a server of it, or the coordinator, may be about to come back.
                self._changed.wait_for(lambda: self._has_ended, ASK_AGAIN_S)

    def _awaits_change(self) -> bool:
        """False once the stream has ended."""
        with self._changed:
            self._changed.wait_for(lambda: self._has_ended or self._looks_again)
            self._looks_again = False
            return not self._has_ended

    def _follow(self, status: tessera_pb2.StatusReply) -> bool:
        """Opens streams at the servers that take part in the world, and ends those at others. False if no
        server does, or others have yet to end.
        """
        wanted = {server.stream_address: server.node for server in status.servers if server.takes_part}
        with self._changed:
            if status.state == "failed":
                self.end(Unavailable("; ".join(filter(None, (self._last_end, status.failure)))))
            elif status.load != self._load:
                self.end(Aborted("the world was unloaded or replaced"))
            if self._has_ended:
                return True
            for address, reader in list(self._readers.items()):
                if reader.has_ended or not reader.may_stay(address in wanted):
                    self._readers.pop(address).channel.close()
            for address in wanted.keys() - self._readers.keys():
                node = wanted[address] if status.through_gateway else None
                self._readers[address] = self._open(address, node)
            return bool(wanted) and not any(reader.unwanted_since for reader in self._readers.values())

    def _open(self, address: str, node: int | None) -> _Reader:
        """The stream of the server at `address`; with a `node`, through the gateway, which is told it."""
        door = address if node is None else self._gateway()
        headers = () if node is None else ((_SERVER_HEADER, str(node)),)
        reader = _Reader(self._keys.channel(door, [("grpc.max_receive_message_length", -1)]))
        stub = tessera_pb2_grpc.StreamsStub(reader.channel)
        call = getattr(stub, self._method)(self._request, metadata=headers)
        threading.Thread(target=self._read, args=(address, reader, call), daemon=True).start()
        return reader

    def _read(self, address: str, reader: _Reader, call: Any) -> None:
        """Passes on the messages of a server, until it or the stream ends."""
        why = TesseraError("it ended the stream")
        servers: tuple[int, int] | None = None  # epoch, first tick
        node: int | None = None
        try:
            for batch in call:
                source = batch.source
                node = batch.node
                now = (source.epoch, source.since)
                if now != servers and (servers or source.servers != self._count_readers()):
                    self._look_again()
                servers = now
                if not self._merger.push(batch):
                    self.end(Cancelled("the stream has ended"))
                    return
        except grpc.RpcError as error:
            why = from_grpc(error)
        if node is not None:
            self._merger.ended(node)
        told = f"sector server at {address}: {why}"
        if isinstance(why, (InvalidArgument, ResourceExhausted)):
            self.end(type(why)(told))
        with self._changed:
            self._last_end = told
            reader.has_ended = True
        self._look_again()

    def _count_readers(self) -> int:
        """Waits until those that are being opened all are."""
        with self._changed:
            return len(self._readers)

    def _look_again(self) -> None:
        with self._changed:
            self._looks_again = True
            self._changed.notify_all()
