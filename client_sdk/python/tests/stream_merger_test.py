"""The parts of ticks that several servers tell of become whole ticks."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from dataclasses import dataclass

import pytest

from tessera.errors import Aborted, Cancelled, DeadlineExceeded, Unavailable
from tessera.stream_merger import FRAMES_QUEUED_MAX, StreamMerger


@dataclass
class Source:
    load: int
    epoch: int
    servers: int
    first: bool
    since: int


@dataclass
class Part:
    tick: int
    ids: Sequence[int]
    node: int
    source: Source


@dataclass
class Server:
    """One of `servers` that take part in an epoch from tick `since` on."""

    node: int
    servers: int
    epoch: int = 1
    load: int = 1
    since: int = 0

    def part(self, tick: int, ids: Sequence[int] = (), first: bool = False) -> Part:
        source = Source(self.load, self.epoch, self.servers, first, self.since)
        return Part(tick, ids, self.node, source)


def ids(parts: list[Part]) -> list[int]:
    return sorted(body for part in parts for body in part.ids)


def test_tick_is_complete_when_all_have_told_of_it() -> None:
    merger, a, b = StreamMerger[Part](), Server(0, 2), Server(1, 2)
    merger.push(a.part(1, [2, 5]))
    merger.push(a.part(2, [2]))
    with pytest.raises(DeadlineExceeded):
        merger.next(0)
    merger.push(b.part(1, [3]))
    tick, parts = merger.next(0)
    assert (tick, ids(parts)) == (1, [2, 3, 5])
    with pytest.raises(DeadlineExceeded):
        merger.next(0)
    merger.push(b.part(2, [3, 5]))
    assert ids(merger.next(0)[1]) == [2, 3, 5]
    assert merger.skipped == 0


def test_ticks_that_not_all_tell_of_are_left_out() -> None:
    merger, a, b = StreamMerger[Part](), Server(0, 2), Server(1, 2)
    for tick in (3, 4, 6):
        merger.push(a.part(tick))
    for tick in (4, 5, 6):
        merger.push(b.part(tick))
    assert [merger.next(0)[0] for _ in range(2)] == [4, 6]
    assert merger.skipped == 2


def test_part_that_nobody_vouches_for_makes_an_empty_frame() -> None:
    merger, a, b = StreamMerger[Part](), Server(0, 2), Server(1, 2)
    merger.push(a.part(3, first=True))
    merger.push(a.part(4, [1]))
    merger.push(b.part(4, first=True))
    assert merger.next(0) == (4, [])


def test_whole_ticks_are_read_before_the_end() -> None:
    merger, server = StreamMerger[Part](), Server(0, 1)
    merger.push(server.part(1, [1]))
    merger.end(Unavailable("server b is gone"))
    merger.end(Cancelled("later"))
    assert not merger.push(server.part(2, [1]))
    assert merger.next(0)[0] == 1
    with pytest.raises(Unavailable, match="server b is gone"):
        merger.next(0)


def test_another_world_ends_the_stream() -> None:
    merger = StreamMerger[Part]()
    merger.push(Server(0, 1).part(7, [1]))
    assert not merger.push(Server(0, 1, epoch=2, load=2).part(0, [1]))
    assert merger.next(0)[0] == 7
    with pytest.raises(Aborted):
        merger.next(0)


def test_each_tick_is_read_once_where_the_world_is_set_back() -> None:
    """Server a is lost after it told of tick 2: what server b alone told is void, and comes again."""
    merger, a, b, alone = StreamMerger[Part](), Server(0, 2), Server(1, 2), Server(1, 1, epoch=2)
    for tick in (1, 2):
        merger.push(a.part(tick, [1]))
    for tick in (1, 2, 3, 4):
        merger.push(b.part(tick, [2]))
    assert merger.next(0)[0] == 1
    for tick in (0, 1, 2, 3):
        merger.push(alone.part(tick, [1, 2]))
    merger.push(a.part(3, [1]))  # late
    assert merger.next(0)[0] == 2
    tick, parts = merger.next(0)
    assert (tick, ids(parts)) == (3, [1, 2])
    with pytest.raises(DeadlineExceeded):
        merger.next(0)
    merger.push(alone.part(4, [1, 2]))
    assert merger.next(0)[0] == 4
    assert merger.skipped == 0


def test_what_was_told_before_sectors_moved_does_not_count() -> None:
    merger = StreamMerger[Part](of_changes=True)
    before, a, b = Server(0, 2), Server(0, 2, since=5), Server(1, 2, since=5)
    merger.push(before.part(4, [1]))  # 2 is about to come here
    merger.push(b.part(4, [3]))
    with pytest.raises(DeadlineExceeded):
        merger.next(0)
    merger.push(a.part(4, [1, 2]))
    tick, parts = merger.next(0)
    assert (tick, [part.ids for part in parts]) == (4, [[3], [1], [1, 2]]), "of a server, what it tells last counts"
    for server in (a, b):
        merger.push(server.part(5))
    assert merger.next(0)[0] == 5


def test_a_tick_that_is_told_again_comes_once() -> None:
    merger, before, after = StreamMerger[Part](of_changes=True), Server(0, 1), Server(0, 1, since=5)
    merger.push(before.part(4, [1]))
    assert merger.next(0)[0] == 4
    merger.push(after.part(4, [1, 2]))
    with pytest.raises(DeadlineExceeded):
        merger.next(0)
    merger.push(after.part(5, [1]))
    tick, parts = merger.next(0)
    assert (tick, [part.ids for part in parts]) == (5, [[1, 2], [1]])


def test_a_server_that_joins_is_waited_for() -> None:
    merger, alone, a, b = StreamMerger[Part](), Server(0, 1), Server(0, 2, epoch=2), Server(5, 2, epoch=2)
    for tick in (1, 2):
        merger.push(alone.part(tick, [1, 2]))
    for tick in (2, 3):
        merger.push(a.part(tick, [1]))
    assert [merger.next(0)[0] for _ in range(2)] == [1, 2]
    with pytest.raises(DeadlineExceeded):
        merger.next(0)
    merger.push(b.part(2, first=True))
    merger.push(b.part(3, [2]))
    assert ids(merger.next(0)[1]) == [1, 2]
    assert merger.skipped == 0


def test_a_server_that_joins_may_overtake_one_that_stays() -> None:
    merger, alone, a, b = StreamMerger[Part](), Server(0, 1), Server(0, 2, epoch=2), Server(5, 2, epoch=2)
    merger.push(alone.part(1, [1, 2]))
    for tick in (3, 4):
        merger.push(b.part(tick, [2]))
    for tick in (2, 3):
        merger.push(alone.part(tick, [1, 2]))
    for tick in (3, 4):
        merger.push(a.part(tick, [1]))
    assert [ids(merger.next(0)[1]) for _ in range(4)] == [[1, 2]] * 4
    assert merger.skipped == 0


def test_a_server_that_waits_is_let_go_when_the_world_is_set_back() -> None:
    merger, a = StreamMerger[Part](), Server(0, 2)
    for tick in range(FRAMES_QUEUED_MAX):
        merger.push(a.part(tick))
    waiting = threading.Thread(target=merger.push, args=(a.part(FRAMES_QUEUED_MAX),))
    waiting.start()
    merger.push(Server(1, 1, epoch=2).part(0))
    waiting.join()
    assert merger.next(0)[0] == 0


def test_all_sources_must_answer() -> None:
    merger = StreamMerger[Part]()
    merger.push(Server(0, 2).part(1))
    with pytest.raises(DeadlineExceeded):
        merger.wait_for_all(0)
    merger.push(Server(1, 2).part(9))
    merger.wait_for_all(0)


def test_nothing_is_lost_or_doubled_under_load() -> None:
    """Sources on threads of their own, more ticks than the queue holds, a body that changes its source."""
    ticks, sources = 4 * FRAMES_QUEUED_MAX, 3
    merger = StreamMerger[Part]()

    def tell(server: Server) -> None:
        for tick in range(1, ticks + 1):
            bodies = [1] if tick // 7 % sources == server.node else []
            merger.push(server.part(tick, [*bodies, 100 + server.node]))

    threads = [threading.Thread(target=tell, args=(Server(node, sources),)) for node in range(sources)]
    for thread in threads:
        thread.start()
    for expected in range(1, ticks + 1):
        tick, parts = merger.next(60)
        assert (tick, ids(parts)) == (expected, [1, 100, 101, 102])
    for thread in threads:
        thread.join()
    assert merger.skipped == 0


def test_ticks_are_those_of_the_servers_that_take_part_in_them() -> None:
    merger, a, b = StreamMerger[Part](), Server(0, 2), Server(1, 2)
    for tick in (1, 2):
        merger.push(a.part(tick, [1]))
    merger.push(b.part(1, [2]))
    assert merger.next(0)[0] == 1
    # From tick 3 on with another one, from tick 5 on without the second.
    for tick in (3, 4):
        merger.push(Server(0, 3, since=3).part(tick, [1]))
    merger.push(Server(0, 2, since=5).part(5, [1]))
    merger.push(Server(9, 3, since=3).part(2, first=True))  # what it began with
    for tick in (3, 4):
        merger.push(Server(9, 3, since=3).part(tick, [3]))
    merger.push(Server(9, 2, since=5).part(5, [2, 3]))
    with pytest.raises(DeadlineExceeded):  # the second is late with tick 2
        merger.next(0)
    merger.push(b.part(2, [2]))
    assert ids(merger.next(0)[1]) == [1, 2]
    merger.push(Server(1, 3, since=3).part(3, [2]))
    assert ids(merger.next(0)[1]) == [1, 2, 3]
    with pytest.raises(DeadlineExceeded):
        merger.next(0)
    merger.push(Server(1, 3, since=3).part(4, [2]))
    merger.ended(1)
    assert [merger.next(0)[0] for _ in range(2)] == [4, 5]
    assert merger.skipped == 0
