"""The compiled part of the package, which is loaded when it is needed."""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from typing import Any

from tessera.errors import NotFound


def is_there() -> bool:
    """Whether the package was built with it."""
    return find_spec("tessera._native") is not None


def native() -> Any:
    """The module. NotFound if the package was built without it."""
    if not is_there():
        raise NotFound("this package was built without its compiled part: see client_sdk/python/README.md")
    return import_module("tessera._native")
