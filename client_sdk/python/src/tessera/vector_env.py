"""Many copies of a model that are simulated together, with arrays in and out."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from types import TracebackType
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from tessera import commands as of_commands
from tessera import queries as of_queries
from tessera._proto.command_pb2 import Command
from tessera.any_client import AnyClient
from tessera.body import Body, Motion
from tessera.commands import PlacedBody, PlacedJoint
from tessera.env_model import ModelAxis, env_model, split
from tessera.errors import FailedPrecondition, InvalidArgument, NotFound
from tessera.joint import DriveMode
from tessera.position import Floats, Integers, Vector, WorldPosition, relative_to
from tessera.queries import Answers, Query
from tessera.results import Added, Ids
from tessera.shape import plane
from tessera.simulation import Simulation
from tessera.world import Settings, World

COPIES_MAX = 65_536
DELAY_MAX = 1000
SPAWNED_MAX = 50_000  # bodies and joints of a request
SECTOR_SIZE = 16.0  # m, of a scene that is not given
SPACING = 64.0  # m, by default

Mask: TypeAlias = NDArray[np.bool_]


@dataclass(frozen=True)
class Box:
    """Arrays of one shape between two bounds: what Gymnasium calls a space."""

    low: NDArray[Any]
    high: NDArray[Any]

    @property
    def shape(self) -> tuple[int, ...]:
        return self.low.shape

    @property
    def dtype(self) -> np.dtype[Any]:
        return self.low.dtype

    def contains(self, x: ArrayLike) -> bool:
        array = np.asarray(x)
        return array.shape == self.shape and bool(np.all((array >= self.low) & (array <= self.high)))


@dataclass(frozen=True, eq=False)
class EnvState:
    """All copies at the end of a tick; n copies, b bodies, q axes of joints, m actuators."""

    tick: int
    positions: Floats  # [n, b, 3], m from the origin of the copy, of the body frames
    orientations: Floats  # [n, b, 4], body frame to world axes, x y z w
    linear_velocities: Floats  # [n, b, 3], m/s, of the centres of mass, world axes
    angular_velocities: Floats  # [n, b, 3], rad/s, world axes
    joint_positions: Floats  # [n, q], rad or m
    joint_rates: Floats  # [n, q], rad/s or m/s
    joint_efforts: Floats  # [n, q], N m or N, with `efforts`; else not a number
    actions: Floats  # [n, m], those that acted
    steps: Integers  # [n], since the last reset
    answers: Answers  # of `queries`, by these


Rows: TypeAlias = Callable[[EnvState], NDArray[Any]]
"""What a function makes of a state: a row, or an element, for each copy."""


@dataclass(frozen=True)
class Copy:
    """One of the copies, for commands to it."""

    index: int
    bodies: dict[str, int]  # ids, by names of the model
    joints: dict[str, int]
    origin: WorldPosition


@dataclass(frozen=True, eq=False)
class CopyState:
    """Where the bodies of one copy are, in their order."""

    positions: Floats  # [b, 3], m from the origin of the copy, of the body frames
    orientations: Floats  # [b, 4], x y z w
    linear_velocities: Floats  # [b, 3], m/s, of the centres of mass
    angular_velocities: Floats  # [b, 3], rad/s


OnReset: TypeAlias = Callable[[np.random.Generator, Copy], Iterable[Command]]


class VectorEnv:
    """Copies of a model, by index, each around the centre of a sector of its own.

        env = tessera.VectorEnv("worlds/models/ant.sdf", 256, reward=lambda state: state.linear_velocities[:, 0, 0])
        observations, infos = env.reset(seed=1)
        observations, rewards, terminated, truncated, infos = env.step(actions)  # [256, m]

    Since copies differ by whole sectors, equal copies have equal bits, and an environment has them on any number of
    threads or servers. It follows the conventions of Gymnasium's vector environments, of which `gymnasium()` makes one.
    A copy that is terminated or truncated is reset by the next step, whatever its action then, which has no reward
    (`AutoresetMode.NEXT_STEP`). A reset takes effect at the beginning of a step: the first observation is that of
    the end of it.
    """

    single_observation_space: Box
    single_action_space: Box
    observation_space: Box
    action_space: Box

    def __init__(
        self,
        model: World | str,
        count: int,
        *,
        scene: World | None = None,
        settings: Settings | None = None,
        client: AnyClient | None = None,
        threads: int = 1,
        spacing: float = SPACING,
        ticks: int = 1,
        actuators: Sequence[str] | None = None,
        mode: DriveMode | None = None,
        stiffness: float | None = None,
        damping: float | None = None,
        delay: ArrayLike = 0,
        efforts: bool = False,
        queries: Sequence[Query[Any]] = (),
        observe: Rows | None = None,
        reward: Rows | None = None,
        terminate: Rows | None = None,
        steps_max: int = 0,
        position_noise: float = 0.0,
        rate_noise: float = 0.0,
        on_reset: OnReset | None = None,
        dtype: DTypeLike = np.float32,
    ) -> None:
        """`model` is a world, or the file of one, around the centre of the sector (0, 0, 0): `count` copies of its bodies and
        joints are spawned, `spacing` m apart, which is a whole number of sectors. Ground without an end is shared: that
        of the model, or all of `scene`, whose settings the world has, or else a plane through z = 0. `settings` go
        before those: `Settings(sector_size=16, substeps=1, adapt=False)` is fast, and coarse.

        - `client`: a `Client` or `Simulation`, whose world is replaced; by default a simulation of `threads`.
        - `ticks`: of a step.
        - Actions are targets of drives, a column for each actuator: `actuators` are names of joints, by default those that
          the model drives, or else all. `mode`, and for servos `stiffness` (N m/rad or N/m) and `damping` (N m s/rad or
          N s/m), are the model's by default, and EFFORT for what it does not drive. They act `delay` steps later: one
          number, or one for each copy.
        - `observe`, `reward` and `terminate` make arrays of an `EnvState`: [n, ...], [n] and [n] of bool. By default:
          `observation()`, 0 and False. `queries` are asked with each step, and `efforts` of joints told.
        - `steps_max`: after so many, a copy is truncated; 0: never.
        - At a reset, positions and rates of joints get uniform noise of these amplitudes, and `on_reset` returns commands to
          the copy, such as `tessera.commands.set_properties()`, drawn from a generator that depends on the seed, the
          copy and the number of its reset alone.

        InvalidArgument names what is out of bounds.
        """
        if not 1 <= count <= COPIES_MAX:
            raise InvalidArgument(f"count = {count} must be from 1 to {COPIES_MAX}")
        if ticks < 1:
            raise InvalidArgument(f"ticks = {ticks} must be at least 1")
        delays = np.asarray(delay, dtype=np.int64)
        if delays.shape not in ((), (count,)) or delays.min() < 0 or delays.max() > DELAY_MAX:
            raise InvalidArgument(f"delay: it must be from 0 to {DELAY_MAX} steps, one number or {count}")
        read = model if isinstance(model, World) else World.read(model)
        ground, read = split(read) if scene is None else (None, read)
        scene = _with_settings(scene or ground or _plane(), settings)
        self._model = env_model(read)
        if (position_noise or rate_noise) and not self._model.is_tree:
            raise InvalidArgument("position_noise, rate_noise: joints of the model form loops, and cannot be placed so")
        self.model = read
        self.num_envs = count
        self.ticks = ticks
        self.bodies = list(self._model.bodies)
        self.axes: list[ModelAxis] = list(self._model.axes)
        self.actuators = [self.axes[n] for n in self._model.axis_places(actuators)]
        self._driven = _Driven(self.actuators, mode, stiffness, damping)
        self.client = client if client is not None else Simulation(threads=threads, precision=scene.precision)
        self._is_own = client is None
        self._queries = list(queries)
        self._observe = observe or observation
        self._reward = reward
        self._terminate = terminate
        self._steps_max = steps_max
        self._noise = (position_noise, rate_noise)
        self._on_reset = on_reset
        self._dtype = np.dtype(dtype)
        self._load(scene, spacing)
        self._driven.of_joints(self._joint_ids)
        self._bodies_query = of_queries.body_states(self._body_ids.ravel())
        self._joints_query = of_queries.joint_states(self._joint_ids.ravel(), efforts=efforts)
        self._seed = 0
        self._resets = np.zeros(count, dtype=np.int64)  # of each copy, so far
        self._steps = np.zeros(count, dtype=np.int64)
        self._is_over = np.ones(count, dtype=np.bool_)
        self._delays = np.broadcast_to(delays, count)
        # Of the present step, of the one before, and so on.
        self._history: Floats = np.tile(self._driven.neutral, (int(delays.max()) + 1, count, 1))
        self._placed: dict[int, CopyState] = {}  # by the next step
        self.last: EnvState | None = None
        self._find_spaces()

    # --- Gymnasium's conventions ---

    def reset(self, *, seed: int | None = None, mask: Mask | None = None) -> tuple[NDArray[Any], dict[str, Any]]:
        """Resets all copies, or those of a `mask` [n], and runs a step in which actuators hold them as they are at first;
        the other copies get the actions of the last step again. With a `seed`, noise begins anew.
        """
        if seed is not None:
            self._seed = int(seed)
            self._resets[:] = 0
        chosen = np.ones(self.num_envs, dtype=np.bool_) if mask is None else np.asarray(mask, dtype=np.bool_)
        if chosen.shape != (self.num_envs,):
            raise InvalidArgument(f"mask: its shape {chosen.shape} must be ({self.num_envs},)")
        actions = np.tile(self._driven.neutral, (self.num_envs, 1)) if self.last is None else self.last.actions
        self._run(actions, chosen)
        self._is_over &= ~chosen
        return self._observations(), {}

    def step(self, actions: ArrayLike) -> tuple[NDArray[Any], Floats, Mask, Mask, dict[str, Any]]:
        """Observations, rewards [n], terminated [n], truncated [n] and an empty dictionary, after `actions` [n, m]."""
        given = np.asarray(actions, dtype=np.float64)
        if given.shape != (self.num_envs, len(self.actuators)):
            raise InvalidArgument(
                f"actions: their shape {given.shape} must be ({self.num_envs}, {len(self.actuators)})"
            )
        if not np.isfinite(given).all():
            copy, column = np.argwhere(~np.isfinite(given))[0]
            raise InvalidArgument(f"actions: that of copy {copy} for {self.actuators[column].name!r} must be finite")
        self._history[1:] = self._history[:-1].copy()
        self._history[0] = given
        was_over = self._is_over.copy()
        state = self._run(self._history[self._delays, np.arange(self.num_envs)], was_over)
        terminated = np.zeros(self.num_envs, dtype=np.bool_)
        rewards = np.zeros(self.num_envs)
        if self._reward is not None:
            rewards = np.where(was_over, 0.0, self._of_copies("reward", self._reward(state)))
        if self._terminate is not None:
            terminated = self._of_copies("terminate", self._terminate(state)).astype(np.bool_) & ~was_over
        truncated = (self._steps >= self._steps_max) & (self._steps_max > 0) & ~was_over & ~terminated
        self._is_over = terminated | truncated
        return self._observations(), rewards, terminated, truncated, {}

    def close(self) -> None:
        """Ends the simulation, if the environment made it."""
        if self._is_own and isinstance(self.client, Simulation):
            self.client.close()

    def gymnasium(self) -> Any:
        """This environment as a `gymnasium.vector.VectorEnv`, for the package `gymnasium`, which must be installed."""
        from tessera.gymnasium_env import GymnasiumVectorEnv

        return GymnasiumVectorEnv(self)

    def __enter__(self) -> VectorEnv:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    # --- more ---

    def copy_at(self, index: int) -> Copy:
        """The ids of a copy, by the names of the model."""
        moving = self._model.moving
        first = int(self._body_ids[index, 0]) - int(moving[0])
        bodies = {body.name: first + n for n, body in enumerate(self.model.message.bodies)}
        joints = {joint.name: int(id) for joint, id in zip(self.model.message.joints, self._joint_ids[index])}
        return Copy(index, bodies, joints, self._origin(index))

    def end(self, mask: Mask) -> None:
        """Lets the next step reset the copies of a `mask` [n], as if they had ended."""
        self._is_over |= np.asarray(mask, dtype=np.bool_)

    def copy_state(self, index: int) -> CopyState:
        """Where a copy is at the end of the last step."""
        if self.last is None:
            raise FailedPrecondition("the environment has yet to be reset")
        last = self.last
        return CopyState(
            last.positions[index],
            last.orientations[index],
            last.linear_velocities[index],
            last.angular_velocities[index],
        )

    def place(self, index: int, state: CopyState) -> None:
        """Puts a copy where another one was, at the beginning of the next step, which may be its reset. Its contacts begin
        anew.
        """
        self._placed[index] = state

    def state(self) -> bytes:
        """All of the environment between two steps, but what `place()` has yet to do: `set_state()` goes on from it with the
        same bits.
        """
        out = io.BytesIO()
        arrays = {
            "world": np.frombuffer(self.client.state(), dtype=np.uint8),
            "seed": np.array(self._seed),
            "resets": self._resets,
            "steps": self._steps,
            "is_over": self._is_over,
            "history": self._history,
            "actions": self._last_actions(),
        }
        np.savez(out, **arrays)
        return out.getvalue()

    def set_state(self, state: bytes) -> None:
        """Goes on from the state of an environment that was made with the same arguments. DataLoss if it is damaged."""
        with np.load(io.BytesIO(state)) as arrays:
            if arrays["resets"].shape != (self.num_envs,):
                raise InvalidArgument(f"state: it has {len(arrays['resets'])} copies, not {self.num_envs}")
            self.client.restore(arrays["world"].tobytes(), replace=True)
            self._seed = int(arrays["seed"])
            self._resets, self._steps = arrays["resets"], arrays["steps"]
            self._is_over = arrays["is_over"]
            self._history = arrays["history"]
            answers = self.client.ask([self._bodies_query, self._joints_query, *self._queries])
            self.last = self._state_of(answers, arrays["actions"])

    # --- helpers ---

    def _load(self, scene: World, spacing: float) -> None:
        self.client.load(scene, replace=True)
        size = self.client.status().settings.sector_size
        stride = round(spacing / size)
        if stride < 1 or stride * size != spacing:
            raise InvalidArgument(f"spacing = {spacing:g} m must be a whole number of sectors of {size:g} m")
        side = int(np.ceil(np.sqrt(self.num_envs)))
        index = np.arange(self.num_envs)
        self._sectors = np.stack([index % side, index // side, 0 * index], axis=-1).astype(np.int64) * stride
        self._sector_size = size
        message = self.model.message
        at_once = max(1, SPAWNED_MAX // (len(message.bodies) + len(message.joints)))
        created: list[Added] = []
        for start in range(0, self.num_envs, at_once):
            some = range(start, min(start + at_once, self.num_envs))
            spawns = [of_commands.spawn(self.model, f"{n}::", self._origin(n)) for n in some]
            created += self.client.run(spawns, ticks=1).applied.created
        first = np.array([one.bodies[0] for one in created], dtype=np.uint64)
        self._body_ids: Ids = first[:, np.newaxis] + self._model.moving.astype(np.uint64)
        joints = [list(one.joints) for one in created]
        self._joint_ids: Ids = np.array(joints, dtype=np.uint64).reshape(self.num_envs, -1)

    def _origin(self, index: int) -> WorldPosition:
        i, j, k = self._sectors[index].tolist()
        return WorldPosition((0.0, 0.0, 0.0), (i, j, k))

    def _find_spaces(self) -> None:
        count = (self.num_envs,)
        low, high = (np.asarray(bound, dtype=self._dtype) for bound in (self._driven.low, self._driven.high))
        self.single_action_space = Box(low, high)
        self.action_space = Box(np.tile(low, (*count, 1)), np.tile(high, (*count, 1)))
        state = self._run(np.tile(self._driven.neutral, (*count, 1)), np.ones(count, dtype=np.bool_))
        shape = self._of_copies("observe", self._observe(state)).shape
        self._resets[:] = 0
        self._is_over[:] = True
        infinite = np.full(shape, np.inf, dtype=self._dtype)
        self.observation_space = Box(-infinite, infinite)
        self.single_observation_space = Box(-infinite[0], infinite[0])

    def _of_copies(self, name: str, rows: Any) -> NDArray[Any]:
        array = np.asarray(rows)
        if array.ndim == 0 or len(array) != self.num_envs:
            raise InvalidArgument(f"{name}: its shape {array.shape} must begin with {self.num_envs}")
        return array

    def _observations(self) -> NDArray[Any]:
        assert self.last is not None
        return self._of_copies("observe", self._observe(self.last)).astype(self._dtype)

    def _last_actions(self) -> Floats:
        assert self.last is not None
        return self.last.actions

    def _run(self, actions: Floats, is_reset: Mask) -> EnvState:
        """A step, at whose beginning copies are reset; these are held as they are at first."""
        commands: list[Command] = []
        for index in np.flatnonzero(is_reset).tolist():
            commands += self._reset_commands(index)
        for index, placed in self._placed.items():
            commands.append(self._placed_bodies(index, range(len(self.bodies)), [], placed))
        self._placed.clear()
        held = np.where(is_reset[:, np.newaxis], self._driven.neutral, actions)
        self._history[:, is_reset] = self._driven.neutral
        commands += self._driven.commands(held)
        answers = self.client.step(
            self.ticks, commands=commands, queries=[self._bodies_query, self._joints_query, *self._queries]
        )
        self._steps = np.where(is_reset, 0, self._steps + 1)
        self.last = self._state_of(answers, held)
        return self.last

    def _state_of(self, answers: Answers, actions: Floats) -> EnvState:
        bodies, joints = answers[self._bodies_query], answers[self._joints_query]
        if len(bodies) != self._body_ids.size or len(joints) != self._joint_ids.size:
            raise NotFound("bodies or joints of copies were removed")
        count = len(self.bodies)
        offsets = bodies.sectors.reshape(self.num_envs, count, 3) - self._sectors[:, np.newaxis]
        rows = [axis.joint for axis in self.axes]
        columns = [axis.axis - 1 for axis in self.axes]

        def of_axes(values: Floats) -> Floats:
            result: Floats = values.reshape(self.num_envs, -1, 2)[:, rows, columns]
            return result

        def of_bodies(values: Floats) -> Floats:
            return values.reshape(self.num_envs, count, -1)

        return EnvState(
            tick=answers.tick,
            positions=relative_to(offsets, of_bodies(bodies.local), (0, 0, 0), self._sector_size),
            orientations=of_bodies(bodies.orientations),
            linear_velocities=of_bodies(bodies.linear_velocities),
            angular_velocities=of_bodies(bodies.angular_velocities),
            joint_positions=of_axes(joints.positions),
            joint_rates=of_axes(joints.rates),
            joint_efforts=of_axes(joints.efforts),
            actions=actions,
            steps=self._steps,
            answers=answers,
        )

    def _reset_commands(self, index: int) -> list[Command]:
        generator = np.random.Generator(
            np.random.Philox(key=[self._seed & (2**64 - 1), index], counter=[0, 0, 0, int(self._resets[index])])
        )
        self._resets[index] += 1
        if any(self._noise):
            result = [self._placed_joints(index, generator)]
        else:
            result = [self._placed_bodies(index, range(len(self.bodies)), [])]
        if self._on_reset is not None:
            result += self._on_reset(generator, self.copy_at(index))
        return result

    def _placed_joints(self, index: int, generator: np.random.Generator) -> Command:
        """The first pose, with noise of joints; those that follow others do so."""
        positions = np.array([axis.position for axis in self.axes])
        by_position, by_rate = (amplitude * generator.uniform(-1, 1, len(positions)) for amplitude in self._noise)
        for n, axis in enumerate(self.axes):
            if axis.leader >= 0:
                by_position[n] = axis.multiplier * by_position[axis.leader]
                by_rate[n] = axis.multiplier * by_rate[axis.leader]
        low = np.array([axis.lower for axis in self.axes])
        high = np.array([axis.upper for axis in self.axes])
        positions = np.clip(positions + by_position, np.minimum(low, positions), np.maximum(high, positions))
        joints = [PlacedJoint(int(id), orientation=self._model.turned.get(n)) for n, id in enumerate(self._joint_ids[index])]
        for axis, position, rate in zip(self.axes, positions.tolist(), by_rate.tolist()):
            joint = joints[axis.joint]
            joint.positions = [*np.atleast_1d(joint.positions).tolist(), position]
            joint.rates = [*np.atleast_1d(joint.rates).tolist(), rate]
        return self._placed_bodies(index, self._model.roots, joints)

    def _placed_bodies(
        self, index: int, rows: Iterable[int], joints: list[PlacedJoint], placed: CopyState | None = None
    ) -> Command:
        """As at first, or as `placed`."""
        state = placed or self._model
        sector = self._origin(index).sector
        places: list[Vector] = [(x, y, z) for x, y, z in state.positions.tolist()]
        bodies = [
            PlacedBody(
                int(self._body_ids[index, row]),
                WorldPosition(places[row], sector),
                state.orientations[row],
                state.linear_velocities[row],
                state.angular_velocities[row],
            )
            for row in rows
        ]
        return of_commands.set_state(bodies, joints)


class _Driven:
    """The actuators of a copy."""

    def __init__(
        self, axes: Sequence[ModelAxis], mode: DriveMode | None, stiffness: float | None, damping: float | None
    ) -> None:
        self._axes = axes
        self._modes = [mode or (DriveMode.EFFORT if axis.mode is DriveMode.FREE else axis.mode) for axis in axes]
        self._stiffness = np.array([axis.stiffness if stiffness is None else stiffness for axis in axes])
        self._damping = np.array([axis.damping if damping is None else damping for axis in axes])
        self._groups: list[tuple[list[int], Ids, dict[str, Any]]] = []
        holds_position = [one in (DriveMode.POSITION, DriveMode.SERVO) for one in self._modes]
        self.neutral = np.where(holds_position, [axis.position for axis in axes], 0.0).astype(np.float64)
        bounds = {DriveMode.VELOCITY: "velocity_max", DriveMode.EFFORT: "effort_max"}
        self.low = np.array([
            axis.lower if is_position else -getattr(axis, bounds[one])
            for axis, one, is_position in zip(axes, self._modes, holds_position)
        ])
        self.high = np.array([
            axis.upper if is_position else getattr(axis, bounds[one])
            for axis, one, is_position in zip(axes, self._modes, holds_position)
        ])

    def of_joints(self, joint_ids: Ids) -> None:
        """Whose ids are `joint_ids` [n, joints of the model]."""
        kinds = [(mode, axis.axis) for mode, axis in zip(self._modes, self._axes)]
        self._groups = []
        for mode, number in dict.fromkeys(kinds):
            columns = [column for column, kind in enumerate(kinds) if kind == (mode, number)]
            joints = joint_ids[:, [self._axes[column].joint for column in columns]]
            is_servo = mode is DriveMode.SERVO
            gains = {
                name: np.tile(values[columns], len(joints)) if is_servo else 0.0
                for name, values in (("stiffness", self._stiffness), ("damping", self._damping))
            }
            self._groups.append((columns, joints.ravel(), {"mode": mode, "axis": number, **gains}))

    def commands(self, targets: Floats) -> list[Command]:
        """Those that set targets [n, m]: one for each mode and axis that there is."""
        return [
            command
            for columns, joints, drive in self._groups
            for command in of_commands.set_drives(joints, targets[:, columns].ravel(), **drive)
        ]


def observation(state: EnvState) -> Floats:
    """What is observed by default [n, 10 + 2 q]: of the first body, height, orientation and velocities; positions and
    rates of joints. Without the place on the ground, which should not matter.
    """
    return np.concatenate(
        [
            state.positions[:, 0, 2:],
            state.orientations[:, 0],
            state.linear_velocities[:, 0],
            state.angular_velocities[:, 0],
            state.joint_positions,
            state.joint_rates,
        ],
        axis=1,
    )


def _with_settings(scene: World, settings: Settings | None) -> World:
    if settings is None:
        return scene
    other = World()
    other.message.CopyFrom(scene.message)
    other.message.settings.MergeFrom(settings.message())
    return other


def _plane() -> World:
    world = World("env", Settings(sector_size=SECTOR_SIZE))
    world.add(Body("ground", plane(), motion=Motion.STATIC, friction=1.0))
    return world
