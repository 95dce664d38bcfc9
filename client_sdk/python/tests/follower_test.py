"""Streams of a world that moves between servers or ends. Servers and coordinator are imitated."""

from __future__ import annotations

import queue
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

import grpc
import pytest
from conftest import PATIENCE_S

import tessera
from tessera import stream
from tessera._proto import tessera_pb2, tessera_pb2_grpc
from tessera.body_streams import BodyStream
from tessera.keys import Keys
from tessera.known_bodies import KnownBodies


class Server(tessera_pb2_grpc.StreamsServicer):
    """Streams what it is given to one client at a time."""

    def __init__(self, node: int) -> None:
        self.node = node
        self.subscriptions: list[int] = []
        self.named: list[str] = []  # by headers, as gateways want it
        self._batches: queue.SimpleQueue[tessera_pb2.BodyBatch | grpc.StatusCode | None] = queue.SimpleQueue()
        self._server = grpc.server(ThreadPoolExecutor(2))
        self.address = f"127.0.0.1:{self._server.add_insecure_port('127.0.0.1:0')}"
        tessera_pb2_grpc.add_StreamsServicer_to_server(self, self._server)
        self._server.start()

    def WatchBodies(
        self, request: tessera_pb2.WatchBodiesRequest, context: grpc.ServicerContext
    ) -> Iterator[tessera_pb2.BodyBatch]:
        self.subscriptions.append(request.subscription)
        self.named += [value for name, value in context.invocation_metadata() if name == "tessera-server"]
        for batch in iter(self._batches.get, None):
            if isinstance(batch, grpc.StatusCode):
                context.abort(batch, "too slow")
            yield batch

    def tell(self, tick: int, servers: int = 1, epoch: int = 1) -> None:
        batch = tessera_pb2.BodyBatch(tick=tick, node=self.node, bodies=[{"id": self.node}])
        batch.source.load, batch.source.epoch, batch.source.servers = 1, epoch, servers
        self._batches.put(batch)

    def end(self, why: grpc.StatusCode | None = None) -> None:
        self._batches.put(why)

    def stop(self) -> None:
        self.end()
        self._server.stop(None).wait()


class Coordinator:
    """Has the status of a world. `answers` come before it."""

    def __init__(self) -> None:
        self.answers: list[tessera_pb2.StatusReply | Exception] = []
        self.status: tessera_pb2.StatusReply | Exception = tessera_pb2.StatusReply()
        self.gateway = ""

    def ask(self, timeout: float) -> tessera_pb2.StatusReply:
        answer = self.answers.pop(0) if self.answers else self.status
        if isinstance(answer, Exception):
            raise answer
        return answer

    def place(self, *servers: Server, load: int = 1) -> None:
        places = [{"stream_address": server.address, "takes_part": True} for server in servers]
        self.status = tessera_pb2.StatusReply(state="running", load=load, servers=places)

    def watch(self) -> BodyStream:
        status = self.ask(PATIENCE_S)
        request = tessera_pb2.WatchBodiesRequest()
        known = KnownBodies(sector_size=1, complete=True)
        return stream.Stream("WatchBodies", request, known.take, status, self.ask, lambda: self.gateway, Keys(), PATIENCE_S)


@pytest.fixture
def a() -> Iterator[Server]:
    server = Server(1)
    yield server
    server.stop()


@pytest.fixture
def b() -> Iterator[Server]:
    server = Server(2)
    yield server
    server.stop()


@pytest.fixture
def coordinator(a: Server) -> Coordinator:
    coordinator = Coordinator()
    coordinator.place(a)
    return coordinator


def test_server_that_joins_is_subscribed_to_alike(a: Server, b: Server, coordinator: Coordinator) -> None:
    a.tell(1)
    with coordinator.watch() as bodies:
        assert bodies.next(PATIENCE_S).ids.tolist() == [1]
        coordinator.place(a, b)
        for server in (a, b):
            server.tell(2, servers=2, epoch=2)
        frame = bodies.next(PATIENCE_S)
        assert (frame.tick, frame.ids.tolist()) == (2, [1, 2])
        assert a.subscriptions == b.subscriptions != [0]


def test_server_that_joins_before_the_stream_is_open_is_found(
    a: Server, b: Server, coordinator: Coordinator
) -> None:
    coordinator.answers.append(coordinator.status)
    coordinator.place(a, b)
    for server in (a, b):
        server.tell(1, servers=2)
    with coordinator.watch() as bodies:
        assert bodies.next(PATIENCE_S).ids.tolist() == [1, 2]


def test_through_a_gateway_streams_are_opened_there_and_name_the_server(
    a: Server, coordinator: Coordinator
) -> None:
    server = {"stream_address": "127.0.0.1:1", "takes_part": True, "node": 77}
    coordinator.status = tessera_pb2.StatusReply(state="running", load=1, servers=[server], through_gateway=True)
    coordinator.gateway = a.address
    a.tell(1)
    with coordinator.watch() as bodies:
        assert bodies.next(PATIENCE_S).tick == 1
    assert a.named == ["77"]


def test_world_is_followed_from_a_server_that_is_lost(a: Server, b: Server, coordinator: Coordinator) -> None:
    a.tell(1)
    with coordinator.watch() as bodies:
        coordinator.place(b)
        for tick in (0, 1, 2):
            b.tell(tick, epoch=2)
        a.end()
        frames = [bodies.next(PATIENCE_S) for _ in range(2)]
        assert [(frame.tick, frame.ids.tolist()) for frame in frames] == [(1, [1]), (2, [2])]
        assert bodies.skipped == 0


def test_failure_of_the_world_is_told(a: Server, coordinator: Coordinator) -> None:
    a.tell(1)
    with coordinator.watch() as bodies:
        coordinator.status = tessera_pb2.StatusReply(state="failed", load=1, failure="it ends its servers")
        a.end()
        assert bodies.next(PATIENCE_S).tick == 1
        with pytest.raises(tessera.Unavailable, match=f"{a.address}: it ended the stream; it ends its servers"):
            bodies.next(PATIENCE_S)


def test_another_world_is_not_followed(a: Server, coordinator: Coordinator) -> None:
    a.tell(1)
    with coordinator.watch() as bodies:
        coordinator.place(a, load=2)
        a.end()
        assert bodies.next(PATIENCE_S).tick == 1
        with pytest.raises(tessera.Aborted):
            bodies.next(PATIENCE_S)


def test_coordinator_that_is_back_in_time_is_not_missed(
    a: Server, b: Server, coordinator: Coordinator
) -> None:
    a.tell(1)
    with coordinator.watch() as bodies:
        coordinator.place(b)
        coordinator.answers += [tessera.Unavailable("gone"), tessera.Unavailable("gone")]
        b.tell(2, epoch=2)
        a.end()
        assert [bodies.next(PATIENCE_S).tick for _ in range(2)] == [1, 2]


@pytest.mark.parametrize("why", [tessera.DeadlineExceeded("gone"), ValueError("gone: the client was closed")])
def test_coordinator_that_stays_away_is_an_end(
    why: Exception, a: Server, coordinator: Coordinator, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stream, "COORDINATOR_MISSED_MAX_S", 0)
    a.tell(1)
    with coordinator.watch() as bodies:
        coordinator.status = why
        a.end()
        assert bodies.next(PATIENCE_S).tick == 1
        with pytest.raises(tessera.Unavailable, match="gone"):
            bodies.next(PATIENCE_S)


def test_reader_that_is_too_slow_is_told(a: Server, coordinator: Coordinator) -> None:
    a.tell(1)
    with coordinator.watch() as bodies:
        a.end(grpc.StatusCode.RESOURCE_EXHAUSTED)
        assert bodies.next(PATIENCE_S).tick == 1
        with pytest.raises(tessera.ResourceExhausted, match=f"{a.address}: too slow"):
            bodies.next(PATIENCE_S)
