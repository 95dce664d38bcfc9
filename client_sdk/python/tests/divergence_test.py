"""Bodies that diverge are told, and frames go with their bodies."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import PATIENCE_S, flat_world

import tessera
from tessera._proto import tessera_pb2
from tessera.frame import body_frame, divergence_frame


def test_the_largest_impulse_is_told_and_ends_nothing(client: tessera.Client) -> None:
    world = flat_world(8)
    world.add(tessera.Body("crate", tessera.box(1, 1, 1), 10, (0.3, 0.2, 0.5)))
    client.load(world, replace=True)
    crate = client.find("crate").id
    with client.watch_divergences() as frames:
        assert frames.next(PATIENCE_S).divergences == []
        client.apply_impulse("crate", (0, 0, 1e12))
        client.step(2)
        told = frames.next(PATIENCE_S).divergences
        assert frames.next(PATIENCE_S).divergences == []
    assert told == [tessera.Divergence(1, crate, tessera.DivergenceKind.SPEED, 0)]
    status = client.status()
    assert status.counts_since_load["diverged"] == 1
    assert [one.body_name for one in status.divergences] == ["crate"]


def test_a_world_without_frames_has_none(client: tessera.Client) -> None:
    client.load(flat_world(), replace=True)
    assert client.find_frames() == []
    with pytest.raises(tessera.NotFound, match="handle"):
        client.find_frame("handle")


def test_divergences_of_all_servers_are_one_list() -> None:
    parts = [
        tessera_pb2.DivergenceBatch(
            tick=5, divergences=[tessera_pb2.Divergence(tick=5, body=body, kind="SPEED")]
        )
        for body in (7, 3)
    ]
    assert [one.body for one in divergence_frame(5, parts).divergences] == [3, 7]


def test_frames_go_with_their_bodies() -> None:
    half = np.sqrt(0.5)
    state = tessera_pb2.BodyState(id=4)
    state.pose.position.sector.i = 5
    state.pose.position.local.x = 7
    state.pose.orientation.z = state.pose.orientation.w = half
    frame = body_frame(1, tessera_pb2.BodyBatch(bodies=[state]), 16)
    handle = tessera.FoundFrame("crate::handle", 4, "crate", (2.0, 0.0, 1.0), (0.0, 0.0, half, half))
    position, orientation = frame.pose_of(handle)
    assert position.sector == (5, 0, 0)
    assert np.allclose(position.local, (7, 2, 1), atol=1e-12)
    assert np.allclose(orientation, (0, 0, 1, 0), atol=1e-12)
    with pytest.raises(KeyError):
        frame.pose_of(tessera.FoundFrame("other", 9, "nobody", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)))
