"""The parts of ticks that several servers tell of become whole ticks."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from dataclasses import dataclass

import pytest

from tessera.errors import Aborted, Cancelled, DeadlineExceeded, Unavailable
from tessera.stream import FRAMES_QUEUED_MAX, StreamMerger


@dataclass
class Part:
    tick: int
    ids: Sequence[int] = ()


def ids(parts: list[Part]) -> list[int]:
    return sorted(body for part in parts for body in part.ids)


def test_tick_is_complete_when_all_have_told_of_it() -> None:
    merger = StreamMerger[Part](2)
    merger.push(0, Part(1, [2, 5]))
    merger.push(0, Part(2, [2]))
    with pytest.raises(DeadlineExceeded):
        merger.next(0)
    merger.push(1, Part(1, [3]))
    tick, parts = merger.next(0)
    assert (tick, ids(parts)) == (1, [2, 3, 5])
    with pytest.raises(DeadlineExceeded):
        merger.next(0)
    merger.push(1, Part(2, [3, 5]))
    assert ids(merger.next(0)[1]) == [2, 3, 5]
    assert merger.skipped == 0


def test_ticks_that_not_all_tell_of_are_left_out() -> None:
    merger = StreamMerger[Part](2)
    for tick in (3, 4, 6):
        merger.push(0, Part(tick))
    for tick in (4, 5, 6):
        merger.push(1, Part(tick))
    assert [merger.next(0)[0] for _ in range(2)] == [4, 6]
    assert merger.skipped == 2


def test_part_that_nobody_vouches_for_makes_an_empty_frame() -> None:
    merger = StreamMerger[Part](2)
    merger.push(0, Part(3), is_whole=False)
    merger.push(0, Part(4, [1]))
    merger.push(1, Part(4), is_whole=False)
    assert merger.next(0) == (4, [])


def test_whole_ticks_are_read_before_the_end() -> None:
    merger = StreamMerger[Part](1)
    merger.push(0, Part(1, [1]))
    merger.end(Unavailable("server b is gone"))
    merger.end(Cancelled("later"))
    assert not merger.push(0, Part(2, [1]))
    assert merger.next(0)[0] == 1
    with pytest.raises(Unavailable, match="server b is gone"):
        merger.next(0)


def test_time_that_goes_back_ends_the_stream() -> None:
    merger = StreamMerger[Part](1)
    merger.push(0, Part(7, [1]))
    assert not merger.push(0, Part(0, [1]))
    assert merger.next(0)[0] == 7
    with pytest.raises(Aborted):
        merger.next(0)


def test_all_sources_must_answer() -> None:
    merger = StreamMerger[Part](2)
    merger.push(0, Part(1))
    with pytest.raises(DeadlineExceeded):
        merger.wait_for_all(0)
    merger.push(1, Part(9))
    merger.wait_for_all(0)


def test_nothing_is_lost_or_doubled_under_load() -> None:
    """Sources on threads of their own, more ticks than the queue holds, a body that changes its source."""
    ticks, sources = 4 * FRAMES_QUEUED_MAX, 3
    merger = StreamMerger[Part](sources)

    def tell(source: int) -> None:
        for tick in range(1, ticks + 1):
            merger.push(
                source, Part(tick, [100 + source, 1] if tick // 7 % sources == source else [100 + source])
            )

    threads = [threading.Thread(target=tell, args=(source,)) for source in range(sources)]
    for thread in threads:
        thread.start()
    for expected in range(1, ticks + 1):
        tick, parts = merger.next(60)
        assert (tick, ids(parts)) == (expected, [1, 100, 101, 102])
    for thread in threads:
        thread.join()
    assert merger.skipped == 0
