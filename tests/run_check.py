"""Checks that ./run refuses wrong arguments before it builds, as `tessera run` does after it.

    tests/run_check.py build/release/bin

The script runs in a folder of its own, where the build only leaves a mark, and the command says what it is given.
Prints what is not so; exit code 1 if anything is.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

TOP = Path(__file__).resolve().parent.parent
HELP = "deploy/run_help.txt"

REFUSED = (
    ("--secnds", "3"),
    ("--seconds",),
    ("tower.sdf", "other.sdf"),
    ("tower.sdf", "other.sdf", "another.sdf"),
    ("tower.sdf", "--x"),
    ("tower.sdf", "--no-such", "--secnds=1"),
    ("--shift",),
    ("--prove", "--json"),
    ("nowhere.sdf",),
    ("folder",),
    ("--seconds", "1", "nowhere.sdf"),
)
# What the command gets in the end, where DEFAULT is the world that is run if none is named.
ACCEPTED = {
    (): "run DEFAULT --prove",
    ("tower.sdf",): "run tower.sdf --prove",
    ("--seconds", "2", "tower.sdf", "--shift", "-1,0,0"): "run tower.sdf --prove --seconds 2 --shift -1,0,0",
    ("--seconds=2", "--engine", "f32", "--in-process"): "run DEFAULT --prove --seconds=2 --engine f32 --in-process",
    ("tower.sdf", "--json", "--prove"): "run tower.sdf --prove --json --prove",
}


class Scratch:
    """A copy of ./run with a build and a command that only say that they were started."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.world = folder / "worlds/earth.sdf"
        for name in ("run", "deploy/run_arguments.sh", HELP, "worlds/earth.sdf", "worlds/tower.sdf"):
            (folder / name).parent.mkdir(exist_ok=True)
            shutil.copy(TOP / name, folder / name)
        for name, text in (
            ("deploy/build.sh", 'touch "$(dirname "$0")/built"'),
            ("build/release/bin/tessera", 'echo "$@"'),
        ):
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_text(f"#!/usr/bin/env bash\n{text}\n")
            (folder / name).chmod(0o755)
        for name in ("tower.sdf", "other.sdf", "another.sdf"):
            shutil.copy(TOP / "worlds/tower.sdf", folder / name)
        (folder / "folder").mkdir()

    def run(self, words: tuple[str, ...], program: Path | None = None) -> subprocess.CompletedProcess[str]:
        command = [self.folder / "run", *words] if program is None else [program, "run", *words]
        return subprocess.run(command, cwd=self.folder, capture_output=True, text=True, timeout=120)

    def was_built(self) -> bool:
        mark = self.folder / "deploy/built"
        was = mark.exists()
        mark.unlink(missing_ok=True)
        return was


def first_line(said: subprocess.CompletedProcess[str], scratch: Scratch) -> str:
    """Without the folder, what may have been meant, and the bounds after the kind of a value."""
    line = (said.stderr.splitlines() or [""])[0].replace(f"{scratch.folder}/", "")
    line = re.sub(r" \(did you mean [^)]*\)", "", line)
    head, found, _ = line.partition(" required ")
    return head + found + line[len(head + found) :].partition(":")[0].replace(" missing", "") if found else line


def check_refusals(scratch: Scratch, program: Path) -> Iterator[str]:
    for words in REFUSED:
        script, command = scratch.run(words), scratch.run(words, program)
        if scratch.was_built():
            yield f"{words}: it builds first"
        if script.returncode != command.returncode or first_line(script, scratch) != first_line(command, scratch):
            yield f"{words}: ./run says {script.returncode}, {script.stderr}, and not {command.returncode}, {command.stderr}"


def check_others(scratch: Scratch) -> Iterator[str]:
    for words, expected in ACCEPTED.items():
        said = scratch.run(words)
        got = said.stdout.splitlines()[:1]
        wanted = expected.replace("DEFAULT", str(scratch.world)).replace("tower.sdf", f"{scratch.folder}/tower.sdf")
        if not scratch.was_built() or got != [wanted]:
            yield f"{words}: the command gets {got}, not {wanted}; {said.stderr}"
    for option in ("--plain", "--from"):
        said = scratch.run((option, "x"))
        if scratch.was_built() or said.returncode != 2 or f"--prove, which ./run adds, excludes {option}" not in said.stderr:
            yield f"{option}: {said.returncode}, {said.stderr}"


def check_help(scratch: Scratch, program: Path) -> Iterator[str]:
    real = subprocess.run([program, "run", "--help"], capture_output=True, text=True, check=True).stdout
    if (TOP / HELP).read_text() != real:
        yield f"{HELP} is not what the command says: build/release/bin/tessera run --help >{HELP}"
    said = scratch.run(("tower.sdf", "--help"))
    if scratch.was_built() or said.returncode != 0 or not said.stdout.endswith(real) or "./run [WORLD.sdf]" not in said.stdout:
        yield f"./run --help: {said.returncode}, {said.stdout}{said.stderr}"


def main() -> int:
    if len(sys.argv) != 2:
        print(__doc__, file=sys.stderr)
        return 2
    program = Path(sys.argv[1]).resolve() / "tessera"
    with tempfile.TemporaryDirectory(prefix="tessera-run-") as name:
        scratch = Scratch(Path(name).resolve())
        failures = [*check_refusals(scratch, program), *check_others(scratch), *check_help(scratch, program)]
    for failure in failures:
        print(failure)
    print(f"{len(REFUSED)} refused, {len(ACCEPTED)} accepted, {len(failures)} failed")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
