"""Streams over two servers: bodies that cross, contacts that happen once, ends that are told."""

from __future__ import annotations

import threading

import numpy as np
import pytest
from conftest import PATIENCE_S, WORLDS, flat_world

import tessera
from tessera.followed_bodies import FollowedBodies


def crossing_world() -> tessera.World:
    """A ball that rolls from the far west to the far east, and crates on both sides, so that the world is
    cut between.
    """
    world = flat_world(8)
    world.add(
        tessera.Body(
            "ball",
            tessera.sphere(0.5),
            10,
            (-18, 0, 0.5),
            linear_velocity=(8, 0, 0),
            angular_velocity=(0, 16, 0),
        )
    )
    for x in (-20, -22, 20, 22):
        world.add(tessera.Body(f"crate {x}", tessera.box(1, 1, 1), 10, (x, 6, 0.5)))
    return world


def hosts(client: tessera.Client) -> dict[int, int]:
    return {server.node: server.bodies for server in client.status().servers}


def test_body_crosses_from_server_to_server_without_gap_or_jump(client: tessera.Client) -> None:
    client.load(crossing_world(), replace=True)
    client.step()
    before = hosts(client)
    path = client.trajectory("ball", 270)
    assert path.ticks.tolist() == list(range(1, 272))
    steps = np.linalg.norm(np.diff(path.relative_to()[:, 0], axis=0), axis=1)
    assert (steps > 4 / 60).all() and (steps < 8.5 / 60).all()
    assert len(set(path.sectors[:, 0, 0].tolist())) >= 4
    assert hosts(client) != before


def test_every_body_is_in_every_frame_once_as_arrays(client: tessera.Client) -> None:
    client.load(WORLDS / "busy.sdf", replace=True)
    movable = [body.id for body in client.find_bodies() if body.motion is not tessera.Motion.STATIC]
    with client.watch_bodies(every_ticks=5, complete=True) as stream:
        client.step(50)
        for tick in range(0, 51, 5):
            frame = stream.next(PATIENCE_S)
            assert frame.tick == tick
            assert frame.ids.tolist() == movable
    n = len(movable)
    shapes = {
        "ids": (n,),
        "sectors": (n, 3),
        "local": (n, 3),
        "orientations": (n, 4),
        "linear_velocities": (n, 3),
        "angular_velocities": (n, 3),
        "asleep": (n,),
    }
    assert {name: getattr(frame, name).shape for name in shapes} == shapes
    assert frame.sectors.dtype == np.int64
    assert np.allclose(np.linalg.norm(frame.orientations, axis=1), 1)
    assert frame.ids[frame.row(movable[3])] == movable[3]
    with pytest.raises(KeyError):
        frame.row(10**6)


def test_only_what_is_asked_for(client: tessera.Client) -> None:
    client.load(crossing_world(), replace=True)
    ball = client.find("ball").id
    west = tessera.Region((-21, 6, 0), (3, 3, 3))
    with client.watch_bodies(region=west) as stream, client.watch_bodies(ids=[ball]) as alone:
        assert len(stream.next(PATIENCE_S)) == 2
        assert alone.next(PATIENCE_S).ids.tolist() == [ball]


def test_precision_is_as_asked_for(client: tessera.Client) -> None:
    client.load(WORLDS / "busy.sdf", replace=True)
    with client.watch_bodies(complete=True) as exact, client.watch_bodies(
        complete=True, precision=1e-3, velocity_precision=0.01
    ) as packed, client.watch_bodies(precision=0.1) as still:
        client.step(90)
        for _ in range(91):
            a, b = exact.next(PATIENCE_S), packed.next(PATIENCE_S)
            assert a.ids.tolist() == b.ids.tolist()
            away = tessera.relative_to(a.sectors - b.sectors, a.local - b.local, (0, 0, 0), a.sector_size)
            assert np.linalg.norm(away, axis=1).max() <= 1.000001e-3
            dots = np.abs((a.orientations * b.orientations).sum(axis=1))
            assert 2 * np.arccos(np.minimum(dots, 1)).max() <= 1e-3
            for v, w in (
                (a.linear_velocities, b.linear_velocities),
                (a.angular_velocities, b.angular_velocities),
            ):
                assert np.linalg.norm(v - w, axis=1).max() <= 0.01001
            assert not still.next(PATIENCE_S).linear_velocities.any()
    with pytest.raises(tessera.InvalidArgument, match="precision: 2 m is neither"):
        client.watch_bodies(precision=2)


def test_a_region_goes_with_a_body(client: tessera.Client) -> None:
    world = flat_world(8)
    for x in range(-20, 21, 2):
        world.add(tessera.Body(f"crate {x}", tessera.box(1, 1, 1), 10, (x, 3, 0.5)))
    world.add(tessera.Body("ball", tessera.sphere(0.5), 10, (-18, 0, 0.5), linear_velocity=(8, 0, 0)))
    client.load(world, replace=True)
    ball = client.find("ball").id
    around = tessera.Region((0, 0, 0), (4, 4, 4))
    with client.watch_bodies(complete=True) as everything, client.watch_bodies(
        follow="ball", region=around
    ) as followed:
        assert isinstance(followed, FollowedBodies)
        known: dict[int, object] = {}
        for tick in range(0, 241):
            if tick > 0:
                client.step()
            if followed._opening:
                followed._opening.result(PATIENCE_S)  # a call takes no time, in the world's
            everywhere, frame = everything.next(PATIENCE_S), followed.next(PATIENCE_S)
            assert everywhere.tick == frame.tick == tick
            assert not set(frame.gone.tolist()) - known.keys()
            for body in frame.gone.tolist():
                del known[body]
            known |= dict(zip(frame.ids.tolist(), frame.relative_to()))
            here = everywhere.relative_to()[everywhere.row(ball)]
            away = np.abs(everywhere.relative_to() - here)
            assert sorted(known) == everywhere.ids[(away <= 4).all(axis=1)].tolist(), tick
        assert followed.skipped == 0
    with pytest.raises(tessera.NotFound, match="follow"):
        client.watch_bodies(follow=10**6, region=around)
    with pytest.raises(tessera.InvalidArgument, match="follow"):
        client.watch_bodies(follow="ball")


def test_each_contact_is_told_once_whatever_the_server(client: tessera.Client) -> None:
    world = flat_world(8)
    for x in (-20.0, -4.0, 4.0, 20.0):
        world.add(tessera.Body(f"ball {x}", tessera.sphere(0.5), 1, (x, 0, 0.6)))
    client.load(world, replace=True)
    ground = client.find("ground").id
    balls = [body.id for body in client.find_bodies("ball")]
    with client.watch_contacts() as stream:
        last = client.step(60)
        contacts: list[tessera.Contact] = []
        for frame in stream:
            contacts += frame.contacts
            if frame.tick == last:
                break
    begun = [contact for contact in contacts if contact.phase is tessera.Phase.BEGIN]
    assert sorted(contact.b for contact in begun) == balls
    assert {contact.a for contact in begun} == {ground}
    assert all(abs(contact.normal[2]) > 0.99 for contact in begun)


def test_seams_are_those_of_all_servers(client: tessera.Client) -> None:
    client.load(WORLDS / "seam.sdf", replace=True)
    tower = [body.id for body in client.find_bodies("tower_2::")]
    beside = tessera.Region((5, 2, 0), (2, 2, 50))
    nowhere = tessera.Region(tessera.WorldPosition(sector=(1000, 0, 0)), (2, 2, 2))
    with client.watch_seams() as all_seams, client.watch_seams(
        region=beside, every_ticks=10
    ) as some, client.watch_seams(region=nowhere) as none:
        client.step(20)
        for tick in range(21):
            frame, empty = all_seams.next(PATIENCE_S), none.next(PATIENCE_S)
            assert frame.tick == empty.tick == tick
            assert len(empty.clones) == len(empty.islands) == len(empty.bodies) == 0
            assert empty.sectors.shape == (0, 3)
        at_tower = [some.next(PATIENCE_S) for _ in range(3)]
    assert [one.tick for one in at_tower] == [0, 10, 20]
    count = len(frame.clones)
    assert count > 0
    assert frame.sectors.shape == (count, 3) and frame.sectors.dtype == np.int64
    assert set(frame.servers.tolist()) <= hosts(client).keys()
    order = list(zip(frame.clones.tolist(), frame.sectors.tolist()))
    assert order == sorted(order)
    assert frame.islands.tolist() == sorted(frame.islands.tolist())
    assert [bodies.tolist() for bodies in frame.bodies].count(tower) == 1
    assert [bodies.tolist() for bodies in at_tower[-1].bodies] == [tower]


def test_ends_when_the_world_is_replaced(client: tessera.Client) -> None:
    client.load(crossing_world(), replace=True)
    client.step()
    with client.watch_bodies() as stream:
        stream.next(PATIENCE_S)
        client.load(crossing_world(), replace=True)
        with pytest.raises(tessera.Aborted):
            for _ in stream:
                pass


def test_cancel_ends_the_iteration_of_another_thread(client: tessera.Client) -> None:
    client.load(crossing_world(), replace=True)
    stream = client.watch_bodies()
    read = threading.Event()
    ticks: list[int] = []

    def follow() -> None:
        for frame in stream:
            ticks.append(frame.tick)
            read.set()

    reader = threading.Thread(target=follow)
    reader.start()
    assert read.wait(PATIENCE_S)
    stream.cancel()
    reader.join(PATIENCE_S)
    assert not reader.is_alive()
    assert ticks == [0]


def test_nothing_to_watch_is_an_error(client: tessera.Client) -> None:
    client.load(flat_world(), replace=True)
    client.unload()
    with pytest.raises(tessera.FailedPrecondition, match="no world is loaded"):
        client.watch_bodies()
