"""Runs the examples of docs/python.md, one after the other, as a reader would: from the top of the repository."""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path

TOP = Path(__file__).resolve().parent.parent


def main() -> int:
    os.chdir(TOP)
    page = (TOP / "docs" / "python.md").read_text()
    names: dict[str, object] = {}
    for found in re.finditer(r"^```python\n(.*?)^```", page, re.MULTILINE | re.DOTALL):
        line = page.count("\n", 0, found.start(1))
        exec(compile("\n" * line + found.group(1), "docs/python.md", "exec"), names)
    return 0


if __name__ == "__main__":
    sys.exit(main())
