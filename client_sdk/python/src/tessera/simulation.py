"""A world in this process, with the calls of a client: no daemons, no network."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from types import TracebackType
from typing import TYPE_CHECKING, Any, TypeVar

from tessera import queries
from tessera._proto import tessera_pb2
from tessera.any_client import AnyClient, Status
from tessera.compiled import native
from tessera.errors import Cancelled, InvalidArgument, TesseraError, from_number
from tessera.frame import BodyFrame
from tessera.results import BodyStates
from tessera.world import Precision, World

if TYPE_CHECKING:
    from tessera.keys import Keys

SERVERS_MAX = 64

T = TypeVar("T")

_REPLIES: dict[str, Any] = {
    "Load": tessera_pb2.LoadReply,
    "Unload": tessera_pb2.UnloadReply,
    "Pause": tessera_pb2.PauseReply,
    "Resume": tessera_pb2.ResumeReply,
    "GetStatus": tessera_pb2.StatusReply,
    "Drain": tessera_pb2.DrainReply,
    "Balance": tessera_pb2.BalanceReply,
    "Shutdown": tessera_pb2.ShutdownReply,
}


class Simulation(AnyClient):
    """A world in this process.

        simulation = tessera.Simulation("worlds/tower.sdf")
        simulation.apply_impulse("tower::box_9", (20, 0, 0))
        simulation.step(60)
        print(simulation.hash())

    It has the calls of a `Client`, and its world has the bits that it would have on a cluster. The world is paused: it
    goes on in `step()`, or by itself after `resume()`. Calls do their work on the thread that makes them, and let other
    threads of Python run meanwhile. Ctrl-C ends a long `step()` after the present tick.
    """

    def __init__(
        self,
        world: World | str | os.PathLike[str] | None = None,
        *,
        threads: int = 1,
        servers: int = 1,
        precision: Precision | None = None,
    ) -> None:
        """Loads a world, or the file of one (see `World.read()`); without it, `load()` and `restore()` do.

        `threads` work on each tick. With more than one of `servers`, the world is divided among them as on a cluster,
        for tests: the bits are the same. The `precision` is by default that of the world, or FLOAT32; a process can
        have one only. Errors as `load()`; NotFound if the compiled part of the package is missing.
        """
        super().__init__()
        if not 1 <= threads <= 1024:
            raise InvalidArgument(f"threads = {threads} must be from 1 to 1024")
        if not 1 <= servers <= SERVERS_MAX:
            raise InvalidArgument(f"servers = {servers} must be from 1 to {SERVERS_MAX}")
        loaded = World.read(world) if isinstance(world, (str, os.PathLike)) else world
        if not isinstance(loaded, World | None):
            raise TypeError(f"world must be a World or the path of a file, not {type(world).__name__}")
        if precision is None:
            precision = Precision.FLOAT32 if loaded is None else loaded.precision
        if loaded is not None:
            loaded = loaded.with_precision(precision)
        self._options = (threads, servers, precision)
        self._cluster: Any = native().Cluster(precision is Precision.FLOAT64, servers, threads)
        if loaded is not None:
            self.load(loaded)

    def close(self) -> None:
        """Ends the simulation, and gives its memory back; calls then raise Cancelled."""
        self._cluster = None

    def __enter__(self) -> Simulation:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def serve(self, listen: str = "127.0.0.1:0") -> str:
        """Lets clients of other processes of this machine in, without keys, at host:port; port 0: any free one. Returns the
        address, which stays the same until `close()`: for `tessera.Client(address)`, the web UI (`tessera-viewer
        --connect`), and the command line. FailedPrecondition for an address that other machines could reach, Unavailable for
        one that is in use.
        """
        return self._taken(self._open().serve(listen)).decode()

    def copy(self) -> Simulation:
        """Another simulation, which goes on from the present state by itself."""
        return _from_state(self.state(), *self._options)

    def __reduce__(self) -> tuple[Any, ...]:
        """For pickle and copy: its state; the copy is paused."""
        return _from_state, (self.state(), *self._options)

    # --- of AnyClient ---

    def _stepped(self, ids: Sequence[int], ticks: int, every_ticks: int) -> list[BodyFrame]:
        """By queries: streams would need a door for them."""
        query = queries.body_states(ids)
        sector_size = self.status().settings.sector_size
        frames = [_frame(self.ask_one(query), sector_size)]
        last = frames[0].tick + ticks
        while (now := frames[-1].tick) + (ahead := every_ticks - now % every_ticks) <= last:
            frames.append(_frame(self.step(ahead, queries=[query])[query], sector_size))
        if now < last:
            self.step(last - now)
        return frames

    def _watchable(self, timeout: float | None) -> Status:
        self.serve()  # streams are those of a cluster
        return super()._watchable(timeout)

    def _call(self, method: str, request: Any, timeout: float | None) -> Any:
        answer = self._taken(self._open().call(method, request.SerializeToString(), timeout))
        return _REPLIES[method].FromString(answer)

    def _do(self, request: tessera_pb2.Request, timeout: float | None) -> tessera_pb2.Reply:
        answer = self._taken(self._open().call("Do", request.SerializeToString(), timeout))
        reply: tessera_pb2.Reply = tessera_pb2.Reply.FromString(answer)
        return reply

    def _send(self, request: tessera_pb2.Request, read: Callable[[tessera_pb2.Reply], T]) -> Future[T]:
        future: Future[T] = Future()
        future.set_running_or_notify_cancel()
        try:
            future.set_result(read(self._do(request, None)))
        except TesseraError as error:
            future.set_exception(error)
        return future

    def _snapshot(self, timeout: float | None) -> Iterator[tessera_pb2.SnapshotPiece]:
        state = self._taken(self._open().snapshot(timeout))
        yield tessera_pb2.SnapshotPiece(bytes=state, tick=self.status().tick)

    def _restore(self, pieces: Iterator[bytes], replace: bool, timeout: float | None) -> tessera_pb2.LoadReply:
        answer = self._taken(self._open().restore(b"".join(pieces), replace, timeout))
        reply: tessera_pb2.LoadReply = tessera_pb2.LoadReply.FromString(answer)
        return reply

    def _keys(self) -> Keys:
        from tessera.keys import Keys

        return Keys.read("")

    def _gateway(self) -> str:
        return self.serve()

    def _open(self) -> Any:
        if self._cluster is None:
            raise Cancelled("the simulation was closed")
        return self._cluster

    @staticmethod
    def _taken(outcome: tuple[int, bytes]) -> bytes:
        code, result = outcome
        if code != 0:
            raise from_number(code, result.decode())
        return result


def _from_state(state: bytes, threads: int, servers: int, precision: Precision) -> Simulation:
    simulation = Simulation(threads=threads, servers=servers, precision=precision)
    simulation.restore(state)
    return simulation


def _frame(states: BodyStates, sector_size: float) -> BodyFrame:
    return BodyFrame(
        states.tick,
        states.ids,
        states.sectors,
        states.local,
        states.orientations,
        states.linear_velocities,
        states.angular_velocities,
        states.asleep,
        sector_size,
        states.frames if states.frames.any() else None,
    )
