"""Writes MCAP files: compressed chunks with an index.

Debian 12 has no package for this, and recordings need only a small part of the format.
"""

from __future__ import annotations

import os
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field

from tessera.record.mcap_format import (
    CHUNK,
    CHUNK_INDEX,
    COMPRESSION,
    FOOTER,
    MAGIC,
    MESSAGE,
    MESSAGE_PLACE,
    NUMBERED,
    PLACE,
    RECORD,
    STATISTICS,
    SUMMARY_OFFSET,
    UINT16,
    UINT32,
    UINT64,
    Opcode,
    prefixed,
    record,
    string,
    string_map,
)
from tessera.record.zstd import zstandard

CHUNK_SIZE = 4 << 20  # bytes, at which a chunk is ended

_SUMMARY = (
    Opcode.SCHEMA,
    Opcode.CHANNEL,
    Opcode.STATISTICS,
    Opcode.CHUNK_INDEX,
    Opcode.METADATA_INDEX,
)


@dataclass
class _Chunk:
    """Messages that are not in the file yet."""

    data: bytearray = field(default_factory=bytearray)
    places: dict[int, bytearray] = field(default_factory=dict)  # positions of the messages of each channel
    times: list[int] = field(default_factory=list)


class McapWriter:
    """Writes a new file; `finish()` completes it. Before, the chunks that `end_chunk()` wrote can be read."""

    def __init__(self, path: str | os.PathLike[str], library: str) -> None:
        """`library` names the writer. FileExistsError if the file exists."""
        self._file = open(path, "xb")
        self._compressor = zstandard.ZstdCompressor()
        self._chunk = _Chunk()
        self._summary: dict[Opcode, list[bytes]] = {opcode: [] for opcode in _SUMMARY}
        self._counts: dict[int, int] = {}  # messages of each channel
        self._times: list[int] = []  # of the first and of the last message
        self._file.write(MAGIC + record(Opcode.HEADER, string("") + string(library)))

    @property
    def size(self) -> int:
        """Bytes written to the file."""
        return self._file.tell()

    def add_metadata(self, name: str, values: Mapping[str, str]) -> None:
        content = record(Opcode.METADATA, string(name) + string_map(values))
        place = PLACE.pack(self._file.tell(), len(content))
        self._summary[Opcode.METADATA_INDEX].append(place + string(name))
        self._file.write(content)

    def add_channel(self, topic: str, schema: str, definition: bytes) -> int:
        """A channel of protobuf messages of type `schema`, defined in `definition`, a FileDescriptorSet."""
        number = len(self._counts) + 1
        self._define(
            Opcode.SCHEMA, UINT16.pack(number) + string(schema) + string("protobuf") + prefixed(definition)
        )
        self._define(
            Opcode.CHANNEL,
            UINT16.pack(number) + UINT16.pack(number) + string(topic) + string("protobuf") + string_map({}),
        )
        self._counts[number] = 0
        return number

    def write(self, channel: int, time: int, data: bytes, sequence: int) -> None:
        """Adds a message of `time` ns."""
        chunk = self._chunk
        chunk.places.setdefault(channel, bytearray()).extend(MESSAGE_PLACE.pack(time, len(chunk.data)))
        chunk.data += RECORD.pack(Opcode.MESSAGE, MESSAGE.size + len(data))
        chunk.data += MESSAGE.pack(channel, sequence, time, time)
        chunk.data += data
        chunk.times.append(time)
        self._counts[channel] += 1
        if len(chunk.data) >= CHUNK_SIZE:
            self.end_chunk()

    def end_chunk(self) -> None:
        """Ends the chunk: all messages so far can be read, even if this process is killed."""
        chunk, self._chunk = self._chunk, _Chunk()
        if not chunk.times:
            return
        first, last = min(chunk.times), max(chunk.times)
        packed = self._compressor.compress(bytes(chunk.data))
        head = CHUNK.pack(first, last, len(chunk.data), zlib.crc32(chunk.data)) + string(COMPRESSION)
        content = record(Opcode.CHUNK, head + UINT64.pack(len(packed)) + packed)
        start = self._file.tell()
        indices, offsets = b"", b""
        for channel, places in chunk.places.items():
            offsets += NUMBERED.pack(channel, start + len(content) + len(indices))
            indices += record(Opcode.MESSAGE_INDEX, UINT16.pack(channel) + prefixed(places))
        self._file.write(content + indices)
        self._file.flush()
        self._summary[Opcode.CHUNK_INDEX].append(
            CHUNK_INDEX.pack(first, last, start, len(content))
            + prefixed(offsets)
            + UINT64.pack(len(indices))
            + string(COMPRESSION)
            + PLACE.pack(len(packed), len(chunk.data))
        )
        self._times = [min(self._times + [first]), max(self._times + [last])]

    def finish(self) -> None:
        """Ends the file with its index. Call it once."""
        self.end_chunk()
        self._file.write(record(Opcode.DATA_END, UINT32.pack(0)))
        self._summary[Opcode.STATISTICS].append(self._statistics())
        start = self._file.tell()
        summary, offsets = b"", b""
        for opcode, contents in self._summary.items():
            group = b"".join(record(opcode, content) for content in contents)
            place = SUMMARY_OFFSET.pack(opcode, start + len(summary), len(group))
            summary += group
            offsets += record(Opcode.SUMMARY_OFFSET, place)
        footer = RECORD.pack(Opcode.FOOTER, FOOTER.size) + PLACE.pack(start, start + len(summary))
        checked = summary + offsets + footer
        self._file.write(checked + UINT32.pack(zlib.crc32(checked)) + MAGIC)
        self._file.close()

    def _define(self, opcode: Opcode, content: bytes) -> None:
        self._summary[opcode].append(content)
        self._file.write(record(opcode, content))

    def _statistics(self) -> bytes:
        summary = self._summary
        first, last = self._times or (0, 0)
        return STATISTICS.pack(
            sum(self._counts.values()),
            len(summary[Opcode.SCHEMA]),
            len(summary[Opcode.CHANNEL]),
            0,
            len(summary[Opcode.METADATA_INDEX]),
            len(summary[Opcode.CHUNK_INDEX]),
            first,
            last,
        ) + prefixed(b"".join(NUMBERED.pack(*count) for count in self._counts.items()))
