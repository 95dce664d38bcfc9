"""Frames of bodies have what has changed, once, whatever servers tell again or hand to each other."""

from __future__ import annotations

from collections.abc import Sequence

from tessera._proto import tessera_pb2
from tessera.frame import BodyFrame
from tessera.known_bodies import KnownBodies
from tessera.stream_merger import StreamMerger


def state(body: int, x: float = 0, asleep: bool = True) -> tessera_pb2.BodyState:
    return tessera_pb2.BodyState(id=body, pose={"position": {"local": {"x": x}}}, asleep=asleep)


def part(
    node: int,
    states: Sequence[tessera_pb2.BodyState] = (),
    gone: Sequence[int] = (),
    whole: bool = False,
    tick: int = 1,
    servers: int = 1,
) -> tessera_pb2.BodyBatch:
    source = tessera_pb2.StreamSource(load=1, epoch=1, servers=servers)
    return tessera_pb2.BodyBatch(
        tick=tick, node=node, bodies=states, gone=gone, whole=whole, source=source
    )


def taken(known: KnownBodies, *parts: tessera_pb2.BodyBatch) -> tuple[list[int], list[int]]:
    """The ids that are in the frame, and those that are gone."""
    return told(known.take(1, parts))


def told(frame: BodyFrame) -> tuple[list[int], list[int]]:
    return frame.ids.tolist(), frame.gone.tolist()


def test_bodies_are_in_a_frame_once_they_have_changed() -> None:
    known = KnownBodies(128, complete=False)
    assert taken(known, part(1, [state(1), state(2)], whole=True)) == ([1, 2], [])
    assert taken(known, part(1)) == ([], [])
    assert taken(known, part(1, [state(1), state(2, asleep=False)])) == ([2], [])
    assert taken(known, part(1, [state(2)])) == ([2], []), "it has fallen asleep"
    assert taken(known, part(1, [state(1, x=5)])) == ([1], []), "it was moved"
    assert taken(known, part(1, gone=[2])) == ([], [2])
    assert taken(known, part(1, gone=[2])) == ([], [])
    assert taken(known, part(1, [state(2)])) == ([2], []), "it is new again"


def test_all_are_in_each_complete_frame() -> None:
    known = KnownBodies(128, complete=True)
    taken(known, part(1, [state(1), state(3)], whole=True))
    assert taken(known, part(1, [state(2)])) == ([1, 2, 3], [])
    frame = known.take(2, [part(1, [state(3, x=7)], gone=[1])])
    assert told(frame) == ([2, 3], [1])
    assert frame.local[:, 0].tolist() == [0, 7]


def test_bodies_that_move_to_another_server_are_not_gone() -> None:
    known = KnownBodies(128, complete=False)
    taken(known, part(1, [state(1), state(2)], whole=True), part(2, whole=True))
    assert taken(known, part(1, gone=[1, 2]), part(2, [state(1)])) == ([], [2])
    assert taken(known, part(1, gone=[1]), part(2)) == ([], []), "it is not there"
    assert taken(known, part(1), part(2, gone=[1])) == ([], [1])


def test_bodies_are_gone_with_a_server_unless_another_one_has_them() -> None:
    known = KnownBodies(128, complete=False)
    taken(known, part(1, [state(1)], whole=True), part(2, [state(2), state(3)], whole=True))
    assert taken(known, part(1, [state(3)])) == ([], [2])


def test_bodies_are_those_that_a_server_tells_when_it_begins_anew() -> None:
    known = KnownBodies(128, complete=False)
    taken(known, part(1, [state(1), state(2), state(3)], whole=True))
    assert taken(known, part(1, [state(1), state(3, x=1)], whole=True)) == ([3], [2])


def test_bodies_of_which_two_servers_told_are_kept_while_one_has_them() -> None:
    for loser in (1, 2):
        known = KnownBodies(128, complete=False)
        assert taken(known, part(1, [state(1)], whole=True), part(2, [state(1)], whole=True)) == ([1], [])
        assert taken(known, part(loser, gone=[1]), part(3 - loser)) == ([], [])
        assert taken(known, part(loser), part(3 - loser, gone=[1])) == ([], [1])


def test_of_parts_of_one_server_the_later_ones_count() -> None:
    known = KnownBodies(128, complete=False)
    taken(known, part(1, [state(4), state(5)], whole=True))
    frame = known.take(
        2,
        [
            part(1, [state(9)]),
            part(1, [state(1), state(2), state(3)], gone=[4, 2], whole=True),
            part(1, [state(2, x=7)], gone=[3]),
        ],
    )
    assert told(frame) == ([1, 2], [4, 5])
    assert frame.local[:, 0].tolist() == [0, 7]


def test_changes_of_ticks_that_not_all_tell_of_are_in_the_next_frame() -> None:
    merger = StreamMerger[tessera_pb2.BodyBatch](of_changes=True)
    merger.push(part(1, [state(1), state(3)], whole=True, tick=2, servers=2))
    merger.push(part(1, [state(4)], gone=[3], tick=3, servers=2))
    merger.push(part(1, tick=4, servers=2))
    merger.push(part(2, [state(2)], whole=True, tick=4, servers=2))
    tick, parts = merger.next(0)
    assert tick == 4
    assert told(KnownBodies(128, complete=False).take(tick, parts)) == ([1, 2, 4], [])
