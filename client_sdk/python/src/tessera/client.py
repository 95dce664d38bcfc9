"""The client of a cluster: loads a world, changes it, controls its time, watches it."""

from __future__ import annotations

import os
import time
from collections.abc import Iterable, Sequence
from itertools import dropwhile
from types import TracebackType
from typing import Any, TypeAlias

from tessera._proto import tessera_pb2, world_pb2
from tessera.body import Body
from tessera.coordinators import Coordinators, is_worth_another
from tessera.errors import FailedPrecondition, NotFound, raising
from tessera.frame import (
    BodyFrame,
    ContactFrame,
    DivergenceFrame,
    Trajectory,
    contact_frame,
    divergence_frame,
    trajectory,
)
from tessera.joint import Drive, Joint, joint_ref
from tessera.keys import Keys
from tessera.known_bodies import KnownBodies
from tessera.position import (
    IDENTITY,
    PositionLike,
    Vector,
    VectorLike,
    position_message,
    to_position,
    to_quaternion,
    to_vector,
    vector_message,
    world_pose_message,
)
from tessera.results import (
    Added,
    FoundBody,
    FoundFrame,
    FoundJoint,
    HashAt,
    LoadSummary,
    Neighbour,
    RayHit,
    Region,
)
from tessera.stream import Stream
from tessera.stream_merger import FRAMES_QUEUED_MAX
from tessera.whole_file import whole_file
from tessera.world import World

ADDRESS_VARIABLE = "TESSERA_ADDRESS"
KEYS_VARIABLE = "TESSERA_KEYS"
ADDRESS_DEFAULT = "127.0.0.1:7300"
CALL_TIMEOUT_S = 10.0
LOAD_TIMEOUT_S = 120.0
BODIES_ASKED = 100_000  # per request: the coordinator's maximum

BodyName: TypeAlias = int | str
"""A body by its id or by its name."""

Status: TypeAlias = tessera_pb2.StatusReply
Balance: TypeAlias = tessera_pb2.BalanceReply
"""The status of a cluster; proto/tessera.proto documents its fields."""

Catalogue: TypeAlias = tessera_pb2.FindBodiesReply
"""Bodies with their names and properties, and their shapes by the ids in the properties."""

BodyStream: TypeAlias = Stream[tessera_pb2.BodyBatch, BodyFrame]
ContactStream: TypeAlias = Stream[tessera_pb2.ContactBatch, ContactFrame]
DivergenceStream: TypeAlias = Stream[tessera_pb2.DivergenceBatch, DivergenceFrame]

_ZERO: Vector = (0.0, 0.0, 0.0)
_PIECE_BYTES = 1 << 20


class Client:
    """A connection to the coordinator of a cluster.

        with tessera.Client("127.0.0.1:7300") as client:
            client.load("worlds/tower.sdf")
            client.step(60)

    Units: m, kg, s, rad, N. Bodies are given by name or id. Calls block until the cluster has answered
    or `timeout` seconds have passed; None waits indefinitely. Errors are those of `tessera.errors` and carry
    the message of the cluster. In addition to the errors that a method lists, each can raise
    DeadlineExceeded, and Unavailable if a process is gone. Safe to use from any thread.
    """

    def __init__(
        self,
        address: str | None = None,
        *,
        keys: str | os.PathLike[str] | None = None,
        timeout: float = CALL_TIMEOUT_S,
    ) -> None:
        """Connects to host:port. The default is TESSERA_ADDRESS, or else port 7300 of this machine.

        Of a cluster with several coordinators, the addresses of all, separated by commas: calls go to the one
        that leads, also where that changes. A cluster with keys wants a folder that `tessera keys create` made; the
        default is TESSERA_KEYS, or else none ("" for none in any case). NotFound, naming the file, if the folder
        lacks one; Unavailable if no coordinator answers within `timeout` s.
        """
        default: str = os.environ.get(ADDRESS_VARIABLE, ADDRESS_DEFAULT)
        self.address = address or default
        self._keys = Keys.read(os.environ.get(KEYS_VARIABLE, "") if keys is None else keys)
        self._coordinators = Coordinators(self.address, self._keys, timeout)

    def close(self) -> None:
        """Closes the connection; the cluster and its world stay. Streams end if the world changes servers."""
        self._coordinators.close()

    def __enter__(self) -> Client:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

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
        return LoadSummary(reply.bodies, reply.sectors, reply.servers)

    def unload(self, timeout: float | None = CALL_TIMEOUT_S) -> None:
        """Unloads the world; servers stay."""
        self._call("Unload", tessera_pb2.UnloadRequest(), timeout)

    def snapshot(self, file: str | os.PathLike[str], timeout: float | None = LOAD_TIMEOUT_S) -> int:
        """Writes all of the world between two ticks, whether it runs or not, to a file; one of that name is
        replaced once the new one is whole. Returns the tick. OSError if the file cannot be written.
        """
        tick = 0
        with whole_file(file) as out, raising(self._coordinators.where):
            leader = self._coordinators.leader(timeout)
            for piece in leader.Snapshot(tessera_pb2.SnapshotRequest(), timeout=timeout):
                out.write(piece.bytes)
                tick = piece.tick
        return tick

    def restore(
        self,
        file: str | os.PathLike[str],
        *,
        replace: bool = False,
        timeout: float | None = LOAD_TIMEOUT_S,
    ) -> LoadSummary:
        """Loads the world of such a file: paused at its tick, it goes on with the bits that it would have had,
        on any number of servers. DataLoss for a file that is damaged; otherwise as load().
        """
        with open(file, "rb") as source, raising(self._coordinators.where):
            pieces = iter(lambda: source.read(_PIECE_BYTES), b"")
            requests = (tessera_pb2.RestoreRequest(replace=replace, bytes=piece) for piece in pieces)
            reply = self._coordinators.leader(timeout).Restore(requests, timeout=timeout)
        return LoadSummary(reply.bodies, reply.sectors, reply.servers)

    # --- bodies: each returns the tick at which it takes effect; NotFound if there is no such body ---

    def spawn(self, body: Body, timeout: float | None = CALL_TIMEOUT_S) -> Added:
        """Adds a new body to the world. AlreadyExists for a name in use, InvalidArgument, OutOfRange."""
        request = tessera_pb2.SpawnRequest(body=body.message(), shape=body.shape)
        reply = self._call_once("Spawn", request, timeout)
        return Added(reply.id, reply.tick)

    def remove(self, body: BodyName, timeout: float | None = CALL_TIMEOUT_S) -> int:
        """Removes a body from the world."""
        return self._command("Remove", tessera_pb2.RemoveRequest(body=_body_ref(body)), timeout)

    def set_velocity(
        self,
        body: BodyName,
        linear: VectorLike,
        angular: VectorLike = _ZERO,
        timeout: float | None = CALL_TIMEOUT_S,
    ) -> int:
        """Sets the velocity of the centre of mass (m/s) and the angular velocity (rad/s), along the world's
        axes.
        """
        return self._command(
            "SetVelocity",
            tessera_pb2.SetVelocityRequest(
                body=_body_ref(body),
                linear=vector_message(linear, "linear"),
                angular=vector_message(angular, "angular"),
            ),
            timeout,
        )

    def set_surface_motion(
        self,
        body: BodyName,
        velocity: VectorLike,
        running: VectorLike = _ZERO,
        timeout: float | None = CALL_TIMEOUT_S,
    ) -> int:
        """Starts or stops the moving surface of a body, in its frame and m/s: a conveyor belt (`velocity`), or
        a track, which runs around the axis `running`.
        """
        return self._command(
            "SetSurfaceMotion",
            tessera_pb2.SurfaceMotionRequest(
                body=_body_ref(body),
                velocity=vector_message(velocity, "velocity"),
                running=vector_message(running, "running"),
            ),
            timeout,
        )

    def apply_impulse(
        self,
        body: BodyName,
        impulse: VectorLike,
        lever: VectorLike = _ZERO,
        timeout: float | None = CALL_TIMEOUT_S,
    ) -> int:
        """Applies `impulse` in N s and `lever` in m from the centre of mass, along the world's axes."""
        return self._command(
            "ApplyImpulse",
            tessera_pb2.ApplyImpulseRequest(
                body=_body_ref(body),
                impulse=vector_message(impulse, "impulse"),
                lever=vector_message(lever, "lever"),
            ),
            timeout,
        )

    def apply_force(
        self,
        body: BodyName,
        force: VectorLike,
        torque: VectorLike = _ZERO,
        timeout: float | None = CALL_TIMEOUT_S,
    ) -> int:
        """Applies, for one tick, `force` in N and `torque` in N m, along the world's axes."""
        return self._command(
            "ApplyForce",
            tessera_pb2.ApplyForceRequest(
                body=_body_ref(body),
                force=vector_message(force, "force"),
                torque=vector_message(torque, "torque"),
            ),
            timeout,
        )

    def teleport(
        self,
        body: BodyName,
        position: PositionLike,
        orientation: VectorLike | None = None,
        linear_velocity: VectorLike | None = None,
        angular_velocity: VectorLike | None = None,
        timeout: float | None = CALL_TIMEOUT_S,
        *,
        alone: bool = False,
    ) -> int:
        """Moves the body frame to a new pose, with these velocities; values that are not given stay the same.
        OutOfRange beyond 64-bit sectors.

        Moves this body only: FailedPrecondition for one that joints hold, unless `alone`, after which joints pull
        what they hold together (teleport each link of a robot so, before the next tick).
        """
        request = tessera_pb2.TeleportRequest(
            body=_body_ref(body),
            pose=world_pose_message(position, orientation),
            keeps_orientation=orientation is None,
            keeps_linear_velocity=linear_velocity is None,
            keeps_angular_velocity=angular_velocity is None,
            alone=alone,
        )
        if linear_velocity is not None:
            request.linear_velocity.CopyFrom(vector_message(linear_velocity, "linear_velocity"))
        if angular_velocity is not None:
            request.angular_velocity.CopyFrom(vector_message(angular_velocity, "angular_velocity"))
        return self._command("Teleport", request, timeout)

    def set_kinematic_target(
        self,
        body: BodyName,
        position: PositionLike,
        orientation: VectorLike | None = None,
        timeout: float | None = CALL_TIMEOUT_S,
    ) -> int:
        """Makes a kinematic body move so that it reaches the pose at the end of the tick, at the velocity that this
        takes; it then stays there until the next target or velocity. Without an orientation, it keeps its own.
        """
        return self._command(
            "SetKinematicTarget",
            tessera_pb2.KinematicTargetRequest(
                body=_body_ref(body),
                pose=world_pose_message(position, orientation),
                keeps_orientation=orientation is None,
            ),
            timeout,
        )

    # --- joints: likewise ---

    def add_joint(self, joint: Joint, timeout: float | None = CALL_TIMEOUT_S) -> Added:
        """Connects two bodies of the world. AlreadyExists for a name in use, NotFound,
        InvalidArgument.
        """
        request = tessera_pb2.AddJointRequest(joint=joint.message(), child=_body_ref(joint.child))
        if joint.parent is not None:
            request.parent.CopyFrom(_body_ref(joint.parent))
        reply = self._call_once("AddJoint", request, timeout)
        return Added(reply.id, reply.tick)

    def remove_joint(self, joint: int | str, timeout: float | None = CALL_TIMEOUT_S) -> int:
        """Removes a joint."""
        return self._command("RemoveJoint", tessera_pb2.RemoveJointRequest(joint=joint_ref(joint)), timeout)

    def set_drive(
        self, joint: int | str, drive: Drive, axis: int = 1, timeout: float | None = CALL_TIMEOUT_S
    ) -> int:
        """Sets the drive of axis 1, or 2 of a universal joint; the other axis keeps its drive."""
        given = tessera_pb2.AxisDrive(axis=axis, drive=drive.message())
        request = tessera_pb2.SetJointDrivesRequest(joint=joint_ref(joint), drives=[given])
        return self._command("SetJointDrives", request, timeout)

    # --- time ---

    def pause(self, timeout: float | None = CALL_TIMEOUT_S) -> int:
        """Pauses the world and returns the tick at which it has stopped."""
        return self._tick_of("Pause", tessera_pb2.PauseRequest(), timeout)

    def resume(self, real_time_factor: float = 1.0, timeout: float | None = CALL_TIMEOUT_S) -> int:
        """Runs the world at this many simulated seconds per second; 0: as fast as possible."""
        return self._tick_of("Resume", tessera_pb2.ResumeRequest(real_time_factor=real_time_factor), timeout)

    def step(self, ticks: int = 1, timeout: float | None = None) -> int:
        """Runs that many ticks and returns the last one. FailedPrecondition unless the world is paused."""
        return self._tick_of("Step", tessera_pb2.StepRequest(ticks=ticks), timeout)

    def trajectory(
        self, bodies: BodyName | Sequence[BodyName], ticks: int, *, every_ticks: int = 1
    ) -> Trajectory:
        """Steps a paused world and returns the states of bodies over time.

        It begins with the current state, or with the first tick of bodies that were just spawned, and has
        those of the following `ticks` that are multiples of `every_ticks`. NotFound for a body that does not
        exist, or no longer exists; errors as `step()`.
        """
        names = [bodies] if isinstance(bodies, (int, str)) else bodies
        ids = {name if isinstance(name, int) else self.find(name).id for name in names}
        frames: list[BodyFrame] = []
        with self.watch_bodies(ids=ids, every_ticks=every_ticks, complete=True) as stream:
            frames.append(stream.next(CALL_TIMEOUT_S))
            for done in range(0, ticks, FRAMES_QUEUED_MAX):
                last = self.step(min(FRAMES_QUEUED_MAX, ticks - done))
                while frames[-1].tick < last - last % every_ticks:
                    frames.append(stream.next(CALL_TIMEOUT_S))
        begun = list(dropwhile(lambda frame: len(frame) < len(ids), frames))
        if not begun or any(len(frame) < len(ids) for frame in begun):
            raise NotFound(f"bodies: not all of {names} existed until the end")
        return trajectory(begun, self.status().settings.time_step)

    # --- questions ---

    def status(self, timeout: float | None = CALL_TIMEOUT_S) -> Status:
        """The status of the cluster: `state` ("empty", "loading", "paused", "running", "recovering",
        "failed"), `world`, `tick`, `time`, `bodies`, `settings`, `recoveries`, `joined_servers`, `left_servers`, `checkpoint_tick`, `servers`
        (`node`, `drained` and more) and more: the fields of StatusReply in proto/tessera.proto.
        """
        status: Status = self._call("GetStatus", tessera_pb2.StatusRequest(), timeout)
        return status

    def hash(self, timeout: float | None = CALL_TIMEOUT_S) -> HashAt:
        """The hash of the world's state."""
        reply = self._call("GetHash", tessera_pb2.HashRequest(), timeout)
        return HashAt(reply.tick, reply.hash)

    def raycast(
        self,
        origin: PositionLike,
        direction: VectorLike,
        length: float = 100.0,
        *,
        mask: int = 0,
        timeout: float | None = CALL_TIMEOUT_S,
    ) -> RayHit | None:
        """The nearest hit within `length` m, in any sectors on any servers; None if nothing is hit.

        `direction` may have any length but zero; `mask` selects the collision categories, 0: all.
        """
        reply = self._call(
            "Raycast",
            tessera_pb2.RaycastRequest(
                origin=position_message(origin),
                direction=vector_message(direction, "direction"),
                length=length,
                mask=mask,
            ),
            timeout,
        )
        if not reply.hit:
            return None
        return RayHit(
            reply.body, reply.name, reply.distance, to_position(reply.position), to_vector(reply.normal)
        )

    def near(
        self,
        position: PositionLike,
        reach: float = 0.0,
        *,
        probe: world_pb2.Shape | None = None,
        orientation: VectorLike = IDENTITY,
        mask: int = 0,
        limit: int = 0,
        timeout: float | None = CALL_TIMEOUT_S,
    ) -> list[Neighbour]:
        """The bodies within `reach` m of a convex probe of one part (not given: a point), by distance and id.

        With reach 0, the bodies that it overlaps. `reach` is at most 4 sectors; `limit` 0: 1000 bodies.
        """
        request = tessera_pb2.NearRequest(
            pose=world_pose_message(position, orientation), reach=reach, mask=mask, limit=limit
        )
        if probe is not None:
            (part,) = probe.parts
            request.probe.CopyFrom(part.geometry)
        reply = self._call("Near", request, timeout)
        return [Neighbour(body.id, body.name, body.distance) for body in reply.bodies]

    def find(self, name: str, timeout: float | None = CALL_TIMEOUT_S) -> FoundBody:
        """The body of that name. NotFound."""
        for body in self.find_bodies(name, BODIES_ASKED, timeout):
            if body.name == name:
                return body
        raise NotFound(f'no body is called "{name}"')

    def find_bodies(
        self, prefix: str = "", limit: int = 0, timeout: float | None = CALL_TIMEOUT_S
    ) -> list[FoundBody]:
        """Bodies whose names begin with `prefix`, ascending by id, at most `limit`; 0: 1000."""
        request = tessera_pb2.FindBodiesRequest(name_prefix=prefix, limit=limit)
        reply = self._call("FindBodies", request, timeout)
        return [FoundBody(body.id, body.name, body.properties) for body in reply.bodies]

    def catalogue(
        self,
        ids: Sequence[int] = (),
        *,
        only_static: bool = False,
        with_shapes: bool = True,
        timeout: float | None = CALL_TIMEOUT_S,
    ) -> Catalogue:
        """The existing bodies of `ids`; without `ids`, the first 100,000 of all."""
        result = tessera_pb2.FindBodiesReply()
        for begin in range(0, max(1, len(ids)), BODIES_ASKED):
            request = tessera_pb2.FindBodiesRequest(
                ids=ids[begin : begin + BODIES_ASKED],
                limit=BODIES_ASKED,
                only_static=only_static,
                with_shapes=with_shapes,
            )
            result.MergeFrom(self._call("FindBodies", request, timeout))
        return result

    def find_joints(
        self, prefix: str = "", limit: int = 0, timeout: float | None = CALL_TIMEOUT_S
    ) -> list[FoundJoint]:
        """Joints whose names begin with `prefix`, ascending by id, at most `limit`; 0: 1000."""
        reply = self._call(
            "ListJoints", tessera_pb2.ListJointsRequest(name_prefix=prefix, limit=limit), timeout
        )
        return [FoundJoint(j.id, j.joint.name, j.parent, j.child, j.joint) for j in reply.joints]

    def find_frame(self, name: str, timeout: float | None = CALL_TIMEOUT_S) -> FoundFrame:
        """NotFound if no frame has that name."""
        for frame in self.find_frames(name, 1, timeout):  # the name itself comes first
            if frame.name == name:
                return frame
        raise NotFound(f'no frame is called "{name}"')

    def find_frames(
        self, prefix: str = "", limit: int = 0, timeout: float | None = CALL_TIMEOUT_S
    ) -> list[FoundFrame]:
        """Frames whose names begin with `prefix`, ascending by name, at most `limit`; 0: 1000."""
        reply = self._call(
            "ListFrames", tessera_pb2.ListFramesRequest(name_prefix=prefix, limit=limit), timeout
        )
        return [_frame(found) for found in reply.frames]

    # --- streams: one frame per tick, merged over all servers; FailedPrecondition without a world ---

    def watch_bodies(
        self,
        *,
        ids: Iterable[int] = (),
        region: Region | None = None,
        every_ticks: int = 1,
        only_awake: bool = False,
        complete: bool = False,
        timeout: float | None = CALL_TIMEOUT_S,
    ) -> BodyStream:
        """The states of bodies, from the next tick on, and immediately if the world is paused.

        Without `ids`, all bodies that are not static; without `region`, everywhere; only ticks that are
        multiples of `every_ticks`. The first frame has all of these bodies, each later one those that have
        changed (`BodyFrame`), or with `complete` all again, which costs time here but no bytes on the way.
        """
        request = tessera_pb2.WatchBodiesRequest(
            ids=ids, every_ticks=every_ticks, only_awake=only_awake, in_columns=True
        )
        if region is not None:
            request.region.centre.CopyFrom(position_message(region.centre))
            request.region.half_size.CopyFrom(vector_message(region.half_size, "half_size"))
        status = self._watchable(timeout)
        known = KnownBodies(status.settings.sector_size, complete)
        return Stream(
            "WatchBodies", request, known.take, status, self.status, self._keys, timeout, of_changes=True
        )

    def watch_contacts(
        self, *, ids: Iterable[int] = (), persisting: bool = False, timeout: float | None = CALL_TIMEOUT_S
    ) -> ContactStream:
        """Contacts that begin or end, each once; with `persisting` also continuing ones.

        Without `ids`, all contacts; otherwise those with any of these bodies. The first frame is empty: its
        tick is the one from which on the stream is complete.
        """
        request = tessera_pb2.WatchContactsRequest(ids=ids, persisting=persisting)
        status = self._watchable(timeout)
        return Stream("WatchContacts", request, contact_frame, status, self.status, self._keys, timeout)

    def watch_divergences(self, timeout: float | None = CALL_TIMEOUT_S) -> DivergenceStream:
        """Bodies that leave the range of numbers, speeds or sectors. The first frame is as that of contacts."""
        request = tessera_pb2.WatchDivergencesRequest()
        status = self._watchable(timeout)
        return Stream("WatchDivergences", request, divergence_frame, status, self.status, self._keys, timeout)

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

    def _call(self, method: str, request: Any, timeout: float | None) -> Any:
        return self._coordinators.call(method, request, timeout)

    def _call_once(self, method: str, request: Any, timeout: float | None) -> Any:
        return self._coordinators.call_once(method, request, timeout)

    def _command(self, method: str, request: Any, timeout: float | None) -> int:
        tick: int = self._call_once(method, request, timeout).tick
        return tick

    def _tick_of(self, method: str, request: Any, timeout: float | None) -> int:
        tick: int = self._call(method, request, timeout).tick
        return tick

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


def _frame(found: tessera_pb2.ListFramesReply.Found) -> FoundFrame:
    frame = found.frame
    return FoundFrame(
        frame.name,
        frame.body,
        found.body,
        to_vector(frame.pose.position),
        to_quaternion(frame.pose.orientation),
    )


def _body_ref(body: BodyName) -> tessera_pb2.BodyRef:
    return tessera_pb2.BodyRef(id=body) if isinstance(body, int) else tessera_pb2.BodyRef(name=body)
