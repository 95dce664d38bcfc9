"""Copies of a model, simulated together: spaces, resets, and equal bits wherever they are."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
from conftest import WORLDS, flat_world

import tessera
from tessera.errors import InvalidArgument

ANT = str(WORLDS / "models" / "ant.sdf")


def cart() -> tessera.World:
    """A slider along x, fixed to the world, with a free pole on it."""
    world = tessera.World("cart")
    cart = tessera.Body("cart", tessera.box(0.4, 0.2, 0.1), mass=1, position=(0, 0, 2), mask=0)
    world.add(cart)
    world.add(tessera.Body("pole", tessera.box(0.05, 0.05, 1), mass=0.1, position=(0, 0, 2.5), mask=0))
    rail = tessera.Axis(lower=-2, upper=2, effort_max=20)
    world.add_joint(tessera.Joint(tessera.JointType.PRISMATIC, "cart", None, "rail", in_parent=(0, 0, 2), axes=[rail]))
    upright = (0, 0, 2**-0.5, 2**-0.5)  # the axis is y
    world.add_joint(
        tessera.Joint(tessera.JointType.REVOLUTE, "pole", "cart", "hinge", (0, 0, 0), upright, (0, 0, -0.5), upright)
    )
    return world


@pytest.fixture
def carts() -> Iterator[tessera.VectorEnv]:
    with tessera.VectorEnv(cart(), 4, actuators=["rail"], spacing=16, steps_max=10) as env:
        yield env


def wave(env: tessera.VectorEnv, step: int) -> Any:
    place = np.arange(env.num_envs * env.single_action_space.shape[0]).reshape(env.num_envs, -1)
    return 0.3 * np.sin(0.4 * step + place)


def test_spaces_are_those_of_actuators_and_observations(carts: tessera.VectorEnv) -> None:
    assert carts.bodies == ["cart", "pole"]
    assert [axis.name for axis in carts.axes] == ["rail", "hinge"]
    assert carts.action_space.shape == (4, 1)
    assert carts.single_action_space.low.tolist() == [-20]
    assert carts.single_action_space.contains(np.array([20], dtype=np.float32))
    assert not carts.single_action_space.contains([21])
    assert carts.observation_space.shape == (4, 11 + 4)
    observations, infos = carts.reset(seed=3)
    assert observations.shape == (4, 15) and observations.dtype == np.float32 and infos == {}


def test_equal_copies_have_equal_bits(carts: tessera.VectorEnv) -> None:
    carts.reset()
    for _ in range(5):
        observations, *_ = carts.step(np.full((4, 1), 3.0))
        assert (observations == observations[0]).all()
    assert carts.last is not None
    assert (carts.last.joint_positions[:, 0] > 0).all()
    assert np.abs(carts.last.positions[:, :, 1]).max() < 1e-15  # of the copy, wherever that is


def test_copies_are_reset_by_the_step_after_their_end() -> None:
    def reward(state: tessera.EnvState) -> Any:
        return np.ones(len(state.steps))

    def terminate(state: tessera.EnvState) -> Any:
        return (state.steps == 3) & (np.arange(4) == 1)

    env = tessera.VectorEnv(
        cart(), 4, actuators=["rail"], spacing=16, steps_max=5, reward=reward, terminate=terminate
    )
    first, _ = env.reset()
    for step in range(1, 8):
        observations, rewards, terminated, truncated, _ = env.step(np.full((4, 1), 3.0))
        assert terminated.tolist() == [False, step == 3 or step == 7, False, False]
        assert truncated.tolist() == [step == 5, False, step == 5, step == 5]
        assert rewards.tolist() == [step != 6, step != 4, step != 6, step != 6]
        if step == 4:
            assert (observations[1] == first[1]).all()
        if step == 6:
            assert (observations[[0, 2, 3]] == first[0]).all()


def test_noise_depends_on_seed_copy_and_reset_alone() -> None:
    def env() -> tessera.VectorEnv:
        return tessera.VectorEnv(cart(), 3, actuators=["rail"], spacing=16, position_noise=0.2, rate_noise=0.1)

    one, other = env(), env()
    first, _ = one.reset(seed=7)
    assert len({row.tobytes() for row in first}) == 3
    again, _ = one.reset()
    assert (again != first).any()
    other.reset(seed=8)
    repeated, _ = other.reset(seed=7)
    assert (repeated == first).all()
    only, _ = other.reset(mask=np.array([False, True, False]))
    assert (only[1] == again[1]).all()
    assert other.last is not None
    assert np.abs(other.last.joint_positions).max() < 0.25


def test_actions_act_later() -> None:
    env = tessera.VectorEnv(cart(), 3, actuators=["rail"], spacing=16, delay=[0, 1, 2])
    env.reset()
    assert env.last is not None
    moves = []
    for _ in range(3):
        env.step(np.full((3, 1), 5.0))
        moves.append((env.last.joint_rates[:, 0] > 0.01).tolist())
    assert moves == [[True, False, False], [True, True, False], [True, True, True]]


def test_state_goes_on_with_the_same_bits(carts: tessera.VectorEnv) -> None:
    carts.reset(seed=1)
    for step in range(8):
        carts.step(wave(carts, step))
    state = carts.state()
    expected = [carts.step(wave(carts, step))[0] for step in range(6)]  # with a reset in between
    carts.set_state(state)
    found = [carts.step(wave(carts, step))[0] for step in range(6)]
    assert all((one == other).all() for one, other in zip(expected, found))


def test_copies_may_go_on_from_others(carts: tessera.VectorEnv) -> None:
    carts.reset()
    for step in range(5):
        carts.step(wave(carts, step))
    for index in (0, 1, 3):
        carts.place(index, carts.copy_state(2))
    for _ in range(3):
        carts.step(np.full((4, 1), 2.0))
    assert carts.last is not None
    assert np.ptp(carts.last.joint_positions, axis=0).max() < 1e-6
    assert np.ptp(carts.last.joint_rates, axis=0).max() < 1e-5


def test_observations_are_the_same_on_a_cluster(client: tessera.Client) -> None:
    def observed(**where: Any) -> list[Any]:
        env = tessera.VectorEnv(ANT, 6, spacing=16, position_noise=0.1, steps_max=15, **where)
        env.reset(seed=5)
        return [env.step(wave(env, step))[0] for step in range(20)]

    expected = observed()
    assert np.isfinite(expected[-1]).all()
    places: list[dict[str, Any]] = [
        {"client": client},
        {"threads": 2},
        {"client": tessera.Simulation(servers=4)},
    ]
    for where in places:
        for one, other in zip(expected, observed(**where)):
            assert (one == other).all()


def test_resets_may_change_copies() -> None:
    def heavier(generator: np.random.Generator, copy: tessera.Copy) -> list[tessera.Command]:
        mass = 1 + copy.index
        return [tessera.commands.set_properties(copy.bodies["cart"], mass=mass, inertia=(mass, mass, mass))]

    env = tessera.VectorEnv(cart(), 3, actuators=["rail"], spacing=16, on_reset=heavier)
    env.reset()
    env.step(np.full((3, 1), 5.0))
    assert env.last is not None
    rates = env.last.joint_rates[:, 0]
    assert rates[0] > 1.5 * rates[1] > 1.5 * rates[2] > 0


def test_ground_without_end_is_shared() -> None:
    world = flat_world(sector_size=32)
    world.add(tessera.Body("ball", tessera.sphere(0.5), mass=1, position=(0, 0, 0.5)))
    env = tessera.VectorEnv(world, 5, settings=tessera.Settings(substeps=1, adapt=False))
    env.reset()
    settings = env.client.status().settings
    assert (settings.sector_size, settings.substeps, settings.adapt) == (32, 1, False)
    assert env.client.status().bodies == 6
    for _ in range(30):
        observations, *_ = env.step(np.empty((5, 0)))
    assert observations[:, 0] == pytest.approx(0.5, abs=1e-3)


def test_what_is_wrong_is_named(carts: tessera.VectorEnv) -> None:
    with pytest.raises(InvalidArgument, match=r"actions: their shape \(4, 2\) must be \(4, 1\)"):
        carts.step(np.zeros((4, 2)))
    carts.reset()
    with pytest.raises(InvalidArgument, match="that of copy 2 for 'rail' must be finite"):
        carts.step(np.array([[0], [0], [np.nan], [0]]))
    with pytest.raises(InvalidArgument, match="count = 0"):
        tessera.VectorEnv(cart(), 0)
    with pytest.raises(InvalidArgument, match="spacing = 10 m must be a whole number of sectors of 16 m"):
        tessera.VectorEnv(cart(), 2, spacing=10)
    with pytest.raises(InvalidArgument, match="no joint 'elbow' with an axis, but rail, hinge"):
        tessera.VectorEnv(cart(), 2, actuators=["elbow"])
    with pytest.raises(InvalidArgument, match=r"observe: its shape \(2,\) must begin with 3"):
        tessera.VectorEnv(cart(), 3, observe=lambda state: np.zeros(2))
    with pytest.raises(InvalidArgument, match="no body that can move"):
        tessera.VectorEnv(flat_world(), 1)


def test_gymnasium_has_its_interface(carts: tessera.VectorEnv, monkeypatch: pytest.MonkeyPatch) -> None:
    """Against a stand-in of what gymnasium 1.1 documents, which Debian does not have."""

    class VectorEnv:
        metadata: dict[str, Any] = {}

    class Space(SimpleNamespace):
        def __init__(self, low: Any, high: Any, shape: Any, dtype: Any) -> None:
            super().__init__(low=low, high=high, shape=shape, dtype=dtype)

    gymnasium, vector = ModuleType("gymnasium"), ModuleType("gymnasium.vector")
    vector.VectorEnv = VectorEnv  # type: ignore[attr-defined]
    vector.AutoresetMode = SimpleNamespace(NEXT_STEP="NextStep")  # type: ignore[attr-defined]
    gymnasium.vector = vector  # type: ignore[attr-defined]
    gymnasium.spaces = SimpleNamespace(Box=Space)  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "gymnasium", gymnasium)
    monkeypatch.setitem(sys.modules, "gymnasium.vector", vector)
    env: Any = carts.gymnasium()
    assert issubclass(type(env), VectorEnv)
    assert env.metadata["autoreset_mode"] == "NextStep"
    assert env.num_envs == 4 and env.single_action_space.shape == (1,)
    assert env.observation_space.dtype is np.float32
    first, _ = env.reset(seed=2)
    mask = np.array([True, False, False, False])
    env.step(np.full((4, 1), 4.0))
    observations, _ = env.reset(options={"reset_mask": mask})
    assert (observations[0] == first[0]).all() and (observations[1] != first[1]).any()
    assert len(env.step(env.action_space.low)) == 5
