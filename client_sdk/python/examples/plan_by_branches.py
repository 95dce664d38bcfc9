"""A shot over the cushions, planned by a thousand futures of one state.

A ball is to hit another one, which lies behind a wall, after it has bounced off a cushion. A thousand ways to push it are tried
from the same state, each in some milliseconds; then the best one is played.
"""

from __future__ import annotations

import math

import numpy as np

import tessera

TRIES = 1000
TICKS = 150


def table() -> tessera.World:
    world = tessera.World("table", tessera.Settings(sector_size=16))
    static = tessera.Motion.STATIC
    world.add(tessera.Body("cloth", tessera.plane(), motion=static, friction=0.2))
    for name, size, position in (
        ("left", (0.2, 4, 0.4), (-2.1, 0, 0.2)),
        ("right", (0.2, 4, 0.4), (2.1, 0, 0.2)),
        ("near", (4, 0.2, 0.4), (0, -2.1, 0.2)),
        ("far", (4, 0.2, 0.4), (0, 2.1, 0.2)),
        ("wall", (0.1, 1.6, 0.4), (0, -0.8, 0.2)),
    ):
        world.add(tessera.Body(name, tessera.box(*size), position=position, motion=static, friction=0.2, restitution=0.8))
    for name, position in (("white", (-1, -1, 0.15)), ("red", (1, -1, 0.15))):
        ball = tessera.Body(name, tessera.sphere(0.15), mass=0.5, position=position, friction=0.2, restitution=0.8)
        world.add(ball)
    return world


def main() -> None:
    generator = np.random.default_rng(1)
    simulation = tessera.Simulation(table())
    red = tessera.queries.body_states(prefix="red")
    before = simulation.state()
    rest = simulation.ask_one(red).local[0]

    def moved_by(direction: float, speed: float) -> float:
        """How far the red ball gets (m)."""
        velocity = (speed * math.cos(direction), speed * math.sin(direction), 0)
        simulation.restore(before, replace=True)
        answers = simulation.step(TICKS, commands=[tessera.commands.set_velocity("white", velocity)], queries=[red])
        return float(np.linalg.norm(answers[red].local[0] - rest))

    tries = np.stack([generator.uniform(0, math.pi, TRIES), generator.uniform(2, 6, TRIES)], axis=1).tolist()
    ways = [moved_by(*one) for one in tries]
    hits = sum(way > 0.01 for way in ways)
    best = tries[int(np.argmax(ways))]
    print(f"{hits} of {TRIES} shots hit the red ball")
    print(f"best: {math.degrees(best[0]):.1f} degrees at {best[1]:.2f} m/s moves it by {max(ways):.3f} m")
    print(f"played again: {moved_by(*best):.3f} m")


if __name__ == "__main__":
    main()
