"""The coordinators of a cluster, one of which leads, and a connection to each."""

from __future__ import annotations

import secrets
import time
from collections.abc import Iterator
from typing import Any

import grpc

from tessera._proto import tessera_pb2, tessera_pb2_grpc
from tessera.deadline import is_worth_another
from tessera.errors import Unavailable
from tessera.grpc_errors import raising
from tessera.keys import Keys

ANSWER_MAX_S = 1.0  # how long one of several may take to tell whether it leads

_SESSION_HEADER = "tessera-session"  # proto/session_header.h
_STANDS_BY = b"tessera/stands-by"  # proto/status.cc
_CHANNEL_OPTIONS = [
    ("grpc.max_receive_message_length", -1),
    ("grpc.max_send_message_length", -1),
    # Of its own, for the coordinator's limits are by connection, and what one has lost another may have.
    ("grpc.use_local_subchannel_pool", 1),
    # A coordinator that is replaced is back within a second or two.
    ("grpc.initial_reconnect_backoff_ms", 100),
    # An attempt may take several ways there and back: the ends of TCP and TLS meet over slow links, too.
    ("grpc.min_reconnect_backoff_ms", 1000),
    ("grpc.max_reconnect_backoff_ms", 1000),
]
# One of several that does not answer pings is as good as gone, although its connection stands.
_SEVERAL_OPTIONS = [
    ("grpc.keepalive_time_ms", 2000),
    ("grpc.keepalive_timeout_ms", 2000),
    ("grpc.http2.min_sent_ping_interval_without_data_ms", 1000),
    ("grpc.http2.max_pings_without_data", 0),
]


class Coordinators:
    """Safe to use from any thread."""

    def __init__(self, addresses: str, keys: Keys, timeout: float) -> None:
        """`addresses` are separated by commas. Unavailable if none answers within `timeout` s."""
        self._addresses = addresses.split(",")
        self.are_several = len(self._addresses) > 1
        options = _CHANNEL_OPTIONS + (_SEVERAL_OPTIONS if self.are_several else [])
        self._channels = [keys.channel(address, options) for address in self._addresses]
        self._stubs = [tessera_pb2_grpc.TesseraStub(channel) for channel in self._channels]
        self._place = 0  # of the one that led last
        self._is_in_doubt = True  # whether it still does
        self._session = str(secrets.randbits(64) | 1)  # that no other client has
        if not self._is_there(timeout):
            self.close()
            keyed = "with these keys" if keys else "without keys"
            raise Unavailable(f"no coordinator answers at {addresses} within {timeout:g} s, {keyed}")

    def close(self) -> None:
        for channel in self._channels:
            channel.close()

    @property
    def where(self) -> str:
        """The coordinator that leads, as far as is known, for messages."""
        return f"coordinator at {self.address}"

    @property
    def address(self) -> str:
        """That of the one that answered last; where it is a gateway, streams are opened there, too."""
        return self._addresses[self._place]

    def call(self, method: str, request: Any, timeout: float | None) -> Any:
        """Calls the coordinator that leads.

        Where another one leads, or none so far, the call goes to the others until one takes it. A call to one
        that is gone, or does not answer, is not made again: it may have taken effect. The next one goes elsewhere.
        """
        deadline = None if timeout is None else time.monotonic() + timeout
        while True:
            place = self.find(deadline)
            left = None if deadline is None else max(deadline - time.monotonic(), 0)
            with raising(f"coordinator at {self._addresses[place]}"):
                try:
                    reply = getattr(self._stubs[place], method)(request, timeout=left)
                    self._place, self._is_in_doubt = place, False
                    return reply
                except grpc.RpcError as error:
                    self.leave(place, error)
                    if not (self.are_several and stands_by(error) and is_worth_another(deadline)):
                        raise

    def open_session(self, place: int, requests: Iterator[tessera_pb2.Request]) -> Any:
        """A stream of requests to that coordinator; iterating over it waits for replies."""
        return self._stubs[place].Session(requests, metadata=((_SESSION_HEADER, self._session),))

    def leader(self, timeout: float | None) -> tessera_pb2_grpc.TesseraStub:
        """That of the coordinator that leads, as far as is known."""
        if self.are_several:
            self.call("GetStatus", tessera_pb2.StatusRequest(), timeout)
        return self._stubs[self._place]

    def _is_there(self, timeout: float) -> bool:
        """Whether any answers, also one that stands by."""
        if not self.are_several:
            try:
                grpc.channel_ready_future(self._channels[0]).result(timeout)
            except grpc.FutureTimeoutError:
                return False
            return True
        deadline = time.monotonic() + timeout
        while True:
            if any(self._leads(place) is not None for place in range(len(self._stubs))):
                return True
            if not is_worth_another(deadline):
                return False

    def _leads(self, place: int) -> bool | None:
        """None without an answer."""
        try:
            self._stubs[place].GetStatus(tessera_pb2.StatusRequest(), timeout=ANSWER_MAX_S, wait_for_ready=True)
        except grpc.RpcError as error:
            return False if stands_by(error) else None
        return True

    def find(self, deadline: float | None) -> int:
        """Whoever leads; without any, the one that led last."""
        while self.are_several and self._is_in_doubt:
            for n in range(len(self._stubs)):
                place = (self._place + n) % len(self._stubs)
                if self._leads(place):
                    self._place, self._is_in_doubt = place, False
                    return place
            if not is_worth_another(deadline):
                break
        return self._place

    def leave(self, place: int, error: grpc.RpcError | None) -> None:
        """A call to it has ended: others are asked first after one that stands by, is gone, or does not answer."""
        gone = (grpc.StatusCode.UNAVAILABLE, grpc.StatusCode.DEADLINE_EXCEEDED)
        self._is_in_doubt = error is not None and error.code() in gone
        self._place = (place + self._is_in_doubt) % len(self._addresses)


def stands_by(error: grpc.RpcError) -> bool:
    return any(value == _STANDS_BY for _, value in error.trailing_metadata() or ())
