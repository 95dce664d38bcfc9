"""Exceptions of this package for calls that fail."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

import grpc

from tessera.errors import DeadlineExceeded, TesseraError, Unavailable, kind_of


@contextlib.contextmanager
def raising(where: str) -> Iterator[None]:
    """Raises the exceptions of this package for failed calls; `where` as in from_grpc()."""
    try:
        yield
    except grpc.RpcError as error:
        raise from_grpc(error, where) from None


def from_grpc(error: grpc.RpcError, where: str = "") -> TesseraError:
    """The exception for a failed call; `where` names the failing party if the message does not."""
    kind = kind_of(error.code().value[0])
    spoken = kind not in (Unavailable, DeadlineExceeded)
    return kind(error.details() if spoken or not where else f"{where}: {error.details()}")
