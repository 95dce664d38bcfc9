"""Recordings of a real cluster: all that was streamed is in them, for Python and for the field's tools."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import PATIENCE_S, flat_world

import tessera
from tessera.frame import BodyFrame
from tessera.record import Recorder, Recording, read

FAR = 2**62
READER = Path(__file__).parent / "mcap" / "read.mjs"


def falling_world(sector: tessera.position.Sector = (0, 0, 0)) -> tessera.World:
    """Balls and crates that fall on a plane, in four sectors on two servers, and a wall."""
    world = tessera.World("falling", tessera.Settings(sector_size=8), sector)

    def at(x: float, y: float, z: float) -> tessera.WorldPosition:
        return tessera.WorldPosition((x, y, z), sector)

    world.add(tessera.Body("ground", tessera.plane(), position=at(0, 0, 0), motion=tessera.Motion.STATIC))
    wall = tessera.box(0.2, 4, 4)
    world.add(tessera.Body("wall", wall, position=at(25, 0, 2), motion=tessera.Motion.STATIC))
    for n, x in enumerate((-20.0, -4.0, 4.0, 20.0)):
        world.add(tessera.Body(f"ball {n}", tessera.sphere(0.5), 1, at(x, 0, 0.8), linear_velocity=(3, 0, 0)))
        world.add(tessera.Body(f"crate {n}", tessera.box(1, 1, 1), 1, at(x, 2, 1.5)))
    return world


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "run.mcap"


def same(a: BodyFrame, b: BodyFrame) -> bool:
    """Whether two frames have the same bits."""
    return all(np.array_equal(getattr(a, field.name), getattr(b, field.name)) for field in fields(BodyFrame))


def by_foxglove(path: Path, *options: str) -> Any:
    """The recording as the libraries read it that Foxglove reads it with."""
    if "TESSERA_MCAP_PACKAGES" not in os.environ:
        pytest.skip("TESSERA_MCAP_PACKAGES does not name the npm packages of tests/mcap")
    node = shutil.which("node")
    assert node is not None
    done = subprocess.run([node, READER, path, *options], capture_output=True, check=True)
    return json.loads(done.stdout)


def record(client: tessera.Client, path: Path, ticks: int, **options: Any) -> None:
    with Recorder(client, path, **options) as recorder:
        client.step(ticks)
        recorder.run(ticks)


def test_every_tick_is_there_as_it_was_streamed(client: tessera.Client, path: Path) -> None:
    client.load(falling_world(), replace=True)
    with Recorder(client, path) as recorder, client.watch_bodies(complete=True) as bodies, client.watch_contacts(
        persisting=True
    ) as contacts:
        client.step(90)
        recorder.run(90)
        assert recorder.count == 91
        frames = [bodies.next(PATIENCE_S) for _ in range(91)]
        touching = [contacts.next(PATIENCE_S) for _ in range(91)]
    with read(path) as recording:
        assert recording.is_whole
        assert recording.ticks.tolist() == list(range(91))
        assert all(same(recording.frame(frame.tick), frame) for frame in frames)
        assert all(same(*both) for both in zip(recording.frames(30, 60), frames[30:60], strict=True))
        assert all(recording.contacts(frame.tick) == frame for frame in touching[1:])
        assert any(frame.contacts for frame in touching)
        with pytest.raises(KeyError):
            recording.frame(91)


def test_what_is_said_of_the_world(client: tessera.Client, path: Path) -> None:
    client.load(falling_world(), replace=True)
    record(client, path, 60)
    with read(path) as recording:
        assert recording.world == "falling"
        assert recording.settings == client.status().settings
        assert recording.every_ticks == 1
        assert [(status.tick, status.world) for status in recording.statuses()] == [(60, "falling")] * 2
        assert recording.find("ball 2").id == client.find("ball 2").id
        (part,) = recording.shapes[recording.find("ball 2").properties.shape].parts
        assert part.geometry == tessera.sphere(0.5).parts[0].geometry
        statics = recording.static_bodies(0)
        assert [recording.bodies[body].name for body in statics.ids] == ["ground", "wall"]
        assert statics.local.tolist() == [[0, 0, 0], [1, 0, 2]]
        with pytest.raises(tessera.NotFound, match="nobody"):
            recording.find("nobody")


def test_trajectory_is_that_of_the_client(client: tessera.Client, path: Path) -> None:
    client.load(falling_world(), replace=True)
    names = ["ball 0", "crate 3"]
    with Recorder(client, path) as recorder:
        there = client.trajectory(names, 60)
        recorder.run(60)
    with read(path) as recording:
        here = recording.trajectory(names)
        assert np.array_equal(here.time, there.time)
        assert np.array_equal(here.ids, there.ids)
        assert np.array_equal(here.relative_to(), there.relative_to())
        assert recording.trajectory("ball 0", 20, 30).ticks.tolist() == list(range(20, 30))
        with pytest.raises(tessera.NotFound):
            recording.trajectory("ground")
        with pytest.raises(tessera.InvalidArgument, match="no tick from 61"):
            recording.trajectory("ball 0", 61)


def test_foxglove_reads_it_by_its_index(client: tessera.Client, path: Path) -> None:
    client.load(falling_world(), replace=True)
    record(client, path, 90)
    found = by_foxglove(path)
    assert found["count"] == len(found["messages"])
    assert found["chunks"] == 2
    assert found["metadata"]["tessera"]["world"] == "falling"

    def of(topic: str) -> list[Any]:
        return [message for message in found["messages"] if message["topic"] == topic]

    bodies, tf, (scene,) = of("/tessera/bodies"), of("/tf"), of("/scene")
    ticks = range(91)
    for messages in (bodies, tf):
        assert [message["sequence"] for message in messages] == list(ticks)
        assert [message["time"] for message in messages] == [round(tick / 60 * 1e9) for tick in ticks]
    assert bodies[0]["encoding"] == "protobuf protobuf tessera.v1.BodyBatch"
    assert tf[0]["encoding"] == "protobuf protobuf foxglove.FrameTransforms"
    assert scene["encoding"] == "protobuf protobuf foxglove.SceneUpdate"
    assert [entity["frame_id"] for entity in scene["data"]["entities"][:3]] == ["ground", "wall", "ball 0"]
    assert scene["data"]["entities"][2]["spheres"][0]["size"] == {"x": 1, "y": 1, "z": 1}
    frames = [transform["child_frame_id"] for transform in of("/tf_static")[0]["data"]["transforms"]]
    assert frames == ["ground", "wall"]

    with read(path) as recording:
        for frame, message, moved in zip(recording.frames(), bodies, tf, strict=True):
            told = message["data"]["bodies"]
            assert [int(body["id"]) for body in told] == frame.ids.tolist()
            local = [list(body["pose"]["position"]["local"].values()) for body in told]
            assert local == frame.local.tolist()
            assert [body["asleep"] for body in told] == frame.asleep.tolist()
            places = [list(body["translation"].values()) for body in moved["data"]["transforms"]]
            assert places == frame.relative_to(recording.sector).tolist()


def test_foxglove_draws_what_programs_measure(client: tessera.Client, path: Path) -> None:
    world = tessera.World("sensors", tessera.Settings(sector_size=8))
    before = tessera.WorldPosition((3.5, 0, 0), (0, 0, 0))
    world.add(tessera.Body("wall", tessera.box(1, 8, 8), position=before, motion=tessera.Motion.STATIC))
    sensors = (
        tessera.Program("ranger", rays=3, angle=1.2, z=0.5, yaw=0.25),
        tessera.Program("ranger", rays=4, rows=2, angle=1, row_angle=0.5, plane=1).named("eye"),
        tessera.Program("satellite", latitude=48, longitude=11, noise=2),
        tessera.Program("imu"),
    )
    world.add(tessera.Body("robot::hull", tessera.sphere(0.2), 1, programs=sensors))
    client.load(world, replace=True)
    record(client, path, 30)
    found = by_foxglove(path)

    def of(topic: str) -> list[Any]:
        return [message for message in found["messages"] if message["topic"] == topic]

    scan, points, fix = of("/robot/hull/scan_0"), of("/robot/hull/eye"), of("/robot/hull/fix_2")
    assert scan[-1]["encoding"] == "protobuf protobuf foxglove.LaserScan"
    assert points[-1]["encoding"] == "protobuf protobuf foxglove.PointCloud"
    assert fix[-1]["encoding"] == "protobuf protobuf foxglove.LocationFix"
    assert scan[-1]["data"]["frame_id"] == "robot::hull"
    assert (scan[-1]["data"]["start_angle"], scan[-1]["data"]["end_angle"]) == (-0.6, 0.6)
    assert scan[-1]["data"]["ranges"] == pytest.approx([3 / np.cos(a + 0.25) for a in (-0.6, 0, 0.6)], 1e-4)
    assert scan[-1]["data"]["pose"]["position"] == {"x": 0, "y": 0, "z": 0.5}
    assert scan[-1]["data"]["pose"]["orientation"]["z"] == pytest.approx(np.sin(0.125))
    assert points[-1]["data"]["point_stride"] == 12
    assert [field["name"] for field in points[-1]["data"]["fields"]] == ["x", "y", "z"]
    data = points[-1]["data"]["data"]
    cloud = np.frombuffer(bytes(data[str(n)] for n in range(96)), "<f4").reshape(-1, 3)
    assert cloud[:, 0].tolist() == pytest.approx([3] * 8, 1e-4)  # the wall
    assert fix[-1]["data"]["latitude"] == pytest.approx(48, abs=1e-3)
    assert fix[-1]["data"]["position_covariance"] == [4, 0, 0, 0, 4, 0, 0, 0, 0]

    with read(path) as recording:
        programs = {program.kind: program for program in recording.programs(30)}
        assert programs["imu"].values["acceleration_z"] == pytest.approx(0, abs=1e-4)  # it falls
        assert programs["imu"].body_name == "robot::hull"


def test_far_away_the_same_is_drawn(client: tessera.Client, path: Path, tmp_path: Path) -> None:
    client.load(falling_world(), replace=True)
    record(client, path, 30)
    client.load(falling_world((FAR, -FAR, 7)), replace=True)
    record(client, tmp_path / "far.mcap", 30)
    assert read(path).sector == (0, 0, 0)
    assert read(tmp_path / "far.mcap").sector == (FAR, -FAR, 7)
    here, there = by_foxglove(path), by_foxglove(tmp_path / "far.mcap")

    def places(found: Any) -> list[Any]:
        return [
            [transform["translation"] for transform in message["data"]["transforms"]]
            for message in found["messages"]
            if message["topic"] in ("/tf", "/tf_static")
        ]

    assert places(here) == places(there)


def test_interrupted_recording_has_all_but_its_last_second(client: tessera.Client, path: Path) -> None:
    client.load(falling_world(), replace=True)
    with Recorder(client, path) as recorder:
        client.step(150)
        recorder.run(150)
        with read(path) as recording:
            assert not recording.is_whole
            assert recording.ticks.tolist() == list(range(120))
            cut = recording.frame(119)
        found = by_foxglove(path, "--stream")
        assert not found["isWhole"]
        tf = [message["sequence"] for message in found["messages"] if message["topic"] == "/tf"]
        assert tf == list(range(120))
    with read(path) as recording:
        assert recording.is_whole
        assert recording.ticks.tolist() == list(range(151))
        assert same(recording.frame(119), cut)


def test_bodies_come_and_go(client: tessera.Client, path: Path) -> None:
    client.load(falling_world(), replace=True)
    with Recorder(client, path) as recorder:
        client.step(5)
        recorder.run(5)
        client.spawn(tessera.Body("late", tessera.capsule(0.2, 1), 1, (0, 0, 5)))
        client.remove("ball 1")
        client.step(5)
        recorder.run(4)
    with read(path) as recording:
        late, ball = recording.find("late").id, recording.find("ball 1").id
        assert late not in recording.frame(5).ids and late in recording.frame(6).ids
        assert ball in recording.frame(5).ids and ball not in recording.frame(6).ids
    scenes = [message for message in by_foxglove(path)["messages"] if message["topic"] == "/scene"]
    assert [message["sequence"] for message in scenes] == [0, 6]
    drawn = [entity["id"] for entity in scenes[1]["data"]["entities"]]
    assert "late" in drawn and "wall" in drawn and "ball 1" not in drawn


def test_static_body_that_is_put_elsewhere_is_seen(client: tessera.Client, path: Path) -> None:
    client.load(falling_world(), replace=True)
    with Recorder(client, path) as recorder:
        client.step(30)
        recorder.run(30)
        client.teleport("wall", (25, 0, 3))
        client.step(60)
        recorder.run(59)
    with read(path) as recording:
        assert recording.static_bodies(59).local[1].tolist() == [1, 0, 2]
        assert recording.static_bodies(60).local[1].tolist() == [1, 0, 3]


def test_only_what_is_asked_for(client: tessera.Client, path: Path) -> None:
    client.load(falling_world(), replace=True)
    record(client, path, 90, every=20, bodies=["ball 0", "wall"], sector=(1, 2, 3))
    with read(path) as recording:
        ball = recording.find("ball 0").id
        assert recording.ticks.tolist() == list(range(0, 81, 20))
        assert {body.name for body in recording.bodies.values()} == {"ball 0", "wall"}
        assert all(len(frame) == 2 for frame in recording.frames())
        assert recording.sector == (1, 2, 3)
        assert recording.every_ticks == 20
        assert all(contact.b == ball for contact in recording.contacts(40).contacts)
    contacts = [m for m in by_foxglove(path)["messages"] if m["topic"] == "/tessera/contacts"]
    between = [m["data"]["contacts"] for m in contacts if m["sequence"] % 20]
    assert all(between)
    assert {contact["phase"] for told in between for contact in told} == {"BEGIN"}


def test_what_cannot_be_recorded_is_refused_and_no_file_made(client: tessera.Client, path: Path) -> None:
    client.load(falling_world(), replace=True)
    with pytest.raises(tessera.InvalidArgument, match="every: 0 is not within 1 to 1000"):
        Recorder(client, path, every=0)
    with pytest.raises(tessera.NotFound, match="nobody"):
        Recorder(client, path, bodies=["nobody"])
    with pytest.raises(ValueError):
        Recorder(client, path, sector=(2**63, 0, 0))
    client.unload()
    with pytest.raises(tessera.FailedPrecondition, match="no world is loaded"):
        Recorder(client, path)
    assert not path.exists()


class Command:
    """`tessera-record` as a process of its own, that has begun to record."""

    def __init__(self, cluster: tessera.Cluster, path: Path, *options: str) -> None:
        arguments = ["--connect", cluster.address, "--output", str(path), *options]
        self.process = subprocess.Popen(
            [sys.executable, "-m", "tessera.record", *arguments],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        assert self.process.stdout is not None
        assert self.process.stdout.readline().startswith(f"recording falling to {path}")

    def end(self) -> tuple[int, str, str]:
        said, complained = self.process.communicate(timeout=PATIENCE_S)
        return self.process.returncode, said, complained


@pytest.fixture
def falling(client: tessera.Client) -> Iterator[None]:
    client.load(falling_world(), replace=True)
    yield


@pytest.mark.usefixtures("falling")
def test_command_records_to_the_given_end(
    client: tessera.Client, cluster: tessera.Cluster, path: Path
) -> None:
    command = Command(cluster, path, "--seconds", "0.5", "--sector=-1,0,2^62", "--bodies", "ball 0", "ball 3")
    client.step(31)
    code, said, complained = command.end()
    assert (code, complained) == (0, "")
    assert said.startswith("recorded 31 ticks")
    with read(path) as recording:
        assert recording.is_whole
        assert recording.ticks.tolist() == list(range(31))
        assert recording.sector == (-1, 0, 2**62)
        assert len(recording.frame(30)) == 2


@pytest.mark.usefixtures("falling")
@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM])
def test_command_makes_the_file_whole_when_it_is_interrupted(
    client: tessera.Client, cluster: tessera.Cluster, path: Path, how: signal.Signals
) -> None:
    command = Command(cluster, path)
    client.step(60)
    command.process.send_signal(how)
    code, said, complained = command.end()
    assert (code, complained) == (0, "")
    with read(path) as recording:
        assert recording.is_whole
        assert recording.ticks.tolist() == list(range(len(recording)))
        assert said.startswith(f"recorded {len(recording)} ticks")


@pytest.mark.usefixtures("falling")
def test_command_says_when_the_world_ends_and_keeps_what_it_has(
    client: tessera.Client, cluster: tessera.Cluster, path: Path
) -> None:
    command = Command(cluster, path)
    client.load(falling_world(), replace=True)
    code, said, complained = command.end()
    assert (code, said) == (1, "")
    assert complained.startswith("tessera-record: ")
    with read(path) as recording:
        assert recording.is_whole
        assert len(recording) <= 1


def test_command_refuses_with_a_reason(cluster: tessera.Cluster, path: Path) -> None:
    def run(*arguments: str) -> tuple[int, str]:
        command = [sys.executable, "-m", "tessera.record", *arguments]
        done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S)
        return done.returncode, done.stdout + done.stderr

    code, said = run("--help")
    assert code == 0 and "tessera-record --output run.mcap --seconds 2" in said
    code, said = run("--output", str(path), "--ticks", "5", "--seconds", "1")
    assert code == 2 and "not allowed with" in said
    code, said = run("--output", str(path), "--ticks", "0")
    assert code == 2 and "--ticks: 0 is not above 0" in said
    code, said = run("--output", str(path), "--sector", "1,2")
    assert code == 2 and "--sector" in said
    path.write_text("precious")
    code, said = run("--output", str(path), "--connect", cluster.address)
    assert code == 1 and "run.mcap" in said
    with pytest.raises(tessera.InvalidArgument, match="run.mcap"):
        Recording(path)
