"""The client of a cluster: loads a world, changes it, controls its time, watches it."""

from __future__ import annotations

import os
import weakref
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from types import TracebackType
from typing import Any, TypeVar

from tessera._proto import tessera_pb2
from tessera.any_client import CALL_TIMEOUT_S, AnyClient
from tessera.coordinators import Coordinators
from tessera.grpc_errors import raising
from tessera.keys import Keys
from tessera.request_session import RequestSession

ADDRESS_VARIABLE = "TESSERA_ADDRESS"
KEYS_VARIABLE = "TESSERA_KEYS"
ADDRESS_DEFAULT = "127.0.0.1:7300"

T = TypeVar("T")


class Client(AnyClient):
    """A connection to the coordinator of a cluster.

        with tessera.Client("127.0.0.1:7300") as client:
            client.load("worlds/tower.sdf")
            client.step(60)

    Units: m, kg, s, rad, N. Bodies are given by name or id. Calls block until the cluster has answered
    or `timeout` seconds have passed, by default 10; None waits indefinitely. Errors are those of
    `tessera.errors` and carry the message of the cluster. In addition to the errors that a method lists, each
    can raise DeadlineExceeded, and Unavailable if a process is gone. Safe to use from any thread.
    """

    def __init__(
        self,
        address: str | None = None,
        *,
        keys: str | os.PathLike[str] | None = None,
        timeout: float = CALL_TIMEOUT_S,
    ) -> None:
        """Connects to host:port. The default is TESSERA_ADDRESS, or else port 7300 of this machine.

        Of a cluster with several coordinators, the addresses of all, separated by commas: calls go to the one
        that leads, also where that changes. A cluster with keys wants a folder that `tessera keys create` made; the
        default is TESSERA_KEYS, or else none ("" for none in any case). NotFound, naming the file, if the folder
        lacks one; Unavailable if no coordinator answers within `timeout` s.
        """
        default: str = os.environ.get(ADDRESS_VARIABLE, ADDRESS_DEFAULT)
        self.address = address or default
        super().__init__()
        self._keys_read = Keys.read(os.environ.get(KEYS_VARIABLE, "") if keys is None else keys)
        self._coordinators = Coordinators(self.address, self._keys_read, timeout)
        self._session = RequestSession(self._coordinators)
        self._finalizer = weakref.finalize(self, _close, self._session, self._coordinators)

    def close(self) -> None:
        """Closes the connection; the cluster and its world stay. Streams end if the world changes servers."""
        self._finalizer()

    def __enter__(self) -> Client:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    # --- of AnyClient ---

    def _call(self, method: str, request: Any, timeout: float | None) -> Any:
        return self._coordinators.call(method, request, timeout)

    def _do(self, request: tessera_pb2.Request, timeout: float | None) -> tessera_pb2.Reply:
        return self._session.call(request, timeout)

    def _send(self, request: tessera_pb2.Request, read: Callable[[tessera_pb2.Reply], T]) -> Future[T]:
        return self._session.send(request, read)

    def _snapshot(self, timeout: float | None) -> Iterator[tessera_pb2.SnapshotPiece]:
        with raising(self._coordinators.where):
            leader = self._coordinators.leader(timeout)
            yield from leader.Snapshot(tessera_pb2.SnapshotRequest(), timeout=timeout)

    def _restore(self, pieces: Iterator[bytes], replace: bool, timeout: float | None) -> tessera_pb2.LoadReply:
        requests = (tessera_pb2.RestoreRequest(replace=replace, bytes=piece) for piece in pieces)
        with raising(self._coordinators.where):
            reply: tessera_pb2.LoadReply = self._coordinators.leader(timeout).Restore(requests, timeout=timeout)
        return reply

    def _keys(self) -> Keys:
        return self._keys_read

    def _gateway(self) -> str:
        return self._coordinators.address


def _close(session: RequestSession, coordinators: Coordinators) -> None:
    session.close()
    coordinators.close()
