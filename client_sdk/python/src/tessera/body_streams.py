"""Streams of bodies, as clients ask for them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

from tessera._proto import tessera_pb2
from tessera.errors import InvalidArgument
from tessera.followed_bodies import FollowedBodies
from tessera.frame import BodyFrame
from tessera.keys import Keys
from tessera.known_bodies import KnownBodies
from tessera.position import position_message, to_vector, vector_message
from tessera.results import Region
from tessera.stream import AskStatus, Frame, Gateway, Stream

BYTES_PER_SECOND_MIN = 10_000  # for each server: proto/stream_limits.h

BodyStream: TypeAlias = Stream[tessera_pb2.BodyBatch, BodyFrame]


class BodySubscriber:
    """Subscribes at the servers of a world."""

    def __init__(
        self,
        watchable: Callable[[float | None], tessera_pb2.StatusReply],
        ask_status: AskStatus,
        gateway: Gateway,
        keys: Keys,
    ) -> None:
        """`watchable` waits for a world with servers that can be watched."""
        self._watchable = watchable
        self._ask_status = ask_status
        self._gateway = gateway
        self._keys = keys

    def subscribe(
        self,
        request: tessera_pb2.WatchBodiesRequest,
        region: Region | None,
        complete: bool,
        timeout: float | None,
    ) -> BodyStream:
        """Bodies that match the request, in a region or everywhere."""
        return self.watch(request, region, complete, timeout, lambda frame: frame)

    def watch(
        self,
        request: tessera_pb2.WatchBodiesRequest,
        region: Region | None,
        complete: bool,
        timeout: float | None,
        read: Callable[[BodyFrame], Frame],
    ) -> Stream[tessera_pb2.BodyBatch, Frame]:
        """Likewise, what `read` makes of their frames."""
        here = tessera_pb2.WatchBodiesRequest()
        here.CopyFrom(request)
        if region is not None:
            here.region.CopyFrom(region_message(region))
        status = self._watchable(timeout)
        here.bytes_per_second = _shared_out(here.bytes_per_second, status)
        known = KnownBodies(
            status.settings.sector_size, complete, here.precision, here.velocity_precision
        )
        return Stream(
            "WatchBodies",
            here,
            lambda tick, parts: read(known.take(tick, parts)),
            status,
            self._ask_status,
            self._gateway,
            self._keys,
            timeout,
            of_changes=True,
        )

    def follow(
        self,
        body: int,
        request: tessera_pb2.WatchBodiesRequest,
        region: Region,
        complete: bool,
        timeout: float | None,
    ) -> BodyStream:
        """Bodies that match the request, in a region of that size around a body."""
        leader = tessera_pb2.WatchBodiesRequest()
        leader.CopyFrom(request)
        leader.only_awake = False
        leader.bytes_per_second = 0  # one body is not too much
        leader.ids[:] = [body]

        def open_area(around: Region) -> BodyStream:
            return self.subscribe(request, around, True, timeout)

        half_size = to_vector(vector_message(region.half_size, "half_size"))
        of_leader = self.subscribe(leader, None, True, timeout)
        return FollowedBodies(of_leader, half_size, complete, open_area, timeout)


def region_message(region: Region) -> tessera_pb2.Region:
    return tessera_pb2.Region(
        centre=position_message(region.centre), half_size=vector_message(region.half_size, "half_size")
    )


def _shared_out(bytes_per_second: int, status: tessera_pb2.StatusReply) -> int:
    """What each server of the world may send. InvalidArgument."""
    servers = sum(1 for server in status.servers if server.takes_part)
    if bytes_per_second != 0 and bytes_per_second < servers * BYTES_PER_SECOND_MIN:
        raise InvalidArgument(
            f"bytes_per_second = {bytes_per_second} must be 0, or at least {BYTES_PER_SECOND_MIN} "
            f"for each of {servers} servers"
        )
    return bytes_per_second // servers
