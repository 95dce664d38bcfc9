"""What functions of `tessera.commands` make, and what commands do to a world: together, or not at all."""

from __future__ import annotations

import math

import numpy as np
import pytest
from conftest import flat_world

import tessera
from tessera import commands, queries

SECTOR = 10.0


@pytest.fixture(autouse=True)
def world(client: tessera.Client) -> None:
    """Three crates, 3 m high in three sectors, without gravity."""
    world = flat_world(SECTOR, gravity=(0, 0, 0))
    for i in range(3):
        place = tessera.WorldPosition((0, 0, 3), (i, 0, 0))
        world.add(tessera.Body(f"crate_{i}", tessera.box(1, 1, 1), 10, place))
    client.load(world, replace=True)


def pendulum() -> tessera.World:
    """Two bars in a row along x, each 1 m long, on hinges about y, the first of which is at the origin."""
    model = tessera.World("pendulum")
    for n in range(2):
        model.add(tessera.Body(f"bar_{n}", tessera.box(0.9, 0.1, 0.1), position=(n + 0.5, 0, 0)))
        model.add_joint(
            tessera.Joint(
                tessera.JointType.REVOLUTE,
                child=f"bar_{n}",
                parent=f"bar_{n - 1}" if n else None,
                name=f"hinge_{n}",
                in_parent=(0.5 if n else 0.0, 0, 0),
                in_parent_turned=(0, 0, math.sqrt(0.5), math.sqrt(0.5)),
                in_child=(-0.5, 0, 0),
                in_child_turned=(0, 0, math.sqrt(0.5), math.sqrt(0.5)),
                axes=[tessera.Axis(effort_max=1e3)],
            )
        )
    return model


def test_ids_may_be_of_any_integer_type() -> None:
    same: list[tessera.BodyName] = [7, np.uint64(7), np.int32(7)]
    for body in same:
        assert commands.set_velocity(body, (1, 2, 3)).set_velocity.body.id == 7
    assert commands.set_velocity("seven", (1, 2, 3)).set_velocity.body.name == "seven"
    (drives,) = commands.set_drives(np.array([7, 8]), np.array([0.5, 0.25]), stiffness=[1, 2])
    assert list(drives.drive_joints.joints) == [7, 8]
    assert list(drives.drive_joints.targets) == [0.5, 0.25]
    assert list(drives.drive_joints.stiffness) == [1, 2]
    assert list(drives.drive_joints.efforts) == [0]
    some: list[tessera.JointName] = ["a", 8]
    named = commands.set_drives(some, 1, stiffness=[1, 2])
    assert [one.set_joint_drives.joint.WhichOneof("by") for one in named] == ["name", "id"]
    assert [one.set_joint_drives.drives[0].drive.stiffness for one in named] == [1, 2]


def test_arguments_of_another_shape_are_named() -> None:
    with pytest.raises(ValueError, match="linear: 3 numbers"):
        commands.set_velocity("crate_0", (1, 2))
    with pytest.raises(ValueError, match=r"targets: one number or 2 are expected, not an array of shape \(3,\)"):
        commands.set_drives([1, 2], [1, 2, 3])
    with pytest.raises(ValueError, match="body, prefix"):
        commands.remove()
    with pytest.raises(ValueError, match="body, prefix"):
        commands.remove("a", prefix="b")


def test_a_list_takes_effect_at_one_tick(client: tessera.Client) -> None:
    applied = client.apply(
        [
            commands.set_velocity("crate_0", (1, 0, 0)),
            commands.spawn(tessera.Body("ball", tessera.sphere(0.5), 2, (0, 0, 6))),
            commands.apply_impulse("ball", (0, 4, 0)),
        ]
    )
    (ball,) = applied.created
    assert (applied.tick, ball.tick, ball.command, len(ball.bodies), len(ball.joints)) == (1, 1, 1, 1, 0)
    answers = client.step(queries=[queries.body_states([ball.id]), queries.find_bodies("ball")])
    states, found = answers
    assert answers.tick == states.tick == 1
    assert states.linear_velocities.tolist() == [[0, 2, 0]]
    assert [body.id for body in found] == [ball.id]


def test_nothing_is_done_where_anything_is_wrong(client: tessera.Client) -> None:
    before = client.hash()
    wrong = [
        commands.set_velocity("crate_0", (1, 0, 0)),
        commands.remove(prefix="crate"),
        commands.set_velocity("crate_1", (1, 0, 0)),
    ]
    with pytest.raises(tessera.NotFound, match=r"commands\[2\] \(set_velocity\).*crate_1"):
        client.apply(wrong)
    with pytest.raises(tessera.InvalidArgument, match=r"queries\[1\] \(ray\).*length"):
        client.run(wrong[:1], 1, [queries.hash(), queries.ray((0, 0, 5), (0, 0, 1), -1)])
    assert client.hash() == before


def test_requests_are_sent_without_waiting(client: tessera.Client) -> None:
    ids = [client.find(f"crate_{i}").id for i in range(3)]
    sent = [client.send([commands.set_velocity(ids[n % 3], (n, 0, 0))]) for n in range(300)]
    stepped = client.send(ticks=1, queries=[queries.body_states(ids)])
    (states,) = stepped.result(30)
    assert states.linear_velocities[:, 0].tolist() == [297, 298, 299]
    assert {future.result(30).applied.tick for future in sent} == {1}
    with pytest.raises(tessera.NotFound, match="nobody"):
        client.send([commands.remove("nobody")]).result(30)


def test_a_model_is_spawned_placed_and_removed_in_one(client: tessera.Client) -> None:
    model = pendulum()
    turned = (0, 0, math.sqrt(0.5), math.sqrt(0.5))  # x comes to y
    first = client.spawn(model, "a::", tessera.WorldPosition((0, 0, 3), (0, 1, 0)), turned)
    second = client.spawn(model, prefix="b::")
    assert (len(first.bodies), len(first.joints), len(second.joints)) == (2, 2, 2)
    assert first.id == first.bodies[0]
    client.step(10)
    states = client.body_states(first.bodies)
    assert states.relative_to((0, 1, 0), SECTOR) == pytest.approx(np.array([[0, 0.5, 3], [0, 1.5, 3]]), abs=1e-3)
    assert [joint.name for joint in client.find_joints("b::")] == ["b::hinge_0", "b::hinge_1"]
    client.remove(prefix="a::")
    client.step()
    assert client.find_bodies("a::") == []
    assert len(client.joint_states()) == 2
    with pytest.raises(tessera.NotFound, match="a::"):
        client.remove(prefix="a::")


def test_a_robot_is_placed_with_its_joints(client: tessera.Client) -> None:
    arm = client.spawn(pendulum(), "arm::", (0, 0, 5))
    client.step(5)
    client.set_state(
        joints=[
            tessera.PlacedJoint(np.uint64(arm.joints[0]), math.pi / 2, 0.5),
            tessera.PlacedJoint("arm::hinge_1", [-math.pi / 2]),
        ]
    )
    client.step()
    states = client.joint_states(np.array(arm.joints))
    assert states.ids.tolist() == list(arm.joints)
    assert states.positions[:, 0] == pytest.approx([math.pi / 2, -math.pi / 2], abs=0.02)
    assert states.rates[0, 0] == pytest.approx(0.5, abs=0.05)
    assert np.isnan(states.positions[:, 1]).all()
    places = client.body_states(arm.bodies)
    assert places.relative_to((0, 0, 0), SECTOR) == pytest.approx(
        np.array([[0, 0, 4.5], [0.5, 0, 4]]), abs=0.03
    )
    client.set_state([tessera.PlacedBody("crate_0", (1, 2, 3), linear_velocity=(0, 0, 6))])
    client.step()
    assert client.body_states([client.find("crate_0").id]).local[0] == pytest.approx((1, 2, 3.1), abs=1e-5)


def test_joints_are_driven_by_arrays(client: tessera.Client) -> None:
    arm = client.spawn(pendulum(), "arm::", (0, 0, 5))
    client.set_drives(np.array(arm.joints), [0.5, -0.25], tessera.DriveMode.SERVO, stiffness=400, damping=40)
    client.step(120)
    assert client.joint_states(arm.joints).positions[:, 0] == pytest.approx([0.5, -0.25], abs=0.01)


def test_properties_change_while_the_world_runs(client: tessera.Client) -> None:
    client.set_properties("crate_0", mass=20, friction=0.25, gravity=False)
    client.set_properties("crate_1", motion=tessera.Motion.KINEMATIC)
    client.apply_impulse("crate_0", (20, 0, 0))
    client.step()
    properties = client.find("crate_0").properties
    assert (properties.mass, properties.friction, properties.no_gravity) == (20, 0.25, True)
    assert client.find("crate_1").motion is tessera.Motion.KINEMATIC
    assert client.body_states([client.find("crate_0").id]).linear_velocities[0] == pytest.approx((1, 0, 0))
    with pytest.raises(tessera.InvalidArgument, match="mass"):
        client.set_properties("crate_0", mass=-1)


def test_a_radial_impulse_pushes_what_is_near(client: tessera.Client) -> None:
    client.apply_radial_impulse((-5, 0, 3), 20, 40)
    client.step()
    ids = [client.find(f"crate_{i}").id for i in range(3)]
    velocities = client.body_states(ids).of(ids).linear_velocities
    assert velocities[:, 0] == pytest.approx([3, 1, 0])  # 5, 15 and 25 m away, 10 kg
    assert velocities[:, 1:] == pytest.approx(np.zeros((3, 2)))


def test_a_lasting_force_pushes_until_it_is_changed(client: tessera.Client) -> None:
    client.set_force("crate_0", (60, 0, 0))
    client.step(30)
    client.set_force("crate_0", None)
    client.step(30)
    assert client.body_states(prefix="crate_0").linear_velocities[0] == pytest.approx((3, 0, 0), abs=1e-5)
    client.set_state([tessera.PlacedBody("crate_1", (0, 0, 3), (0, 0, math.sqrt(0.5), math.sqrt(0.5)))])
    client.set_force("crate_1", (60, 0, 0), body_axes=True)
    client.step(30)
    assert client.body_states(prefix="crate_1").linear_velocities[0] == pytest.approx((0, 3, 0), abs=1e-5)
    with pytest.raises(tessera.errors.InvalidArgument, match="force = inf|must be finite"):
        client.set_force("crate_0", (math.inf, 0, 0))
    with pytest.raises(tessera.errors.InvalidArgument, match="must be dynamic"):
        client.set_force("ground", (1, 0, 0))


def test_bodies_have_data_and_owners(client: tessera.Client) -> None:
    client.spawn(tessera.Body("chest", tessera.box(1, 1, 1), position=(0, 0, 9), user_data=b"gold\x00"))
    client.set_properties("crate_0", user_data=b"\xff", owner="alice")
    chest, crate = client.find("chest"), client.find("crate_0")
    assert (chest.user_data, chest.owner) == (b"gold\x00", "")
    assert (crate.user_data, crate.owner) == (b"\xff", "alice")
    mine = client.run([commands.spawn(tessera.Body("mine", tessera.sphere(0.5), position=(0, 0, 20)))], owner="bob")
    assert client.find("mine").owner == "bob"
    assert mine.applied.created
    with pytest.raises(tessera.errors.PermissionDenied, match="body 'crate_0': it is not owned by 'bob'"):
        client.run([commands.remove("crate_0")], owner="bob")
    with pytest.raises(tessera.errors.InvalidArgument, match="user data: 1025 bytes must be at most 1024"):
        client.set_properties("crate_0", user_data=bytes(1025))
