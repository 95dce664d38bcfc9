"""A real cluster of two servers for all tests of a file; each test loads a world of its own."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

import tessera

WORLDS = Path(os.environ.get("TESSERA_OWN_WORLDS", Path(__file__).parents[3] / "worlds"))
PATIENCE_S = 60.0  # for machines that are busy otherwise


def flat_world(sector_size: float = 128, gravity: Sequence[float] = (0, 0, -9.81)) -> tessera.World:
    """A plane through z = 0 and nothing else."""
    world = tessera.World("flat", tessera.Settings(sector_size=sector_size, gravity=gravity))
    world.add(tessera.Body("ground", tessera.plane(), motion=tessera.Motion.STATIC))
    return world


@pytest.fixture(scope="session")
def cluster() -> Iterator[tessera.Cluster]:
    with tessera.Cluster(servers=2, threads=1) as running:
        yield running


@pytest.fixture(scope="session")
def client(cluster: tessera.Cluster) -> Iterator[tessera.Client]:
    with cluster.connect() as connected:
        yield connected
