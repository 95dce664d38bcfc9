#!/usr/bin/env python3
"""Runs worlds on a cluster of a sector server for amd64 and one for arm64, and compares the hashes with one process.

    tests/mixed_cluster.py AMD64_BUILD ARM64_BUILD [WORLD...]

The coordinator is for amd64; the server for arm64 runs by qemu, with the libraries of the root TESSERA_ARM64_ROOT. Each
world runs once on both servers to the end, once until the server for amd64 is killed in the middle, and once until the one
for arm64 is. Prints a row for each; exit code 1 if a hash differs, or if a server had no part of the world.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

TOP = Path(__file__).resolve().parent.parent
WORLDS = ("seam", "busy", "machines", "harbour", "workshop", "voyage")
TICKS = 600
KILL_AFTER = 150  # ticks
DEADLINE_S = 600.0


class Failed(Exception):
    """What a cluster does not do in time."""


def wait_for(what: str, is_there: Callable[[], bool]) -> None:
    until = time.monotonic() + DEADLINE_S
    while not is_there():
        if time.monotonic() > until:
            raise Failed(f"waited {DEADLINE_S:.0f} s for {what}")
        time.sleep(0.05)


class Cluster:
    """A coordinator, and a sector server for each machine."""

    def __init__(self, amd64: Path, arm64: Path, scratch: Path) -> None:
        self._tessera = str(amd64 / "bin" / "tessera")
        self._scratch = scratch
        shared = ["--cluster", f"mixed-{os.getpid()}", "--shared-memory=false", "--exit-with-parent"]
        ready = scratch / "ready"
        ready.unlink(missing_ok=True)
        emulated = ["qemu-aarch64-static", "-L", os.environ["TESSERA_ARM64_ROOT"]]
        server = ["bin/tessera-sector-server", "--threads", "1", "--join-timeout", str(DEADLINE_S)]
        self._log = (scratch / "log").open("w")
        self.processes = {
            "coordinator": self._start([str(amd64 / "bin" / "tessera-coordinator"), "--listen", "127.0.0.1:0", "--servers", "2",
                                        "--join-timeout", str(DEADLINE_S), "--ready-file", str(ready), *shared]),
            "amd64": self._start([str(amd64 / server[0]), *server[1:], "--labels", "machine=amd64", *shared]),
            "arm64": self._start([*emulated, str(arm64 / server[0]), *server[1:], "--labels", "machine=arm64", *shared]),
        }
        wait_for("the coordinator", lambda: ready.exists() and ready.read_text() != "")
        self.address = ready.read_text().strip()

    def _start(self, words: list[str]) -> subprocess.Popen[str]:
        return subprocess.Popen(words, stderr=self._log, text=True)

    def command(self, *words: str) -> None:
        done = subprocess.run([self._tessera, *words, "--connect", self.address], capture_output=True, text=True,
                              timeout=DEADLINE_S, check=False)
        if done.returncode != 0:
            raise Failed(f"{done.stderr.strip()}\n{(self._scratch / 'log').read_text()[-2000:]}")

    def answer(self, *words: str) -> Any:
        file = self._scratch / "answer.json"
        self.command(*words, "--json", str(file))
        return json.loads(file.read_text())

    def bodies(self) -> dict[str, int]:
        """How many bodies each machine has."""
        return {server["labels"][0].removeprefix("machine="): server["bodies"] for server in self.answer("status")["servers"]}

    def wait_for_tick(self, tick: int) -> None:
        wait_for(f"tick {tick}", lambda: bool(self.answer("status")["tick"] > tick))

    def kill(self, name: str) -> None:
        self.processes[name].send_signal(signal.SIGKILL)
        self.processes[name].wait()

    def end(self) -> None:
        for process in self.processes.values():
            process.kill()
        for process in self.processes.values():
            process.wait()
        self._log.close()


def alone(amd64: Path, world: Path, scratch: Path) -> str:
    file = scratch / "alone.json"
    subprocess.run([amd64 / "bin" / "tessera", "run", world, "--in-process", "--seconds", str(TICKS / 60), "--json", file],
                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=True)
    return str(json.loads(file.read_text())["world_hash"])


def together(amd64: Path, arm64: Path, world: Path, killed: str | None, scratch: Path) -> tuple[str, dict[str, int]]:
    """The hash at the end, and how many bodies each machine had after the first ticks."""
    cluster = Cluster(amd64, arm64, scratch)
    try:
        cluster.command("load", str(world))
        cluster.command("step", str(KILL_AFTER))
        bodies = cluster.bodies()
        if killed:
            cluster.command("resume")
            cluster.wait_for_tick(KILL_AFTER + 30)
            cluster.kill(killed)
            cluster.wait_for_tick(KILL_AFTER + 90)
            cluster.command("pause")
        status = cluster.answer("status")
        if status["recoveries"] != (1 if killed else 0):
            raise Failed(f"{status['recoveries']} recoveries")
        cluster.command("step", str(TICKS - status["tick"]))
        return str(cluster.answer("hash")["world_hash"]), bodies
    finally:
        cluster.end()


def main() -> int:
    if len(sys.argv) < 3:
        print(__doc__, file=sys.stderr)
        return 2
    amd64, arm64 = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()
    worlds = [Path(name) for name in sys.argv[3:]] or [TOP / "worlds" / f"{name}.sdf" for name in WORLDS]
    is_right = True
    print("world       killed  bodies amd64, arm64  seconds  hash")
    with tempfile.TemporaryDirectory() as folder:
        scratch = Path(folder)
        for world in worlds:
            expected = alone(amd64, world, scratch)
            for killed in (None, "amd64", "arm64"):
                began = time.monotonic()
                try:
                    found, bodies = together(amd64, arm64, world, killed, scratch)
                except Failed as error:
                    print(f"{world.stem}, killed: {killed}: {error}")
                    is_right = False
                    continue
                is_same = found == expected and all(bodies.get(machine) for machine in ("amd64", "arm64"))
                is_right = is_right and is_same
                print(f"{world.stem:10}  {killed or '-':6}  {bodies.get('amd64', 0):12}, {bodies.get('arm64', 0):5}"
                      f"  {time.monotonic() - began:7.0f}  {found}{'' if found == expected else f', not {expected}'}", flush=True)
    return 0 if is_right else 1


if __name__ == "__main__":
    sys.exit(main())
