"""Calls go to the coordinator that leads, also where that changes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import grpc
import pytest

from tessera import Client
from tessera._proto import tessera_pb2, tessera_pb2_grpc
from tessera.errors import DeadlineExceeded, Unavailable


class Coordinator(tessera_pb2_grpc.TesseraServicer):
    """One that leads, or stands by."""

    def __init__(self) -> None:
        self.leads = False
        self.loses_answers = False
        self.pauses = 0
        self.pushes: list[tuple[Any, int]] = []  # session and number
        self.server = grpc.server(ThreadPoolExecutor(4))
        tessera_pb2_grpc.add_TesseraServicer_to_server(self, self.server)
        self.address = f"127.0.0.1:{self.server.add_insecure_port('127.0.0.1:0')}"
        self.server.start()

    def _refuse_unless_it_leads(self, context: Any) -> None:
        if not self.leads:
            context.set_trailing_metadata((("grpc-status-details-bin", b"tessera/stands-by"),))
            context.abort(grpc.StatusCode.UNAVAILABLE, "another one leads")

    def GetStatus(self, request: tessera_pb2.StatusRequest, context: Any) -> tessera_pb2.StatusReply:
        self._refuse_unless_it_leads(context)
        return tessera_pb2.StatusReply()

    def Pause(self, request: tessera_pb2.PauseRequest, context: Any) -> tessera_pb2.PauseReply:
        self._refuse_unless_it_leads(context)
        self.pauses += 1
        return tessera_pb2.PauseReply(tick=self.pauses)

    def Session(self, requests: Iterable[tessera_pb2.Request], context: Any) -> Iterator[tessera_pb2.Reply]:
        session = dict(context.invocation_metadata())["tessera-session"]
        for request in requests:
            self._refuse_unless_it_leads(context)
            self.pushes.append((session, request.number))
            if self.loses_answers:
                context.abort(grpc.StatusCode.UNAVAILABLE, "the connection is lost")
            yield tessera_pb2.Reply(number=request.number, applied={"tick": 7})


@pytest.fixture
def pair() -> Iterator[list[Coordinator]]:
    coordinators = [Coordinator(), Coordinator()]
    yield coordinators
    for coordinator in coordinators:
        coordinator.server.stop(None)


def test_calls_go_to_the_one_that_leads(pair: list[Coordinator]) -> None:
    with Client(",".join(one.address for one in pair)) as client:
        pair[1].leads = True
        assert client.pause() == 1
        pair[0].leads, pair[1].leads = True, False
        assert client.pause() == 1
        assert [one.pauses for one in pair] == [1, 1]


def test_calls_wait_for_a_leader_and_not_longer_than_they_may(pair: list[Coordinator]) -> None:
    with Client(",".join(one.address for one in pair)) as client:
        with pytest.raises((Unavailable, DeadlineExceeded), match="another one leads|no answer|Deadline"):
            client.pause(timeout=0.3)


def test_one_that_is_gone_is_passed_over(pair: list[Coordinator]) -> None:
    with Client(",".join(one.address for one in pair)) as client:
        pair[0].leads = pair[1].leads = True
        assert client.pause() == 1
        pair[0].server.stop(None).wait()
        with pytest.raises(Unavailable):  # it may have been asked already
            client.pause()
        assert client.pause() == 1
        assert pair[1].pauses == 1


def test_a_command_whose_answer_is_lost_is_made_again_under_its_number(pair: list[Coordinator]) -> None:
    with Client(",".join(one.address for one in pair)) as client:
        pair[0].leads = pair[1].leads = True
        pair[0].loses_answers = True
        assert client.apply_impulse("ball", (1, 0, 0)) == 7
        assert len(pair[0].pushes) == 1
        assert pair[1].pushes == pair[0].pushes
        pair[0].loses_answers = False
        assert client.apply_impulse("ball", (1, 0, 0)) == 7
        session, number = pair[1].pushes[0]
        assert pair[1].pushes[1] == (session, number + 1)


def test_a_standby_alone_refuses_at_once(pair: list[Coordinator]) -> None:
    with Client(pair[0].address) as client, pytest.raises(Unavailable, match="another one leads"):
        client.pause()
