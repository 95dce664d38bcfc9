"""Follows tutorials as a reader does: writes their files, runs their commands, and compares what is printed.

    tests/tutorials_check.py build/release docs/tutorials/world.md...

Each page runs in one shell, in a folder of its own that looks like the top of the repository. Of a page count

- indented blocks and fenced shell blocks: commands, which must succeed. Those that install, build or need root
  (SET_UP) are left out: the build to test is there already;
- other fenced blocks below a line that ends with the name of a file, as in "Save this as `lane.sdf`:": that file;
- `<!-- $ COMMAND -->`: a command that readers do not see, such as one that provokes an error; it may fail;
- `text` blocks: what the commands before them print, unless all of those are left out. Their lines must come in this
  order; lines between them may be left out, and `...` stands for anything within a line.

Clusters listen at a free port instead of 7300, and have no web UI. Prints the first line of each page that fails; exit
code 1 if any does.
"""

from __future__ import annotations

import os
import queue
import re
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from docs_pages import INDENT, SHELL_FENCES

TOP = Path(__file__).resolve().parent.parent
DEADLINE_S = 120.0
SET_UP = re.compile(r"((sudo|git|pip|npm|apt) |\./run|\./test|deploy/|(/usr/bin/)?python3 -m venv|source |export (PATH|TESSERA_COMMAND)=)")
HIDDEN = re.compile(r"<!-- \$ (.*) -->")
FILE = re.compile(r"`([^`\s]+)`:$")
DONE = "-- these commands are done"


class Failed(Exception):
    """What a page promises, and does not happen."""


@dataclass(frozen=True)
class Block:
    kind: str  # commands, file or output
    line: int
    text: str
    name: str = ""  # of a file


def blocks(page: Path) -> Iterator[Block]:
    """The blocks of a page that count, in order."""
    lines = page.read_text(encoding="utf-8").splitlines()
    before, at = "", 0
    while at < len(lines):
        line, first = lines[at], at
        at += 1
        if line.startswith("```"):
            while lines[at] != "```":
                at += 1
            at += 1
            text = "\n".join(lines[first + 1 : at - 1]) + "\n"
            if line in SHELL_FENCES:
                yield Block("commands", first + 1, text)
            elif line == "```text":
                yield Block("output", first + 1, text)
            elif found := FILE.search(before):
                yield Block("file", first + 1, text, found.group(1))
        elif hidden := HIDDEN.fullmatch(line):
            command = hidden.group(1)
            yield Block("commands", first + 1, f"{command}\n" if command.endswith("&") else f"{{ {command}; }} || true\n")
        elif line.startswith(INDENT) and not before_is_text(lines, first):
            while at < len(lines) and (lines[at].startswith(INDENT) or not lines[at].strip()):
                at += 1
            yield Block("commands", first + 1, "\n".join(each[len(INDENT) :] for each in lines[first:at]) + "\n")
        if line.strip():
            before = line


def before_is_text(lines: list[str], at: int) -> bool:
    """Whether an indented line continues a paragraph or list."""
    return at > 0 and bool(lines[at - 1].strip())


class Shell:
    """A shell of one page. What its commands print arrives line by line, also from those in the background."""

    def __init__(self, build: Path, folder: Path) -> None:
        self._seen: list[str] = []
        self._lines: queue.Queue[str | None] = queue.Queue()
        self._port = free_port()
        programs = folder / ".programs"
        programs.mkdir()
        wrapper = programs / "tessera"
        wrapper.write_text(
            "#!/bin/sh\n"
            f'real="{build}/bin/tessera"\n'
            '[ "$1" = up ] || exec "$real" "$@"\n'
            f'shift\nexec "$real" up --no-page --listen 127.0.0.1:{self._port} "$@"\n'
        )
        wrapper.chmod(0o755)
        python = build / "client_sdk/python/environment/bin"
        self._process = subprocess.Popen(
            ["bash", "--noprofile", "--norc", "-eo", "pipefail"],
            cwd=folder,
            env=os.environ
            | {
                "PATH": f"{programs}:{build / 'bin'}:{python}:{os.environ['PATH']}",
                "TESSERA_ADDRESS": f"127.0.0.1:{self._port}",
                "TESSERA_COMMAND": str(build / "bin/tessera"),
                "MPLBACKEND": "Agg",
                "HOME": str(folder),
            },
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        )
        threading.Thread(target=self._read, daemon=True).start()

    def run(self, commands: str) -> None:
        """Runs commands until the last one has ended, or is in the background. Failed unless all succeed."""
        self._seen.clear()
        assert self._process.stdin is not None
        self._process.stdin.write(f"{{\n{commands}}} </dev/null\necho '{DONE}'\n")
        self._process.stdin.flush()
        self._wait(lambda line: line == DONE, "the command does not end")

    def expect(self, text: str) -> None:
        """Failed unless the last commands print these lines, or do so soon."""
        wanted = [line for line in text.splitlines() if line.strip()]
        said = iter(list(self._seen))
        for line in wanted:
            pattern = pattern_of(line)
            if not any(matches(pattern, each) for each in said):
                said = iter(())
                self._wait(partial(matches, pattern), f"not printed: {line}")

    def end(self) -> None:
        """Ends the shell, and what it has left in the background."""
        for number in (signal.SIGTERM, signal.SIGKILL):
            try:
                os.killpg(self._process.pid, number)
                self._process.wait(10)
            except (ProcessLookupError, subprocess.TimeoutExpired):
                continue

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self._lines.put(line.rstrip("\n").replace(f":{self._port}", ":7300"))
        self._lines.put(None)

    def _wait(self, arrived: Callable[[str], bool], otherwise: str) -> None:
        until = time.monotonic() + DEADLINE_S
        while True:
            try:
                line = self._lines.get(timeout=1)
            except queue.Empty:
                if self._process.poll() is not None:
                    raise self._failed("a command fails") from None
                if time.monotonic() > until:
                    raise self._failed(otherwise) from None
                continue
            if line is None:
                raise self._failed("a command fails")
            self._seen.append(line)
            if arrived(line):
                return

    def _failed(self, why: str) -> Failed:
        return Failed("\n    ".join([why, "what was printed:", *self._seen]))


def matches(pattern: re.Pattern[str], line: str) -> bool:
    return pattern.fullmatch(collapsed(line)) is not None


def pattern_of(line: str) -> re.Pattern[str]:
    return re.compile(".*".join(map(re.escape, collapsed(line).split("..."))))


def collapsed(line: str) -> str:
    return " ".join(line.split())


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def without_set_up(commands: str) -> str:
    joined = commands.replace("\\\n", " ")
    kept = [line for line in joined.splitlines() if line.strip() and not SET_UP.match(line.strip())]
    return "".join(f"{line}\n" for line in kept).replace("build/release/bin/", "")


def follow(page: Path, build: Path) -> int:
    """Does what a page says, and returns how many blocks were compared or run."""
    done = 0
    with tempfile.TemporaryDirectory(prefix="tessera-tutorial-") as name:
        folder = Path(name)
        for each in ("client_sdk", "worlds", "docs", "deploy"):
            (folder / each).symlink_to(TOP / each)
        (folder / "build").mkdir()
        (folder / "build/release").symlink_to(build)
        shell = Shell(build, folder)
        commands = ""
        try:
            for block in blocks(page):
                done += 1
                try:
                    if block.kind == "file":
                        (folder / block.name).write_text(block.text, encoding="utf-8")
                    elif block.kind == "commands":
                        commands = without_set_up(block.text)
                        if commands:
                            shell.run(commands)
                    elif commands:
                        shell.expect(block.text)
                except Failed as failure:
                    raise Failed(f"{page}:{block.line}: {failure}") from None
        finally:
            shell.end()
    return done


def main() -> int:
    if len(sys.argv) < 3:
        print(__doc__, file=sys.stderr)
        return 2
    build = Path(sys.argv[1]).resolve()
    failed = 0
    for page in map(Path, sys.argv[2:]):
        try:
            print(f"{page}: {follow(page, build)} blocks")
        except Failed as failure:
            print(failure)
            failed += 1
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
