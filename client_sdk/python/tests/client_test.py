"""Commands and questions, with their errors."""

from __future__ import annotations

import gc
import pathlib
import subprocess
import weakref

import numpy as np
import pytest
from conftest import flat_world

import tessera
from tessera import program

SECTOR = 10.0


@pytest.fixture(autouse=True)
def world(client: tessera.Client) -> None:
    """Five crates, 3 m high in five sectors, without gravity."""
    world = flat_world(SECTOR, gravity=(0, 0, 0))
    for i in range(-2, 3):
        world.add(
            tessera.Body(f"crate_{i}", tessera.box(1, 1, 1), 10, tessera.WorldPosition((0, 0, 3), (i, 0, 0)))
        )
    summary = client.load(world, replace=True)
    assert (summary.bodies, summary.servers) == (6, 2)


def test_spawned_body_is_found_moved_and_removed(client: tessera.Client) -> None:
    ball = client.spawn(
        tessera.Body("ball", tessera.sphere(0.5), 2, tessera.WorldPosition((0, 0, 4), (5, 0, 0)))
    )
    assert client.find("ball").id == ball.id
    assert client.find("ball").properties.mass == 2
    assert client.apply_impulse(ball.id, (4, 0, 0)) == 1
    path = client.trajectory("ball", 60)
    assert path.ids.tolist() == [ball.id]
    assert path.ticks.tolist() == list(range(1, 61))
    assert path.time[-1] == pytest.approx(1)
    assert path.relative_to()[-1, 0] == pytest.approx((2, 0, 4), abs=0.05)
    assert path.sectors[-1, 0].tolist() == [5, 0, 0]
    assert np.allclose(path.linear_velocities[1:, 0], (2, 0, 0))
    client.remove("ball")
    client.step()
    with pytest.raises(tessera.NotFound, match="ball"):
        client.find("ball")
    with pytest.raises(tessera.NotFound):
        client.remove(ball.id)


def test_trajectory_of_many_in_strides_and_over_the_length_of_a_queue(client: tessera.Client) -> None:
    client.set_velocity("crate_0", (0, 0, 1), (0, 0, 1))
    client.apply_force("crate_1", (0, 0, 600), (0, 0, 1))
    path = client.trajectory([f"crate_{i}" for i in range(-2, 3)], 300, every_ticks=50)
    assert path.ticks.tolist() == list(range(0, 301, 50))
    assert path.local.shape == (7, 5, 3)
    # A force acts for a tick, in which its body reaches 1 m/s.
    pushed = 3 + 0.5 / 60 + 299 / 60
    assert path.relative_to((0, 0, 0))[-1, :, 2] == pytest.approx((3, 3, 8, pushed, 3), abs=1e-3)


def test_teleport_far_away_and_back(client: tessera.Client) -> None:
    far = (2**62, -(2**62), 5)
    client.teleport("crate_0", tessera.WorldPosition((1, 2, 3), far), linear_velocity=(0, 0, 1))
    path = client.trajectory("crate_0", 60)
    assert path.sectors[-1, 0].tolist() == list(far)
    assert path.relative_to(far)[-1, 0] == pytest.approx((1, 2, 4), abs=1e-4)


def test_teleport_keeps_what_it_is_not_told(client: tessera.Client) -> None:
    turned = (0.6, 0.0, 0.0, 0.8)
    top = tessera.Body("top", tessera.box(1, 1, 1), position=(0, 0, 30), orientation=turned)
    client.spawn(top)
    client.step()
    client.set_velocity("top", (1, 0, 0), (0, 0, 0))
    client.teleport("top", (5, 0, 40), angular_velocity=(0, 0, 0))
    path = client.trajectory("top", 1)
    assert path.relative_to((0, 0, 0))[-1, 0, 0] == pytest.approx(5 + 1 / 60, abs=1e-3)
    assert path.orientations[-1, 0] == pytest.approx(turned, abs=1e-5)


def test_kinematic_body_goes_where_it_is_told(client: tessera.Client) -> None:
    lift = tessera.Body("lift", tessera.box(2, 2, 0.2), position=(0, 0, 1), motion=tessera.Motion.KINEMATIC)
    client.spawn(lift)
    client.step()
    client.set_kinematic_target("lift", (0, 0, 1.1))
    assert client.trajectory("lift", 1).local[-1, 0, 2] == pytest.approx(1.1)


def test_ray_and_probe_reach_over_sectors_and_servers(client: tessera.Client) -> None:
    hit = client.raycast(tessera.WorldPosition((0, 0, 3), (-1, 0, 0)), (2, 0, 0))
    assert hit is not None
    assert hit.name == "crate_0"
    assert hit.distance == pytest.approx(9.5, abs=0.05)
    hit = client.raycast(tessera.WorldPosition((2, 0, 3), (0, 0, 0)), (2, 0, 0))
    assert hit is not None
    assert (hit.name, hit.position.sector) == ("crate_1", (1, 0, 0))
    assert hit.distance == pytest.approx(7.5, abs=0.05)
    assert hit.normal == pytest.approx((-1, 0, 0), abs=1e-3)
    assert client.raycast((2, 2, 3), (1, 0, 0)) is None

    nearest = client.near((1, 0, 3), reach=12)
    assert [body.name for body in nearest] == ["crate_0", "ground", "crate_1", "crate_-1"]
    assert nearest[0].distance == pytest.approx(0.5, abs=0.01)
    assert len(client.near((0, 0, 3), probe=tessera.box(9, 1, 1))) == 1


def test_joints_tie_and_drive(client: tessera.Client) -> None:
    slide = tessera.Joint(
        tessera.JointType.PRISMATIC,
        child="crate_0",
        name="slide",
        in_parent=(0, 0, 3),
        axes=[tessera.Axis(lower=-1, upper=1, effort_max=1e4)],
    )
    added = client.add_joint(slide)
    client.set_drive("slide", tessera.Drive(tessera.DriveMode.VELOCITY, 0.5))
    path = client.trajectory("crate_0", 60)
    assert path.local[-1, 0] == pytest.approx((0.5, 0, 3), abs=0.02)
    client.set_drive("slide", tessera.Drive(tessera.DriveMode.SERVO, -0.5, stiffness=4e4, damping=4e3))
    path = client.trajectory("crate_0", 120)
    assert path.local[-1, 0] == pytest.approx((-0.5, 0, 3), abs=0.02)
    (found,) = client.find_joints()
    assert (found.id, found.name, found.parent, found.child) == (added.id, "slide", "", "crate_0")
    client.remove_joint(added.id)
    client.step()
    assert client.find_joints("slide") == []


def test_snapshot_is_gone_on_from(client: tessera.Client, tmp_path: pathlib.Path) -> None:
    file = tmp_path / "a.snapshot"
    client.apply_impulse("crate_0", (3, 2, 1))
    client.step(20)
    assert client.snapshot(file) == 20
    client.step(20)
    expected = client.hash()
    assert client.restore(file, replace=True).bodies == 6
    assert client.status().tick == 20
    client.step(20)
    assert client.hash() == expected
    file.write_bytes(file.read_bytes()[:-1])
    with pytest.raises(tessera.DataLoss, match="cut off"):
        client.restore(file, replace=True)
    with pytest.raises(FileNotFoundError):
        client.restore(tmp_path / "none", replace=True)
    assert client.hash() == expected


def test_inertia_is_that_of_the_command_line(client: tessera.Client, cluster: tessera.Cluster) -> None:
    shapes = {
        "box:1,2,3": tessera.box(1, 2, 3),
        "sphere:0.7": tessera.sphere(0.7),
        "capsule:0.3,1.2": tessera.capsule(0.3, 1.2),
        "cylinder:0.4,1.5": tessera.cylinder(0.4, 1.5),
        "ellipsoid:0.5,0.6,0.7": tessera.ellipsoid(0.5, 0.6, 0.7),
    }
    for text, shape in shapes.items():
        here = client.spawn(tessera.Body(f"here {text}", shape, 3, (0, 0, 40)))
        subprocess.run(
            [
                program.find(),
                "spawn",
                "--connect",
                cluster.address,
                "--name",
                f"there {text}",
                "--shape",
                text,
                "--mass",
                "3",
                "--at",
                "0,0,50",
            ],
            check=True,
            capture_output=True,
        )
        there = client.find(f"there {text}")
        ours = client.find(f"here {text}").properties.inertia
        assert here.id < there.id
        assert [ours.x, ours.y, ours.z] == pytest.approx(
            [there.properties.inertia.x, there.properties.inertia.y, there.properties.inertia.z], rel=1e-12
        )


def test_what_cannot_be_done_is_refused_and_the_world_unchanged(client: tessera.Client) -> None:
    before = client.hash()
    box = tessera.box(1, 1, 1)
    with pytest.raises(tessera.AlreadyExists, match="crate_0"):
        client.spawn(tessera.Body("crate_0", box))
    with pytest.raises(tessera.InvalidArgument, match="mass"):
        client.spawn(tessera.Body("a", box, mass=-1, inertia=(1, 1, 1)))
    with pytest.raises(tessera.InvalidArgument, match="30"):
        client.spawn(tessera.Body("b", tessera.box(30, 1, 1)))
    with pytest.raises(tessera.OutOfRange):
        client.spawn(tessera.Body("c", box, position=tessera.WorldPosition((100, 0, 0), (2**63 - 1, 0, 0))))
    with pytest.raises(tessera.NotFound, match="nobody"):
        client.set_velocity("nobody", (1, 0, 0))
    with pytest.raises(tessera.InvalidArgument):
        client.set_velocity("crate_0", (float("nan"), 0, 0))
    with pytest.raises(tessera.InvalidArgument):
        client.resume(-1)
    with pytest.raises(tessera.AlreadyExists):
        client.load(flat_world())
    with pytest.raises(ValueError, match="impulse: 3 numbers"):
        client.apply_impulse("crate_0", (1, 2))
    assert client.hash() == before
    assert client.status().state == "paused"


def test_client_that_nobody_has_is_closed(cluster: tessera.Cluster) -> None:
    client = cluster.connect()
    with pytest.raises(tessera.NotFound):
        client.remove("nobody")
    gone = weakref.ref(client)
    del client
    gc.collect()
    assert gone() is None


def test_nobody_there_is_an_error_that_names_the_address() -> None:
    with pytest.raises(tessera.Unavailable, match="127.0.0.1:1 within 0.2 s"):
        tessera.Client("127.0.0.1:1", timeout=0.2)
