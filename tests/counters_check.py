"""Compares docs/counters.md with the programs: the page has every counter, and no other.

    tests/counters_check.py build/release/bin

Counters of a tick come from their table in lpss/model/tick_counts.h, metrics from where daemons make them, and fields of
reports from a run and from the status of a cluster. Prints each name that is missing or stale; exit code 1 if any is.
"""

from __future__ import annotations

import json
import re
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from docs_programs import Cluster, Programs

TOP = Path(__file__).resolve().parent.parent
PAGE = TOP / "docs/counters.md"
MAKERS = ("coordinator/metrics.cc", "sector_server/metrics.cc", "gateway/metrics.cc", "daemon/process_metrics.cc")
METRIC = re.compile(r"""["`]((?:tessera|process)_[a-z_]*[a-z])["`]""")
COUNTER = re.compile(r'{"(\w+)", &TickCounts::\w+, OverTicks::k(\w+), "(\w+)"')

# What another page describes, or what has the names of processes, servers or settings in it.
OPAQUE = {
    *("settings", "divergences", "cut_off", "left_out"),
    *("peak_rss_mb_by_process", "proof.tessera", "proof.plain_bullet"),
}


def fields(report: dict[str, object], prefix: str = "") -> Iterator[str]:
    """The names of all fields, with dots between an object and its fields."""
    for name, value in report.items():
        whole = prefix + name
        if whole in OPAQUE or not isinstance(value, dict | list):
            yield whole
        elif isinstance(value, dict):
            yield from fields(value, f"{whole}.")
        elif value and isinstance(value[0], dict):
            yield whole
            yield from fields(value[0], f"{whole}.")
        else:
            yield whole


def documented(section: str) -> set[str]:
    """The names in the first column (of counters: the first two) of the tables below a heading."""
    text = PAGE.read_text(encoding="utf-8").partition(f"## {section}\n")[2].partition("\n## ")[0]
    columns = 2 if section.startswith("Counters") else 1
    names: set[str] = set()
    for row in re.findall(r"^\| (`.*)\|$", text, re.MULTILINE):
        for cell in row.split("|")[:columns]:
            names.update(re.findall(r"`([\w.]+)`", cell))
    return names


def report_of(programs: Programs, words: tuple[str, ...], address: str = "") -> dict[str, object]:
    programs.run((*words, "--json", "report.json"), address)
    report = json.loads((programs.scratch / "report.json").read_text(encoding="utf-8"))
    assert isinstance(report, dict)
    return report


def compare(what: str, real: set[str], page: set[str]) -> list[str]:
    missing = [f"{what}: {name} is not in {PAGE.name}" for name in sorted(real - page)]
    return missing + [f"{what}: {name} of {PAGE.name} does not exist" for name in sorted(page - real)]


def main() -> int:
    if len(sys.argv) != 2:
        print(__doc__, file=sys.stderr)
        return 2
    counters = COUNTER.findall((TOP / "lpss/model/tick_counts.h").read_text(encoding="utf-8"))
    names = {name for name, _, _ in counters}
    names_in_run = {name for _, _, name in counters}
    metrics = {name for maker in MAKERS for name in METRIC.findall((TOP / maker).read_text(encoding="utf-8"))}
    for kind in ("world", "server"):
        metrics |= {f"tessera_{kind}_{name}{'_total' if over == 'Total' else ''}" for name, over, _ in counters}

    with tempfile.TemporaryDirectory(prefix="tessera-counters-") as folder:
        programs = Programs(Path(sys.argv[1]).resolve(), Path(folder))
        world = str(TOP / "worlds/tower.sdf")
        run = set(fields(report_of(programs, ("tessera", "run", world, "--seconds", "0.1", "--prove"))))
        run |= set(fields(report_of(programs, ("tessera", "run", world, "--seconds", "0.1", "--in-process"))))
        cluster = Cluster(programs, (world,))
        status = set(fields(report_of(programs, ("tessera", "status"), cluster.address)))
        cluster.stop()
    times = {name for name in status if ".tick_ms." in name or name.startswith("tick_ms.")}
    status = (status - times) | {name.rpartition(".")[0] for name in times}
    by_server = {f"servers.{name}" for name in names}

    failures = compare("counters of a tick", names | names_in_run, documented("Counters of a tick"))
    failures += compare("run", run - names_in_run, documented("`tessera run --json`"))
    failures += compare("status", status - names - by_server, documented("`tessera status --json`"))
    failures += compare("metrics", metrics, documented("Metrics"))
    for failure in failures:
        print(failure)
    print(f"{len(names)} counters, {len(run)} fields of a run, {len(status)} of a status, {len(metrics)} metrics")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
