"""The friction of a crate, found from a recording of how it slid.

    pip install './client_sdk/python[record]'

A recording of a crate that slides to rest stands for a measurement. Simulations with other frictions start from its first
tick; the error of their ways is smallest where the friction is that of the crate.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import tessera
import tessera.record

TICKS = 60
SPEED = 3.0  # m/s, at first
HIDDEN = 0.37  # what is to be found


def crate_with(friction: float) -> tessera.World:
    world = tessera.World("floor", tessera.Settings(sector_size=32))
    # A contact has the smaller friction of its two bodies.
    world.add(tessera.Body("floor", tessera.plane(), motion=tessera.Motion.STATIC, friction=1.0))
    world.add(tessera.Body("crate", tessera.box(1, 1, 0.5), 20, (0, 0, 0.25), friction=friction, linear_velocity=(SPEED, 0, 0)))
    return world


def measured(file: Path) -> NDArray[np.float64]:
    """The way of the crate along x (m), from a recording."""
    with tessera.Simulation(crate_with(HIDDEN)) as simulation, simulation.record(file) as recorder:
        simulation.step(TICKS)
        recorder.run(ticks=TICKS)
    with tessera.record.read(file) as recording:
        return recording.trajectory("crate").relative_to()[:, 0, 0]


def simulated(friction: float) -> NDArray[np.float64]:
    return tessera.Simulation(crate_with(friction)).trajectory("crate", TICKS).relative_to()[:, 0, 0]


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        way = measured(Path(folder) / "slide.mcap")

    def error(friction: float) -> float:
        return float(np.sqrt(np.mean((simulated(friction) - way) ** 2)))

    # A search by golden sections.
    low, high, ratio = 0.05, 1.0, (5**0.5 - 1) / 2
    while high - low > 1e-4:
        left, right = high - ratio * (high - low), low + ratio * (high - low)
        low, high = (low, right) if error(left) < error(right) else (left, high)
    found = (low + high) / 2
    print(f"the crate slid {way[-1]:.3f} m; its friction is {found:.3f} (error of the way {1000 * error(found):.3f} mm)")


if __name__ == "__main__":
    main()
