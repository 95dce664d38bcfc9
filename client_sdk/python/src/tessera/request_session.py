"""A stream of requests to the coordinator that leads, each of which is carried out once."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Any, TypeVar

import grpc

from tessera._proto import tessera_pb2
from tessera.coordinators import Coordinators, stands_by
from tessera.deadline import is_worth_another
from tessera.errors import Cancelled, DeadlineExceeded, TesseraError, Unavailable, from_number
from tessera.grpc_errors import from_grpc

WINDOW = 1024  # requests without a reply
# Without an answer for so long, requests are given up. A coordinator that is replaced is back within a second or two,
# and on a busy machine within some more.
ONE_IS_GONE_MAX_S = 10.0
NOBODY_LEADS_MAX_S = 60.0  # of several
FIND_MAX_S = 1.0

T = TypeVar("T")


@dataclass
class _Pending:
    request: tessera_pb2.Request
    future: Future[Any]
    read: Callable[[tessera_pb2.Reply], Any]


class _Stream:
    """What is still to be sent on one stream: the numbers of requests, ascending."""

    def __init__(self, numbers: Iterator[int] = iter(())) -> None:
        self.unsent = deque(numbers)
        self.call: Any = None
        self.has_replied = False
        self.has_ended = False


class RequestSession:
    """Requests are numbered as they are sent. Where the stream is lost, those without a reply are made again, under
    the same numbers, to whoever leads then. Safe to use from any thread.
    """

    def __init__(self, coordinators: Coordinators) -> None:
        self._coordinators = coordinators
        lock = threading.Lock()  # guards the following
        self._to_do = threading.Condition(lock)
        self._has_room = threading.Condition(lock)
        self._lock = lock
        self._pending: dict[int, _Pending] = {}  # by number, ascending
        self._last_number = 0
        self._answered: list[int] = []  # since the last request that was sent
        self._stream = _Stream()  # the present one
        self._is_closing = False
        threading.Thread(target=self._run, name="tessera-requests", daemon=True).start()

    def close(self) -> None:
        """What waits for a reply gets Cancelled."""
        with self._lock:
            self._is_closing = True
            call = self._stream.call
            self._to_do.notify_all()
            self._has_room.notify_all()
        if call is not None:
            call.cancel()

    def send(self, request: tessera_pb2.Request, read: Callable[[tessera_pb2.Reply], T]) -> Future[T]:
        """Waits while WINDOW requests have no reply, and sends; takes the request over. `read` gets the reply, on a
        thread of this object, and its result is that of the future. Errors are those of the reply, or Unavailable
        where nobody was there to take the request again.
        """
        return self._enqueue(request, read, None)[1]

    def call(self, request: tessera_pb2.Request, timeout: float | None) -> tessera_pb2.Reply:
        """As `send()`, and waits. DeadlineExceeded: no reply within `timeout` s; the request may take effect
        nevertheless.
        """
        began = time.monotonic()
        number, future = self._enqueue(request, _as_it_is, timeout)
        try:
            return future.result(None if timeout is None else max(0.0, began + timeout - time.monotonic()))
        except TimeoutError:  # perhaps that of the reply
            if self._forget(number):
                raise self._late(timeout) from None
            return future.result()

    def _enqueue(
        self, request: tessera_pb2.Request, read: Callable[[tessera_pb2.Reply], T], timeout: float | None
    ) -> tuple[int, Future[T]]:
        future: Future[T] = Future()
        future.set_running_or_notify_cancel()  # from here on, it cannot be cancelled
        with self._lock:
            if not self._has_room.wait_for(lambda: len(self._pending) < WINDOW or self._is_closing, timeout):
                raise self._late(timeout)
            if self._is_closing:
                raise Cancelled("the client was closed")
            self._last_number += 1
            number = request.number = self._last_number
            self._pending[number] = _Pending(request, future, read)
            self._stream.unsent.append(number)
            self._to_do.notify_all()
        return number, future

    def _late(self, timeout: float | None) -> DeadlineExceeded:
        return DeadlineExceeded(f"{self._coordinators.where}: no answer within {timeout:g} s")

    def _forget(self, number: int) -> bool:
        """Nobody waits for that reply any more. False if it has come."""
        with self._lock:
            return self._pop(number) is not None

    def _pop(self, number: int) -> _Pending | None:
        """For whoever has the lock."""
        pending = self._pending.pop(number, None)
        if pending is not None:
            self._answered.append(number)
            self._has_room.notify()
        return pending

    def _run(self) -> None:
        lost: float | None = None  # since when no reply has come
        while self._awaits_requests():
            place = self._coordinators.find(time.monotonic() + FIND_MAX_S)
            stream, error = self._serve(place)
            self._coordinators.leave(place, error)
            if stream.has_replied:
                lost = None
            lost = lost or time.monotonic()
            with self._lock:
                if self._is_closing:
                    break
                if not self._pending:
                    continue
            patience_s = NOBODY_LEADS_MAX_S if self._coordinators.are_several else ONE_IS_GONE_MAX_S
            if self._is_lost(error) and is_worth_another(lost + patience_s):
                continue
            where = self._coordinators.where
            self._fail_all(from_grpc(error, where) if error else Unavailable(f"{where}: the stream has ended"))
            lost = None
        self._fail_all(Cancelled("the client was closed"))

    def _awaits_requests(self) -> bool:
        """False when the session ends."""
        with self._lock:
            self._to_do.wait_for(lambda: self._is_closing or self._pending)
            return not self._is_closing

    def _serve(self, place: int) -> tuple[_Stream, grpc.RpcError | None]:
        """One stream, until it is lost."""
        with self._lock:
            stream = self._stream = _Stream(iter(self._pending))
            if self._is_closing:
                return stream, None
            stream.call = self._coordinators.open_session(place, self._requests(stream))
        error = None
        try:
            for reply in stream.call:
                stream.has_replied = True
                self._take(reply)
        except grpc.RpcError as lost:
            error = lost
        with self._lock:
            stream.has_ended = True
            stream.call = None
            self._to_do.notify_all()
        return stream, error

    def _requests(self, stream: _Stream) -> Iterator[tessera_pb2.Request]:
        """All that are to be sent on it, as gRPC takes them."""
        while (request := self._next_request(stream)) is not None:
            yield request

    def _next_request(self, stream: _Stream) -> tessera_pb2.Request | None:
        """Waits for it. None when the stream has ended."""
        with self._lock:
            while True:
                self._to_do.wait_for(lambda: stream.unsent or stream.has_ended or self._is_closing)
                if stream.has_ended or self._is_closing:
                    return None
                pending = self._pending.get(stream.unsent.popleft())
                if pending is not None:  # otherwise nobody waits for it any more
                    break
            request = pending.request
            request.answered = next(iter(self._pending)) - 1
            request.also_answered[:] = [number for number in self._answered if number > request.answered]
            self._answered.clear()
        return request

    def _take(self, reply: tessera_pb2.Reply) -> None:
        with self._lock:
            pending = self._pop(reply.number)
        if pending is None:
            return
        if reply.code != 0:
            pending.future.set_exception(from_number(reply.code, reply.message))
            return
        try:
            pending.future.set_result(pending.read(reply))
        except Exception as error:  # that of `read`
            pending.future.set_exception(error)

    def _is_lost(self, error: grpc.RpcError | None) -> bool:
        """Whether the connection, or the coordinator, is what has ended, and another one may be there."""
        if error is None:
            return True
        may_change = self._coordinators.are_several or not stands_by(error)
        return may_change and error.code() == grpc.StatusCode.UNAVAILABLE

    def _fail_all(self, error: TesseraError) -> None:
        with self._lock:
            failed, self._pending = self._pending, {}
            self._answered.extend(failed)
            self._has_room.notify_all()
        for pending in failed.values():
            pending.future.set_exception(error)


def _as_it_is(reply: tessera_pb2.Reply) -> tessera_pb2.Reply:
    return reply
