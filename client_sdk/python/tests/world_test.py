"""Worlds that are built here, and files of worlds."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest
from conftest import WORLDS, flat_world

import tessera
from tessera import program

EMPTY = """<sdf version="1.9"><world name="empty"><gravity>0 0 -9.81</gravity></world></sdf>"""


def test_settings_begin_as_those_of_files_do(client: tessera.Client, tmp_path: Path) -> None:
    file = tmp_path / "empty.sdf"
    file.write_text(EMPTY)
    client.load(tessera.World("empty", tessera.Settings()), replace=True)
    assert client.status().settings == tessera.World.read(file).message.settings


def test_settings_are_those_of_the_protocol(client: tessera.Client) -> None:
    settings = tessera.Settings(precision=tessera.Precision.FLOAT32, substeps=8, adapt=False, sleep_after=0)
    client.load(tessera.World("flat", settings), replace=True)
    loaded = client.status().settings
    assert (loaded.substeps, loaded.adapt, loaded.sleep_after) == (8, False, 0)
    assert loaded.sector_size == 128
    with pytest.raises(ValueError, match="no setting 'gravity_z'"):
        tessera.Settings(gravity_z=-9.81)
    with pytest.raises(TypeError):
        tessera.Settings(substeps=0.5)


def test_file_is_the_world_that_the_command_line_loads(
    client: tessera.Client, cluster: tessera.Cluster
) -> None:
    client.load(WORLDS / "tower.sdf", replace=True)
    client.step(30)
    ours = client.hash()
    subprocess.run(
        [program.find(), "load", str(WORLDS / "tower.sdf"), "--replace", "--connect", cluster.address],
        check=True,
        capture_output=True,
    )
    client.step(30)
    assert client.hash() == ours


def test_world_is_written_read_and_moved(client: tessera.Client, tmp_path: Path) -> None:
    world = flat_world()
    for n in range(3):
        world.add(tessera.Body(f"crate_{n}", tessera.box(1, 1, 1), 10, (0, 0, 0.5 + n)))
    assert len(world.message.shapes) == 2
    world.add_joint(
        tessera.Joint(
            tessera.JointType.FIXED,
            "crate_1",
            parent="crate_0",
            name="glue",
            in_parent=(0, 0, 0.5),
            in_child=(0, 0, -0.5),
        )
    )
    file = tmp_path / "crates.pb"
    world.write(file)
    assert tessera.World.read(file).message.bodies == world.message.bodies

    client.load(world, replace=True)
    assert [joint.parent for joint in client.find_joints("glue")] == ["crate_0"]
    here = client.trajectory("crate_2", 30)
    client.load(tessera.World.read(file, ["--shift", "2^62,0,-2^62"]), replace=True)
    there = client.trajectory("crate_2", 30)
    assert (here.relative_to() == there.relative_to()).all()
    assert there.sectors[0, 0].tolist() == [2**62, 0, -(2**62)]


def test_what_cannot_be_read_says_why(tmp_path: Path) -> None:
    with pytest.raises(tessera.NotFound, match="nowhere.sdf"):
        tessera.World.read(tmp_path / "nowhere.sdf")
    bad = tmp_path / "bad.pb"
    bad.write_bytes(b"\xff\xff")
    with pytest.raises(tessera.InvalidArgument, match="bad.pb is no world"):
        tessera.World.read(bad)
    with pytest.raises(tessera.NotFound, match='no body "nobody"'):
        flat_world().add_joint(tessera.Joint(tessera.JointType.BALL, "nobody"))


def test_program_that_is_not_there_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(program.VARIABLE, "/nowhere/tessera")
    with pytest.raises(tessera.NotFound, match="TESSERA_COMMAND = /nowhere/tessera"):
        tessera.Cluster()


def test_a_hull_carries_its_deck(client: tessera.Client) -> None:
    deck = tessera.MovingFrame("deck", (0, 0, 1), carrier=1)
    world = tessera.World("ferry", tessera.Settings(frames=[deck]))
    hull = tessera.Body("hull", tessera.box(8, 4, 2), 1000, (3, 0, 0), motion=tessera.Motion.KINEMATIC)
    hull.linear_velocity = (2, 0, 0)
    world.add(hull)
    floor = tessera.Body(
        "floor", tessera.box(8, 4, 1), 1, tessera.WorldPosition((0, 0, -0.5), frame=1), motion=tessera.Motion.STATIC
    )
    world.add(floor)
    world.add(tessera.Body("crate", tessera.box(1, 1, 1), 10, tessera.WorldPosition((1, 0, 0.5), frame=1)))
    client.load(world, replace=True)
    client.step(60)
    states = client.body_states()
    assert states.frames.tolist() == [0, 1]
    assert states.local[0] == pytest.approx([5, 0, 0], abs=1e-3)
    assert states.local[1] == pytest.approx([1, 0, 0.5], abs=1e-3)
    with pytest.raises(tessera.InvalidArgument, match="body 'hull': it carries the frame 'deck'"):
        client.teleport("hull", tessera.WorldPosition((0, 0, 5), frame=1))


def test_what_rests_in_a_ship_sleeps(client: tessera.Client) -> None:
    ship = tessera.MovingFrame("ship", velocity=(7800, 0, 0), legs=[(3, (0, 0, 0)), (1, (0, -4, 0))])
    world = tessera.World("ship", tessera.Settings(frames=[ship]))
    for name, size, place, motion in (
        ("floor", (40, 40, 1), (0, 0, -0.5), tessera.Motion.STATIC),
        ("crate", (1, 1, 0.5), (5, 0, 0.25), tessera.Motion.DYNAMIC),
    ):
        body = tessera.Body(name, tessera.box(*size), 10, tessera.WorldPosition(place, frame=1), motion=motion)
        body.friction = 0.2
        world.add(body)
    client.load(world, replace=True)
    client.step(175)
    states = client.body_states()
    assert states.frames.tolist() == [1]
    assert states.asleep.all() and states.local[0] == pytest.approx([5, 0, 0.25], abs=1e-3)
    (crate,) = client.near(tessera.WorldPosition((5, 0, 1.5), frame=1), reach=1.2)
    assert crate.distance == pytest.approx(1, abs=1e-3)
    with client.watch_bodies(complete=True) as frames:
        client.step(65)
        frame = next(frame for frame in frames if frame.tick == 240)
    assert frame.frames is not None and frame.frames.tolist() == [1]
    slid = 4 - 0.2 * 9.81
    assert frame.linear_velocities[0][1] == pytest.approx(slid, rel=0.02)
    with pytest.raises(tessera.InvalidArgument, match="frame 2 must be at most 1"):
        client.spawn(tessera.Body("stray", tessera.box(1, 1, 1), position=tessera.WorldPosition(frame=2)))


def test_a_lift_that_follows_keys(client: tessera.Client) -> None:
    keys = [
        tessera.FrameKey(0, (0, 0, 0)),
        tessera.FrameKey(2, (0, 0, 8), (0, 0, 1, 0), velocity=(0, 0, 6)),
        tessera.FrameKey(4, (0, 0, 16)),
    ]
    lift = tessera.MovingFrame("lift", keys=keys)
    world = tessera.World("lift", tessera.Settings(frames=[lift]))
    floor = tessera.Body("floor", tessera.box(4, 4, 1), 1, tessera.WorldPosition((0, 0, -0.5), frame=1))
    floor.motion = tessera.Motion.STATIC
    world.add(floor)
    world.add(tessera.Body("crate", tessera.box(1, 1, 1), 10, tessera.WorldPosition((0, 0, 0.5), frame=1)))
    client.load(world, replace=True)
    client.step(300)
    states = client.body_states()
    assert states.frames.tolist() == [1]
    assert states.local[0][2] == pytest.approx(0.5, abs=1e-3)
    keys[2].time = 1
    with pytest.raises(tessera.InvalidArgument, match="frame 'lift': key 3: time = 1 s must be at least"):
        client.load(tessera.World("lift", tessera.Settings(frames=[lift])), replace=True)


def test_triggers_tell_what_enters_and_leaves(client: tessera.Client) -> None:
    client.load(flat_world(), replace=True)
    gate = tessera.Body(
        "gate", tessera.box(4, 4, 0.2), position=(0, 0, 4), motion=tessera.Motion.STATIC, trigger=True
    )
    shell = tessera.compound([(tessera.sphere(0.5), (0, 0, 0)), (tessera.trigger(tessera.sphere(1)), (0, 0, 0))])
    assert tessera.moments_of(shell, 3) == tessera.moments_of(tessera.sphere(0.5), 3)
    ids = [client.spawn(body).id for body in (gate, tessera.Body("ball", shell, 3, (0, 0, 6)))]
    with client.watch_contacts() as contacts:
        client.step(100)
        events = [contact for _ in range(100) for contact in contacts.next(10).contacts if contact.trigger]
    of_gate = [event for event in events if event.a == ids[0]]
    phases = [tessera.Phase.BEGIN, tessera.Phase.END]
    assert [(event.b, event.phase) for event in of_gate] == [(ids[1], phase) for phase in phases]
    assert any(event.a == ids[1] for event in events)  # the ground


def test_shapes_of_all_kinds_are_taken(client: tessera.Client) -> None:
    client.load(flat_world(), replace=True)
    hull = tessera.convex_hull([(0, 0, 1), (1, 0, -1), (-1, 1, -1), (-1, -1, -1)])
    dumbbell = tessera.compound([(tessera.sphere(0.5), (-1, 0, 0)), (tessera.sphere(0.5), (1, 0, 0))])
    assert tessera.bounding_radius(dumbbell) == 1.5
    for name, shape in {"hull": hull, "dumbbell": dumbbell}.items():
        client.spawn(tessera.Body(name, shape, 5, (0, 0, 3 if name == "hull" else 6)))
    slope = tessera.triangle_mesh([(0, 0, 0), (5, 0, 1), (0, 5, 0)], [(0, 1, 2)])
    hills = tessera.height_field([[0.0, 1.0, 0.0], [0.0, 0.5, 0.0]], 2, 3)
    for n, shape in enumerate((slope, hills)):
        client.spawn(
            tessera.Body(f"terrain {n}", shape, position=(20, 20 * n, 0), motion=tessera.Motion.STATIC)
        )
    client.step(10)
    hit = client.raycast((20, 20, 5), (0, 0, -1))
    assert hit is not None and hit.name == "terrain 1"
