"""Rotations as unit quaternions x y z w: one, or arrays of them."""

from __future__ import annotations

import numpy as np

from tessera.position import Floats


def turned(q: Floats, v: Floats) -> Floats:
    """Vectors [..., 3], turned by quaternions [..., 4]."""
    across = 2 * np.cross(q[..., :3], v)
    result: Floats = v + q[..., 3:] * across + np.cross(q[..., :3], across)
    return result


def product(a: Floats, b: Floats) -> Floats:
    """The rotations by b, followed by those by a."""
    vector = a[..., 3:] * b[..., :3] + b[..., 3:] * a[..., :3] + np.cross(a[..., :3], b[..., :3])
    scalar = a[..., 3] * b[..., 3] - (a[..., :3] * b[..., :3]).sum(axis=-1)
    return np.concatenate([vector, scalar[..., np.newaxis]], axis=-1)


def inverse(q: Floats) -> Floats:
    result: Floats = q * np.array([-1.0, -1.0, -1.0, 1.0])
    return result
