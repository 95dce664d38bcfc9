"""Compares the lists of docs/elements.md with those in the readers of world files.

    tests/elements_check.py

Prints each name that is missing from the page, or that no reader knows; exit code 1 if any does.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

TOP = Path(__file__).resolve().parent.parent
PAGE = (TOP / "docs/elements.md").read_text(encoding="utf-8")
SIMULATED = (TOP / "worlds/loader/simulated_elements.cc").read_text(encoding="utf-8")
URDF = (TOP / "worlds/loader/elements.cc").read_text(encoding="utf-8")
MJCF = (TOP / "worlds/mjcf/document.cc").read_text(encoding="utf-8")
SENSORS = (TOP / "worlds/mjcf/sensors.cc").read_text(encoding="utf-8")


def list_in(source: str, name: str) -> set[str]:
    """The words of a table of words."""
    found = re.search(rf"\b{name} = {{(.*?)}};", source, re.DOTALL)
    assert found, name
    return set(re.findall(r'"([^"]+)"', found.group(1)))


def words_between(start: str, end: str) -> set[str]:
    """What is in code spans between two texts of the page; of links, nothing."""
    text = PAGE.partition(start)[2].partition(end)[0]
    assert text, start
    return set(re.findall(r"`([\w/]+)`", re.sub(r"\[[^\]]*\]\([^)]*\)", "", text)))


def urdf(use: str) -> dict[str, set[str]]:
    """The elements of URDF that are read or not simulated, with their attributes."""
    rows = re.findall(rf'UrdfElement{{"(\w*)", "(\w+)", Use::{use}, "([^"]*)"}}', URDF)
    return {f"{parent}/{name}".lstrip("/"): set(attributes.split()) for parent, name, attributes in rows}


def documented_urdf() -> dict[str, set[str]]:
    text = PAGE.partition("## URDF")[2].partition("**Known and not")[0]
    rows = re.findall(r"^\| `([\w/]+)` \|(.*)\|$", text, re.MULTILINE)
    return {name: set(re.findall(r"`(\w+)`", attributes)) for name, attributes in rows}


def sensors() -> set[str]:
    """The sensors of MuJoCo that become programs."""
    names = dict(re.findall(r'{(mjSENS_\w+), "(\w+)"}', SENSORS))
    kinds = SENSORS.partition("const char* program_of(")[2].partition("default")[0]
    return {names[one] for one in re.findall(r"case (mjSENS_\w+):", kinds)}


def compare(what: str, real: object, page: object) -> list[str]:
    return [] if real == page else [f"{what}:\n    readers: {real}\n    page: {page}"]


def main() -> int:
    failures = compare("SDF, simulated", list_in(SIMULATED, "kSimulated"), words_between("## SDF", "**No physics**"))
    no_physics = words_between("**No physics**", "Everything")
    failures += compare("SDF, no physics", list_in(SIMULATED, "kNoPhysics"), no_physics)
    failures += compare("URDF, read", urdf("kRead"), documented_urdf())
    unread = words_between("**Known and not simulated**", "Sensors, systems")
    failures += compare("URDF, not simulated", set(urdf("kNotSimulated")), unread)
    for name, start, end in (
        ("kSeenOnly", "**Only seen**", "**Bodies"),
        ("kBodiesOfNewerFiles", "**Bodies of newer", "**Attributes"),
        ("kKnownHere", "**Attributes of newer", "**Sensors"),
    ):
        failures += compare(f"MJCF, {name}", list_in(MJCF, name), words_between(start, end))
    failures += compare("MJCF, sensors", sensors(), words_between("that become programs", "\n\n"))
    for failure in failures:
        print(failure)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
