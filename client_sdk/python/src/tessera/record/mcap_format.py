"""The parts that files in the MCAP format (mcap.dev/spec) are made of, as far as recordings need them.

A file is a sequence of records: an opcode, a length, and fields that follow each other without gaps.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from enum import IntEnum

MAGIC = b"\x89MCAP0\r\n"
COMPRESSION = "zstd"

RECORD = struct.Struct("<BQ")  # opcode and length of what follows
FOOTER = struct.Struct("<QQI")  # where the summary begins, where its offsets do, CRC
CHUNK = struct.Struct("<QQQI")  # first and last log time, size and CRC of what is compressed
CHUNK_INDEX = struct.Struct("<QQQQ")  # first and last log time, start and length of the chunk
MESSAGE = struct.Struct("<HIQQ")  # channel, sequence, log time, publish time
MESSAGE_PLACE = struct.Struct("<QQ")  # log time, offset in the chunk
STATISTICS = struct.Struct("<QHIIIIQQ")  # messages, schemas, channels, attachments, metadata, chunks, times
SUMMARY_OFFSET = struct.Struct("<BQQ")  # opcode, start and length of a group of records
PLACE = struct.Struct("<QQ")  # start and length of a record
NUMBERED = struct.Struct("<HQ")  # an entry of a map from channels
UINT16 = struct.Struct("<H")
UINT32 = struct.Struct("<I")
UINT64 = struct.Struct("<Q")


class Opcode(IntEnum):
    """What a record is."""

    HEADER = 0x01
    FOOTER = 0x02
    SCHEMA = 0x03
    CHANNEL = 0x04
    MESSAGE = 0x05
    CHUNK = 0x06
    MESSAGE_INDEX = 0x07
    CHUNK_INDEX = 0x08
    STATISTICS = 0x0B
    METADATA = 0x0C
    METADATA_INDEX = 0x0D
    SUMMARY_OFFSET = 0x0E
    DATA_END = 0x0F


def record(opcode: Opcode, content: bytes) -> bytes:
    return RECORD.pack(opcode, len(content)) + content


def prefixed(data: bytes) -> bytes:
    """Bytes behind their length; so are arrays and maps."""
    return UINT32.pack(len(data)) + data


def string(text: str) -> bytes:
    return prefixed(text.encode())


def string_map(values: Mapping[str, str]) -> bytes:
    return prefixed(b"".join(string(key) + string(value) for key, value in values.items()))


class Fields:
    """The fields of a record, one after the other. struct.error where it ends too early."""

    def __init__(self, content: bytes) -> None:
        self._content = content
        self._at = 0

    def take(self, kind: struct.Struct) -> tuple[int, ...]:
        values = kind.unpack_from(self._content, self._at)
        self._at += kind.size
        return values

    def prefixed(self, length: struct.Struct = UINT32) -> bytes:
        (size,) = self.take(length)
        (data,) = struct.unpack_from(f"{size}s", self._content, self._at)
        self._at += size
        return bytes(data)

    def string(self) -> str:
        return self.prefixed().decode()

    def string_map(self) -> dict[str, str]:
        entries = Fields(self.prefixed())
        result = {}
        while entries._at < len(entries._content):
            key = entries.string()
            result[key] = entries.string()
        return result
