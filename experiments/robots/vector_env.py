"""What `tessera.VectorEnv` adds to the ticks of its world, as a table: python3 experiments/robots/vector_env.py [--quick]

Ants of worlds/models/ant.sdf swing all hinges at 1 Hz. *Ticks* are the same actions from the same state without observations:
commands that were made before, and no queries. Times are of this process on its processors.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

import tessera

MODEL = str(Path(__file__).parents[2] / "worlds" / "models" / "ant.sdf")
SWING = np.tile([0.35, 0.25], 4)  # rad
RESET = 0.1  # of the copies, in each step


def memory_kb() -> float:
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmRSS"):
            return float(line.split()[1])
    return 0.0


def actions(count: int, step: int) -> Any:
    return SWING * np.sin(2 * np.pi * (step / 60 + np.arange(8 * count).reshape(count, 8) * 0.618))


def measure(count: int, threads: int, steps: int) -> list[str]:
    before = memory_kb()
    env = tessera.VectorEnv(MODEL, count, threads=threads, spacing=16)
    env.reset(seed=1)
    for step in range(30):
        env.step(actions(count, step))
    memory = (memory_kb() - before) / count
    state = env.state()
    wanted = [actions(count, 30 + step) for step in range(steps)]

    def timed(run: Any) -> tuple[float, float, str]:
        """Of a step: s on processors, s by the wall, and the hash at the end."""
        env.set_state(state)
        processor, wall = time.process_time(), time.perf_counter()
        for number, action in enumerate(wanted):
            run(number, action)
        return (
            (time.process_time() - processor) / steps,
            (time.perf_counter() - wall) / steps,
            env.client.hash().hash,
        )

    joints = np.concatenate([list(env.copy_at(n).joints.values()) for n in range(count)]).astype(np.uint64)
    gains = {"stiffness": 200.0, "damping": 10.0}
    made = [tessera.commands.set_drives(joints, one.ravel(), tessera.DriveMode.SERVO, **gains) for one in wanted]
    ticks = timed(lambda number, action: env.client.step(commands=made[number]))
    whole = timed(lambda number, action: env.step(action))
    generator = np.random.default_rng(1)

    def step_with_resets(number: int, action: Any) -> None:
        env.end(generator.uniform(size=count) < RESET)
        env.step(action)

    resets = timed(step_with_resets)
    assert ticks[2] == whole[2], "the same actions have the same bits"
    return [
        f"{count}",
        f"{threads}",
        f"{count / whole[1]:,.0f}",
        f"{count / whole[0]:,.0f}",
        f"{whole[0] / ticks[0]:.3f}",
        f"{resets[0] / whole[0]:.3f}",
        f"{memory:.0f}",
        whole[2][:8],
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="fewer copies and steps")
    parser.add_argument("--row", type=int, nargs=3, metavar=("COUNT", "THREADS", "STEPS"), help="one row alone")
    options = parser.parse_args()
    if options.row:
        print("| " + " | ".join(measure(*options.row)) + " |", flush=True)
        return
    quick = options.quick
    heads = ["ants", "threads", "steps/s", "steps/processor s", "of ticks", "with resets", "kB an ant", "hash"]
    print("| " + " | ".join(heads) + " |\n" + "|---" * len(heads) + "|", flush=True)
    for row in [(16, 1, 20)] if quick else [(256, 1, 60), (256, 2, 60), (4096, 1, 12), (4096, 2, 12)]:
        # In a process of its own, whose memory nobody had before.
        subprocess.run([sys.executable, __file__, "--row", *map(str, row)], check=True)


if __name__ == "__main__":
    main()
