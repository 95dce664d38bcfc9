"""Checks what each folder may include: dependences point one way. Tests may include anything except
experiments/, which nothing includes.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

TOP = Path(__file__).resolve().parent.parent
SDK = "tessera"  # how public headers of client_sdk/ are included

MAY_INCLUDE = {
    "lpss": "",
    "transport": "",
    "keys": "",
    "proto": "lpss",
    "tiles": "lpss",
    "worlds": "lpss proto tiles",
    "daemon": "keys lpss proto transport",
    "coordinator": "daemon keys lpss proto transport",
    "sector_server": "daemon keys lpss proto tiles transport",
    "embedded": "coordinator daemon lpss proto sector_server tiles transport worlds",
    "gateway": "daemon keys lpss proto transport",
    "client_sdk": "daemon keys lpss proto",
    "viewer": "client_sdk daemon keys lpss worlds",
    "ros": "client_sdk daemon lpss transport worlds",
    "simulator": "coordinator lpss proto sector_server transport",
    "cli": "client_sdk coordinator daemon gateway keys lpss proto sector_server simulator tiles worlds",
    "experiments": "cli client_sdk coordinator lpss proto simulator worlds",
}


# Inside lpss/. The core, base to islands, is numbers: it knows neither sectors nor engines.
CORE_TO_SIMULATION = {
    "base": "",
    "collision": "base",
    "solver": "base",
    "joints": "base",
    "islands": "base joints solver",
    "grid": "base",
    "model": "base grid joints",
    "ground": "base grid model",
    "engine": "base islands joints model",
    "bullet": "base engine grid joints model",
    "native": "base bullet collision engine grid islands model solver",
    "partition": "base engine grid ground model",
    "wasm": "base",
    "programs": "base grid model wasm",
    "tick": "base engine grid model observe partition programs",
    "observe": "collision grid model partition",
    "snapshot": "base engine grid model partition programs tick",
    "simulation": "base engine grid model observe partition programs snapshot tick",
}


def layers_included(source: Path) -> set[str]:
    """The folders of lpss/ that a file includes from."""
    return set(re.findall(r'^#include "lpss/(\w+)/', source.read_text(), re.MULTILINE))


def forbidden_layers() -> list[str]:
    wrong = [
        f"lpss/{folder}/ is not in {Path(__file__).name}"
        for folder in sorted({file.parent.name for file in sources("lpss")} - CORE_TO_SIMULATION.keys())
    ]
    for folder, below in CORE_TO_SIMULATION.items():
        for source in sources(f"lpss/{folder}"):
            if "test" in source.name:
                continue
            for other in sorted(layers_included(source) - {folder, *below.split()}):
                wrong.append(f"{source.relative_to(TOP)} includes from lpss/{other}/")
    return wrong


def folders_included(source: Path) -> set[str]:
    """The folders of the project that a file includes from."""
    named = re.findall(r'^#include "(\w+)/', source.read_text(), re.MULTILINE)
    return {"client_sdk" if name == SDK else name for name in named if name == SDK or (TOP / name).is_dir()}


def may_include(folder: str, source: Path) -> set[str]:
    if "test" in source.name:
        return MAY_INCLUDE.keys() - {"experiments"} | {folder}
    return {folder, *MAY_INCLUDE[folder].split()}


def sources(folder: str) -> list[Path]:
    return sorted(file for ending in ("c", "cc", "h") for file in (TOP / folder).rglob(f"*.{ending}"))


def main() -> int:
    wrong = [
        f"{source.relative_to(TOP)} includes from {other}/"
        for folder in MAY_INCLUDE
        for source in sources(folder)
        for other in sorted(folders_included(source) - may_include(folder, source))
    ]
    wrong += forbidden_layers()
    for line in wrong:
        print(line)
    print(f"{len(MAY_INCLUDE) + len(CORE_TO_SIMULATION)} folders, {len(wrong)} forbidden includes")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
