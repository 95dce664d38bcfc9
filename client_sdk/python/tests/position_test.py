"""Differences of positions keep their digits, wherever in the world they are."""

import numpy as np
import pytest

import tessera
from tessera.position import position_message, to_position

FAR = 2**62


def test_what_is_near_keeps_all_digits_at_any_distance() -> None:
    sectors = np.array([[FAR, -FAR, 7], [FAR + 1, -FAR, 7]])
    local = np.array([[0.1, -0.2, 1e-17], [-63.999, 0.25, 3.0]])
    near = tessera.relative_to(sectors, local, (FAR, -FAR, 7), 128)
    assert near.dtype == np.float64
    assert near.tolist() == [[0.1, -0.2, 1e-17], [128 - 63.999, 0.25, 3.0]]


def test_the_world_may_be_moved_by_whole_sectors() -> None:
    sectors = np.array([[3, -2, 0], [4, 5, -6]])
    local = np.random.default_rng(1).uniform(-50, 50, (2, 3))
    moved = sectors + np.array([FAR, -FAR, 12345])
    here = tessera.relative_to(sectors, local, (1, 1, 1), 100.3)
    there = tessera.relative_to(moved, local, (FAR + 1, 1 - FAR, 12346), 100.3)
    assert (here == there).all()


def test_from_one_end_of_the_world_to_the_other() -> None:
    end = 2**63
    way = tessera.relative_to([end - 1, -end, 0], [0, 0, 0], (-end, end - 1, 0), 1)
    assert way.tolist() == [2.0**64, -(2.0**64), 0]


def test_messages_hold_positions_exactly() -> None:
    position = tessera.WorldPosition((0.1, -1e-300, 1e9), (FAR, -(2**63), 2**63 - 1))
    assert to_position(position_message(position)) == position
    assert to_position(position_message((1, 2, 3))) == tessera.WorldPosition((1.0, 2.0, 3.0))


def test_what_is_no_position_is_refused_by_name() -> None:
    with pytest.raises(ValueError, match="position: 3 numbers are expected, not 2"):
        position_message((1, 2))
    with pytest.raises(ValueError):
        position_message(tessera.WorldPosition(sector=(2**63, 0, 0)))


def test_a_sector_is_three_whole_numbers() -> None:
    for sector in [(0, 0, 0.42), (0, 0), (0, 0, 0, 0)]:
        with pytest.raises(ValueError, match="sector"):
            position_message(tessera.WorldPosition((0, 0, 0), sector))  # type: ignore[arg-type]
