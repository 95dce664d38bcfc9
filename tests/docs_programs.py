"""The programs of a build: their --help, running them, and clusters of `tessera up`."""

from __future__ import annotations

import contextlib
import os
import re
import signal
import subprocess
import threading
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path

INTERRUPTED = 128 + signal.SIGINT  # the exit code of a command that Ctrl-C ends
DEADLINE_S = 120.0  # of one command, on a busy machine

Words = tuple[str, ...]


class Failed(Exception):
    """Why a command fails."""


class Programs:
    """The programs in `folder`, which is also on their PATH.

    They run in `scratch`.
    """

    def __init__(self, folder: Path, scratch: Path) -> None:
        self.folder = folder
        self.scratch = scratch
        self.environment = os.environ | {"PATH": f"{folder}:{os.environ['PATH']}"}
        self.help = cache(self._help)

    def run(self, words: Words, address: str = "") -> str:
        """The output of a command. Failed unless it succeeds; a command that watches is interrupted."""
        process = self.start(words, {"TESSERA_ADDRESS": address} if address else {})
        with process, deadline(process):
            assert process.stdin is not None and process.stdout is not None
            process.stdin.close()
            said = process.stdout.readline()
            if is_endless(words):
                process.send_signal(signal.SIGINT)
            said += process.stdout.read()
        if process.returncode != (INTERRUPTED if is_endless(words) else 0):
            raise Failed(f"exit code {process.returncode}: {said.strip()}")
        return said

    def start(self, words: Sequence[str], variables: dict[str, str] | None = None) -> subprocess.Popen[str]:
        return subprocess.Popen(
            [self.folder / words[0], *words[1:]],
            cwd=self.scratch,
            env=self.environment | (variables or {}),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )

    def subcommand(self, words: Words) -> Words:
        """The program and subcommands at the start of a command."""
        for length in range(1, len(words)):
            if words[length] not in self.subcommands(words[:length]):
                return words[:length]
        return words

    def subcommands(self, words: Words) -> list[str]:
        """Those of all groups."""
        groups = re.findall(r"^([A-Z][a-z ]+):\n((?:  .*\n)+)", self.help(words), re.MULTILINE)
        listed = [text for title, text in groups if title not in ("Positionals", "Options", "Example", "Examples")]
        found = re.findall(r"^  ([a-z]+)", "".join(listed), re.MULTILINE)
        return ["help", *found] if found and len(words) == 1 else found

    def options(self, words: Words) -> list[str]:
        """The options of a program or subcommand."""
        said = self.help(words).partition("\nExample")[0]
        names = ",".join(re.findall(r"^  (-\S+)", said, re.MULTILINE)).split(",")
        return [re.split("[={]", name)[0] for name in names]  # --flag=false, --flag{false}: with its default

    def examples(self, words: Words) -> list[str]:
        """The command lines at the end of the help."""
        said = self.help(words).partition("\nExample")[2].partition(":")[2]
        return [line.strip() for line in said.splitlines() if line.strip()]

    def check_options(self, words: Words) -> None:
        """Failed for an unknown subcommand or option."""
        known = self.subcommand(words)
        given = words[len(known) :]
        options = self.options(known)
        if self.subcommands(known) and not set(given) & set(options):
            raise Failed(f"{' '.join(known)} has no subcommand {' '.join(given[:1])}")
        for word in given:
            option = word.partition("=")[0]
            if re.match(r"--?[a-z]", option) and option not in options:
                raise Failed(f"{' '.join(known)} has no option {option}")

    def _help(self, words: Words) -> str:
        return self.run((*words, "--help"))


class Cluster:
    """A cluster that `tessera up` starts on a free port, and that ends when its input is closed."""

    def __init__(self, programs: Programs, given: Words = ()) -> None:
        """`given` are world and options of `up`; Failed if it does not start."""
        arguments = with_option(without_option(given, "--page"), "--listen", "127.0.0.1:0")
        self._process = programs.start(["tessera", "up", "--no-page", "--end-with-input", *arguments])
        assert self._process.stdout is not None
        with deadline(self._process):  # the second line says that the world is loaded, or how to load one
            said = self._line() + self._line()
        up = re.search(r"cluster is up.* on (\S+:\d+)", said)
        if not up:
            self.stop()
            raise Failed(said.strip())
        self.address = up.group(1)

    def _line(self) -> str:
        """The next line that is no note of what a file has."""
        assert self._process.stdout is not None
        while (line := self._process.stdout.readline()).startswith("note: "):
            pass
        return line

    def stop(self) -> None:
        """Ends it. Failed if its exit code is not 0."""
        with self._process as process, deadline(process):
            said, _ = process.communicate()
        if process.returncode != 0:
            raise Failed(f"the cluster ended with exit code {process.returncode}: {said.strip()}")


@contextlib.contextmanager
def deadline(process: subprocess.Popen[str]) -> Iterator[None]:
    """Kills a process that exceeds the deadline, which also ends the wait for its output."""
    timer = threading.Timer(DEADLINE_S, process.kill)
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


def is_endless(words: Words) -> bool:
    """Whether a command runs until it is interrupted."""
    return "--watch" in words or (words[1] == "top" and not {"--once", "--help"} & set(words))


def with_option(words: Words, option: str, value: str) -> Words:
    """The command with an option set to this value."""
    return (*without_option(words, option), option, value)


def without_option(words: Words, option: str) -> Words:
    """The command without an option and its value."""
    kept = [word for word in words if not word.startswith(f"{option}=")]
    if option in kept:
        place = kept.index(option)
        del kept[place : place + 2]
    return tuple(kept)
