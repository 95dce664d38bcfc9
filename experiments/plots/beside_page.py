"""Writes the tables of docs/beside.md from the data files of the experiments.

    python3 experiments/plots/beside_page.py            writes them
    python3 experiments/plots/beside_page.py --check    compares them; exit code 1 if the page has others
"""

from __future__ import annotations

import csv
import re
import sys
from collections.abc import Iterator
from pathlib import Path

TOP = Path(__file__).resolve().parent.parent.parent
PAGE = TOP / "docs/beside.md"
DATA = TOP / "docs/pictures"

Row = dict[str, str]

DISTANCES = {13: "8 km", 20: "1,000 km", 23: "8,400 km", 27: "1.3e8 m", 30: "1.1e9 m", 40: "1.1e12 m"}  # 2^N m
SECTOR = "128"  # m
SCENES = {
    "pile": "8,192 boxes dropped in 4 layers",
    "towers": "800 towers of 10",
    "pyramid": "pyramid of 465 boxes",
    "mixed": "2,800 hulls, capsules, boxes, balls and chains on hills",
}
ROBOTS = {
    "sectors of 16 m": "Tessera",
    "sectors of 16 m, 1 substep": "Tessera, one substep",
    "MuJoCo": "MuJoCo",
    "MuJoCo, 4 steps a tick": "MuJoCo, 4 steps a tick",
}


def rows_of(name: str) -> list[Row]:
    with (DATA / name).open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def table(head: list[str], lines: list[list[str]]) -> str:
    return "\n".join(f"| {' | '.join(line)} |".replace("|  |", "| |") for line in [head, ["---"] * len(head), *lines])


def metres(text: str) -> str:
    """A length with two digits, in the unit in which it is easiest to read."""
    value = float(text)
    for unit, name in ((1, "m"), (1e-3, "mm"), (1e-6, "um"), (1e-9, "nm"), (1e-12, "pm")):
        if value >= unit:
            return f"{float(f'{value / unit:.2g}'):g} {name}"
    return f"{value:g}"


def distance() -> str:
    def error(system: str, engine: str, log2: int) -> str:
        (row,) = (
            row
            for row in rows_of("distance.csv")
            if row["system"] == system and row["engine"] == engine and row["distance_log2"] == str(log2)
            and row["sector_size"] in ("", SECTOR) and row["observers"] == "1"
        )
        return metres(row["error_m"])

    worlds = [("one world in floats", "one-world", "f32"), ("one world in doubles", "one-world", "f64")]
    worlds += [("Tessera, floats", "lpss", "f32"), ("Tessera, doubles", "lpss", "f64")]
    return table(
        ["", *DISTANCES.values()],
        [[name, *(error(system, engine, log2) for log2 in DISTANCES)] for name, system, engine in worlds],
    )


def performance() -> str:
    def lines() -> Iterator[list[str]]:
        for scene, name in SCENES.items():
            ratio = {row["world"]: float(row["ratio"]) for row in rows_of("performance.csv")
                     if row["engine"] == "f32" and row["scene"] == scene}
            one, small = ratio["one sector"], ratio["sectors of 16 m"]
            yield [name, f"{one:.2g}", f"{small:.2g}", f"{small / one:.2g} times"]

    return table(["never asleep", "one sector", "sectors of 16 m", "sectors"], list(lines()))


def robots() -> str:
    def lines() -> Iterator[list[str]]:
        for row in rows_of("robots.csv"):
            if row["world"] in ROBOTS:
                name = f"{row['robots']} {row['robot']}s: {ROBOTS[row['world']]}"
                yield [
                    name, f"{float(row['steps_per_s']):,.0f}", f"{float(row['below_mm_mean']):.2g} mm",
                    f"{float(row['energy_error_mean']):.1g}", row["thrown_lost"],
                ]

    return table(["", "steps", "depth in the ground, mean", "energy", "lost"], list(lines()))


def with_tables(text: str) -> str:
    for name, rows in (("distance", distance()), ("performance", performance()), ("robots", robots())):
        begin, end = f"<!-- {name}: begin -->", f"<!-- {name}: end -->"
        pattern = re.compile(f"{re.escape(begin)}.*?{re.escape(end)}", re.DOTALL)
        text, count = pattern.subn(f"{begin}\n\n{rows}\n\n{end}", text)
        if count != 1:
            raise SystemExit(f"{PAGE}: {begin} and {end} must be there once")
    return text


def main() -> int:
    text = PAGE.read_text(encoding="utf-8")
    written = with_tables(text)
    if sys.argv[1:] == ["--check"]:
        if written != text:
            print(f"{PAGE} has other tables than its data: run experiments/plots/beside_page.py")
        return int(written != text)
    if sys.argv[1:]:
        print(__doc__, file=sys.stderr)
        return 2
    PAGE.write_text(written, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
