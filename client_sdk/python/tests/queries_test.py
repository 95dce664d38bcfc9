"""Queries with arrays in and out, answered at one tick over sectors and servers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from conftest import flat_world

import tessera
from tessera import queries
from tessera._proto import query_pb2, tessera_pb2
from tessera.results import to_body_states, to_joint_states

SECTOR = 10.0


@pytest.fixture
def crates(client: tessera.Client) -> list[int]:
    """Five crates, 3 m high in five sectors, without gravity."""
    world = flat_world(SECTOR, gravity=(0, 0, 0))
    for i in range(-2, 3):
        place = tessera.WorldPosition((0, 0, 3), (i, 0, 0))
        world.add(tessera.Body(f"crate_{i}", tessera.box(1, 1, 1), 10, place))
    client.load(world, replace=True)
    return [client.find(f"crate_{i}").id for i in range(-2, 3)]


def test_many_rays_are_one_call(client: tessera.Client, crates: list[int]) -> None:
    hits = client.raycast(
        np.array([[0, 0, 8], [1.0, 1, 8], [0, 0, 8], [-2, 0, 3]]),
        np.array([[0, 0, -2], [0, 0, -1], [0, 0, 1], [1, 0, 0]]),
        [20, 20, 20, 1],
        sectors=[(1, 0, 0), (-2, 0, 0), (0, 0, 0), (0, 0, 0)],
    )
    assert isinstance(hits, tessera.RayHits)
    ground = client.find("ground").id
    assert len(hits) == 4
    assert hits.ids.tolist() == [crates[3], ground, 0, 0]
    assert hits.hit.tolist() == [True, True, False, False]
    assert hits.distances == pytest.approx([4.5, 8, np.inf, np.inf])
    assert hits.relative_to((1, 0, 0), SECTOR)[:2] == pytest.approx(np.array([[0, 0, 3.5], [-29, 1, 0]]))
    assert hits.normals[:2] == pytest.approx(np.array([[0, 0, 1], [0, 0, 1]]))
    assert hits.sectors.tolist()[2:] == [[0, 0, 0]] * 2
    assert np.isnan(hits.local[2:]).all() and np.isnan(hits.normals[2:]).all()


def test_a_lidar_is_one_origin_and_many_directions(client: tessera.Client, crates: list[int]) -> None:
    angles = np.linspace(0, 2 * np.pi, 1000, endpoint=False)
    directions = np.stack([np.cos(angles), np.sin(angles), np.zeros(1000)], axis=1)
    hits = client.raycast((0, 0, 3), directions, 8, sectors=(1, 0, 0), excepting=[np.uint64(crates[3])])
    assert isinstance(hits, tessera.RayHits)
    assert not hits.hit.any()
    hits = client.raycast((5, 0, 3), directions, 8, sectors=(1, 0, 0))
    assert isinstance(hits, tessera.RayHits)
    assert set(hits.ids.tolist()) == {0, crates[3], crates[4]}
    assert hits.distances[0] == hits.distances[500] == pytest.approx(4.5)
    one = client.raycast(tessera.WorldPosition((5, 0, 3), (1, 0, 0)), (1, 0, 0))
    assert isinstance(one, tessera.RayHit)
    assert (one.id, one.distance) == (hits.ids[0], hits.distances[0])


def test_each_ray_may_pass_through_a_body_of_its_own(client: tessera.Client, crates: list[int]) -> None:
    down = client.raycast((0, 0, 8), [(0, 0, -1)] * 3, excepting_by_ray=[0, crates[2], crates[1]])
    ground = client.find("ground").id
    assert isinstance(down, tessera.RayHits)
    assert down.ids.tolist() == [crates[2], ground, crates[2]]
    with pytest.raises(tessera.InvalidArgument, match=r"lengths\[1\] = -2"):
        client.raycast((0, 0, 8), [(0, 0, -1)] * 3, [1, -2, 3])


def test_arrays_of_another_shape_are_named() -> None:
    with pytest.raises(ValueError, match=r"directions: an array \[2, 3\] or \[3\] is expected, not one of"):
        queries.rays([(0, 0, 1), (0, 0, 2)], [(0, 0)])
    with pytest.raises(ValueError, match="lengths"):
        queries.rays((0, 0, 1), [(0, 0, 1), (0, 0, 2)], [1, 2, 3])


def test_no_rays_have_no_hits(client: tessera.Client, crates: list[int]) -> None:
    hits = client.raycast((0, 0, 0), np.empty((0, 3)))
    assert isinstance(hits, tessera.RayHits)
    assert (len(hits), hits.local.shape) == (0, (0, 3))


def test_all_or_any_hit(client: tessera.Client, crates: list[int]) -> None:
    start = tessera.WorldPosition((-2, 0, 3), (-2, 0, 0))
    through, is_hit, is_not = answers = client.ask(
        [
            queries.ray_all(start, (1, 0, 0), excepting=["crate_0"]),
            queries.ray_any(start, (1, 0, 0)),
            queries.ray_any(start, (-1, 0, 0)),
        ]
    )
    assert [hit.name for hit in through] == ["crate_-2", "crate_-1", "crate_1", "crate_2"]
    assert [hit.distance for hit in through] == pytest.approx([1.5, 11.5, 31.5, 41.5])
    assert (is_hit, is_not, len(answers)) == (True, False, 3)


def test_a_shape_is_swept_and_leaves_out_what_it_must(client: tessera.Client, crates: list[int]) -> None:
    ball = tessera.sphere(0.5)
    hit = client.sweep(ball, (0, 0, 8), (0, 0, -1))
    assert hit is not None
    assert hit.name == "crate_0"
    assert hit.distance == pytest.approx(4, abs=1e-3)
    hit = client.sweep(ball, (0, 0, 8), (0, 0, -1), excepting=["crate_0"])
    assert hit is not None
    assert hit.name == "ground"
    assert hit.distance == pytest.approx(7.5, abs=1e-3)
    assert client.sweep(ball, (0, 0, 8), (0, 0, 1)) is None
    assert [body.name for body in client.near((0, 0, 3), 9, excepting=["ground", crates[2]])] == []


def test_contacts_are_those_of_the_last_tick(client: tessera.Client) -> None:
    world = flat_world(SECTOR)
    place = tessera.WorldPosition((4.8, 0, 0.5))  # over a border
    world.add(tessera.Body("crate", tessera.box(1, 1, 1), 10, place))
    client.load(world, replace=True)
    assert client.contacts("crate").contacts == []
    client.step(10)
    found = client.contacts("crate")
    assert (found.tick, found.truncated, len(found.contacts)) == (10, False, 1)
    (contact,) = found.contacts
    assert contact.impulse == pytest.approx(10 * 9.81 / 60, rel=0.01)
    assert len(contact.points) == 4
    assert client.contacts(prefix="gr").contacts == found.contacts
    client.step(600)  # asleep, and packed
    assert [one.impulse for one in client.contacts("crate").contacts] == pytest.approx([10 * 9.81 / 60], rel=0.01)
    with pytest.raises(tessera.NotFound, match="nobody"):
        client.contacts("nobody")
    with pytest.raises(tessera.InvalidArgument, match="bodies or name_prefix"):
        client.contacts()


def test_distances_go_over_borders(client: tessera.Client, crates: list[int]) -> None:
    found = client.distance("crate_-1", crates[3], 40)
    assert found is not None
    assert found.distance == pytest.approx(19)
    assert found.normal == pytest.approx((-1, 0, 0))
    assert found.on_a.sector == (-1, 0, 0)
    assert client.distance("crate_-1", "crate_1", 18.9) is None
    below = client.distance("crate_0", "ground", 5)
    assert below is not None
    assert below.distance == pytest.approx(2.5)


def arm(client: tessera.Client) -> None:
    """Two bars of 2 kg, level, of which a servo holds the first one, and a hinge the second."""
    world = flat_world(SECTOR)
    along_y = (0, 0, 2**-0.5, 2**-0.5)
    for n, name in enumerate(("upper", "lower")):
        place = tessera.WorldPosition((4.5 + n, 0, 4))
        world.add(tessera.Body(name, tessera.box(0.8, 0.1, 0.1), 2, place))
    for name, parent, reach in (("shoulder", None, (4, 0, 4)), ("elbow", "upper", (0.5, 0, 0))):
        servo = tessera.Drive(tessera.DriveMode.SERVO, 0, stiffness=1e6, damping=1e4)
        world.add_joint(
            tessera.Joint(
                tessera.JointType.REVOLUTE,
                name=name,
                parent=parent,
                child="upper" if parent is None else "lower",
                in_parent=reach,
                in_child=(-0.5, 0, 0),
                in_parent_turned=along_y,
                in_child_turned=along_y,
                drives=[servo],
            )
        )
    client.load(world, replace=True)


def test_joints_tell_what_they_give_and_bear(client: tessera.Client) -> None:
    arm(client)
    client.step(120)
    joints = client.joint_states(efforts=True, reactions=True)
    weight = 2 * 9.81
    assert joints.efforts[:, 0] == pytest.approx([-weight * (0.5 + 1.5), -weight * 0.5], rel=1e-3)
    assert np.isnan(joints.efforts[:, 1]).all()
    assert joints.reactions[:, 2] == pytest.approx([2 * weight, weight], rel=1e-3)
    assert np.isnan(client.joint_states().reactions).all()


def test_dynamics_of_an_arm(client: tessera.Client) -> None:
    arm(client)
    dynamics = client.dynamics("lower", mass_matrix=True, points=[("lower", (0.5, 0, 0))])
    assert (dynamics.base, dynamics.freedoms.tolist()) == (0, [1, 1])
    weight, inertia = 2 * 9.81, 2 * (0.8**2 + 0.1**2) / 12
    assert dynamics.bias == pytest.approx([-weight * 2, -weight * 0.5])
    coupled = 2 * (0.25 + 0.5) + inertia
    expected = [2 * 0.25 + 2 * 2.25 + 2 * inertia, coupled, coupled, 2 * 0.25 + inertia]
    assert dynamics.mass_matrix.ravel() == pytest.approx(expected)
    assert dynamics.jacobians[0][2] == pytest.approx([-2, -1])  # both angles turn what is in front of them down
    assert client.mass_matrix("upper").ravel() == pytest.approx(expected)
    assert client.jacobian("lower", (0.5, 0, 0))[2] == pytest.approx([-2, -1])
    assert client.inverse_dynamics("lower", [0, 0]) == pytest.approx(dynamics.bias)
    assert client.inverse_dynamics("lower", [1, 0]) == pytest.approx(dynamics.bias + expected[:2])
    with pytest.raises(tessera.InvalidArgument, match="2 degrees of freedom"):
        client.inverse_dynamics("lower", [1])


def test_states_are_arrays(client: tessera.Client, crates: list[int]) -> None:
    client.set_velocity("crate_1", (1, 2, 3))
    client.step()
    states = client.body_states()
    assert states.tick == 1
    assert states.ids.tolist() == crates
    assert states.sectors[:, 0].tolist() == [-2, -1, 0, 1, 2]
    assert states.linear_velocities[3].tolist() == [1, 2, 3]
    assert not states.asleep.any()
    some = client.body_states(np.array(crates[3:0:-1] + [999])).of(np.array([crates[3], crates[1]]))
    assert some.ids.tolist() == [crates[3], crates[1]]
    assert some.relative_to((1, 0, 0), SECTOR)[:, 0] == pytest.approx([1 / 60, -20])
    with pytest.raises(KeyError, match="999"):
        some.of([999])
    assert client.body_states(prefix="crate_-").ids.tolist() == crates[:2]
    assert len(client.body_states([])) == 0
    assert len(client.joint_states()) == 0


def test_answers_are_found_by_their_queries(client: tessera.Client, crates: list[int]) -> None:
    hash_now, states = queries.hash(), queries.body_states(crates)
    rays = queries.rays((0, 0, 8), [(0, 0, -1)] * 3)
    answers = client.ask([hash_now, rays, states])
    assert answers[states].ids.tolist() == crates
    assert answers[hash_now] == client.hash()
    assert answers[rays].ids.tolist() == [crates[2]] * 3
    assert client.ask([rays])[rays].ids.tolist() == [crates[2]] * 3


def test_results_of_other_queries_are_refused() -> None:
    reply = tessera_pb2.Reply(results=[{"hash": {}}])
    other: list[list[queries.Query[Any]]] = [[], [queries.near((0, 0, 0))], [queries.hash(), queries.hash()]]
    for asked in other:
        with pytest.raises(tessera.DataLoss):
            queries.Answers(reply, asked)


def test_columns_are_read_as_protobuf_packs_them() -> None:
    """With indices of sectors that take one, two and three bytes."""
    random = np.random.default_rng(5)
    place = [0, 127, 128, 300, 16383, 16384, 20000]
    count = len(place)
    motion = random.normal(size=(count, 13))
    states = to_body_states(
        7,
        query_pb2.BodyColumns(
            ids=range(1, count + 1),
            sectors=[{"i": n, "j": -n, "k": 2**62} for n in range(20001)],
            sector=place,
            positions=motion[:, 0:3].ravel(),
            orientations=motion[:, 3:7].ravel(),
            linear_velocities=motion[:, 7:10].ravel(),
            angular_velocities=motion[:, 10:13].ravel(),
            asleep=[n % 2 == 1 for n in range(count)],
        ),
    )
    assert states.tick == 7
    assert states.ids.tolist() == list(range(1, count + 1))
    assert states.sectors.tolist() == [[n, -n, 2**62] for n in place]
    found = (states.local, states.orientations, states.linear_velocities, states.angular_velocities)
    assert np.array_equal(np.hstack(found), motion)
    assert states.asleep.tolist() == [False, True] * 3 + [False]
    none = to_body_states(0, query_pb2.BodyColumns())
    assert len(none) == len(none.of([])) == 0
    with pytest.raises(KeyError, match="5"):
        none.of([5])


def test_joints_have_as_many_axes_as_they_say() -> None:
    columns = query_pb2.JointColumns(ids=[3, 5, 9], axes=[1, 0, 2], positions=[0.1, 0.2, 0.3], rates=[1, 2, 3])
    joints = to_joint_states(4, columns)
    none = np.nan
    positions = np.array([[0.1, none], [none, none], [0.2, 0.3]])
    assert np.array_equal(joints.positions, positions, equal_nan=True)
    assert np.array_equal(joints.rates, np.array([[1, none], [none, none], [2, 3]]), equal_nan=True)
    assert joints.of([9, 3]).positions[:, 0].tolist() == [0.2, 0.1]
