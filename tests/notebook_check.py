"""Runs the code cells of a notebook as one program of plain Python.

    tests/notebook_check.py docs/tutorials/notebook.ipynb

The cells run in order, in a folder that looks like the top of the repository, and must raise nothing. The notebook is
stored without outputs, which nobody would check. Prints the first cell that fails; exit code 1 if one does.
"""

from __future__ import annotations

import json
import os
import sys
import tempfile
import traceback
from pathlib import Path

TOP = Path(__file__).resolve().parent.parent


def code_cells(notebook: Path) -> list[tuple[int, str]]:
    """The code cells with their places. ValueError for another format, or for one with an output."""
    content = json.loads(notebook.read_text(encoding="utf-8"))
    if content["nbformat"] != 4:
        raise ValueError(f"nbformat = {content['nbformat']} must be 4")
    cells = []
    for number, cell in enumerate(content["cells"], 1):
        if cell["cell_type"] != "code":
            continue
        if cell["outputs"] or cell["execution_count"] is not None:
            raise ValueError(f"cell {number} has an output: clear all outputs before you commit")
        cells.append((number, "".join(cell["source"])))
    if not cells:
        raise ValueError("no code")
    return cells


def run(cells: list[tuple[int, str]]) -> bool:
    names: dict[str, object] = {"__name__": "__main__"}
    for number, source in cells:
        try:
            exec(compile(source, f"cell {number}", "exec"), names)
        except Exception:
            traceback.print_exc()
            print(f"cell {number}:\n{source}", file=sys.stderr)
            return False
    return True


def main() -> int:
    if len(sys.argv) != 2:
        print(__doc__, file=sys.stderr)
        return 2
    try:
        cells = code_cells(Path(sys.argv[1]))
    except ValueError as error:
        print(f"{sys.argv[1]}: {error}", file=sys.stderr)
        return 1
    os.environ["MPLBACKEND"] = "Agg"
    with tempfile.TemporaryDirectory(prefix="tessera-notebook-") as folder:
        (Path(folder) / "worlds").symlink_to(TOP / "worlds")
        os.chdir(folder)
        succeeded = run(cells)
        os.chdir(TOP)
    print(f"{len(cells)} cells")
    return 0 if succeeded else 1


if __name__ == "__main__":
    sys.exit(main())
