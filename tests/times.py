#!/usr/bin/env python3
"""Measures how long `./run` and `./test` take from nothing, and adds a row to the table in CONTRIBUTING.md.

    tests/times.py

Takes a clone of the current commit, in a temporary folder, and no ccache. Run it where nothing else runs. Packages are
installed before, unless this is a bare machine: then the first row includes them.
"""

import collections
import datetime
import os
import pathlib
import re
import resource
import subprocess
import sys
import tempfile
import time

TOP = pathlib.Path(__file__).resolve().parent.parent
TABLE = "| date | commit | `./run` | `./test` | processor | folders that took most to build |\n|---|---|---|---|---|---|\n"


def clock(seconds: float) -> str:
    return f"{int(seconds) // 60}:{int(seconds) % 60:02d}"


def processor_seconds() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def measure(clone: pathlib.Path, command: str) -> str:
    """Runs a command of the clone: how long it took and, of that, the build."""
    start = time.monotonic()
    run = subprocess.run([f"./{command}"], cwd=clone, env=os.environ | {"CCACHE_DISABLE": "1"}, text=True,
                         stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, check=False)
    if run.returncode != 0:
        sys.exit(f"./{command} failed:\n{run.stderr}")
    whole = clock(time.monotonic() - start)
    built = re.search(r"^built in (\d+) s$", run.stderr, re.MULTILINE)
    return f"{whole} ({clock(int(built[1]))} to build)" if built else whole


def heaviest_folders(log: pathlib.Path) -> str:
    """By what ninja took for each output; a step has one processor."""
    seconds: collections.Counter[str] = collections.Counter()
    for line in log.read_text().splitlines()[1:]:
        start, end, _, output, _ = line.split("\t")
        if not output.startswith("/"):
            seconds[output.split("/")[0]] += (int(end) - int(start)) / 1000
    return ", ".join(f"{folder} {spent:.0f} s" for folder, spent in seconds.most_common(6))


def main() -> None:
    commit = subprocess.run(["git", "rev-parse", "--short", "HEAD"], cwd=TOP, capture_output=True, text=True,
                            check=True).stdout.strip()
    with tempfile.TemporaryDirectory() as folder:
        clone = pathlib.Path(folder) / "tessera"
        subprocess.run(["git", "clone", "--quiet", TOP, clone], check=True)
        before = processor_seconds()
        cells = [str(datetime.date.today()), commit, measure(clone, "run"), measure(clone, "test"),
                 f"{processor_seconds() - before:.0f} s", heaviest_folders(clone / "build" / "release" / ".ninja_log")]
    page = TOP / "CONTRIBUTING.md"
    text = page.read_text()
    head = text.index(TABLE) + len(TABLE)
    rows = re.match(r"(\|.*\n)*", text[head:])
    end = head + (rows.end() if rows else 0)
    page.write_text(f"{text[:end]}| {' | '.join(cells)} |\n{text[end:]}")
    print(" | ".join(cells))


if __name__ == "__main__":
    main()
