"""Positions of joints follow from their bodies, wherever in the world and in whichever sectors these are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from conftest import PATIENCE_S, WORLDS, flat_world

import tessera
from tessera._proto import world_pb2
from tessera.frame import BodyFrame
from tessera.joint_stream import WatchedJoints
from tessera.position import pose_message, sector_message
from tessera.results import FoundJoint

SIZE = 16.0  # m, of a sector
FAR = 2**62
HALF = 0.5**0.5
ALONG_Z = (0.0, -HALF, 0.0, HALF)  # its x is z


def hinge() -> FoundJoint:
    """About z; its frame is 1 m along x from the parent, and 2 m against x from the child."""
    joint = world_pb2.Joint(
        properties=world_pb2.JointProperties(
            type=tessera.JointType.REVOLUTE.value,
            parent=1,
            child=2,
            in_parent=pose_message((1, 0, 0), ALONG_Z),
            in_child=pose_message((-2, 0, 0), ALONG_Z),
        )
    )
    return FoundJoint(7, "hinge", "a", "b", joint, child_centre=(0.5, 0, 0))


def bodies_at(sector: tuple[int, int, int]) -> BodyFrame:
    """The child is turned by 0.3 rad about the hinge and spins with 2 rad/s; a border lies between the two."""
    i, j, k = sector
    arm = np.array([np.cos(0.3), np.sin(0.3), 0])
    return BodyFrame(
        tick=5,
        ids=np.array([1, 2], dtype=np.uint64),
        sectors=np.array([sector, (i + 1, j, k)]),
        local=np.array([(6, 0, 0), np.array([7 - SIZE, 0, 0]) + 2 * arm]),
        orientations=np.array([(0, 0, 0, 1), (0, 0, np.sin(0.15), np.cos(0.15))]),
        linear_velocities=np.array([(0, 0, 0), np.cross([0, 0, 2], 2.5 * arm)]),  # of the centre of mass
        angular_velocities=np.array([(0.0, 0, 0), (0, 0, 2)]),
        asleep=np.array([False, True]),
        sector_size=SIZE,
    )


@pytest.mark.parametrize("sector", [(0, 0, 0), (FAR, -5, 9)])
def test_positions_follow_from_the_bodies(sector: tuple[int, int, int]) -> None:
    frame = WatchedJoints([hinge()]).frame(bodies_at(sector))
    assert (frame.tick, len(frame), frame.ids.tolist(), frame.asleep.tolist()) == (5, 1, [7], [True])
    assert frame.positions[0] == pytest.approx([0.3, np.nan], nan_ok=True)
    assert frame.rates[0] == pytest.approx([2, np.nan], nan_ok=True)
    assert frame.gaps[0] == pytest.approx(0, abs=1e-12)
    assert frame.twists[0] == pytest.approx(0, abs=1e-7)


def test_those_on_the_world_count_from_their_anchor() -> None:
    pin = hinge()
    pin.joint.properties.parent = 0
    pin.joint.properties.anchor.CopyFrom(sector_message((FAR, 0, 0)))
    pin.joint.properties.in_parent.position.x = 7
    bodies = bodies_at((FAR, 0, 0)).of([2])
    frame = WatchedJoints([pin]).frame(bodies)
    assert frame.positions[0, 0] == pytest.approx(0.3)
    assert frame.rates[0, 0] == pytest.approx(2)
    assert frame.gaps[0] == pytest.approx(0, abs=1e-12)


def test_they_need_both_bodies_and_come_in_the_order_given() -> None:
    other = replace(hinge(), id=3)
    watched = WatchedJoints([hinge(), other])
    assert watched.bodies.tolist() == [1, 2]
    bodies = bodies_at((0, 0, 0))
    assert watched.frame(bodies).ids.tolist() == [7, 3]
    assert len(watched.frame(bodies.of([1]))) == len(watched.frame(bodies.of([2]))) == 0
    assert len(watched.frame(bodies.of([]))) == 0
    with pytest.raises(tessera.InvalidArgument, match="joints: there must be at least one"):
        WatchedJoints([])


def mechanisms() -> tessera.World:
    """A joint of each type, on the world and on a body beyond a border, in motion."""
    world = flat_world(SIZE, gravity=(0.5, 0.3, -3))
    random = np.random.default_rng(7)
    for n, kind in enumerate(tessera.JointType):
        at = np.array([7.6, 4.0 * n, 6])
        turn = random.normal(size=4)
        for name, place in ((f"a{n}", at), (f"b{n}", at + (1, 0, 0))):
            world.add(tessera.Body(name, tessera.box(0.4, 0.3, 0.2), 2, place))
        frame = turn / np.linalg.norm(turn)
        of_links = (f"a{n}", None, at), (f"b{n}", f"a{n}", np.array([0.5, 0, 0]))
        for child, parent, in_parent in of_links:
            world.add_joint(
                tessera.Joint(
                    kind,
                    name=f"{child}::joint",
                    child=child,
                    parent=parent,
                    in_parent=in_parent,
                    in_child=(0, 0, 0) if parent is None else (-0.5, 0, 0),
                    in_parent_turned=frame,
                    in_child_turned=frame,
                    axes=[tessera.Axis(damping=0.1)] * {"FIXED": 0, "BALL": 0, "UNIVERSAL": 2}.get(kind.name, 1),
                    pitch=0.2 if kind is tessera.JointType.SCREW else 0,
                )
            )
    return world


def test_joints_of_all_types_are_as_the_cluster_says(client: tessera.Client) -> None:
    client.load(mechanisms(), replace=True)
    joints = client.find_joints()
    with client.watch_joints(joints, every_ticks=2) as stream:
        client.step(40)
        frames = [stream.next(PATIENCE_S) for _ in range(21)]
    assert [frame.tick for frame in frames] == list(range(0, 41, 2))
    expected = client.joint_states()
    last = frames[-1]
    assert last.ids.tolist() == expected.ids.tolist() == [joint.id for joint in joints]
    assert np.allclose(last.positions, expected.positions, rtol=0, atol=1e-9, equal_nan=True)
    assert np.allclose(last.rates, expected.rates, rtol=0, atol=1e-9, equal_nan=True)
    assert np.nanmax(np.abs(last.positions)) > 0.1
    assert max(frame.gaps.max() for frame in frames) < 0.01
    assert max(frame.twists.max() for frame in frames) < 0.01


def test_joints_that_are_removed_leave_the_frames(client: tessera.Client) -> None:
    client.load(WORLDS / "machines.sdf", replace=True)
    motors = client.find_joints("cart::")
    with client.watch_joints(motors) as stream:
        assert len(stream.next(PATIENCE_S)) == len(motors)
        client.remove(prefix="cart::")
        client.step()
        assert len(stream.next(PATIENCE_S)) == 0
    client.unload()
    with pytest.raises(tessera.FailedPrecondition, match="no world is loaded"):
        client.watch_joints(motors)
