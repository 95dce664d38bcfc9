"""Files of messages: found again by topic and time, whole or interrupted anywhere."""

from __future__ import annotations

from pathlib import Path

import pytest

from tessera.errors import InvalidArgument
from tessera.record.mcap_reader import McapReader, Message
from tessera.record.mcap_writer import McapWriter


def write(path: Path, chunks: int) -> list[int]:
    """A file of two topics, ten messages a chunk. How long it was after each chunk."""
    sizes = []
    writer = McapWriter(path, "test")
    writer.add_metadata("about", {"world": "flat", "empty": "", "ü": "→"})
    even, odd = (writer.add_channel(topic, "a.Type", b"definition") for topic in ("/even", "/odd"))
    for chunk in range(chunks):
        for n in range(10 * chunk, 10 * chunk + 10):
            writer.write(odd if n % 2 else even, 1000 * n, b"%d" % n * (n + 1), n)
        writer.end_chunk()
        sizes.append(writer.size)
    writer.finish()
    return sizes


def messages(numbers: range) -> list[Message]:
    return [Message(1000 * n, b"%d" % n * (n + 1)) for n in numbers]


def test_messages_are_found_by_topic_and_time(tmp_path: Path) -> None:
    write(tmp_path / "a.mcap", 3)
    reader = McapReader(tmp_path / "a.mcap")
    assert reader.is_whole
    assert reader.metadata == {"about": {"world": "flat", "empty": "", "ü": "→"}}
    assert reader.times("/odd").tolist() == [1000 * n for n in range(1, 30, 2)]
    assert list(reader.messages("/odd")) == messages(range(1, 30, 2))
    assert list(reader.messages("/even", 4, 7)) == messages(range(8, 14, 2))
    assert reader.times("/other").tolist() == []
    assert list(reader.messages("/other")) == []
    reader.close()


def test_messages_are_in_the_order_of_their_times(tmp_path: Path) -> None:
    writer = McapWriter(tmp_path / "a.mcap", "test")
    topic = writer.add_channel("/a", "a.Type", b"")
    for n, time in enumerate((3, 1, 2, 1)):
        writer.write(topic, time, b"%d" % n, n)
        if n == 1:
            writer.end_chunk()
    writer.finish()
    read = list(McapReader(tmp_path / "a.mcap").messages("/a"))
    assert read == [Message(1, b"1"), Message(1, b"3"), Message(2, b"2"), Message(3, b"0")]


def test_whole_chunks_are_read_wherever_the_file_was_cut(tmp_path: Path) -> None:
    sizes = write(tmp_path / "a.mcap", 4)
    whole = (tmp_path / "a.mcap").read_bytes()
    for length in sorted({*range(8, len(whole), 13), *sizes, *(size - 1 for size in sizes), len(whole) - 1}):
        (tmp_path / "cut.mcap").write_bytes(whole[:length])
        reader = McapReader(tmp_path / "cut.mcap")
        chunks = sum(size <= length for size in sizes)
        assert not reader.is_whole
        assert list(reader.messages("/odd"))[: 5 * chunks] == messages(range(1, 10 * chunks, 2))
        reader.close()


def test_empty_file_is_whole(tmp_path: Path) -> None:
    write(tmp_path / "a.mcap", 0)
    reader = McapReader(tmp_path / "a.mcap")
    assert reader.is_whole
    assert list(reader.messages("/odd")) == []


def test_existing_file_is_kept(tmp_path: Path) -> None:
    (tmp_path / "a.mcap").write_text("precious")
    with pytest.raises(FileExistsError):
        McapWriter(tmp_path / "a.mcap", "test")
    assert (tmp_path / "a.mcap").read_text() == "precious"


def test_what_is_no_such_file_is_refused_by_name(tmp_path: Path) -> None:
    (tmp_path / "a.mcap").write_text("precious")
    with pytest.raises(InvalidArgument, match="a.mcap: it does not begin as an MCAP file"):
        McapReader(tmp_path / "a.mcap")


def test_damage_is_told(tmp_path: Path) -> None:
    (end,) = write(tmp_path / "a.mcap", 1)
    whole = (tmp_path / "a.mcap").read_bytes()
    start = whole.index(b"zstd") + 12 + 20  # within what is compressed
    (tmp_path / "bad.mcap").write_bytes(whole[:start] + bytes(8) + whole[start + 8 :])
    assert start < end
    with pytest.raises(InvalidArgument, match="bad.mcap: a chunk is damaged"):
        list(McapReader(tmp_path / "bad.mcap").messages("/odd"))
