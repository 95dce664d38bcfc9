"""Files that are there as a whole or not at all."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from typing import BinaryIO


@contextlib.contextmanager
def whole_file(file: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """Opens a file beside its place, which it takes once it is written; after an exception nothing has changed."""
    beside = f"{os.fspath(file)}.part"
    try:
        with open(beside, "wb") as out:
            yield out
        os.replace(beside, file)
    except BaseException:
        with contextlib.suppress(FileNotFoundError):
            os.remove(beside)
        raise
