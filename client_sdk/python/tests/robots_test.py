"""Robots of 17 parts: spawned and reset in one call each, beside others, on any number of servers, and where one of
these is killed. With TESSERA_ROBOTS=256, of so many robots; `pytest -s` shows how long the calls take.
"""

from __future__ import annotations

import math
import os
import signal
import time

import numpy as np
import pytest
from conftest import PATIENCE_S
from recovery_test import SERVER, processes

import tessera
from tessera import commands
from tessera.position import Floats

LEGS = 4
LINKS = 4  # of a leg
ROBOTS = int(os.environ.get("TESSERA_ROBOTS", 16))
ROW = 16  # robots
ALL_S = PATIENCE_S * max(1, ROBOTS / 16)  # for what takes longer, the more there are
APART = 2.0  # m
SECTOR = 8.0  # m
HALF = math.sqrt(0.5)


def robot() -> tessera.World:
    """A trunk on four legs of four links, which servos hold straight, with its feet at z = 0.1 m."""
    model = tessera.World("robot", tessera.Settings(sector_size=SECTOR))
    model.add(tessera.Body("trunk", tessera.box(0.6, 0.6, 0.2), 10, (0, 0, 1.0)))
    for leg in range(LEGS):
        x, y = 0.28 * (leg % 2 * 2 - 1), 0.28 * (leg // 2 * 2 - 1)
        for link in range(LINKS):
            top = 0.9 - 0.2 * link
            name = f"leg{leg}_{link}"
            model.add(tessera.Body(name, tessera.capsule(0.05, 0.1), 1, (x, y, top - 0.1)))
            model.add_joint(
                tessera.Joint(
                    tessera.JointType.REVOLUTE,
                    child=name,
                    parent=f"leg{leg}_{link - 1}" if link else "trunk",
                    name=f"joint{leg}_{link}",
                    in_parent=(0, 0, -0.1) if link else (x, y, -0.1),
                    in_parent_turned=(0, 0, HALF, HALF),
                    in_child=(0, 0, 0.1),
                    in_child_turned=(0, 0, HALF, HALF),
                    axes=[tessera.Axis(lower=-1, upper=1, effort_max=200)],
                    drives=[tessera.Drive(tessera.DriveMode.SERVO, 0, stiffness=800, damping=20)],
                )
            )
    return model


def field() -> tessera.World:
    """A plane on which nothing falls asleep."""
    world = tessera.World("field", tessera.Settings(sector_size=SECTOR, sleep_after=0))
    world.add(tessera.Body("ground", tessera.plane(), motion=tessera.Motion.STATIC))
    return world


def place(number: int) -> tuple[float, float]:
    return APART * (number % ROW), APART * (number // ROW)


def spawned(count: int) -> list[commands.Command]:
    """That many robots in rows, as one list."""
    return [commands.spawn(robot(), f"r{n}::", (*place(n), 0)) for n in range(count)]


def reset(number: int) -> commands.Command:
    """The robot is where it began, straight, and at rest."""
    trunk = commands.PlacedBody(f"r{number}::trunk", (*place(number), 1.0))
    joints = [f"r{number}::joint{leg}_{link}" for leg in range(LEGS) for link in range(LINKS)]
    return commands.set_state([trunk], [commands.PlacedJoint(joint) for joint in joints])


def motion(client: tessera.Client, prefix: str) -> Floats:
    """States of the bodies of a robot, without their ids."""
    states = client.body_states(prefix=prefix)
    assert len(states) == 1 + LEGS * LINKS
    of = (states.sectors, states.local, states.orientations, states.linear_velocities, states.angular_velocities)
    return np.hstack(of)


def course(servers: int, kill: bool = False) -> str:
    """The hash after robots have run, one was spawned beside them, and one was pushed over and reset while a server
    may be killed.
    """
    with tessera.Cluster(servers=servers, threads=1) as cluster, cluster.connect() as client:
        client.load(field())
        began = time.monotonic()
        client.apply(spawned(ROBOTS), timeout=ALL_S)
        took = [time.monotonic() - began]
        client.step(60, timeout=ALL_S)
        stands = motion(client, "r3::")
        began = time.monotonic()
        client.spawn(robot(), "late::", (0, -3, 0))
        took.append(time.monotonic() - began)
        client.apply_impulse("r3::trunk", (0, 40, 20))
        client.step(60, timeout=ALL_S)
        assert not np.allclose(motion(client, "r3::"), stands, rtol=0, atol=0.1)
        began = time.monotonic()
        client.apply([reset(3)])
        took.append(time.monotonic() - began)
        stepped = client.send(ticks=60)
        if kill:
            os.kill(processes(cluster, SERVER)[0], signal.SIGKILL)
        stepped.result(ALL_S)
        assert np.array_equal(motion(client, "r3::"), stands)
        for trunk in ("r2::trunk", "late::trunk"):
            height = client.body_states(prefix=trunk).local[0][2]
            assert height == pytest.approx(0.9, abs=0.02), trunk
        assert client.status().recoveries == kill
        spawn_all, spawn_one, reset_one = (1000 * s for s in took)
        print(
            f"{ROBOTS} robots on {servers} servers: all spawned in {spawn_all:.0f} ms, one more in {spawn_one:.1f} ms, "
            f"one reset in {reset_one:.1f} ms"
        )
        return client.hash().hash


def test_robots_are_spawned_and_reset_beside_others() -> None:
    alone = course(1)
    assert course(2) == alone
    assert course(4) == alone
    assert course(2, kill=True) == alone


def test_a_spawned_robot_is_as_one_that_was_loaded(client: tessera.Client) -> None:
    world = field()
    base = robot().message
    for shape in base.shapes:
        world.message.shapes.append(shape)
    for body in base.bodies:
        loaded = world.message.bodies.add()
        loaded.CopyFrom(body)
        loaded.name = f"r0::{body.name}"
    for joint in base.joints:
        added = world.message.joints.add()
        added.CopyFrom(joint)
        added.name = f"r0::{joint.name}"
        added.properties.parent += 1  # the ground comes first
        added.properties.child += 1
    for body in world.message.bodies[1:]:
        body.properties.shape += 1
    client.load(world, replace=True)
    client.step(120)
    of_load, stands = client.hash().hash, motion(client, "r0::")
    client.load(field(), replace=True)
    client.apply(spawned(1))
    client.step(120)
    assert client.hash().hash == of_load
    client.load(field(), replace=True)
    client.resume()
    tick = client.apply(spawned(1)).tick
    client.step(tick - 1 + 120 - client.pause())
    assert np.array_equal(motion(client, "r0::"), stands)
