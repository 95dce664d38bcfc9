"""Writes the table of docs/results/robots.md from the data file of `tessera experiment robots --csv`.

robots_page.py DATA.csv PAGE.md
"""

from __future__ import annotations

import csv
import sys
from pathlib import Path

BEGIN = "<!-- table: begin -->"
END = "<!-- table: end -->"
COLUMNS = {
    "steps_per_s": "steps",
    "ratio": "of MuJoCo's",
    "gap_mm_max": "gap, largest, mm",
    "gap_mm_mean": "mean",
    "below_mm_max": "below, largest, mm",
    "below_mm_mean": "mean",
    "height_m": "height, m",
    "thrown_lost": "lost",
    "energy_error_mean": "energy",
    "spin_error_mean": "turn",
}


def cell(text: str) -> str:
    if not text:
        return ""
    value = float(text)
    return f"{value:,.0f}" if abs(value) >= 100 else f"{value:.2g}"


def main(data: Path, page: Path) -> int:
    with data.open(newline="") as file:
        rows = list(csv.DictReader(file))
    lines = ["| | " + " | ".join(COLUMNS.values()) + " |", "|---" * (len(COLUMNS) + 1) + "|"]
    for row in rows:
        what = f"{row['robots']} {row['robot']}s, {row['engine']}: {row['world']}"
        lines.append(f"| {what} | {' | '.join(cell(row[column]) for column in COLUMNS)} |")
    before, rest = page.read_text().split(BEGIN)
    page.write_text("\n".join([before + BEGIN, "", *lines, "", END + rest.split(END)[1]]))
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), Path(sys.argv[2])))
