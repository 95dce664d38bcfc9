"""Requests are made again where their replies are lost, under their numbers, and wait for no longer than they may."""

from __future__ import annotations

import queue
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import grpc
import pytest

from tessera._proto import tessera_pb2, tessera_pb2_grpc
from tessera.coordinators import Coordinators
from tessera.errors import Cancelled, DeadlineExceeded, InvalidArgument, NotFound, PermissionDenied
from tessera.keys import Keys
from tessera.request_session import WINDOW, RequestSession

PATIENCE_S = 30.0
UNKNOWN = 10**9  # ticks that are refused


class Coordinator(tessera_pb2_grpc.TesseraServicer):
    """Replies to requests once it may."""

    def __init__(self) -> None:
        self.replies = threading.Event()
        self.replies.set()
        self.loses: set[int] = set()  # numbers at which it breaks the stream, once each
        self.refuses: grpc.StatusCode | None = None
        self.requests: queue.SimpleQueue[tessera_pb2.Request] = queue.SimpleQueue()
        self.sessions: set[Any] = set()
        self.server = grpc.server(ThreadPoolExecutor(8))
        tessera_pb2_grpc.add_TesseraServicer_to_server(self, self.server)
        self.address = f"127.0.0.1:{self.server.add_insecure_port('127.0.0.1:0')}"
        self.server.start()

    def Session(self, requests: Iterator[tessera_pb2.Request], context: Any) -> Iterator[tessera_pb2.Reply]:
        self.sessions.add(dict(context.invocation_metadata())["tessera-session"])
        if self.refuses:
            context.abort(self.refuses, "not you")
        for request in requests:
            self.requests.put(request)
            if request.number in self.loses:
                self.loses.remove(request.number)
                context.abort(grpc.StatusCode.UNAVAILABLE, "the connection is lost")
            self.replies.wait()
            reply = tessera_pb2.Reply(number=request.number, tick=request.ticks)
            if request.ticks == UNKNOWN:
                reply.code, reply.message = grpc.StatusCode.NOT_FOUND.value[0], "no such"
            yield reply

    def next(self) -> tessera_pb2.Request:
        return self.requests.get(timeout=PATIENCE_S)


@pytest.fixture
def coordinator() -> Iterator[Coordinator]:
    one = Coordinator()
    yield one
    one.replies.set()
    one.server.stop(None)


@pytest.fixture
def session(coordinator: Coordinator) -> Iterator[RequestSession]:
    coordinators = Coordinators(coordinator.address, Keys(), PATIENCE_S)
    one = RequestSession(coordinators)
    yield one
    one.close()
    coordinators.close()


def tick_of(reply: tessera_pb2.Reply) -> int:
    return int(reply.tick)


def step(ticks: int) -> tessera_pb2.Request:
    return tessera_pb2.Request(ticks=ticks)


def test_numbers_count_and_tell_which_replies_have_come(coordinator: Coordinator, session: RequestSession) -> None:
    assert [session.call(step(n), PATIENCE_S).tick for n in (5, 6, 7)] == [5, 6, 7]
    requests = [coordinator.next() for _ in range(3)]
    assert [request.number for request in requests] == [1, 2, 3]
    assert [request.answered for request in requests] == [0, 1, 2]
    assert not any(request.also_answered for request in requests)


def test_errors_are_those_of_the_reply(session: RequestSession) -> None:
    with pytest.raises(NotFound, match="no such"):
        session.call(step(UNKNOWN), PATIENCE_S)
    future = session.send(step(UNKNOWN), tick_of)
    with pytest.raises(NotFound, match="no such"):
        future.result(PATIENCE_S)

    def fails(reply: tessera_pb2.Reply) -> int:
        raise InvalidArgument("of the reader")

    with pytest.raises(InvalidArgument, match="of the reader"):
        session.send(step(1), fails).result(PATIENCE_S)
    assert session.call(step(2), PATIENCE_S).tick == 2


def test_what_is_lost_is_made_again_under_its_number(coordinator: Coordinator, session: RequestSession) -> None:
    coordinator.loses = {2, 4}
    futures = [session.send(step(n), tick_of) for n in range(1, 7)]
    assert [future.result(PATIENCE_S) for future in futures] == [1, 2, 3, 4, 5, 6]
    numbers = [coordinator.next().number for _ in range(8)]
    assert sorted(numbers) == [1, 2, 2, 3, 4, 4, 5, 6]
    assert len(coordinator.sessions) == 1


def test_requests_without_replies_are_bounded(coordinator: Coordinator, session: RequestSession) -> None:
    coordinator.replies.clear()
    futures = [session.send(step(n), tick_of) for n in range(WINDOW)]
    with pytest.raises(DeadlineExceeded, match="no answer within 0.05 s"):
        session.call(step(1), 0.05)
    with ThreadPoolExecutor(1) as other:
        one_more = other.submit(lambda: session.send(step(WINDOW), tick_of))
        assert not one_more.done()
        coordinator.replies.set()
        assert one_more.result(PATIENCE_S).result(PATIENCE_S) == WINDOW
    assert [future.result(PATIENCE_S) for future in futures] == list(range(WINDOW))


def test_nobody_waits_longer_than_they_may(coordinator: Coordinator, session: RequestSession) -> None:
    coordinator.replies.clear()
    with pytest.raises(DeadlineExceeded, match=f"{coordinator.address}: no answer within 0.05 s"):
        session.call(step(1), 0.05)
    waits = session.send(step(2), tick_of)
    assert not waits.cancel()
    coordinator.replies.set()
    assert waits.result(PATIENCE_S) == 2
    assert session.call(step(3), PATIENCE_S).tick == 3
    requests = [coordinator.next() for _ in range(3)]
    assert [request.answered for request in requests] == [0, 1, 2]


def test_a_reply_that_overtakes_others_is_told_apart() -> None:
    """The oldest request has no reply yet: later ones are told by their numbers."""

    class Slow(Coordinator):
        def Session(self, requests: Iterator[tessera_pb2.Request], context: Any) -> Iterator[tessera_pb2.Reply]:
            first = next(requests)
            for request in requests:
                self.requests.put(request)
                yield tessera_pb2.Reply(number=request.number)
                if request.number == 4:
                    yield tessera_pb2.Reply(number=first.number)

    slow = Slow()
    coordinators = Coordinators(slow.address, Keys(), PATIENCE_S)
    session = RequestSession(coordinators)
    oldest = session.send(step(1), tick_of)
    for _ in range(3):
        session.call(step(1), PATIENCE_S)
    oldest.result(PATIENCE_S)
    requests = [slow.next() for _ in range(3)]
    told = [(request.number, request.answered, list(request.also_answered)) for request in requests]
    assert told == [(2, 0, []), (3, 0, [2]), (4, 0, [3])]
    session.close()
    coordinators.close()
    slow.server.stop(None)


def test_whom_the_cluster_does_not_know_is_told_at_once(coordinator: Coordinator, session: RequestSession) -> None:
    coordinator.refuses = grpc.StatusCode.UNAUTHENTICATED
    with pytest.raises(PermissionDenied, match="not you"):
        session.call(step(1), PATIENCE_S)
    coordinator.refuses = None
    assert session.call(step(2), PATIENCE_S).tick == 2


def test_what_waits_is_cancelled_when_the_client_is_closed(
    coordinator: Coordinator, session: RequestSession
) -> None:
    coordinator.replies.clear()
    waits = session.send(step(1), tick_of)
    coordinator.next()
    session.close()
    with pytest.raises(Cancelled, match="closed"):
        waits.result(PATIENCE_S)
    with pytest.raises(Cancelled, match="closed"):
        session.call(step(1), PATIENCE_S)


def test_a_thousand_threads_share_it(coordinator: Coordinator, session: RequestSession) -> None:
    coordinator.loses = {100, 1000, 1900}
    told: list[int] = []

    def call(n: int) -> None:
        for ticks in (2 * n + 1, 2 * n + 2):
            assert session.call(step(ticks), PATIENCE_S).tick == ticks
            told.append(ticks)

    threads = [threading.Thread(target=call, args=(n,)) for n in range(1000)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(told) == list(range(1, 2001))
