"""A real cluster of two servers for all tests of a file; each test loads a world of its own. With
TESSERA_TEST_IN_PROCESS set, tests that need no cluster have a simulation in its place.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

import tessera

WORLDS = Path(os.environ.get("TESSERA_OWN_WORLDS", Path(__file__).parents[3] / "worlds"))
IN_PROCESS_VARIABLE = "TESSERA_TEST_IN_PROCESS"
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
def client(request: pytest.FixtureRequest) -> Iterator[tessera.AnyClient]:
    if os.environ.get(IN_PROCESS_VARIABLE):
        with tessera.Simulation(servers=2) as simulation:
            yield simulation
    else:
        cluster: tessera.Cluster = request.getfixturevalue("cluster")
        with cluster.connect() as connected:
            yield connected
