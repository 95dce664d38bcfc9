#!/usr/bin/env python3
"""Measures what all locks together cost: TLS and keys for clients, DDS Security between daemons.

    experiments/clusters/price_of_locks.py --interface eth0 --address ADDRESS_OF_IT [--rounds N] [--ticks N] [--world FILE]
                             [--no-shared-memory] [--bin FOLDER]

Starts a coordinator and two sector servers on a network interface other than `lo`, since DDS Security is off there, loads a
world, and steps it as fast as it goes, while a client reads all bodies and another one commands; with keys and
without in turn. Prints the p50 and p99 of ticks of each run, then the median and the least of them over the runs, and
what locks add. On a machine that does other work, the least says more.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

TOP = Path(__file__).resolve().parent.parent.parent
DEADLINE_S = 30.0
SERVERS = 2
CHUNKS = 10  # steps of a run, between which a body is pushed


class Run:
    """A cluster, with locks or without, that ends with the `with` statement."""

    def __init__(self, arguments: argparse.Namespace, keys: Path | None, scratch: Path) -> None:
        self._arguments = arguments
        self._keys = keys
        self._scratch = scratch
        self._processes: list[subprocess.Popen] = []
        self._address = ""

    def __enter__(self) -> Run:
        ready = self._scratch / "ready"
        ready.unlink(missing_ok=True)
        self._start("tessera-coordinator", "--servers", str(SERVERS), "--ready-file", str(ready))
        for _ in range(SERVERS):
            self._start("tessera-sector-server", "--threads", "1")
        until = time.monotonic() + DEADLINE_S
        while not ready.exists() or not ready.read_text():
            if time.monotonic() > until:
                raise SystemExit("the coordinator did not start")
            time.sleep(0.05)
        self._address = ready.read_text().strip()
        return self

    def _start(self, program: str, *options: str) -> None:
        a = self._arguments
        shared = ["--interface", a.interface, "--peers", a.address, "--domain", "77", "--cluster", "price"]
        shared += ["--shared-memory", str(a.shared_memory).lower(), "--listen", f"{a.address}:0"]
        shared += ["--log-level", "error"]
        shared += ["--keys", str(self._keys)] if self._keys else ["--insecure"]
        self._processes.append(subprocess.Popen([a.bin / program, *options, *shared]))

    def command(self, *words: str) -> None:
        subprocess.run([self._arguments.bin / "tessera", *words, *self._reach()], check=True, stdout=subprocess.DEVNULL)

    def watch(self) -> None:
        words = [self._arguments.bin / "tessera", "watch", "--frames", "1000000", *self._reach()]
        self._processes.append(subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL))

    def _reach(self) -> list[str]:
        return ["--connect", self._address, *(["--keys", str(self._keys)] if self._keys else [])]

    def tick_ms(self) -> dict:
        file = self._scratch / "status.json"
        self.command("status", "--json", str(file))
        return json.loads(file.read_text())["tick_ms"]

    def __exit__(self, *_: object) -> None:
        for process in reversed(self._processes):
            process.terminate()
        for process in self._processes:
            process.wait()


def measure(arguments: argparse.Namespace, keys: Path | None, scratch: Path) -> dict:
    with Run(arguments, keys, scratch) as run:
        run.command("load", str(arguments.world))
        run.watch()
        for _ in range(CHUNKS):
            run.command("impulse", arguments.body, "--impulse", "0.01,0,0")
            run.command("step", str(arguments.ticks // CHUNKS))
        return run.tick_ms()


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--interface", required=True)
    parser.add_argument("--address", required=True, help="of the interface")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--ticks", type=int, default=1000)
    parser.add_argument("--world", type=Path, default=TOP / "worlds/busy.sdf")
    parser.add_argument("--body", default="2", help="that is pushed")
    parser.add_argument("--no-shared-memory", dest="shared_memory", action="store_false")
    parser.add_argument("--bin", type=Path, default=TOP / "build/release/bin")
    arguments = parser.parse_args()
    runs: dict[str, list[dict]] = {"open": [], "locked": []}
    with tempfile.TemporaryDirectory() as folder:
        scratch = Path(folder)
        keys = scratch / "keys"
        tessera = arguments.bin / "tessera"
        host = ["--host", arguments.address]
        subprocess.run([tessera, "keys", "create", keys, *host], check=True, stdout=subprocess.DEVNULL)
        for _ in range(arguments.rounds):
            for name in runs:
                times = measure(arguments, keys if name == "locked" else None, scratch)
                runs[name].append(times)
                print(name, "  ".join(f"{key} {times[key]:.3f} ms" for key in ("p50", "p99")), flush=True)
    for key in ("p50", "p99"):
        for what, of in (("median", statistics.median), ("least", min)):
            open_ms, locked_ms = (of(times[key] for times in runs[name]) for name in runs)
            more = 100 * (locked_ms / open_ms - 1)
            print(f"{key}, {what} of the runs: {open_ms:.3f} ms open, {locked_ms:.3f} ms locked, {more:+.1f} %")
    return 0


if __name__ == "__main__":
    sys.exit(main())
