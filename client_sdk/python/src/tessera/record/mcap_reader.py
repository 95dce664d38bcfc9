"""Reads MCAP files by topic and time, including files whose writer was interrupted."""

from __future__ import annotations

import io
import os
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tessera.errors import InvalidArgument
from tessera.record.mcap_format import (
    CHUNK,
    CHUNK_INDEX,
    COMPRESSION,
    FOOTER,
    MAGIC,
    MESSAGE,
    PLACE,
    RECORD,
    UINT16,
    UINT64,
    Fields,
    Opcode,
)
from tessera.record.zstd import zstandard

CHUNK_SIZE_MAX = 1 << 32  # bytes, uncompressed
CHUNKS_CACHED = 2

Places = NDArray[np.uint64]
"""Messages of a topic [n, 3]: log time (ns), number of the chunk, offset in it."""


class Message(NamedTuple):
    """One message of a topic."""

    time: int  # ns
    data: bytes


@dataclass
class _Chunk:
    """The position of a chunk in the file, and of the message index after it."""

    start: int
    index_start: int
    index_length: int = 0


class McapReader:
    """Finds messages without reading those in between. For one thread at a time.

    `is_whole` is false if the writer was interrupted: then the file ends with its last whole chunk.
    `metadata` has the values of each metadata record by its name.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        """InvalidArgument if it is not an MCAP file; OSError if it cannot be opened."""
        self._path = os.fspath(path)
        self._file = open(path, "rb")
        self._size = os.fstat(self._file.fileno()).st_size
        self._channels: dict[str, int] = {}
        self._chunks: list[_Chunk] = []
        self.metadata: dict[str, dict[str, str]] = {}
        self._chunk_data = lru_cache(CHUNKS_CACHED)(self._read_chunk)
        if self._at(0, len(MAGIC)) != MAGIC:
            raise self._broken("it does not begin as an MCAP file")
        try:
            summary = self._summary_start()
            self.is_whole = summary is not None
            self._scan(len(MAGIC) if summary is None else summary)
            self._places = self._read_places()
        except (struct.error, UnicodeDecodeError, ValueError) as error:
            raise self._broken(str(error)) from None

    def close(self) -> None:
        self._file.close()

    def times(self, topic: str) -> NDArray[np.uint64]:
        """The log times of the topic's messages in ns, ascending; empty if there is no such topic."""
        return self._of(topic)[:, 0]

    def messages(self, topic: str, start: int = 0, stop: int | None = None) -> Iterator[Message]:
        """The topic's messages with indices from `start` up to `stop`, in the order of `times()`."""
        for time, chunk, offset in self._of(topic)[start:stop].tolist():
            data = self._chunk_data(chunk)
            _, length = RECORD.unpack_from(data, offset)
            begin = offset + RECORD.size
            yield Message(time, data[begin + MESSAGE.size : begin + length])

    def _of(self, topic: str) -> Places:
        none = np.empty((0, 3), dtype=np.uint64)
        return self._places.get(self._channels.get(topic, 0), none)

    def _summary_start(self) -> int | None:
        """Where the summary begins; None if the file has no end."""
        length = RECORD.size + FOOTER.size + len(MAGIC)
        end = self._at(max(0, self._size - length), length)
        if len(end) < length or not end.endswith(MAGIC) or end[0] != Opcode.FOOTER:
            return None
        start: int = FOOTER.unpack_from(end, RECORD.size)[0]
        return start or None

    def _scan(self, at: int) -> None:
        """Processes the records from `at` to the end of their section or of the file."""
        while at + RECORD.size <= self._size:
            opcode, length = RECORD.unpack(self._at(at, RECORD.size))
            begin, at = at + RECORD.size, at + RECORD.size + length
            if at > self._size or opcode in (Opcode.DATA_END, Opcode.FOOTER):
                return
            if opcode == Opcode.CHUNK:
                self._chunks.append(_Chunk(begin, at))
            elif opcode == Opcode.MESSAGE_INDEX:
                self._chunks[-1].index_length = at - self._chunks[-1].index_start
            elif opcode in (Opcode.CHANNEL, Opcode.METADATA, Opcode.METADATA_INDEX, Opcode.CHUNK_INDEX):
                self._note(opcode, Fields(self._at(begin, length)))

    def _note(self, opcode: int, fields: Fields) -> None:
        if opcode == Opcode.CHANNEL:
            number, _ = *fields.take(UINT16), *fields.take(UINT16)
            self._channels[fields.string()] = number
        elif opcode == Opcode.METADATA:
            name = fields.string()
            self.metadata[name] = fields.string_map()
        elif opcode == Opcode.METADATA_INDEX:
            start, length = fields.take(PLACE)
            self._note(Opcode.METADATA, Fields(self._at(start, length)[RECORD.size :]))
        else:
            _, _, start, length = fields.take(CHUNK_INDEX)
            fields.prefixed()
            self._chunks.append(_Chunk(start + RECORD.size, start + length, *fields.take(UINT64)))

    def _read_places(self) -> dict[int, Places]:
        """The positions of the messages of each channel, ascending by time."""
        parts: dict[int, list[Places]] = {}
        for number, chunk in enumerate(self._chunks):
            index = self._at(chunk.index_start, chunk.index_length)
            at = 0
            while at < len(index):
                _, length = RECORD.unpack_from(index, at)
                fields = Fields(index[at + RECORD.size : at + RECORD.size + length])
                (channel,) = fields.take(UINT16)
                entries = np.frombuffer(fields.prefixed(), dtype="<u8").reshape(-1, 2)
                parts.setdefault(channel, []).append(np.insert(entries, 1, number, axis=1))
                at += RECORD.size + length
        places = {channel: np.concatenate(found) for channel, found in parts.items()}
        return {channel: found[np.argsort(found[:, 0], kind="stable")] for channel, found in places.items()}

    def _read_chunk(self, number: int) -> bytes:
        chunk = self._chunks[number]
        fields = Fields(self._at(chunk.start, chunk.index_start - chunk.start))
        _, _, size, crc = fields.take(CHUNK)
        compression, data = fields.string(), fields.prefixed(UINT64)
        if compression not in ("", COMPRESSION):
            raise self._broken(f"its chunks use {compression} compression; only {COMPRESSION} is supported")
        if size > CHUNK_SIZE_MAX:
            raise self._broken(f"it has a chunk of {size} bytes; at most {CHUNK_SIZE_MAX} are supported")
        if compression == COMPRESSION:
            try:
                data = zstandard.ZstdDecompressor().decompress(data, max_output_size=size)
            except zstandard.ZstdError as error:
                raise self._broken(f"a chunk is damaged: {error}") from None
        if crc and zlib.crc32(data) != crc:
            raise self._broken("a chunk is damaged: its CRC does not match")
        return data

    def _at(self, start: int, length: int) -> bytes:
        self._file.seek(start, io.SEEK_SET)
        return self._file.read(length)

    def _broken(self, why: str) -> InvalidArgument:
        return InvalidArgument(f"{self._path}: {why}")
