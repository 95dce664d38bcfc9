"""A world in this process: the bits of a cluster, states, copies, and clients that come in."""

from __future__ import annotations

import gzip
import json
import pickle
import signal
import subprocess
import sys
import urllib.request
from pathlib import Path

import numpy as np
import pytest
from conftest import WORLDS, flat_world

import tessera
import tessera.record
from tessera import program

TOWER = WORLDS / "tower.sdf"


def towers(sector_size: float = 8) -> tessera.World:
    """Four towers on and beside the borders of sectors."""
    world = flat_world(sector_size)
    for tower in range(4):
        for n in range(5):
            position = (tower * 8 - 12 + 0.1 * n, 0.05 * n, n + 0.5)
            world.add(tessera.Body(f"box_{tower}_{n}", tessera.box(1, 1, 1), mass=100, position=position))
    return world


def test_world_has_the_hash_of_the_command_line(tmp_path: Path) -> None:
    told = tmp_path / "run.json"
    program.run("run", str(TOWER), "--servers", "2", "--seconds", "1", "--json", str(told))
    with tessera.Simulation(TOWER) as simulation:
        simulation.step(60)
        assert simulation.hash().hash == json.loads(told.read_text())["world_hash"]


@pytest.mark.parametrize(("servers", "threads"), [(1, 2), (2, 1), (4, 1)])
def test_bits_are_the_same_for_any_number_of_servers(servers: int, threads: int) -> None:
    alone = tessera.Simulation(towers())
    divided = tessera.Simulation(towers(), servers=servers, threads=threads)
    for simulation in (alone, divided):
        simulation.apply_impulse("box_1_4", (300, 0, 0))
        simulation.step(90)
    assert len(divided.status().servers) == servers
    assert divided.hash() == alone.hash()


def test_state_goes_on_with_the_same_bits() -> None:
    simulation = tessera.Simulation(towers())
    simulation.apply_impulse("box_0_4", (300, 0, 0))
    simulation.step(20)
    state = simulation.state()
    simulation.step(40)
    expected = simulation.hash()
    simulation.restore(state, replace=True)
    assert simulation.status().tick == 20
    simulation.step(40)
    assert simulation.hash() == expected
    with pytest.raises(tessera.DataLoss):
        simulation.restore(state[:-1], replace=True)
    assert simulation.hash() == expected  # the world is still there


def test_world_is_a_world_or_a_path() -> None:
    with pytest.raises(TypeError, match="world must be a World or the path of a file, not int"):
        tessera.Simulation(42)  # type: ignore[arg-type]


def test_copies_go_their_own_ways() -> None:
    simulation = tessera.Simulation(towers())
    simulation.step(10)
    same, pushed = simulation.copy(), pickle.loads(pickle.dumps(simulation))
    pushed.apply_impulse("box_0_4", (300, 0, 0))
    for one in (simulation, same, pushed):
        one.step(30)
    assert same.hash() == simulation.hash()
    assert pushed.hash() != simulation.hash()


def test_momentum_and_energy_are_those_of_mechanics() -> None:
    world = tessera.World("free", tessera.Settings(sector_size=16))
    turned = (0, 0, 2**-0.5, 2**-0.5)
    for name, x in (("left", -10.0), ("right", 10.0)):
        world.add(
            tessera.Body(
                name,
                tessera.box(1, 2, 3),
                mass=2,
                position=(x, 0, 0),
                orientation=turned,
                linear_velocity=(0, x / 10, 3),
                angular_velocity=(0.1, 0.2, 0.3),
            )
        )
    simulation = tessera.Simulation(world)
    mechanics = tessera.Mechanics(simulation)
    first = mechanics.sums()
    moments = np.array([10, 13, 5]) * 2 / 12  # of the turned box, along the world's axes
    assert first.mass == 4
    assert first.momentum == pytest.approx([0, 0, 12])
    assert first.kinetic == pytest.approx(2 * (2 * 10 / 2 + (moments * [0.01, 0.04, 0.09]).sum() / 2))
    assert first.angular_momentum == pytest.approx(2 * moments * [0.1, 0.2, 0.3] + [0, 0, 2 * 2 * 10])
    simulation.step(60)
    after = mechanics.sums()
    assert after.energy == pytest.approx(first.energy, rel=1e-3)
    assert after.angular_momentum == pytest.approx(first.angular_momentum, rel=1e-5)
    assert after.centre == pytest.approx([0, 0, 3 - 9.81 / 2], rel=0.02)
    with pytest.raises(tessera.NotFound, match="nobody"):
        tessera.Mechanics(simulation, "nobody")


def test_trajectory_needs_no_stream() -> None:
    simulation = tessera.Simulation(towers())
    simulation.step(2)
    path = simulation.trajectory(["box_0_4", "box_3_0"], 10, every_ticks=4)
    assert path.ticks.tolist() == [2, 4, 8, 12]
    assert path.local.shape == (4, 2, 3)
    assert simulation.status().tick == 12


def test_streams_are_those_of_a_cluster() -> None:
    with tessera.Simulation(towers(), servers=2) as simulation:
        with simulation.watch_bodies(complete=True) as stream:
            assert len(stream.next(60)) == 20
            simulation.step(3)
            frames = [stream.next(60) for _ in range(3)]
        assert [frame.tick for frame in frames] == [1, 2, 3]


def test_clients_come_in() -> None:
    with tessera.Simulation(towers()) as simulation:
        simulation.step(5)
        with tessera.Client(simulation.serve()) as client:
            assert client.hash() == simulation.hash()
            client.step(5)
            assert simulation.status().tick == 10
            with pytest.raises(tessera.Unavailable, match="in use"):
                tessera.Simulation(towers()).serve(simulation.serve())
    with pytest.raises(tessera.FailedPrecondition, match="whoever reaches 0.0.0.0:0 would control the world"):
        tessera.Simulation().serve("0.0.0.0:0")


def test_world_is_shown() -> None:
    with tessera.Simulation(towers()) as simulation, simulation.show() as shown:
        with urllib.request.urlopen(shown.url, timeout=60) as page:
            assert b"<title>" in gzip.decompress(page.read())
        assert shown.url in shown._repr_html_()


def test_world_is_recorded(tmp_path: Path) -> None:
    pytest.importorskip("zstandard")
    with tessera.Simulation(towers()) as simulation:
        with simulation.record(tmp_path / "run.mcap") as recorder:
            simulation.step(5)
            recorder.run(ticks=5)
        with tessera.record.read(tmp_path / "run.mcap") as recording:
            assert len(recording.frame(5)) == 20


def test_world_runs_by_itself_until_it_is_paused() -> None:
    simulation = tessera.Simulation(towers())
    simulation.resume(0)
    while simulation.status().tick < 20:
        pass
    tick = simulation.pause()
    assert simulation.status().tick == tick >= 20


def test_futures_have_the_answers() -> None:
    simulation = tessera.Simulation(towers())
    answers = simulation.send(ticks=3).result()
    assert answers.tick == 3
    failed = simulation.send([tessera.commands.remove("nobody")])
    assert isinstance(failed.exception(), tessera.NotFound)


def test_a_long_step_ends_when_it_is_interrupted() -> None:
    simulation = tessera.Simulation(towers())

    def interrupt(number: int, frame: object) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGALRM, interrupt)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.05)
        with pytest.raises(KeyboardInterrupt):
            simulation.step(1_000_000_000)
    finally:
        signal.signal(signal.SIGALRM, before)
    tick = simulation.status().tick
    assert simulation.step() == tick + 1


def test_errors_are_those_of_a_cluster() -> None:
    simulation = tessera.Simulation(towers())
    with pytest.raises(tessera.AlreadyExists):
        simulation.load(towers())
    with pytest.raises(tessera.NotFound, match="nobody"):
        simulation.set_velocity("nobody", (0, 0, 0))
    with pytest.raises(tessera.InvalidArgument, match="threads = 0"):
        tessera.Simulation(threads=0)
    with pytest.raises(tessera.InvalidArgument, match="ticks = -1 must be at least 0"):
        simulation.step(-1)
    with pytest.raises(tessera.NotFound, match="it is a folder, not a world file"):
        tessera.Simulation(WORLDS)
    with pytest.raises(tessera.NotFound, match="nowhere.sdf"):
        tessera.Simulation("nowhere.sdf")
    with pytest.raises(tessera.FailedPrecondition, match="other precision"):
        tessera.Simulation(towers(), precision=tessera.Precision.FLOAT64)
    simulation.close()
    with pytest.raises(tessera.Cancelled):
        simulation.step()


def test_both_precisions_are_there() -> None:
    code = f"import tessera; s = tessera.Simulation({str(TOWER)!r}, precision=tessera.Precision.FLOAT64); s.step(60); print(s.hash())"
    first = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert first.startswith("HashAt(tick=60")


def test_package_is_imported_without_grpc() -> None:
    code = "import sys, tessera; assert 'grpc' not in sys.modules; tessera.Client; assert 'grpc' in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)
    for name in tessera.__all__:
        assert getattr(tessera, name) is not None
        assert name in dir(tessera)


def test_many_branches_of_one_state() -> None:
    simulation = tessera.Simulation(towers())
    simulation.step(5)
    state = simulation.state()
    hashes = []
    for push in [*np.linspace(-500, 500, 50), -500]:
        simulation.restore(state, replace=True)
        simulation.apply_impulse("box_1_4", (push, 0, 0))
        simulation.step(10)
        hashes.append(simulation.hash().hash)
    assert len(set(hashes)) == 50
    assert hashes[-1] == hashes[0]
