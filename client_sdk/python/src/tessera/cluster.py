"""A cluster on this machine, for notebooks and tests."""

from __future__ import annotations

import os
import re
import subprocess
import weakref
from types import TracebackType

from tessera import program
from tessera.client import Client
from tessera.errors import Unavailable
from tessera.world import Precision

PATIENCE_S = 15.0  # for the daemons to end


class Cluster:
    """A coordinator and its sector servers, started by `tessera up`, which replaces those that are lost.

    It ends with `stop()`, with the end of a `with` block, or with this process. Interrupts of this process,
    as in a notebook, do not reach it.
    """

    def __init__(
        self,
        servers: int = 2,
        *,
        threads: int | None = None,
        precision: Precision = Precision.FLOAT32,
        keys: str | os.PathLike[str] = "",
        store: bool = True,
    ) -> None:
        """Returns when clients can connect. `threads` is the number per server; by default the cores are
        divided evenly. `keys` is a folder of `tessera keys create`, without which clients need no keys. Without a
        `store`, nothing of the world is written to disk, and commands need not wait for that; no process is
        replaced then, and the cluster ends with any of them.

        Raises NotFound if the program `tessera` is missing (see `tessera.program`), and Unavailable, with its
        message, if it does not start a cluster.
        """
        engine = "f32" if precision is Precision.FLOAT32 else "f64"
        arguments = ["up", "--listen", "127.0.0.1:0", "--servers", str(servers), "--engine", engine]
        arguments += ["--keys", os.fspath(keys)]
        arguments += [] if store else ["--no-replacement"]
        self._keys = keys
        if threads is not None:
            arguments += ["--threads", str(threads)]
        self._process = subprocess.Popen(
            [program.find(), *arguments, "--end-with-input"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        )
        self._finalizer = weakref.finalize(self, _end, self._process)
        self.address = self._await_address()

    def connect(self) -> Client:
        """A client of this cluster."""
        return Client(self.address, keys=self._keys)

    def stop(self) -> None:
        """Ends all processes of the cluster; does nothing if they have ended."""
        self._finalizer()

    def __enter__(self) -> Cluster:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()

    def _await_address(self) -> str:
        """host:port of the coordinator, from the first line."""
        assert self._process.stdout is not None
        first = self._process.stdout.readline()
        found = re.search(r"cluster is up.* on (\S+:\d+)", first)
        if found:
            return found.group(1)
        said = first + self._process.stdout.read()
        raise Unavailable(said.strip().removeprefix("tessera: "))


def _end(process: subprocess.Popen[str]) -> None:
    """Ends a cluster by closing its input, and waits until it has ended."""
    assert process.stdin is not None and process.stdout is not None
    process.stdin.close()
    try:
        process.wait(PATIENCE_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
    process.stdout.close()
