"""Prints a header with its plain comments as comments of Doxygen.

A comment above a declaration documents it, and so does one behind a member. The first comment of a file is that of the
file. Words that would be commands or tags of Doxygen are escaped.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

BEHIND_C = re.compile(r"^(?P<code>.*\S)\s*/\* (?P<text>.*) \*/$")
BEHIND = re.compile(r"^(?P<code>[^\"]*[;,{}\w)]\s*)// (?P<text>.*)$")
SPECIAL = re.compile(r"([\\@<>#%&])")


def escaped(text: str) -> str:
    """Text without commands and tags; what is between backticks stays."""
    parts = text.split("`")
    return "`".join(part if n % 2 else SPECIAL.sub(r"\\\1", part) for n, part in enumerate(parts))


def converted(lines: list[str]) -> list[str]:
    result: list[str] = []
    in_c_comment = False
    at_top = True
    for line in lines:
        stripped = line.strip()
        indent = line[: len(line) - len(line.lstrip())]
        if in_c_comment:
            in_c_comment = "*/" not in line
            text = stripped.removesuffix("*/").removeprefix("*").rstrip()
            result.append(f"{indent}* {escaped(text)}{'' if in_c_comment else ' */'}")
        elif stripped.startswith("// --- "):  # the heading of a group
            result.append("")
        elif stripped.startswith("// "):
            opening = "/// @file\n" if at_top else ""
            result.append(f"{opening}{indent}/// {escaped(stripped[3:])}")
            at_top = False
        elif stripped == "//":
            result.append(f"{indent}///")
        elif stripped.startswith("/* "):
            opening = "/** @file\n" if at_top else "/** "
            at_top = False
            in_c_comment = "*/" not in line
            text = stripped.removeprefix("/*").removesuffix("*/").strip()
            result.append(f"{indent}{opening}{escaped(text)}{'' if in_c_comment else ' */'}")
        elif found := BEHIND_C.match(line):
            result.append(f"{found['code']} /**< {escaped(found['text'])} */")
        elif found := BEHIND.match(line):
            result.append(f"{found['code']}///< {escaped(found['text'])}")
        else:
            result.append(line)
    return result


def main() -> int:
    print("\n".join(converted(Path(sys.argv[1]).read_text(encoding="utf-8").splitlines())))
    return 0


if __name__ == "__main__":
    sys.exit(main())
