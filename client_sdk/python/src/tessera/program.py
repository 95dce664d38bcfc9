"""The program `tessera`, which reads SDF, URDF and MJCF files and starts clusters.

Its path is in the environment variable TESSERA_COMMAND, or else it is found on PATH.
"""

from __future__ import annotations

import os
import shutil
import subprocess

from tessera.errors import InvalidArgument, NotFound

VARIABLE = "TESSERA_COMMAND"


def find() -> str:
    """The path of the program. NotFound if there is none."""
    given = os.environ.get(VARIABLE)
    path = shutil.which(given or "tessera")
    if path:
        return path
    where = f"{VARIABLE} = {given} is not a program" if given else f"set PATH or {VARIABLE}"
    raise NotFound(f"the program tessera was not found: {where}")


def beside(name: str) -> str:
    """The path of another program of Tessera: beside `tessera`, or on PATH. NotFound if there is none."""
    path = shutil.which(name, path=os.path.dirname(os.path.realpath(find()))) or shutil.which(name)
    if path:
        return path
    raise NotFound(f"the program {name} was not found beside tessera, nor on PATH")


def run(*arguments: str) -> str:
    """The output of the program. InvalidArgument, with its message, if it fails."""
    done = subprocess.run([find(), *arguments], capture_output=True, text=True)
    if done.returncode != 0:
        raise InvalidArgument(done.stderr.strip().removeprefix("tessera: ") or done.stdout.strip())
    return done.stdout
