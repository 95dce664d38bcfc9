"""Checks the pages and the help of the programs: links have targets, commands run.

    tests/docs_check.py pages build/release/bin
    tests/docs_check.py help build/release/bin

Every relative link and picture of the pages must have a target. Every command on a page that begins with a program of
Tessera is run, and so is every example of --help: in a folder that looks like the repository, shortened if it would
simulate for long, and on a separate cluster if it needs one. The commands of a page run one after the other, as users
type them. Commands that measure for long, start a daemon, or contain a placeholder (HOST, FILE) are not run; only
their program, subcommand and options must exist.

Prints each page and line that fails; exit code 1 if any does.
"""

from __future__ import annotations

import re
import shutil
import sys
import tempfile
from pathlib import Path

from docs_pages import Command, Link, anchors, links, shell_commands
from docs_programs import Cluster, Failed, Programs, Words, with_option, without_option

TOP = Path(__file__).resolve().parent.parent
PAGES = [
    *sorted(TOP.glob("*.md")),
    *sorted((TOP / "docs").rglob("*.md")),
    TOP / "worlds/README.md",
    TOP / "client_sdk/python/README.md",
]
TUTORIALS = TOP / "docs/tutorials"  # tutorials_check.py runs their commands
PROGRAMS = ("tessera", "tessera-coordinator", "tessera-gateway", "tessera-sector-server", "tessera-viewer")

# Where a package has what is in the repository, or in the folder in which commands run.
INSTALLED = {"/usr/share/tessera/": "", "/etc/tessera/": "deploy/", "/var/lib/tessera/": ""}
STORE = TOP / "tests/golden/stored/4/f32.store"
PLACEHOLDER = re.compile(r"\b[A-Z]{4,}\b|/path/to/")

# Enough to see that a command works, on a machine that others use, too.
SHORT = {
    "run": {"--seconds": "0.1"},
    "simulate": {"--ticks": "10", "--seeds": "1", "--tick-work-max": "0"},
    "tune": {"--horizon": "0.1s", "--max-error": "1m"},
    "watch": {"--frames": "1"},
}

# What the examples of --help refer to. SDF is read only once, since that is slow.
READ_STAGE = "tessera convert worlds/machines.sdf stage.pb"
STAGE_WORLD = "tessera load stage.pb --replace"
RECORDING = "inputs.rec"
STAGE_BODIES = {
    "crate": "tessera spawn --name crate --shape box:1,1,1 --at 0,0,5",
    "conveyor": "tessera spawn --name conveyor --shape box:4,1,0.2 --at 0,9,0.1 --kinematic",
    "walker": "tessera spawn --name walker --shape capsule:0.3,0.8 --at 4,0,1.1 --program character:height=1.1",
    "lift": "tessera spawn --name lift --shape box:2,2,0.1 --at 0,-6,0.1 --kinematic",
}


class Check:
    """Checks pages and help texts, and collects the failures."""

    def __init__(self, programs: Programs) -> None:
        self.failures: list[str] = []
        self.links = 0
        self.ran: set[Words] = set()
        self.looked_up: set[Words] = set()
        self._programs = programs
        self._cluster: Cluster | None = None

    def check_links(self, page: Path) -> None:
        for link in links(page):
            self.links += 1
            if not leads_somewhere(link):
                self.failures.append(f"{name_of(page)}:{link.line}: {link.target} does not exist")

    def check_page(self, page: Path) -> None:
        """The commands of a page, in order, on separate clusters."""
        for command in shell_commands(page, name_of(page)):
            self._check(command)
        self.stop_cluster(name_of(page))

    def check_help(self, words: Words) -> None:
        """The examples of a command and its subcommands."""
        where = f"{' '.join(words)} --help"
        examples = self._programs.examples(words)
        if not examples:
            self.failures.append(f"{where}: no example")
        for number, example in enumerate(examples, 1):
            self._check(Command(f"{where}, example", number, tuple(example.split())), staged=True)
        for below in self._programs.subcommands(words):
            self.check_help((*words, below))

    def stop_cluster(self, where: str) -> None:
        cluster, self._cluster = self._cluster, None
        try:
            if cluster is not None:
                cluster.stop()
        except Failed as failure:
            self.failures.append(f"{where}: {failure}")

    def _check(self, command: Command, *, staged: bool = False) -> None:
        try:
            program = Path(command.words[0]).name
            if program in PROGRAMS:
                self._check_words((program, *map(here, command.words[1:])), command.page, staged)
            elif is_of_repository(command.words[0]) and not (TOP / command.words[0]).exists():
                raise Failed("there is no such file")
        except Failed as failure:
            self.failures.append(f"{command}\n    {failure}")

    def _check_words(self, words: Words, where: str, staged: bool) -> None:
        known = self._programs.subcommand(words)
        self._programs.check_options(words)
        needs_cluster = "--connect" in self._programs.options(known)
        if needs_cluster:
            words = without_option(words, "--connect")
        if known[0] != "tessera" or "experiment" in known or any(map(PLACEHOLDER.search, words)):
            self.looked_up.add(words)
            return
        for option, value in SHORT.get(known[-1], {}).items():
            words = with_option(words, option, value)
        if "--help" in words or not (needs_cluster or known[-1] == "up"):
            if words not in self.ran:
                self._programs.run(words)
        else:
            self._run_on_cluster(words, where, staged)
        self.ran.add(words)

    def _run_on_cluster(self, words: Words, where: str, staged: bool) -> None:
        if words[1] == "up":
            self.stop_cluster(where)
            self._cluster = Cluster(self._programs, words[2:])
            return
        if self._cluster is None:
            self._cluster = Cluster(self._programs)
        before = stage_of(words) if staged else []
        for command in (*before, words):
            self._programs.run(command, self._cluster.address)
        if words[1] in ("shutdown", "drain"):  # after either, examples need another cluster
            self.stop_cluster(where)


def stage_of(example: Words) -> list[Words]:
    """The commands to run before an example of --help: they load the world, with the body that it refers to."""
    commands = [STAGE_WORLD]
    if example[1] == "load":
        commands.append("tessera unload")
    elif example[1] != "spawn":
        commands += [spawn for body, spawn in STAGE_BODIES.items() if body in example]
    return [tuple(command.split()) for command in commands]


def leads_somewhere(link: Link) -> bool:
    """Whether a link names another site, or an existing file and an existing heading in it."""
    if re.match(r"[a-z]+:", link.target):
        return True
    file, _, anchor = link.target.partition("#")
    target = link.page.parent / file if file else link.page
    return target.exists() and (not anchor or anchor in anchors(target))


def here(word: str) -> str:
    """The place in the repository of a file of a package."""
    for installed, place in INSTALLED.items():
        word = word.replace(installed, place)
    return word


def is_of_repository(program: str) -> bool:
    return re.fullmatch(r"[\w.-]+(/[\w.-]+)+", program) is not None and not program.startswith("build/")


def name_of(page: Path) -> str:
    return str(page.relative_to(TOP))


def check_pages(check: Check) -> None:
    for page in PAGES:
        check.check_links(page)
        if page.parent != TUTORIALS:
            check.check_page(page)


def check_helps(check: Check, programs: Programs) -> None:
    programs.run(tuple(READ_STAGE.split()))
    recorded = Cluster(programs, ("stage.pb", "--record-inputs", RECORDING))
    programs.run(("tessera", "step", "2"), recorded.address)
    recorded.stop()
    for program in PROGRAMS:
        check.check_help((program,))
    check.stop_cluster("examples of --help")


def main() -> int:
    if len(sys.argv) != 3 or sys.argv[1] not in ("pages", "help"):
        print(__doc__, file=sys.stderr)
        return 2
    with tempfile.TemporaryDirectory(prefix="tessera-docs-") as folder:
        scratch = Path(folder)
        for name in ("client_sdk", "deploy", "worlds"):
            (scratch / name).symlink_to(TOP / name)
        shutil.copytree(STORE, scratch / "store")
        (scratch / "tessera.toml").symlink_to(TOP / "deploy/tessera.toml")
        programs = Programs(Path(sys.argv[2]).resolve(), scratch)
        check = Check(programs)
        if sys.argv[1] == "pages":
            check_pages(check)
        else:
            check_helps(check, programs)
    for failure in check.failures:
        print(failure)
    counts = f"{check.links} links, {len(check.ran)} commands run, {len(check.looked_up)} looked up"
    print(f"{sys.argv[1]}: {counts}, {len(check.failures)} failed")
    return 1 if check.failures else 0


if __name__ == "__main__":
    sys.exit(main())
