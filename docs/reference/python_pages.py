"""Writes the pages of the Python package into the current folder: a page a module, by pydoc.

Left out are modules that begin with an underscore, that need packages that are not installed, and that pydoc cannot read
since they make classes of messages.
"""

from __future__ import annotations

import importlib
import pkgutil
import pydoc
import sys

import tessera


def main() -> int:
    names = [one.name for one in pkgutil.walk_packages(tessera.__path__, "tessera.")]
    for name in ("tessera", *names):
        if any(part.startswith("_") for part in name.split(".")):
            continue
        try:
            importlib.import_module(name)
            pydoc.writedoc(name)
        except (ImportError, TypeError) as error:
            print(f"{name} is left out: {error}", file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main())
