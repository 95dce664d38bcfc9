"""Bodies and joints by their ids or names, as messages have them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, TypeAlias

import numpy as np

BodyName: TypeAlias = int | np.integer[Any] | str
"""A body by its id or by its name."""

JointName: TypeAlias = int | np.integer[Any] | str
"""Likewise a joint."""

IdsLike: TypeAlias = Iterable[int | np.integer[Any]]
"""Ids: an array, a list or a set of any integers."""


def reference(named: BodyName) -> dict[str, Any]:
    """The fields of a BodyRef or JointRef."""
    return {"name": named} if isinstance(named, str) else {"id": int(named)}


def references(named: Iterable[BodyName]) -> list[dict[str, Any]]:
    return [reference(one) for one in named]


def name_list(named: BodyName | Iterable[BodyName]) -> list[BodyName]:
    """One id or name, or several."""
    return [named] if isinstance(named, (int, np.integer, str)) else list(named)


def id_list(ids: IdsLike) -> list[int]:
    """Ids as protobuf takes them."""
    return [int(one) for one in (ids.tolist() if isinstance(ids, np.ndarray) else ids)]
