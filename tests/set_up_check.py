#!/usr/bin/env python3
"""Runs what the pages tell readers to install and build, as root on a bare machine: what other checks of pages leave out.

    tests/set_up_check.py [PAGE...]

Takes the pages in the order in which a reader comes to them. The commands of each run in one shell at the top of the
repository, from the first to the last; `sudo` runs what follows it. Left out: `./run` and `./test`, for which this is not the
place; systemctl, which a container does not have; packages that were downloaded; and, where no package index is in reach, what
pip takes from there. After a command that installs the Python package, `import tessera` must work. Prints a line for each command
with its seconds; exit code 1 if one fails.
"""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from docs_pages import shell_lines
from tutorials_check import SET_UP

TOP = Path(__file__).resolve().parent.parent
PAGES = (
    "README.md", "docs/quickstart.md", "docs/viewer.md", "docs/gallery.md", "docs/tutorials/README.md",
    "docs/tutorials/plot.md", "docs/tutorials/game_server.md", "docs/tutorials/settings.md", "docs/programs_tutorial.md",
    "docs/sdk.md", "docs/python.md", "client_sdk/python/README.md", "docs/ros.md", "docs/ground.md", "docs/seams.md",
    "docs/scale.md", "docs/sizing.md", "docs/performance.md", "docs/results/README.md", "docs/operations.md",
    "CONTRIBUTING.md",
)
NOT_HERE = ("./run", "./test", "sudo systemctl", "git clone", "deploy/release.sh")
DOWNLOADED = "./tessera_"
DEADLINE_S = 3600
PRELUDE = 'command -v sudo >/dev/null || sudo() { "$@"; }\napt() { command apt-get -y -qq "$@"; }\n'
MEASURED = "-- took "


def set_up(page: Path) -> Iterator[str]:
    """The commands of a page that install and build, without comments."""
    for _, line in shell_lines(page):
        command = line.partition(" #")[0].strip()
        if SET_UP.match(command) and not command.startswith(NOT_HERE) and DOWNLOADED not in command:
            yield command


def has_package_index() -> bool:
    found = subprocess.run([sys.executable, "-m", "pip", "index", "versions", "hatchling"], capture_output=True, check=False)
    return found.returncode == 0


def needs_package_index(command: str) -> bool:
    return command.startswith("pip install") and "--no-index" not in command


def run(page: str, commands: list[str]) -> bool:
    lines = [PRELUDE]
    for command in commands:
        lines.append(f"start=$SECONDS\n{command}\necho '{MEASURED}'$((SECONDS - start)) s: {subprocess.list2cmdline([command])}")
        if command.startswith("pip install"):
            lines.append("(cd / && python3 -c 'import tessera; tessera.Client')")
    done = subprocess.run(["bash", "-eo", "pipefail"], input="\n".join(lines), cwd=TOP, text=True, timeout=DEADLINE_S,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False)
    for line in done.stdout.splitlines():
        if line.startswith(MEASURED):
            print(f"{page}: {line.removeprefix(MEASURED)}", flush=True)
    if done.returncode != 0:
        print(f"{page} fails:\n{done.stdout[-3000:]}", flush=True)
    return done.returncode == 0


def main() -> int:
    began = time.monotonic()
    is_right = True
    is_offline = not has_package_index()
    if is_offline:
        print("no package index is in reach: what pip takes from there is left out", flush=True)
    for page in sys.argv[1:] or PAGES:
        commands = [each for each in set_up(TOP / page) if not (is_offline and needs_package_index(each))]
        if commands:
            is_right = run(page, commands) and is_right
    print(f"{time.monotonic() - began:.0f} s")
    return 0 if is_right else 1


if __name__ == "__main__":
    sys.exit(main())
