"""The web UI of a world, for notebooks and scripts."""

from __future__ import annotations

import subprocess
import weakref
import webbrowser
from types import TracebackType

from tessera import program
from tessera.errors import Unavailable

PATIENCE_S = 15.0  # for the process to end
_SAID = "the web UI is at "


class WebUi:
    """A process of `tessera-viewer`, until `close()`, or until this process ends. A notebook shows it in its place."""

    def __init__(self, address: str, *, read_only: bool = False) -> None:
        """Of the world at host:port. NotFound if the program is missing, Unavailable, with its message, if it does not
        start.
        """
        arguments = ["--connect", address, "--listen", "127.0.0.1:0", "--exit-with-parent"]
        self._process = subprocess.Popen(
            [program.beside("tessera-viewer"), *arguments, *(["--read-only"] if read_only else [])],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        )
        self._finalizer = weakref.finalize(self, _end, self._process)
        assert self._process.stdout is not None
        first = self._process.stdout.readline()
        if not first.startswith(_SAID):
            said = first + self._process.stdout.read()
            self.close()
            raise Unavailable(said.strip().removeprefix("tessera-viewer: "))
        self.url: str = first.removeprefix(_SAID).strip()

    def open(self) -> None:
        """Opens it in the browser of the desktop."""
        webbrowser.open(self.url)

    def close(self) -> None:
        """Ends the process; does nothing if it has ended."""
        self._finalizer()

    def __enter__(self) -> WebUi:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _repr_html_(self) -> str:
        return f'<iframe src="{self.url}" width="100%" height="600" style="border: 0"></iframe>'


def _end(process: subprocess.Popen[str]) -> None:
    process.terminate()
    try:
        process.wait(PATIENCE_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
    assert process.stdout is not None
    process.stdout.close()
