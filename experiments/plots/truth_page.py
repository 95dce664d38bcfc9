"""Writes the tables of docs/results/truth.md anew.

    python3 experiments/plots/truth_page.py docs/pictures/truth.csv docs/results/truth.md

puts what `tessera experiment truth --csv` has found between the two comments of the page.
"""

from __future__ import annotations

import csv
import sys
from dataclasses import dataclass, field
from pathlib import Path

BEGIN = "<!-- tables: begin -->"
END = "<!-- tables: end -->"
BORDER = "8"  # m: sectors with a border through the scene
ENGINES = ["f32", "f32 with a border", "f64", "f64 with a border", "Bullet f32", "Bullet f64", "MuJoCo"]


@dataclass
class Sum:
    """What an engine has made of a group."""

    quantities: int = 0
    right: int = 0


@dataclass
class Worst:
    """The largest error of a quantity over the scenes of a group, by its bound."""

    share: float = -1
    row: dict[str, str] = field(default_factory=dict)


def groups_of(rows: list[dict[str, str]]) -> list[str]:
    return list(dict.fromkeys(row["group"] for row in rows))


def number(text: str) -> float:
    return float(text) if text else float("inf")


def engine_of(row: dict[str, str]) -> str:
    return f"{row['engine']} with a border" if row["sector_m"].removesuffix(".0") == BORDER else row["engine"]


def share_of(row: dict[str, str]) -> float:
    error = abs(number(row["got"]) - number(row["right"]))
    bound = number(row["bound"])
    return error / bound if bound > 0 else error * 1e6


def summary(rows: list[dict[str, str]]) -> list[str]:
    sums: dict[tuple[str, str], Sum] = {}
    for row in rows:
        entry = sums.setdefault((row["group"], engine_of(row)), Sum())
        entry.quantities += 1
        entry.right += row["ok"] == "1"
    engines = [engine for engine in ENGINES if any(key[1] == engine for key in sums)]
    lines = [f"| group | {' | '.join(engines)} |", "|---" * (len(engines) + 1) + "|"]
    for group in groups_of(rows):
        cells = [sums.get((group, engine)) for engine in engines]
        texts = [f"{cell.right} of {cell.quantities}" if cell else "" for cell in cells]
        lines.append(f"| {group} | {' | '.join(texts)} |")
    return lines


def worst(rows: list[dict[str, str]]) -> list[str]:
    found: dict[tuple[str, str], dict[str, Worst]] = {}
    for row in rows:
        if not row["quantity"] or engine_of(row) not in {"f32", "f64", "Bullet f32", "MuJoCo"}:
            continue
        engines = found.setdefault((row["group"], row["quantity"]), {})
        entry = engines.setdefault(row["engine"], Worst())
        if share_of(row) > entry.share:
            entry.share, entry.row = share_of(row), row
    lines = ["| group | quantity | allowed | f32 | f64 | plain Bullet, f32 | MuJoCo |", "|---" * 7 + "|"]
    for group in groups_of(rows):
        for key, engines in found.items():
            if key[0] != group:
                continue
            some = next(iter(engines.values())).row
            cells = [error_of(engines.get(engine)) for engine in ("f32", "f64", "Bullet f32", "MuJoCo")]
            bounds = {f"{number(entry.row['bound']):.3g}" for entry in engines.values()}
            ends = sorted(bounds, key=float)
            allowed = f"{' to '.join(dict.fromkeys([ends[0], ends[-1]]))} {some['unit']}".strip()
            lines.append(f"| {group} | {key[1]} | {allowed} | {' | '.join(cells)} |")
    return lines


def error_of(entry: Worst | None) -> str:
    if entry is None:
        return ""
    error = abs(number(entry.row["got"]) - number(entry.row["right"]))
    return f"{error:.3g}" if entry.row["ok"] == "1" else f"**{error:.3g}**"


def main(data: Path, page: Path) -> int:
    with data.open(newline="") as file:
        rows = list(csv.DictReader(file))
    before, rest = page.read_text().split(BEGIN)
    after = rest.split(END)[1]
    tables = [
        "How many quantities are within their bounds:",
        "",
        *summary(rows),
        "",
        "Errors of the scene that is farthest from right, by its bound; bold where that is too far:",
        "",
        *worst(rows),
    ]
    page.write_text("\n".join([before + BEGIN, "", *tables, "", END + after]))
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), Path(sys.argv[2])))
