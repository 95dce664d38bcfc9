"""Programs of bodies: loaded, spawned, told what to do, and asked how they are doing."""

from __future__ import annotations

import pytest
from conftest import WORLDS, flat_world

import tessera


def walker(name: str, along: float, **numbers: float) -> tessera.Body:
    return tessera.Body(
        name,
        tessera.capsule(0.3, 0.8),
        75,
        (along, 0, 1.1),
        friction=0,
        programs=[tessera.Program("character", height=1.1, **numbers).named("legs")],
    )


@pytest.fixture(autouse=True)
def world(client: tessera.Client) -> None:
    world = flat_world(8)
    world.add(walker("loaded", 0))
    client.load(world, replace=True)


def test_a_program_does_what_it_is_told(client: tessera.Client) -> None:
    client.spawn(walker("spawned", 5, x=-0.5))
    client.tell_program("loaded", x=1.5)
    client.step(60)
    states = client.body_states(prefix="loaded")
    assert states.linear_velocities[0] == pytest.approx((1.5, 0, 0), abs=1e-3)
    assert client.body_states(prefix="spawned").linear_velocities[0] == pytest.approx((-0.5, 0, 0), abs=1e-3)


def test_programs_are_found_with_their_numbers(client: tessera.Client) -> None:
    client.tell_program("loaded", y=0.25, step=0.3)
    client.step(30)
    (found,) = client.programs()
    assert (found.body_name, found.kind, found.program, found.fault) == ("loaded", "character", 0, "")
    assert found.name == "legs"
    assert found.parameters["step"] == 0.3
    assert found.inputs["y"] == 0.25
    assert found.values["grounded"] == 1
    assert client.programs(prefix="load") == [found]
    assert client.programs(prefix="ground") == []
    assert client.hash().programs != ""


def test_what_is_wrong_is_named(client: tessera.Client) -> None:
    with pytest.raises(tessera.errors.InvalidArgument, match="has no number 'speed'; it has: height"):
        client.tell_program("loaded", speed=1)
    with pytest.raises(tessera.errors.InvalidArgument, match="step = -1 m must be at least 0 m"):
        client.tell_program("loaded", step=-1)
    with pytest.raises(tessera.errors.InvalidArgument, match="program = 1 must be below 1"):
        client.tell_program("loaded", program=1, x=1)
    with pytest.raises(tessera.errors.InvalidArgument, match="it has no programs"):
        client.tell_program("ground", x=1)
    with pytest.raises(tessera.errors.NotFound, match='no program "walker"'):
        client.spawn(tessera.Body("other", tessera.box(1, 1, 1), programs=[tessera.Program("walker")]))


def ball(name: str, along: float) -> tessera.Body:
    flee = tessera.Program("flee", WORLDS / "programs" / "flee.wasm", radius=3)
    return tessera.Body(name, tessera.sphere(0.3), 2, (along, 3, 0.3), programs=[flee])


def test_a_running_world_gets_the_module_of_a_program(client: tessera.Client) -> None:
    with pytest.raises(tessera.errors.NotFound, match='no program "flee"'):
        client.spawn(tessera.Body("other", tessera.box(1, 1, 1), programs=[tessera.Program("flee")]))
    client.spawn(ball("first", 1))
    client.spawn(ball("second", -1))
    client.step(5)
    kinds = {found.kind for found in client.programs() if found.body_name != "loaded"}
    assert [kind.split("@")[0] for kind in kinds] == ["flee"]
    world = tessera.World("whole", tessera.Settings(sector_size=8))
    world.add(ball("third", 0))
    world.add(ball("fourth", 2))
    assert len(world.message.settings.modules) == 1
    client.load(world, replace=True)
    client.step(5)
    assert {found.kind for found in client.programs()} == kinds


def test_what_they_publish_is_streamed(client: tessera.Client) -> None:
    client.tell_program("loaded", x=1.5)
    with client.watch_programs(kind="character") as frames:
        tick = client.step(20)
        known: dict[int, tessera.ProgramSample] = {}
        for frame in frames:
            known |= {sample.body: sample for sample in frame.programs}
            if frame.tick >= tick:
                break
    (found,) = client.programs()
    sample = known[found.body]
    assert (sample.program, sample.kind, sample.stopped) == (0, "character", False)
    assert sample.values.tolist() == list(found.values.values())
    with client.watch_programs(kind="imu") as frames:
        assert next(iter(frames)).programs == []
