"""Clusters that notebooks start, and what notebooks do with them."""

from __future__ import annotations

import gc
import runpy
import sys
from pathlib import Path
from types import ModuleType
from typing import Any
from unittest.mock import MagicMock

import numpy as np
import pytest
from conftest import WORLDS

import tessera

EXAMPLES = Path(__file__).parents[1] / "examples"


def gone(address: str) -> bool:
    with pytest.raises(tessera.Unavailable):
        tessera.Client(address, timeout=0.2)
    return True


def test_cluster_ends_with_its_block_or_when_nobody_has_it() -> None:
    with tessera.Cluster(servers=1) as cluster, cluster.connect() as client:
        assert client.status().state == "empty"
    assert gone(cluster.address)
    cluster.stop()
    left = tessera.Cluster(servers=1)
    address = left.address
    del left
    gc.collect()
    assert gone(address)


def test_cluster_that_does_not_start_says_why() -> None:
    with pytest.raises(tessera.Unavailable, match="--servers"):
        tessera.Cluster(servers=1000)


def test_cluster_without_a_store_writes_nothing_and_runs() -> None:
    with tessera.Cluster(servers=1, store=False) as cluster, cluster.connect() as client:
        client.load(WORLDS / "falling.sdf")
        assert client.step(10) == 10
        assert client.status().store_failure == ""


def test_world_of_double_precision() -> None:
    with tessera.Cluster(
        servers=1, precision=tessera.Precision.FLOAT64
    ) as cluster, cluster.connect() as client:
        client.load(tessera.World.read(WORLDS / "falling.sdf", ["--engine", "f64"]))
        assert client.step(10) == 10


def run_example(name: str, monkeypatch: pytest.MonkeyPatch, **plots: Any) -> dict[str, Any]:
    """What an example has in the end that plots with these functions instead of in a window."""
    pyplot = ModuleType("matplotlib.pyplot")
    vars(pyplot).update(plots, xlabel=print, ylabel=print, show=print)
    monkeypatch.setitem(sys.modules, "matplotlib", ModuleType("matplotlib"))
    monkeypatch.setitem(sys.modules, "matplotlib.pyplot", pyplot)
    monkeypatch.chdir(WORLDS.parent)
    return runpy.run_path(str(EXAMPLES / name))


def test_example_drives_a_pendulum_in_lock_step(monkeypatch: pytest.MonkeyPatch) -> None:
    done = run_example("lock_step.py", monkeypatch, subplots=lambda _: (None, (MagicMock(), MagicMock())))
    positions, distances = np.array(done["positions"]), np.array(done["distances"])
    targets = 0.5 * np.cos((done["TICKS"] - 1) / 20)
    assert positions.shape == (done["TICKS"], 2)
    assert positions[-1, 1] == pytest.approx(targets, abs=0.1)
    assert distances.shape == (done["TICKS"], 101)
    assert 2 < distances.min() < 4
    assert np.isinf(distances[:, 0]).all()


def test_example_plots_a_tower_that_falls(monkeypatch: pytest.MonkeyPatch) -> None:
    curves: list[tuple[Any, ...]] = []
    run_example("push_a_tower.py", monkeypatch, plot=lambda *data, **_: curves.append(data))
    ((time, heights),) = curves
    assert heights.shape == (len(time), 10)
    assert np.diff(time) == pytest.approx(1 / 60)
    assert heights[0] == pytest.approx(np.arange(10) + 0.5, abs=0.01)
    assert heights[-1, -1] < 2
