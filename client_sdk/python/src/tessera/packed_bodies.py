"""States of bodies in few bytes, with a stated error: proto/packed_bodies.h has the code."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from tessera._proto import tessera_pb2
from tessera.frame import Columns
from tessera.position import Floats, Integers

TURN_MAX = 0.1  # rad
ASLEEP, GOES_ON, TURNS_ON, HAS_VELOCITIES = 1, 2, 4, 32


@dataclass
class _Last:
    """What a body was told to be last; `position` and `orientation` are what is expected next."""

    sector: tuple[int, int, int, int] = (0, 0, 0, 0)  # and its frame
    position_now: tuple[int, ...] = ()
    position: tuple[int, ...] = ()
    orientation_now: tuple[int, ...] = ()
    orientation: tuple[int, ...] = ()


class BodyUnpacker:
    """Reads the packed batches of one server, in their order."""

    def __init__(self, precision: float, velocity_precision: float) -> None:
        self._quantum = 2 * precision / math.sqrt(3)
        self._turn = min(precision, TURN_MAX) / 4
        self._velocity = 2 * velocity_precision / math.sqrt(3)
        self._last: dict[int, _Last] = {}

    def forget(self, bodies: Iterable[int]) -> None:
        """These are gone."""
        for body in bodies:
            self._last.pop(body, None)

    def clear(self) -> None:
        """All are."""
        self._last.clear()

    def read(self, packed: tessera_pb2.PackedBodies) -> Columns:
        """The bodies of the next batch."""
        table = [(sector.i, sector.j, sector.k, sector.frame) for sector in packed.sectors]
        numbers = _numbers(packed.bodies)
        ids: list[int] = []
        sectors: list[tuple[int, int, int, int]] = []
        flags: list[int] = []
        whole: list[tuple[int, ...]] = []
        body, at = 0, 0
        while at < len(numbers):
            body += numbers[at]
            flag = numbers[at + 1]
            at += 2
            last = self._last.setdefault(body, _Last())
            if not flag & GOES_ON:
                last.sector = table[numbers[at]]
                last.position = (0, 0, 0)
                at += 1
            position = _signed(last.position, numbers, at)
            last.position = _expected(last.position_now, position) if flag & GOES_ON else position
            last.position_now = position
            orientation = _signed(last.orientation if flag & TURNS_ON else (0, 0, 0), numbers, at + 3)
            last.orientation = _expected(last.orientation_now, orientation) if flag & TURNS_ON else orientation
            last.orientation_now = orientation
            at += 6
            velocities: tuple[int, ...] = (0, 0, 0, 0, 0, 0)
            if flag & HAS_VELOCITIES:
                velocities = _signed((0, 0, 0), numbers, at) + _signed((0, 0, 0), numbers, at + 3)
                at += 6
            ids.append(body)
            sectors.append(last.sector)
            flags.append(flag)
            whole.append(position + orientation + velocities)
        rows = np.array(whole, dtype=np.float64).reshape(-1, 12)
        flagged = np.array(flags, dtype=np.int64)
        turns = _with_largest(self._turn * rows[:, 3:6], flagged // 8 % 4)
        homes = np.array(sectors, dtype=np.int64).reshape(-1, 4)
        return Columns(
            np.array(ids, dtype=np.uint64),
            homes[:, :3],
            np.hstack([self._quantum * rows[:, 0:3], turns, self._velocity * rows[:, 6:12]]),
            flagged & ASLEEP != 0,
            homes[:, 3].astype(np.uint32),
        )


def _numbers(data: bytes) -> list[int]:
    """The varints of 7 bits a byte."""
    numbers = []
    number = shift = 0
    for byte in data:
        if byte < 128 and not shift:
            numbers.append(byte)
            continue
        number |= (byte & 127) << shift
        shift += 7
        if byte < 128:
            numbers.append(number)
            number = shift = 0
    return numbers


def _signed(start: tuple[int, ...], numbers: list[int], at: int) -> tuple[int, ...]:
    """Three zigzag numbers, added to `start`."""
    x, y, z = numbers[at], numbers[at + 1], numbers[at + 2]
    return (start[0] + (x >> 1 ^ -(x & 1)), start[1] + (y >> 1 ^ -(y & 1)), start[2] + (z >> 1 ^ -(z & 1)))


def _expected(before: tuple[int, ...], now: tuple[int, ...]) -> tuple[int, ...]:
    """Numbers that go on as they did."""
    return (2 * now[0] - before[0], 2 * now[1] - before[1], 2 * now[2] - before[2])


def _with_largest(three: Floats, largest: Integers) -> Floats:
    """Unit quaternions [n, 4] from their other components [n, 3] and the places of the largest ones [n]."""
    quaternions = np.empty((len(three), 4))
    fourth = np.sqrt(np.maximum(0, 1 - (three * three).sum(axis=1)))
    for place in range(4):
        rows = largest == place
        quaternions[rows] = np.insert(three[rows], place, fourth[rows], axis=1)
    normalized: Floats = quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)
    return normalized
