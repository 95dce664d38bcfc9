"""Checks the manual pages and the completion of a package against the programs.

    tests/manual_check.py build/release/bin

Each command has a page with all of its options and examples, which groff reads without a warning. bash completes
commands, options, values that have names, and files. Prints what is not so; exit code 1 if anything is.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from docs_programs import Programs, Words

TOP = Path(__file__).resolve().parent.parent
DAEMONS = ("coordinator", "gateway", "ros", "sector-server", "viewer")
PROGRAMS = ("tessera", *(f"tessera-{name}" for name in DAEMONS))
COMPLETION = TOP / "deploy/completion/tessera.bash"

# What has been typed, with | for words, and what must be offered: all of it, or (with ...) at least that.
COMPLETED = {
    "tessera|lo": "load",
    "tessera|help|unl": "unload",
    "tessera|": "help load run up ...",
    "tessera|keys|cr": "create",
    "tessera|keys|create|--h": "--help --host",
    "tessera|run|world.sdf|--in-p": "--in-process",
    "tessera|run|--eng": "--engine",
    "tessera|up|--balance-policy|": "curve k-means hulls graph grid",
    "tessera|up|--balance-policy|=|h": "hulls",
    "tessera|up|--balance-policy|=": "curve k-means hulls graph grid",
    "tessera|simulate|--no-s": "--no-shrink ...",
    "tessera|load|./tow": "./tower.sdf",
    "tessera-sector-server|--log-l": "--log-level",
    "tessera-ros|--tf|o": "odom",
}
ASK = """
source "$1"
IFS='|' read -ra COMP_WORDS <<<"$2"
[[ $2 != *'|' ]] || COMP_WORDS+=('')
COMP_CWORD=$((${#COMP_WORDS[@]} - 1))
_tessera "${COMP_WORDS[0]}" "${COMP_WORDS[COMP_CWORD]}" "${COMP_WORDS[COMP_CWORD - 1]}"
printf '%s\\n' "${COMPREPLY[@]}"
"""


def commands(programs: Programs, words: Words) -> Iterator[Words]:
    """A program or subcommand, and those below it."""
    yield words
    for below in programs.subcommands(words):
        if below != "help":
            yield from commands(programs, (*words, below))


def missing_in(programs: Programs, words: Words, page: Path) -> Iterator[str]:
    if not page.exists():
        yield "there is no page"
        return
    shown = subprocess.run(
        ["groff", "-man", "-ww", "-Tascii", "-P-cbou", "-rLL=200n", page], capture_output=True, text=True, check=True
    )
    if shown.stderr:
        yield shown.stderr.strip()
    for wanted in (*programs.options(words), *programs.examples(words)):
        if wanted not in shown.stdout:
            yield f"{wanted} is missing"


def check_pages(programs: Programs, folder: Path) -> Iterator[str]:
    paths = [programs.folder / name for name in PROGRAMS]
    subprocess.run([sys.executable, TOP / "deploy/manual_pages.py", folder, *paths], check=True)
    wanted = {words for name in PROGRAMS for words in commands(programs, (name,))}
    for words in sorted(wanted):
        for failure in missing_in(programs, words, folder / f"{'-'.join(words)}.1"):
            yield f"{'-'.join(words)}.1: {failure}"
    for page in sorted({page.stem for page in folder.iterdir()} - {"-".join(words) for words in wanted}):
        yield f"{page}.1 is of no command"


def check_completion(programs: Programs) -> Iterator[str]:
    (programs.scratch / "tower.sdf").touch()
    for typed, expected in COMPLETED.items():
        answer = subprocess.run(
            ["bash", "--noprofile", "--norc", "-c", ASK, "bash", COMPLETION, typed],
            cwd=programs.scratch, env=programs.environment, capture_output=True, text=True, check=True,
        )
        offered, wanted = set(answer.stdout.split()), set(expected.split())
        if "..." in wanted:
            wanted -= {"..."}
            offered &= wanted
        if answer.stderr or offered != wanted:
            yield f"{typed}: bash offers {sorted(answer.stdout.split())}, not {expected} {answer.stderr}"


def main() -> int:
    if len(sys.argv) != 2:
        print(__doc__, file=sys.stderr)
        return 2
    with tempfile.TemporaryDirectory(prefix="tessera-manual-") as name:
        scratch = Path(name)
        programs = Programs(Path(sys.argv[1]).resolve(), scratch)
        failures = [*check_pages(programs, scratch / "man"), *check_completion(programs)]
        pages = len(list((scratch / "man").iterdir()))
    for failure in failures:
        print(failure)
    print(f"{pages} pages, {len(COMPLETED)} completions, {len(failures)} failed")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
