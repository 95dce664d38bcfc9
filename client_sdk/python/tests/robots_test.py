"""Robots of 17 parts: spawned and reset in one call each, beside others, on any number of servers, and where one of
these is killed.
"""

from __future__ import annotations

import math
import os
import signal

import pytest
from conftest import PATIENCE_S
from recovery_test import SERVER, processes

import tessera
from tessera import commands

LEGS = 4
LINKS = 4  # of a leg
ROBOTS = 12
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


def spawned(count: int) -> list[commands.Command]:
    """That many robots in a row, as one list."""
    return [commands.spawn(robot(), f"r{n}::", (APART * n, 0, 0)) for n in range(count)]


def reset(number: int) -> commands.Command:
    """The robot is where it began, straight, and at rest."""
    trunk = commands.PlacedBody(f"r{number}::trunk", (APART * number, 0, 1.0))
    joints = [f"r{number}::joint{leg}_{link}" for leg in range(LEGS) for link in range(LINKS)]
    return commands.set_state([trunk], [commands.PlacedJoint(joint) for joint in joints])


def course(servers: int, kill: bool = False) -> str:
    """The hash after robots have run, one was spawned beside them, and one was pushed over and reset."""
    with tessera.Cluster(servers=servers, threads=1) as cluster, cluster.connect() as client:
        client.load(field())
        client.apply(spawned(ROBOTS))
        client.step(20)
        client.apply([commands.spawn(robot(), "late::", (0, 3, 0))])
        client.apply_impulse("r3::trunk", (0, 40, 20))
        client.step(60)
        if kill:
            os.kill(processes(cluster, SERVER)[0], signal.SIGKILL)
        client.run([reset(3)], timeout=PATIENCE_S)
        client.step(60, timeout=PATIENCE_S)
        for stands in ("r2::trunk", "r3::trunk", "late::trunk"):
            height = client.body_states(prefix=stands).local[0][2]
            assert height == pytest.approx(0.9, abs=0.02), stands
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
    of_load = client.hash().hash
    client.load(field(), replace=True)
    client.apply(spawned(1))
    client.step(120)
    assert client.hash().hash == of_load
