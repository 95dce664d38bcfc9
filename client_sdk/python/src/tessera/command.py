"""The program `tessera`, for what is done in C++ alone: to read SDF and URDF, and to start clusters.

It is the one that the environment variable TESSERA_COMMAND names, or else the one on PATH.
"""

from __future__ import annotations

import os
import shutil
import subprocess

from tessera.errors import InvalidArgument, NotFound

VARIABLE = "TESSERA_COMMAND"


def find() -> str:
    """The path of the program. NotFound where there is none."""
    given = os.environ.get(VARIABLE)
    path = shutil.which(given or "tessera")
    if path:
        return path
    where = f"{VARIABLE} = {given} is no program" if given else f"it is not on PATH; {VARIABLE} may name it"
    raise NotFound(f"the program tessera was not found: {where}")


def run(*arguments: str) -> str:
    """What the program prints. InvalidArgument, with what it says of it, where it fails."""
    done = subprocess.run([find(), *arguments], capture_output=True, text=True)
    if done.returncode != 0:
        raise InvalidArgument(done.stderr.strip().removeprefix("tessera: ") or done.stdout.strip())
    return done.stdout
