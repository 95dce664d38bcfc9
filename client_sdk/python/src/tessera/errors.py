"""Exceptions, which carry the message of the cluster.

Each corresponds to a status code of gRPC, and derives from the closest built-in exception.
"""

from __future__ import annotations


class TesseraError(Exception):
    """The base class of all errors of this package."""


class InvalidArgument(TesseraError, ValueError):
    """A value is out of bounds; the message names the field and the bound."""


class OutOfRange(TesseraError, ValueError):
    """A position is outside the 64-bit range of sectors."""


class NotFound(TesseraError, LookupError):
    """No body, joint, file or program has that name."""


class AlreadyExists(TesseraError):
    """The name is in use, or a world is loaded already."""


class FailedPrecondition(TesseraError):
    """Something is missing: a world, or servers for it."""


class PermissionDenied(TesseraError, PermissionError):
    """The cluster has keys, and those of this client do not allow the call, or are none."""


class ResourceExhausted(TesseraError):
    """A limit is reached: too much is waiting, or a stream is read too slowly."""


class Aborted(TesseraError):
    """The world was unloaded or replaced."""


class Cancelled(TesseraError):
    """The stream or call was cancelled."""


class DeadlineExceeded(TesseraError, TimeoutError):
    """No answer came in time."""


class DataLoss(TesseraError, ValueError):
    """A snapshot is damaged, or is none."""


class Unavailable(TesseraError, ConnectionError):
    """A process of the cluster cannot be reached, or is gone."""


_BY_NUMBER: dict[int, type[TesseraError]] = {
    1: Cancelled,
    3: InvalidArgument,
    4: DeadlineExceeded,
    5: NotFound,
    6: AlreadyExists,
    7: PermissionDenied,
    8: ResourceExhausted,
    9: FailedPrecondition,
    10: Aborted,
    11: OutOfRange,
    14: Unavailable,
    15: DataLoss,
    16: PermissionDenied,
}


def kind_of(code: int) -> type[TesseraError]:
    """The class of the exceptions for a status code of gRPC as a number."""
    return _BY_NUMBER.get(code, TesseraError)


def from_number(code: int, message: str) -> TesseraError:
    """The exception for a status code of gRPC as a number, in a reply."""
    return kind_of(code)(message)
