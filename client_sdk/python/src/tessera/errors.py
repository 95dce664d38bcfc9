"""Exceptions, which carry the message of the cluster.

Each corresponds to a status code of gRPC, and derives from the closest built-in exception.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

import grpc


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


_BY_CODE: dict[grpc.StatusCode, type[TesseraError]] = {
    grpc.StatusCode.INVALID_ARGUMENT: InvalidArgument,
    grpc.StatusCode.OUT_OF_RANGE: OutOfRange,
    grpc.StatusCode.NOT_FOUND: NotFound,
    grpc.StatusCode.ALREADY_EXISTS: AlreadyExists,
    grpc.StatusCode.FAILED_PRECONDITION: FailedPrecondition,
    grpc.StatusCode.PERMISSION_DENIED: PermissionDenied,
    grpc.StatusCode.UNAUTHENTICATED: PermissionDenied,
    grpc.StatusCode.RESOURCE_EXHAUSTED: ResourceExhausted,
    grpc.StatusCode.ABORTED: Aborted,
    grpc.StatusCode.CANCELLED: Cancelled,
    grpc.StatusCode.DEADLINE_EXCEEDED: DeadlineExceeded,
    grpc.StatusCode.DATA_LOSS: DataLoss,
    grpc.StatusCode.UNAVAILABLE: Unavailable,
}

_BY_NUMBER = {code.value[0]: kind for code, kind in _BY_CODE.items()}


@contextlib.contextmanager
def raising(where: str) -> Iterator[None]:
    """Raises the exceptions of this package for failed calls; `where` as in from_grpc()."""
    try:
        yield
    except grpc.RpcError as error:
        raise from_grpc(error, where) from None


def from_grpc(error: grpc.RpcError, where: str = "") -> TesseraError:
    """The exception for a failed call; `where` names the failing party if the message does not."""
    kind = _BY_CODE.get(error.code(), TesseraError)
    spoken = kind not in (Unavailable, DeadlineExceeded)
    return kind(error.details() if spoken or not where else f"{where}: {error.details()}")


def from_number(code: int, message: str) -> TesseraError:
    """The exception for a status code of gRPC as a number, in a reply."""
    return _BY_NUMBER.get(code, TesseraError)(message)
