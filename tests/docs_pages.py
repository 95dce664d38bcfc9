"""Markdown pages: their links, and the commands that they contain."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

SHELL_FENCES = ("```sh", "```bash", "```console")
INDENT = " " * 4
LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")
ASSIGNMENT = re.compile(r"[A-Z_]+=")
CONTROL = {"&", "&&", "||", "|", ";"}


@dataclass(frozen=True)
class Link:
    page: Path
    line: int
    target: str


@dataclass(frozen=True)
class Command:
    """One simple command of a shell line."""

    page: str  # its name in messages
    line: int
    words: tuple[str, ...]

    def __str__(self) -> str:
        return f"{self.page}:{self.line}: {shlex.join(self.words)}"


def links(page: Path) -> Iterator[Link]:
    """The links and pictures of a page, except those in code."""
    for number, line in _lines(page, in_code=False):
        for target in LINK.findall(re.sub(r"`[^`]*`", "", line)):
            yield Link(page, number, target)


def anchors(page: Path) -> set[str]:
    """The valid anchors of links: headings, in lower case, with - between words."""
    titles = (line.lstrip("#").strip() for _, line in _lines(page, in_code=False) if line.startswith("#"))
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


def shell_commands(page: Path, name: str) -> Iterator[Command]:
    """The commands in indented blocks and in fenced shell blocks, in order."""
    for number, line in shell_lines(page):
        yield from split(line, name, number)


def shell_lines(page: Path) -> Iterator[tuple[int, str]]:
    """The numbered lines of those blocks, each with what continues it."""
    first, whole = 0, ""
    for number, line in _lines(page, in_code=True):
        first = first if whole else number
        whole += line.removesuffix("\\")
        if not line.endswith("\\"):
            yield first, whole
            whole = ""


def split(text: str, page: str, line: int) -> Iterator[Command]:
    """The simple commands of a line, without comments and leading variable assignments."""
    lexer = shlex.shlex(text, posix=True, punctuation_chars=True)
    lexer.whitespace_split = True
    words: list[str] = []
    try:
        for token in [*lexer, ";"]:
            if token not in CONTROL:
                words.append(token)
                continue
            while words and ASSIGNMENT.match(words[0]):
                words.pop(0)
            if words:
                yield Command(page, line, tuple(words))
            words = []
    except ValueError:  # an unmatched quote: not a shell line
        return


def _lines(page: Path, in_code: bool) -> Iterator[tuple[int, str]]:
    """The numbered lines inside shell blocks, or those outside any code."""
    fence, indented, blank = "", False, True
    for number, line in enumerate(page.read_text(encoding="utf-8").splitlines(), 1):
        if line.startswith("```"):
            fence = "" if fence else line.rstrip()
            continue
        indented = not fence and line.startswith(INDENT) and (indented or blank)
        blank = not line.strip()
        if in_code == bool(indented or fence in SHELL_FENCES) and (in_code or not fence):
            yield number, line.strip()
