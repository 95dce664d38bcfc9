"""A cluster with keys, and what clients of each role can do there."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from conftest import flat_world

import tessera
from tessera import program


@pytest.fixture(scope="module")
def keys(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("keys") / "keys"
    program.run("keys", "create", str(folder), "--days", "2")
    return folder


@pytest.fixture(scope="module")
def locked(keys: Path) -> Iterator[tessera.Cluster]:
    with tessera.Cluster(servers=2, threads=1, keys=keys) as running:
        world = flat_world()
        world.add(tessera.Body("ball", tessera.sphere(0.5), mass=1, position=(0, 0, 5)))
        with running.connect() as admin:
            admin.load(world)
        yield running


def test_each_role_may_do_its_own(locked: tessera.Cluster, keys: Path) -> None:
    with tessera.Client(locked.address, keys=keys / "observe") as observer:
        assert observer.status().state == "paused"
        with pytest.raises(tessera.PermissionDenied, match="it needs control"):
            observer.apply_impulse("ball", (1, 0, 0))
        with tessera.Client(locked.address, keys=keys / "control") as controller:
            with observer.watch_bodies() as frames:
                controller.step(2)
                assert max(frames.next(30).tick for _ in range(2)) >= 1
            with pytest.raises(tessera.PermissionDenied, match="it needs admin"):
                controller.unload()


def test_a_token_is_enough(locked: tessera.Cluster, keys: Path, tmp_path: Path) -> None:
    for name in ("authority.pem", "token"):
        shutil.copy(keys / "control" / name, tmp_path)
    with tessera.Client(locked.address, keys=tmp_path) as client, client.watch_bodies() as frames:
        client.step(1)
        frames.next(30)


def test_strangers_get_no_answer(locked: tessera.Cluster) -> None:
    with pytest.raises(tessera.Unavailable, match="without keys"):
        tessera.Client(locked.address, keys="", timeout=0.5)


def test_missing_files_are_named(keys: Path) -> None:
    with pytest.raises(tessera.NotFound, match="nobody/authority.pem"):
        tessera.Client(keys=keys / "nobody")
