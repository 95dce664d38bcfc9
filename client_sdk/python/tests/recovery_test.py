"""Processes that end while the world is watched: each tick comes once, in order, and none is missing."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from conftest import PATIENCE_S, WORLDS

import tessera

# Of the names of processes, the system keeps 15 characters.
SERVER = "tessera-sector-"
COORDINATOR = "tessera-coordin"


@pytest.fixture
def cluster() -> Iterator[tessera.Cluster]:
    """One of the test's own, because it ends servers of it."""
    with tessera.Cluster(servers=2, threads=1) as running:
        yield running


@dataclass
class Told:
    """What clients see of the busy world from tick 0 on."""

    ticks: list[int] = field(default_factory=list)
    counts: set[int] = field(default_factory=set)  # of bodies in a frame
    contacts: list[tuple[int, tessera.Phase, int, int]] = field(default_factory=list)

    def read(self, bodies: tessera.BodyStream, contacts: tessera.ContactStream, until: int) -> None:
        while not self.ticks or self.ticks[-1] < until:
            frame, told = bodies.next(PATIENCE_S), contacts.next(PATIENCE_S)
            assert frame.tick == told.tick
            self.ticks.append(frame.tick)
            self.counts.add(len(frame))
            self.contacts += [(told.tick, contact.phase, contact.a, contact.b) for contact in told.contacts]


def processes(cluster: tessera.Cluster, name: str) -> list[int]:
    """Those of that name whose parent is the process of the cluster."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            called, rest = stat.read_text().rpartition(")")[::2]
        except OSError:
            continue  # it has ended
        if int(rest.split()[1]) == cluster._process.pid and called.endswith(f"({name}"):
            found.append(int(stat.parent.name))
    return sorted(found)


def test_each_tick_comes_once_where_processes_are_killed(cluster: tessera.Cluster) -> None:
    with cluster.connect() as client:
        client.load(WORLDS / "busy.sdf")
        with client.watch_bodies(complete=True) as bodies, client.watch_contacts() as contacts:
            told = Told()
            client.resume()
            for name in (SERVER, COORDINATOR, SERVER):
                told.read(bodies, contacts, len(told.ticks) + 90)
                os.kill(processes(cluster, name)[0], signal.SIGKILL)
            told.read(bodies, contacts, len(told.ticks) + 90)
            last = client.pause(PATIENCE_S)
            told.read(bodies, contacts, last)
            assert bodies.skipped == contacts.skipped == 0
        status = client.status()
        assert status.recoveries >= 1
        assert 0 < status.checkpoint_tick <= last

        client.load(WORLDS / "busy.sdf", replace=True)
        with client.watch_bodies(complete=True) as bodies, client.watch_contacts() as contacts:
            undisturbed = Told()
            for tick in range(0, last, 200):
                client.step(min(200, last - tick))
                undisturbed.read(bodies, contacts, min(last, tick + 200))
    assert told == undisturbed
    assert told.ticks == list(range(last + 1))
    assert len(told.counts) == 1


def test_drained_server_can_be_ended(cluster: tessera.Cluster) -> None:
    with cluster.connect() as client:
        client.load(WORLDS / "busy.sdf")
        with client.watch_bodies(complete=True) as bodies:
            frames = [bodies.next(PATIENCE_S)]
            client.resume()
            node = client.status().servers[0].node
            taken_over = client.drain(node)
            (drained,) = (server for server in client.status().servers if server.drained)
            assert (drained.node, drained.bodies, drained.takes_part) == (node, 0, False)
            while frames[-1].tick < taken_over + 30:
                frames.append(bodies.next(PATIENCE_S))
            assert [frame.tick for frame in frames] == list(range(len(frames)))
            assert len({len(frame) for frame in frames}) == 1
            assert bodies.skipped == 0
        with pytest.raises(tessera.FailedPrecondition):
            client.drain(client.status().servers[1].node)
        with pytest.raises(tessera.NotFound):
            client.drain(1)
