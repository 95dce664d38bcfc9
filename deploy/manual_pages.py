#!/usr/bin/env python3
"""Writes the manual pages of programs from what they say about themselves.

    deploy/manual_pages.py FOLDER PROGRAM...

FOLDER gets a page for each program and each of its subcommands, at any depth: tessera.1, tessera-run.1,
tessera-keys-create.1. The source is --help as CLI11 prints it. SOURCE_DATE_EPOCH sets the date of the pages.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

NAMES = {"Positionals": "ARGUMENTS", "Options": "OPTIONS", "Subcommands": "COMMANDS"}
TITLE = re.compile(r"([A-Z][^:]*):")
ENTRY = re.compile(r"  (\S.*?)(?:\s{2,}(.*))?")


@dataclass
class Section:
    """A list of options, arguments or commands, each with what it says."""

    title: str
    entries: list[tuple[str, str]] = field(default_factory=list)


@dataclass
class Help:
    """A parsed --help."""

    about: str
    usage: str
    sections: list[Section]
    examples: list[str]

    def commands(self) -> Iterator[str]:
        """The names of subcommands."""
        for section in self.sections:
            if has_commands(section):
                yield from (name for name, _ in section.entries)


def has_commands(section: Section) -> bool:
    return section.title != "Positionals" and not any(term.startswith("-") for term, _ in section.entries)


def parsed(text: str) -> Help:
    """ValueError for a help that has no usage, or a line that is none of an entry."""
    text, _, examples = re.sub(r"\nExamples?:\s", "\0", text, count=1).partition("\0")
    about, found, rest = text.partition("\nUsage: ")
    if not found:
        raise ValueError("no usage")
    usage, _, listed = rest.partition("\n")
    sections: list[Section] = []
    for line in listed.splitlines():
        if title := TITLE.fullmatch(line):
            sections.append(Section(title[1]))
        elif line.startswith("   ") and sections and sections[-1].entries:
            term, said = sections[-1].entries[-1]
            sections[-1].entries[-1] = (term, f"{said} {line.strip()}".strip())
        elif (entry := ENTRY.fullmatch(line)) and sections:
            sections[-1].entries.append((entry[1], entry[2] or ""))
        elif line.strip():
            raise ValueError(f"not an entry: {line}")
    return Help(" ".join(about.split()), usage, sections, [line.strip() for line in examples.splitlines() if line.strip()])


def escaped(text: str) -> str:
    """As roff shows it. Hyphens stay those of ASCII, so that options can be copied."""
    text = text.replace("\\", r"\e").replace("-", r"\-")
    return rf"\&{text}" if text.startswith((".", "'")) else text


def summary(about: str) -> str:
    """The first sentence, for NAME."""
    return re.split(r"(?<=[.:])\s", about, maxsplit=1)[0].rstrip(".:")


def term(words: str) -> str:
    """The name of an option, argument or command in bold, before its type and bounds."""
    name, _, rest = words.partition(" ")
    return rf"\fB{escaped(name.replace(',', ', '))}\fR {escaped(rest)}".rstrip()


def body(section: Section) -> Iterator[str]:
    for words, said in section.entries:
        yield from (".TP", term(words))
        yield escaped(said) if said else r"\&"


def page(words: Sequence[str], text: Help, version: str, seconds: int) -> str:
    """The page of a program or subcommand."""
    name = "-".join(words)
    date = time.strftime("%Y-%m-%d", time.gmtime(seconds))
    arguments = re.sub(r"^[^\[]*", "", text.usage)  # without the names of the commands
    lines = [
        f'.TH {escaped(name.upper())} 1 "{date}" "Tessera {version}" "Tessera"',
        *(".SH NAME", rf"{escaped(name)} \- {escaped(summary(text.about))}"),
        *(".SH SYNOPSIS", rf"\fB{escaped(' '.join(words))}\fR {escaped(arguments)}".rstrip()),
        *(".SH DESCRIPTION", escaped(text.about)),
    ]
    above = ""
    for section in text.sections:
        heading = NAMES.get(section.title) or ("COMMANDS" if has_commands(section) else "OPTIONS")
        if heading != above:
            lines += [f".SH {heading}"]
            above = heading
        if section.title not in NAMES:
            lines += [f".SS {escaped(section.title)}"]
        lines += body(section)
    if text.examples:
        lines += [".SH EXAMPLES", ".EX", *map(escaped, text.examples), ".EE"]
    also = ["-".join(words[:-1])] if len(words) > 1 else []
    also += [f"{name}-{command}" for command in text.commands()]
    if also:
        lines += [".SH SEE ALSO", ",\n".join(rf"\fB{escaped(other)}\fR(1)" for other in sorted(also))]
    return "\n".join(lines) + "\n"


def said_by(program: Path, arguments: Sequence[str]) -> str:
    return subprocess.run([program, *arguments], check=True, capture_output=True, text=True).stdout


def write_pages(folder: Path, program: Path, words: Sequence[str], version: str, seconds: int) -> None:
    """The page of a command, and those of its subcommands."""
    try:
        text = parsed(said_by(program, [*words[1:], "--help"]))
    except ValueError as error:
        raise SystemExit(f"{' '.join(words)} --help: {error}") from None
    (folder / f"{'-'.join(words)}.1").write_text(page(words, text, version, seconds), encoding="utf-8")
    for command in text.commands():
        write_pages(folder, program, [*words, command], version, seconds)


def main() -> int:
    if len(sys.argv) < 3:
        print(__doc__, file=sys.stderr)
        return 2
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    seconds = int(os.environ.get("SOURCE_DATE_EPOCH") or time.time())
    for program in map(Path, sys.argv[2:]):
        version = said_by(program, ["--version"]).split()[-1]
        write_pages(folder, program, [program.name], version, seconds)
    return 0


if __name__ == "__main__":
    sys.exit(main())
