"""Packed fields of messages as arrays, without a Python number for each value."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Packed: TypeAlias = dict[str, memoryview]
"""The bytes of packed fields, by their names."""

_LENGTH_DELIMITED = 2  # a wire type of protobuf


def packed_fields(message: Any) -> Packed:
    """The fields of a message all of which are repeated, as protobuf sends them."""
    data = memoryview(message.SerializeToString())
    names = message.DESCRIPTOR.fields_by_number
    fields: Packed = {}
    place = 0
    while place < len(data):
        tag, place = _varint(data, place)
        assert tag & 7 == _LENGTH_DELIMITED
        length, place = _varint(data, place)
        fields[names[tag >> 3].name] = data[place : place + length]
        place += length
    return fields


def put_numbers(message: Any, **columns: NDArray[Any]) -> None:
    """Fills repeated fields whose type has a fixed width on the wire; arrays are of that type."""
    for name, array in columns.items():
        data = array.tobytes()
        tag = message.DESCRIPTOR.fields_by_name[name].number << 3 | _LENGTH_DELIMITED
        message.MergeFromString(_varint_bytes(tag) + _varint_bytes(len(data)) + data)


def numbers_of(fields: Packed, name: str, kind: type[np.generic], width: int = 1) -> NDArray[Any]:
    """Those of a field with that type, which has a fixed width on the wire: [n], or [n, width]."""
    values = np.frombuffer(fields.get(name, b""), dtype=kind)
    return values if width == 1 else values.reshape(-1, width)


def varints_of(fields: Packed, name: str) -> NDArray[np.uint64]:
    """Those of a field of integers: [n]. Seven bits a byte, the lowest first; the last byte is below 128."""
    data = np.frombuffer(fields.get(name, b""), dtype=np.uint8).astype(np.uint64)
    is_last = data < 0x80
    if is_last.all():
        return data
    starts = np.flatnonzero(np.append(True, is_last[:-1]))
    place = np.arange(len(data)) - np.repeat(starts, np.diff(np.append(starts, len(data))))
    values: NDArray[np.uint64] = np.add.reduceat((data & np.uint64(0x7F)) << (7 * place).astype(np.uint64), starts)
    return values


def _varint(data: memoryview, place: int) -> tuple[int, int]:
    """The number there, and the place after it."""
    value = shift = 0
    while True:
        byte = data[place]
        place += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value, place
        shift += 7


def _varint_bytes(value: int) -> bytes:
    data = bytearray()
    while value >= 0x80:
        data.append(value & 0x7F | 0x80)
        value >>= 7
    data.append(value)
    return bytes(data)
