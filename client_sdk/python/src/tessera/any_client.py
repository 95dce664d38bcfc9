"""What the client of a cluster and a simulation in this process have in common: all calls."""

from __future__ import annotations

import io
import os
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future
from itertools import dropwhile
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tessera import queries as of_queries
from tessera._proto import tessera_pb2
from tessera._proto.command_pb2 import Command
from tessera.commands import CommandMethods
from tessera.deadline import is_worth_another
from tessera.errors import FailedPrecondition, InvalidArgument, NotFound
from tessera.frame import (
    BodyFrame,
    Trajectory,
    contact_frame,
    divergence_frame,
    program_frame,
    seam_frame,
    trajectory,
)
from tessera.position import ORIGIN, Floats, PositionLike, VectorLike
from tessera.queries import Answers, Catalogue, Query, QueryMethods
from tessera.references import BodyName, IdsLike, id_list, name_list
from tessera.results import Applied, FoundBody, FoundFrame, FoundJoint, LoadSummary, RayHit, RayHits, Region
from tessera.whole_file import whole_file
from tessera.world import World

if TYPE_CHECKING:  # they load gRPC
    from tessera.body_streams import BodyStream, BodySubscriber
    from tessera.joint_stream import JointStream
    from tessera.keys import Keys
    from tessera.record import Recorder
    from tessera.stream import ContactStream, DivergenceStream, Frame, ProgramStream, SeamStream, Stream
    from tessera.stream_merger import Part
    from tessera.web_ui import WebUi

CALL_TIMEOUT_S = 10.0
LOAD_TIMEOUT_S = 120.0
BODIES_ASKED = 100_000  # per request: the coordinator's maximum

Status: TypeAlias = tessera_pb2.StatusReply
Balance: TypeAlias = tessera_pb2.BalanceReply
"""The status of a cluster; proto/tessera.proto documents its fields."""

T = TypeVar("T")

_PIECE_BYTES = 1 << 20


class AnyClient(CommandMethods, QueryMethods, ABC):
    """A `Client` of a cluster, or a `Simulation` in this process: what is written for one runs on the other.

    Units: m, kg, s, rad, N. Bodies are given by name or id. Calls block until they are answered or `timeout` seconds
    have passed, by default 10; None waits indefinitely. Errors are those of `tessera.errors`. In addition to the errors
    that a method lists, each can raise DeadlineExceeded, and Unavailable if a process of a cluster is gone. Safe to use
    from any thread.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._applied = 0  # the last tick of commands of this client

    # --- worlds ---

    def load(
        self,
        world: World | str | os.PathLike[str],
        *,
        replace: bool = False,
        timeout: float | None = LOAD_TIMEOUT_S,
    ) -> LoadSummary:
        """Loads a world, or the file of one (see `World.read()`), and waits until every server has it.

        It starts paused at tick 0. AlreadyExists if a world is loaded and `replace` is not set,
        InvalidArgument for an invalid world, FailedPrecondition if servers are missing.
        """
        loaded = world if isinstance(world, World) else World.read(world)
        reply = self._call("Load", tessera_pb2.LoadRequest(world=loaded.message, replace=replace), timeout)
        self._applied = 0
        return LoadSummary(reply.bodies, reply.sectors, reply.servers)

    def unload(self, timeout: float | None = CALL_TIMEOUT_S) -> None:
        """Unloads the world; servers stay."""
        self._call("Unload", tessera_pb2.UnloadRequest(), timeout)

    def snapshot(self, file: str | os.PathLike[str], timeout: float | None = LOAD_TIMEOUT_S) -> int:
        """Writes all of the world between two ticks, whether it runs or not, to a file; one of that name is
        replaced once the new one is whole. Returns the tick. OSError if the file cannot be written.
        """
        tick = 0
        with whole_file(file) as out:
            for piece in self._snapshot(timeout):
                out.write(piece.bytes)
                tick = piece.tick
        return tick

    def state(self, timeout: float | None = LOAD_TIMEOUT_S) -> bytes:
        """All of the world between two ticks, whether it runs or not: what `snapshot()` writes to a file."""
        return b"".join(piece.bytes for piece in self._snapshot(timeout))

    def restore(
        self,
        state: bytes | str | os.PathLike[str],
        *,
        replace: bool = False,
        timeout: float | None = LOAD_TIMEOUT_S,
    ) -> LoadSummary:
        """Loads the world of such a file, or of a `state()`: paused at its tick, it goes on with the bits that it would
        have had, on any number of servers. DataLoss for one that is damaged; otherwise as load().
        """
        with io.BytesIO(state) if isinstance(state, bytes) else open(state, "rb") as source:
            pieces = iter(lambda: source.read(_PIECE_BYTES), b"")
            reply = self._restore(pieces, replace, timeout)
        self._applied = 0
        return LoadSummary(reply.bodies, reply.sectors, reply.servers)

    # --- commands, ticks and queries: `tessera.commands` and `tessera.queries` make them, and
    # have the methods that are one command or one query ---

    def run(
        self,
        commands: Iterable[Command] = (),
        ticks: int = 0,
        queries: Iterable[Query[Any]] = (),
        *,
        after: int = 0,
        owner: str = "",
        timeout: float | None = None,
    ) -> Answers:
        """Does commands, then ticks of a paused world, and then answers queries: one message there and back.

        All is checked first: where anything is wrong, nothing is done, and the error names the element. Commands
        are stored when it returns, and take effect together, at `applied.tick`. Queries are answered after the
        ticks; without any, at once, but not before the end of tick `after`, as long as the world runs. A request
        whose connection is lost is made again, to whoever leads then, and carried out once.

        With an `owner`, commands are limited to bodies of that owner (`set_properties()`; PermissionDenied), and
        what they spawn is the owner's. A client with a key of role "own" is always limited so, to its own name.
        """
        request, asked = _request(commands, ticks, queries, after, owner)
        answers = Answers(self._do(request, timeout), asked)
        self._note(answers)
        return answers

    def send(
        self,
        commands: Iterable[Command] = (),
        ticks: int = 0,
        queries: Iterable[Query[Any]] = (),
        *,
        after: int = 0,
        owner: str = "",
    ) -> Future[Answers]:
        """As `run()`, without waiting for the answers. Requests of a client take effect in the order in which they
        are sent. Waits where more than 1024 have no answer, or the coordinator does not keep up. Callbacks of the
        future run on a thread of the client, and must not wait there.
        """
        request, asked = _request(commands, ticks, queries, after, owner)

        def read(reply: tessera_pb2.Reply) -> Answers:
            answers = Answers(reply, asked)
            self._note(answers)
            return answers

        return self._send(request, read)

    def apply(self, commands: Iterable[Command], timeout: float | None = CALL_TIMEOUT_S) -> Applied:
        """Commands that take effect together, in their order, or none of them does."""
        return self.run(commands, timeout=timeout).applied

    def ask(self, queries: Iterable[Query[Any]], timeout: float | None = CALL_TIMEOUT_S) -> Answers:
        """Queries that are answered at the end of one tick. They see what this client has done before, unless the
        world is paused.
        """
        return self.run(queries=queries, after=self._applied, timeout=timeout)

    def ask_one(self, query: Query[T], timeout: float | None = CALL_TIMEOUT_S) -> T:
        """The result of one query."""
        return self.ask([query], timeout)[query]

    # --- time ---

    def pause(self, timeout: float | None = CALL_TIMEOUT_S) -> int:
        """Pauses the world and returns the tick at which it has stopped."""
        return self._tick_of("Pause", tessera_pb2.PauseRequest(), timeout)

    def resume(self, real_time_factor: float = 1.0, timeout: float | None = CALL_TIMEOUT_S) -> int:
        """Runs the world at this many simulated seconds per second; 0: as fast as possible."""
        return self._tick_of("Resume", tessera_pb2.ResumeRequest(real_time_factor=real_time_factor), timeout)

    @overload
    def step(self, ticks: int = 1, timeout: float | None = None, *, commands: Iterable[Command] = ()) -> int:
        ...

    @overload
    def step(
        self,
        ticks: int = 1,
        timeout: float | None = None,
        *,
        commands: Iterable[Command] = (),
        queries: Iterable[Query[Any]],
    ) -> Answers:
        ...

    def step(
        self,
        ticks: int = 1,
        timeout: float | None = None,
        *,
        commands: Iterable[Command] = (),
        queries: Iterable[Query[Any]] | None = None,
    ) -> int | Answers:
        """Runs that many ticks and returns the last one. FailedPrecondition unless the world is paused.

        Lock step, in one message there and back: `commands` take effect at the first tick, and `queries`, whose
        answers it then returns, are answered after the last.
        """
        answers = self.run(commands, ticks, queries or (), timeout=timeout)
        return answers.tick if queries is None else answers

    def trajectory(
        self, bodies: BodyName | Sequence[BodyName], ticks: int, *, every_ticks: int = 1
    ) -> Trajectory:
        """Steps a paused world and returns the states of bodies over time.

        It begins with the current state, or with the first tick of bodies that were just spawned, and has
        those of the following `ticks` that are multiples of `every_ticks`. NotFound for a body that does not
        exist, or no longer exists; errors as `step()`.
        """
        names = name_list(bodies)
        ids = sorted({self.find(name).id if isinstance(name, str) else int(name) for name in names})
        frames = self._stepped(ids, ticks, every_ticks)
        begun = list(dropwhile(lambda frame: len(frame) < len(ids), frames))
        if not begun or any(len(frame) < len(ids) for frame in begun):
            raise NotFound(f"bodies: not all of {names} existed until the end")
        return trajectory(begun, self.status().settings.time_step)

    # --- status ---

    def status(self, timeout: float | None = CALL_TIMEOUT_S) -> Status:
        """The status of the cluster: `state` ("empty", "loading", "paused", "running", "recovering",
        "failed"), `world`, `tick`, `time`, `bodies`, `settings`, `recoveries`, `joined_servers`, `left_servers`,
        `checkpoint_tick`, `servers` (`node`, `drained` and more) and more: the fields of StatusReply in
        proto/tessera.proto.
        """
        status: Status = self._call("GetStatus", tessera_pb2.StatusRequest(), timeout)
        return status

    # --- one query ---

    @overload
    def raycast(
        self,
        origin: PositionLike,
        direction: Sequence[float],
        length: float = 100.0,
        *,
        mask: int = 0,
        excepting: Iterable[BodyName] = (),
    ) -> RayHit | None:
        ...

    @overload
    def raycast(
        self,
        origin: ArrayLike,
        direction: Floats | Sequence[VectorLike],
        length: ArrayLike = 100.0,
        *,
        sectors: ArrayLike = ORIGIN,
        mask: int = 0,
        excepting: Iterable[BodyName] = (),
        excepting_by_ray: ArrayLike = 0,
    ) -> RayHits:
        ...

    def raycast(self, origin: Any, direction: Any, length: Any = 100.0, **options: Any) -> RayHit | RayHits | None:
        """The first hit of a ray: `tessera.queries.ray()`; or, with directions of shape [n, 3], of n rays as
        arrays: `tessera.queries.rays()`.
        """
        if np.ndim(direction) == 1:
            return self.ask_one(of_queries.ray(origin, direction, length, **options))
        return self.ask_one(of_queries.rays(origin, direction, length, **options))

    def find(self, name: str) -> FoundBody:
        """The body of that name. NotFound."""
        for body in self.find_bodies(name, BODIES_ASKED):  # longer names may come first
            if body.name == name:
                return body
        raise NotFound(f'no body is called "{name}"')

    def catalogue(
        self,
        ids: Sequence[int] | NDArray[Any] | None = None,
        *,
        only_static: bool = False,
        with_shapes: bool = True,
    ) -> Catalogue:
        """The existing bodies of `ids`; without `ids`, the first 100,000 of all."""
        given: list[IdsLike | None] = [None]
        if ids is not None:
            given = [ids[n : n + BODIES_ASKED] for n in range(0, len(ids), BODIES_ASKED)]
        result = Catalogue()
        for some in given:
            query = of_queries.catalogue(
                some, only_static=only_static, with_shapes=with_shapes, limit=BODIES_ASKED
            )
            result.MergeFrom(self.ask_one(query))
        return result

    def find_frame(self, name: str) -> FoundFrame:
        """NotFound if no frame has that name."""
        for frame in self.find_frames(name, 1):  # the name itself comes first
            if frame.name == name:
                return frame
        raise NotFound(f'no frame is called "{name}"')

    # --- streams: one frame per tick, merged over all servers; FailedPrecondition without a world ---

    def watch_bodies(
        self,
        *,
        ids: IdsLike = (),
        region: Region | None = None,
        follow: BodyName | None = None,
        every_ticks: int = 1,
        only_awake: bool = False,
        complete: bool = False,
        precision: float = 0,
        velocity_precision: float = 0,
        bytes_per_second: int = 0,
        timeout: float | None = CALL_TIMEOUT_S,
    ) -> BodyStream:
        """The states of bodies, from the next tick on, and immediately if the world is paused.

        Without `ids`, all bodies that are not static; without `region`, everywhere; only ticks that are
        multiples of `every_ticks`. The first frame has all of these bodies, each later one those that have
        changed (`BodyFrame`), or with `complete` all again, which costs time here but no bytes on the way.

        With `follow`, the region goes with a body: its `half_size` about where that is at each tick. The body
        itself is in the stream, too. Where it jumps by more than a quarter of the largest half size, or
        opening another stream takes longer than half a second and as long as it takes for that way, bodies
        around it may come some ticks later.

        With a `precision` (m, 1e-6 to 1), positions are off by at most that, and orientations by as many rad,
        in a tenth of the bytes. Velocities then have an error of at most `velocity_precision` (m/s and rad/s,
        1e-6 to 1000), or if that is 0, are zero.

        With `bytes_per_second`, all servers together send no more, in wall time; they share it evenly, from 10,000
        for each. Of what has changed beyond that, later frames tell, as it is then (`BodyFrame.deferred`): first what
        has waited longest, sooner what is near the centre of the region. Bodies that change servers may be gone for
        some frames.
        """
        request = tessera_pb2.WatchBodiesRequest(
            ids=id_list(ids),
            every_ticks=every_ticks,
            only_awake=only_awake,
            in_columns=True,
            precision=precision,
            velocity_precision=velocity_precision,
            bytes_per_second=bytes_per_second,
        )
        subscriber = self._subscriber()
        if follow is None:
            return subscriber.subscribe(request, region, complete, timeout)
        if region is None:
            raise InvalidArgument("follow: it needs a region, whose half_size it takes")
        body = self.find(follow).id if isinstance(follow, str) else int(follow)
        return subscriber.follow(body, request, region, complete, timeout)

    def watch_contacts(
        self,
        *,
        ids: IdsLike = (),
        persisting: bool = False,
        mask: int = 0,
        impulse_min: float = 0,
        timeout: float | None = CALL_TIMEOUT_S,
    ) -> ContactStream:
        """Contacts that begin or end, each once; with `persisting` also continuing ones.

        With a `mask`, those with a body of any of these collision categories. With an `impulse_min` (N s): each
        pair in every tick in which its normal impulses are together at least that, whatever its phase, and no ends.

        Without `ids`, all contacts; otherwise those with any of these bodies. The first frame is empty: its
        tick is the one from which on the stream is complete.
        """
        request = tessera_pb2.WatchContactsRequest(
            ids=id_list(ids), persisting=persisting, mask=mask, impulse_min=impulse_min
        )
        return self._watch("WatchContacts", request, contact_frame, timeout)

    def watch_joints(
        self, joints: Iterable[FoundJoint], *, every_ticks: int = 1, timeout: float | None = CALL_TIMEOUT_S
    ) -> JointStream:
        """The positions and rates of joints, as `find_joints()` finds them, from the states of their bodies at each
        tick. InvalidArgument if there are none.
        """
        from tessera.joint_stream import WatchedJoints

        watched = WatchedJoints(joints)
        request = tessera_pb2.WatchBodiesRequest(ids=id_list(watched.bodies), every_ticks=every_ticks, in_columns=True)
        return self._subscriber().watch(request, None, True, timeout, watched.frame)

    def watch_seams(
        self,
        *,
        region: Region | None = None,
        every_ticks: int = 1,
        timeout: float | None = CALL_TIMEOUT_S,
    ) -> SeamStream:
        """Clones of bodies, and islands across borders; without `region`, everywhere."""
        from tessera.body_streams import region_message

        within = None if region is None else region_message(region)
        request = tessera_pb2.WatchSeamsRequest(region=within, every_ticks=every_ticks)
        return self._watch("WatchSeams", request, seam_frame, timeout)

    def watch_divergences(self, timeout: float | None = CALL_TIMEOUT_S) -> DivergenceStream:
        """Bodies that leave the range of numbers, speeds or sectors. The first frame is as that of contacts."""
        request = tessera_pb2.WatchDivergencesRequest()
        return self._watch("WatchDivergences", request, divergence_frame, timeout)

    def watch_programs(
        self,
        ids: Iterable[int] = (),
        *,
        kind: str = "",
        every_ticks: int = 1,
        timeout: float | None = CALL_TIMEOUT_S,
    ) -> ProgramStream:
        """What programs publish: those of the bodies `ids`, without any of all, and of one kind if there is a `kind`
        ("imu", or the name of a module). That a body is gone is told by `watch_bodies()` alone.
        """
        request = tessera_pb2.WatchProgramsRequest(ids=id_list(ids), kind=kind, every_ticks=every_ticks)
        return self._watch("WatchPrograms", request, program_frame, timeout, of_changes=True)

    # --- seeing ---

    def show(self, *, read_only: bool = False) -> WebUi:
        """The web UI of the world: a notebook shows it in its place, and `show().open()` in a browser. Of a cluster with
        keys, those that TESSERA_KEYS names. NotFound if the program `tessera-viewer` is missing.
        """
        from tessera.web_ui import WebUi

        return WebUi(self._gateway(), read_only=read_only)

    def record(self, path: str | os.PathLike[str], **options: Any) -> Recorder:
        """Records the world to an MCAP file until the end of a `with` block: `tessera.record.Recorder`, and its options."""
        from tessera.record import Recorder

        return Recorder(self, path, **options)

    # --- servers ---

    def drain(self, node: int, timeout: float | None = LOAD_TIMEOUT_S) -> int:
        """Moves all that a server hosts to others, so that it can be ended without a loss, and returns the
        tick at which they took over. NotFound if no server has this `node`, FailedPrecondition if no other
        one can take over.
        """
        return self._tick_of("Drain", tessera_pb2.DrainRequest(node=node), timeout)

    def balance(
        self, dry_run: bool = False, timeout: float | None = CALL_TIMEOUT_S, *, policy: str = ""
    ) -> Balance:
        """Divides the world anew among its servers, by what they have to do; the state stays the same bits.
        `policy`: "curve", "k-means", "hulls", "graph" or "grid"; empty: the coordinator's. With `dry_run`, only
        says what it would do: `shares` (`node`, `tick_us`, `tick_us_then`), `moved_sectors`, `moved_bodies`, `moves`
        and `tick`, as BalanceReply in proto/tessera.proto.
        """
        request = tessera_pb2.BalanceRequest(dry_run=dry_run, policy=policy)
        balance: Balance = self._call("Balance", request, timeout)
        return balance

    def shutdown(self, timeout: float | None = CALL_TIMEOUT_S) -> None:
        """Ends the coordinator and its servers."""
        self._call("Shutdown", tessera_pb2.ShutdownRequest(), timeout)

    # --- what differs ---

    @abstractmethod
    def _call(self, method: str, request: Any, timeout: float | None) -> Any:
        """The answer of a method of service Tessera that has one answer."""

    @abstractmethod
    def _do(self, request: tessera_pb2.Request, timeout: float | None) -> tessera_pb2.Reply:
        """Carries a request out once; takes it over."""

    @abstractmethod
    def _send(self, request: tessera_pb2.Request, read: Callable[[tessera_pb2.Reply], T]) -> Future[T]:
        """Likewise, without waiting for it."""

    @abstractmethod
    def _snapshot(self, timeout: float | None) -> Iterator[tessera_pb2.SnapshotPiece]:
        ...

    @abstractmethod
    def _restore(self, pieces: Iterator[bytes], replace: bool, timeout: float | None) -> tessera_pb2.LoadReply:
        ...

    @abstractmethod
    def _keys(self) -> Keys:
        """Those with which streams are opened."""

    @abstractmethod
    def _gateway(self) -> str:
        """The address of the coordinator or the gateway that answered last."""

    # --- helpers ---

    def _stepped(self, ids: Sequence[int], ticks: int, every_ticks: int) -> list[BodyFrame]:
        """What `trajectory()` has of these bodies; those that are not there are missing."""
        from tessera.stream_merger import FRAMES_QUEUED_MAX

        frames: list[BodyFrame] = []
        with self.watch_bodies(ids=ids, every_ticks=every_ticks, complete=True) as stream:
            frames.append(stream.next(CALL_TIMEOUT_S))
            for done in range(0, ticks, FRAMES_QUEUED_MAX):
                last = self.step(min(FRAMES_QUEUED_MAX, ticks - done))
                while frames[-1].tick < last - last % every_ticks:
                    frames.append(stream.next(CALL_TIMEOUT_S))
        return frames

    def _note(self, answers: Answers) -> None:
        with self._lock:
            self._applied = max(self._applied, answers.applied.tick)

    def _tick_of(self, method: str, request: Any, timeout: float | None) -> int:
        tick: int = self._call(method, request, timeout).tick
        return tick

    def _watch(
        self,
        method: str,
        request: Any,
        read: Callable[[int, list[Part]], Frame],
        timeout: float | None,
        of_changes: bool = False,
    ) -> Stream[Part, Frame]:
        from tessera.stream import Stream

        status = self._watchable(timeout)
        return Stream(method, request, read, status, self.status, self._gateway, self._keys(), timeout, of_changes)

    def _subscriber(self) -> BodySubscriber:
        from tessera.body_streams import BodySubscriber

        return BodySubscriber(self._watchable, self.status, self._gateway, self._keys())

    def _watchable(self, timeout: float | None) -> Status:
        """With servers that take part in the world; one that recovers is waited for."""
        deadline = None if timeout is None else time.monotonic() + timeout
        while True:
            status = self.status(timeout)
            if status.state == "empty":
                raise FailedPrecondition("no world is loaded: there is nothing to watch")
            if any(server.takes_part for server in status.servers):
                return status
            if status.state != "recovering" or not is_worth_another(deadline):
                raise FailedPrecondition(f"the world is {status.state}: it has no server that could be watched")


def _request(
    commands: Iterable[Command], ticks: int, queries: Iterable[Query[Any]], after: int, owner: str
) -> tuple[tessera_pb2.Request, list[Query[Any]]]:
    if ticks < 0:
        raise InvalidArgument(f"ticks = {ticks} must be at least 0")
    asked = list(queries)
    messages = [message for query in asked for message in query.messages]
    return tessera_pb2.Request(
        commands=commands, ticks=ticks, queries=messages, after=after, owner=owner
    ), asked
