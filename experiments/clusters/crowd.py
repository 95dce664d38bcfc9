#!/usr/bin/env python3
"""Runs a cluster in real time among a thousand clients that connect, watch, stall and vanish, and measures whether
memory stays flat and ticks unharmed.

    experiments/clusters/crowd.py [--minutes M] [--clients N] [--world FILE] [--bin FOLDER] [--csv FILE]

Starts `tessera up` with two servers, and processes with at most 200 clients each. A client connects, asks for the
status, opens a stream of the bodies near some place, and then reads it, reads slowly, does not read at all, or
leaves; then it begins anew. Once in 20 s one of the processes is killed, with all its clients, and another one takes
its place. For half a minute before the clients come and as long after they have left, the cluster is alone. Prints a line
in 30 s, and at the end ticks and memory of the three parts. Ticks count as late where the world has fallen behind real time by
more than two ticks since the look before, two seconds ago.

Needs Debian's python3-grpcio, protobuf-compiler and python3-protobuf.
"""

from __future__ import annotations

import argparse
import asyncio
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

from soak import TOP, Cluster, resident_mb

CLIENTS_PER_PROCESS = 200
KILL_EVERY_S = 20.0
SAMPLE_EVERY_S = 2.0
PRINT_EVERY_S = 30.0
ALONE_S = 30.0  # before and after
EVERY_TICKS = 6  # of a stream: 10 batches a second
STAY_S = (2.0, 40.0)
MANNERS = ("reads", "reads", "reads", "reads slowly", "stalls", "leaves at once")


def modules(scratch: Path) -> None:
    """Makes the modules of the protocol in `scratch`."""
    proto = TOP / "proto"
    subprocess.run(
        ["protoc", f"--proto_path={proto}", f"--python_out={scratch}", "tessera.proto", "world.proto"],
        cwd=proto,
        check=True,
    )


class Client:
    """One after the other, clients of one place in the crowd."""

    def __init__(self, address: str, seed: int) -> None:
        self._address = address
        self._random = random.Random(seed)
        self.batches = 0

    async def live(self) -> None:
        import grpc

        while True:
            await asyncio.sleep(self._random.uniform(0, 3))
            try:
                await self._visit()
            except grpc.aio.AioRpcError:
                pass  # a slow client is disconnected, and comes again

    async def _visit(self) -> None:
        import grpc
        import tessera_pb2 as messages

        options = [("grpc.use_local_subchannel_pool", 1)]  # a connection of its own
        async with grpc.aio.insecure_channel(self._address, options) as channel:
            ask = channel.unary_unary(
                "/tessera.v1.Tessera/GetStatus",
                request_serializer=messages.StatusRequest.SerializeToString,
                response_deserializer=messages.StatusReply.FromString,
            )
            status = await ask(messages.StatusRequest(), timeout=30)
        manner = self._random.choice(MANNERS)
        if manner == "leaves at once":
            return
        server = self._random.choice(status.servers).stream_address
        async with grpc.aio.insecure_channel(server, options) as channel:
            watch = channel.unary_stream(
                "/tessera.v1.Streams/WatchBodies",
                request_serializer=messages.WatchBodiesRequest.SerializeToString,
                response_deserializer=lambda batch: batch,
            )
            await self._stay(watch(messages.WatchBodiesRequest(every_ticks=EVERY_TICKS, in_columns=True)), manner)

    async def _stay(self, stream: object, manner: str) -> None:
        import grpc

        until = time.monotonic() + self._random.uniform(*STAY_S)
        await stream.read()
        if manner == "stalls":
            await asyncio.sleep(until - time.monotonic())
            return
        while time.monotonic() < until:
            if await stream.read() is grpc.aio.EOF:
                return
            self.batches += 1
            if manner == "reads slowly":
                await asyncio.sleep(1)


async def be_clients(address: str, count: int, seed: int) -> None:
    await asyncio.gather(*(Client(address, seed + n).live() for n in range(count)))


class Crowd:
    """Processes of clients."""

    def __init__(self, address: str, clients: int, scratch: Path) -> None:
        self._address = address
        self._scratch = scratch
        self._random = random.Random(3)
        self._seed = 0
        self._processes: list[tuple[subprocess.Popen, int]] = []
        while clients > 0:
            self._start(min(clients, CLIENTS_PER_PROCESS))
            clients -= CLIENTS_PER_PROCESS
        self.kills = 0

    def _start(self, clients: int) -> None:
        self._seed += 1000
        command = [sys.executable, __file__, "--be-clients", str(clients), str(self._seed), self._address]
        environment = {**os.environ, "PYTHONPATH": str(self._scratch), "GRPC_VERBOSITY": "NONE"}
        self._processes.append((subprocess.Popen(command, env=environment), clients))

    def kill_one(self) -> None:
        process, clients = self._processes.pop(self._random.randrange(len(self._processes)))
        process.send_signal(signal.SIGKILL)
        process.wait()
        self.kills += 1
        self._start(clients)

    def end(self) -> None:
        for process, _ in self._processes:
            process.kill()
            process.wait()


class Clock:
    """How far the world falls behind real time between two looks at it."""

    def __init__(self) -> None:
        self._behind_s: float | None = None

    def tell(self, time_s: float) -> float:
        behind_s = time.monotonic() - time_s
        before, self._behind_s = self._behind_s, behind_s
        return 0.0 if before is None else behind_s - before


def run(cluster: Cluster, arguments: argparse.Namespace, scratch: Path) -> int:
    if not cluster.command("resume"):
        return 1
    watched = {f"server_{n}": pid for n, pid in enumerate(cluster.servers())}
    watched["coordinator"] = cluster.coordinator()
    clock = Clock()
    crowd: Crowd | None = None
    samples: list[dict] = []
    begin = time.monotonic()
    end = 2 * ALONE_S + 60 * arguments.minutes
    next_kill = ALONE_S + KILL_EVERY_S
    try:
        while (now := time.monotonic() - begin) < end:
            part = "before" if now < ALONE_S else "among" if now < end - ALONE_S else "after"
            if part == "among" and crowd is None:
                crowd = Crowd(cluster.address, arguments.clients, scratch)
            if part == "after" and crowd is not None:
                crowd.end()
                crowd = None
            if crowd is not None and now >= next_kill:
                crowd.kill_one()
                next_kill += KILL_EVERY_S
            status = cluster.status()
            if not status or status["state"] != "running":
                print("the world does not run:", status.get("failure", ""), file=sys.stderr)
                return 1
            fallen_s = clock.tell(status["time"])
            samples.append(
                {
                    "s": round(now),
                    "part": part,
                    "tick": status["tick"],
                    "fallen_behind_ms": round(1000 * fallen_s, 1),
                    "mean_ms": round(status["tick_ms"]["mean"], 3),
                    "own_ms": round(max(server["own_ms"] for server in status["servers"]), 3),
                    "p50_ms": round(status["tick_ms"]["p50"], 3),
                    "p99_ms": round(status["tick_ms"]["p99"], 3),
                    "max_ms": round(status["tick_ms"]["max"], 1),
                    "recoveries": status["recoveries"],
                    **{f"{name}_mb": round(resident_mb(pid), 1) for name, pid in watched.items()},
                }
            )
            if len(samples) % round(PRINT_EVERY_S / SAMPLE_EVERY_S) == 1:
                print("  ".join(f"{key} {value}" for key, value in samples[-1].items()), flush=True)
            time.sleep(max(0.0, SAMPLE_EVERY_S - (time.monotonic() - begin - now)))
    finally:
        if crowd is not None:
            crowd.end()
    if arguments.csv:
        with arguments.csv.open("w", newline="") as file:
            writer = csv.DictWriter(file, samples[0].keys())
            writer.writeheader()
            writer.writerows(samples)
    tick_ms = 1000 * status["settings"]["time_step"]
    for part in ("before", "among", "after"):
        of_part = [sample for sample in samples if sample["part"] == part]
        late = sum(sample["fallen_behind_ms"] > 2 * tick_ms for sample in of_part)
        ticks = max(1, of_part[-1]["tick"] - of_part[0]["tick"])
        ms = (of_part[-1]["mean_ms"] * of_part[-1]["tick"] - of_part[0]["mean_ms"] * of_part[0]["tick"]) / ticks
        own = statistics.median(sample["own_ms"] for sample in of_part)
        rate = (of_part[-1]["tick"] - of_part[0]["tick"]) / max(1, of_part[-1]["s"] - of_part[0]["s"])
        memory = ", ".join(
            f"{name} {max(sample[f'{name}_mb'] for sample in of_part):.0f} MB" for name in watched
        )
        print(f"{part}: {rate:.1f} ticks a second, late in {late} of {len(of_part)} looks; a tick took {ms:.2f} ms in")
        print(f"  the mean, of which a server's own work {own:.2f} ms in the middle; at most {memory}")
    first, last = samples[0], samples[-1]
    print(f"ticks since the load: p50 {last['p50_ms']} ms, p99 {last['p99_ms']} ms, longest {last['max_ms']} ms")
    print(f"{last['recoveries'] - first['recoveries']} recoveries")
    return 0


def main() -> int:
    if sys.argv[1:2] == ["--be-clients"]:
        os.nice(10)  # as if they were on other machines
        asyncio.run(be_clients(sys.argv[4], int(sys.argv[2]), int(sys.argv[3])))
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=10, help="that the clients are there")
    parser.add_argument("--clients", type=int, default=1000)
    parser.add_argument("--world", type=Path, default=TOP / "worlds/falling.sdf")
    parser.add_argument("--bin", type=Path, default=TOP / "build/release/bin")
    parser.add_argument("--csv", type=Path)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        scratch = Path(folder)
        modules(scratch)
        cluster = Cluster(arguments.bin, arguments.world, scratch, servers=2)
        try:
            return run(cluster, arguments, scratch)
        finally:
            cluster.end()


if __name__ == "__main__":
    sys.exit(main())
