#!/usr/bin/env python3
"""Runs a cluster in real time for an hour while bodies come and go and servers are killed and replaced, and
measures whether memory stays flat and ticks stay short.

    experiments/clusters/soak.py [--minutes M] [--world FILE] [--bin FOLDER] [--csv FILE]

Starts `tessera up` with three servers. Once a second a body is spawned, pushed or removed; once a minute a
server is killed, which `tessera up` replaces by one that joins. The first server and the coordinator are left
alone, so that their memory can be watched. Prints a line a minute, then the means of the second and the last
quarter. Ends with 1 if the world stood still for longer than DEADLINE_S, or a command failed that long.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import random
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

TOP = Path(__file__).resolve().parent.parent.parent
DEADLINE_S = 30.0
BODIES_MAX = 300  # that churn adds
KILL_EVERY_S = 60.0
SAMPLE_EVERY_S = 10.0
UP = ("--listen", "127.0.0.1:0", "--no-page", "--sector-size", "8", "--end-with-input")
PLACE_M = 20.0  # bodies come down within this distance of the origin


class Cluster:
    """`tessera up`, and commands to it."""

    def __init__(self, folder: Path, world: Path, scratch: Path, servers: int = 3) -> None:
        self._tessera = str(folder / "tessera")
        self._scratch = scratch
        self._up = subprocess.Popen(
            [self._tessera, "up", str(world), "--servers", str(servers), *UP],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self.address = self._read_address()

    def _read_address(self) -> str:
        assert self._up.stdout is not None
        for line in self._up.stdout:
            for word in line.replace(",", " ").split():
                host, _, port = word.rpartition(":")
                if host == "127.0.0.1" and port.isdigit():
                    return word
        raise SystemExit("the cluster did not start")

    def command(self, *words: str) -> bool:
        """True once the command has taken effect; it is given again until the deadline."""
        until = time.monotonic() + DEADLINE_S
        while time.monotonic() < until:
            done = subprocess.run(
                [self._tessera, *words, "--connect", self.address], capture_output=True, text=True
            )
            if done.returncode == 0:
                return True
        print("failed:", " ".join(words), done.stderr.strip(), file=sys.stderr)
        return False

    def status(self) -> dict:
        file = self._scratch / "status.json"
        return json.loads(file.read_text()) if self.command("status", "--json", str(file)) else {}

    def servers(self) -> list[int]:
        """Process ids of the sector servers, in the order in which they were started."""
        return self._children("tessera-sector-server")

    def coordinator(self) -> int:
        return self._children("tessera-coordinator")[0]

    def _children(self, program: str) -> list[int]:
        found = subprocess.run(["pgrep", "-P", str(self._up.pid), "-f", program], capture_output=True, text=True)
        return [int(word) for word in found.stdout.split()]

    def end(self) -> None:
        self._up.communicate(input="")


def resident_mb(pid: int) -> float:
    for line in Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) / 1000
    return 0.0


class Churn:
    """Bodies that come, are pushed, and go."""

    def __init__(self, cluster: Cluster) -> None:
        self._cluster = cluster
        self._random = random.Random(1)
        self._bodies: list[str] = []
        self.commands = 0

    def step(self) -> bool:
        self.commands += 1
        draw = self._random.random()
        if not self._bodies or (draw < 0.5 and len(self._bodies) < BODIES_MAX):
            name = f"churn{self.commands}"
            self._bodies.append(name)
            place = ",".join(f"{self._random.uniform(-PLACE_M, PLACE_M):.3f}" for _ in range(2)) + ",4"
            shape = self._random.choice(["box:0.5,0.5,0.5", "sphere:0.3", "capsule:0.2,0.5", "cylinder:0.3,0.4"])
            return self._cluster.command("spawn", "--name", name, "--shape", shape, "--at", place)
        if draw < 0.75:
            return self._cluster.command("impulse", self._random.choice(self._bodies), "--impulse", "1,0.5,2")
        return self._cluster.command("remove", self._bodies.pop(self._random.randrange(len(self._bodies))))


def quarter(samples: list[dict], number: int) -> list[dict]:
    size = len(samples) // 4
    return samples[number * size : (number + 1) * size]


def soak(arguments: argparse.Namespace) -> int:
    with tempfile.TemporaryDirectory() as scratch:
        cluster = Cluster(arguments.bin, arguments.world, Path(scratch))
        try:
            return run(cluster, arguments)
        finally:
            cluster.end()


def run(cluster: Cluster, arguments: argparse.Namespace) -> int:
    if not cluster.command("resume"):
        return 1
    watched = {"server": cluster.servers()[0], "coordinator": cluster.coordinator()}
    churn = Churn(cluster)
    draw = random.Random(2)
    begin = time.monotonic()
    next_kill, next_sample = KILL_EVERY_S, 0.0
    kills = 0
    samples: list[dict] = []
    while (now := time.monotonic() - begin) < 60 * arguments.minutes:
        if not churn.step():
            return 1
        if now >= next_kill:
            victims = [pid for pid in cluster.servers() if pid != watched["server"]]
            if victims:
                os.kill(draw.choice(victims), signal.SIGKILL)
                kills += 1
            next_kill += KILL_EVERY_S
        if now >= next_sample:
            status = cluster.status()
            if not status:
                return 1
            own = [server["own_ms"] for server in status["servers"] if server.get("takes_part", True)]
            samples.append(
                {
                    "s": round(now),
                    "tick": status["tick"],
                    "bodies": status["bodies"],
                    "kills": kills,
                    "recoveries": status["recoveries"],
                    "own_ms": max(own, default=0),
                    **{f"{name}_mb": resident_mb(pid) for name, pid in watched.items()},
                }
            )
            next_sample += SAMPLE_EVERY_S
            if len(samples) % 6 == 1:
                print("  ".join(f"{key} {value}" for key, value in samples[-1].items()), flush=True)
        time.sleep(max(0.0, 1 - (time.monotonic() - begin - now)))
    if arguments.csv:
        with arguments.csv.open("w", newline="") as file:
            writer = csv.DictWriter(file, samples[0].keys())
            writer.writeheader()
            writer.writerows(samples)
    for key in ("server_mb", "coordinator_mb", "own_ms"):
        early, late = (statistics.mean(sample[key] for sample in quarter(samples, n)) for n in (1, 3))
        print(f"{key}: {early:.2f} in the second quarter, {late:.2f} in the last")
    first, last = samples[0], samples[-1]
    rate = (last["tick"] - first["tick"]) / (last["s"] - first["s"])
    print(f"{churn.commands} commands, {kills} kills, {last['recoveries']} recoveries, {rate:.1f} ticks a second")
    return 0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=60)
    parser.add_argument("--world", type=Path, default=TOP / "worlds/falling.sdf")
    parser.add_argument("--bin", type=Path, default=TOP / "build/release/bin")
    parser.add_argument("--csv", type=Path)
    arguments = parser.parse_args()
    if arguments.minutes < 1:
        parser.error("--minutes must be at least 1")
    return soak(arguments)


if __name__ == "__main__":
    sys.exit(main())
