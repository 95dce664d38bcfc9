"""An ant learns to walk: an evolution strategy in numpy, on two cores, in minutes.

    python3 examples/learn_to_walk.py --generations 40

Each of 64 ants tries a gait of its own: each hinge swings about an angle of its own, by a way and in a phase of its own.
The gaits are pairs, to both sides of the present one; that moves towards those that went far. The same seed gives the
same gait, bit by bit, on any machine: all that is not whole numbers, sums, products or sums without rounding (`fsum`) is
left to Tessera. (The sine of numpy has other bits on other processors.)
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import Any

import numpy as np

import tessera

MODEL = Path(__file__).parents[3] / "worlds" / "models" / "ant.sdf"
STEPS = 80  # of 3 ticks: 4 s
PERIOD = 16  # steps
SIGMA = 0.12  # how far gaits are from the present one
RATE = 0.15


def wave(turns: Any) -> Any:
    """As a sine, of parabolas; one period a turn."""
    x = 2 * (turns - np.floor(turns)) - 1  # -1 to 1
    return 4 * x * (np.abs(x) - 1)


def ways_of(env: tessera.VectorEnv, gaits: Any) -> Any:
    """How far ants get with these gaits [n, 3, m] along x, less a part of what they leave it by (m)."""
    low, high = env.single_action_space.low.astype(float), env.single_action_space.high.astype(float)
    middle, swing = (low + high) / 2, (high - low) / 2
    env.reset(seed=0)
    for step in range(STEPS):
        angle = gaits[:, 0] + gaits[:, 1] * wave(step / PERIOD + gaits[:, 2])
        env.step(middle + swing * np.clip(angle, -1, 1))
    assert env.last is not None
    trunk = env.last.positions[:, 0]
    return trunk[:, 0] - 0.3 * np.abs(trunk[:, 1])


def learn(env: tessera.VectorEnv, generations: int, seed: int) -> Any:
    """The gait [3, m] after so many generations."""
    generator = np.random.default_rng(seed)
    actuators = env.single_action_space.shape[0]
    gait = np.concatenate([np.zeros((1, actuators)), np.full((1, actuators), 0.3), np.zeros((1, actuators))])
    half = env.num_envs // 2
    for generation in range(generations):
        to_a_side = SIGMA * generator.choice([-1.0, 1.0], (half, *gait.shape))
        tried = np.concatenate([gait + to_a_side, gait - to_a_side])
        ways = ways_of(env, tried)
        ranks = np.argsort(np.argsort(ways, kind="stable"), kind="stable") / (env.num_envs - 1) - 0.5
        better = ranks[:half] - ranks[half:]
        step = [math.fsum(column) for column in (better[:, np.newaxis] * to_a_side.reshape(half, -1)).T]
        gait = gait + RATE * np.array(step).reshape(gait.shape)
        print(f"generation {generation + 1}: mean {ways.mean():6.3f} m, best {ways.max():6.3f} m")
    return gait


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--generations", type=int, default=40)
    parser.add_argument("--ants", type=int, default=64)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=2)
    options = parser.parse_args()
    if options.ants < 2 or options.ants % 2:
        parser.error(f"argument --ants: {options.ants} must be an even number from 2 on: gaits are tried in pairs")
    with tessera.VectorEnv(str(MODEL), options.ants, threads=options.threads, spacing=32, ticks=3) as env:
        gait = learn(env, options.generations, options.seed)
        way = ways_of(env, np.broadcast_to(gait, (options.ants, *gait.shape)))[0]
        print(f"the gait goes {way:.3f} m in {STEPS * 3 / 60:g} s; {env.client.hash()}")


if __name__ == "__main__":
    main()
