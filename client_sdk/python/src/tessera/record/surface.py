"""Triangles, in the body frame, for shapes that drawing tools do not support."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tessera._proto.world_pb2 import Geometry
from tessera.position import Floats, Vector

PLANE_SIZE = 200.0  # m: the drawn part of an infinite plane


class Surface(NamedTuple):
    """Triangles, each three rows of `points`."""

    points: Floats  # [n, 3], m
    triangles: NDArray[np.int64]  # [m, 3]


def surface_of(geometry: Geometry) -> Surface:
    """The surface of a plane, a convex hull, a mesh or a terrain. ValueError for other shapes."""
    kind = geometry.WhichOneof("kind")
    if kind == "plane":
        normal = geometry.plane.normal
        return _plane((normal.x, normal.y, normal.z))
    if kind == "convex_hull":
        return hull(np.array(geometry.convex_hull.points).reshape(-1, 3))
    if kind == "triangle_mesh":
        mesh = geometry.triangle_mesh
        return Surface(
            np.array(mesh.vertices).reshape(-1, 3), np.array(mesh.indices, dtype=np.int64).reshape(-1, 3)
        )
    if kind == "height_field":
        field = geometry.height_field
        heights = np.array(field.heights).reshape(field.rows, field.columns)
        return _terrain(heights, field.spacing_x, field.spacing_y)
    raise ValueError(f"geometry: a {kind} has no triangles")


def hull(points: Floats) -> Surface:
    """The convex hull of points [n, 3] that are not all in a plane; it grows point by point."""
    centre = points.mean(axis=0)
    tolerance = 1e-9 * float(np.abs(points - centre).max())
    corners = _tetrahedron(points)
    inside = points[corners].mean(axis=0)
    faces = np.array([[corners[i] for i in range(4) if i != left] for left in range(4)])
    faces = _outward(points, faces, inside)
    for n in range(len(points)):
        seen = _heights(points, faces, points[n]) > tolerance
        if not seen.any():
            continue
        edges = faces[seen][:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
        known = {(a, b) for a, b in edges.tolist()}
        rim = [(a, b, n) for a, b in edges.tolist() if (b, a) not in known]
        faces = np.concatenate([faces[~seen], np.array(rim)])
    return Surface(points, faces)


def _tetrahedron(points: Floats) -> list[int]:
    """Four points that span a large tetrahedron, found heuristically."""
    a = int(np.argmin(points[:, 0]))
    b = int(np.argmax(np.linalg.norm(points - points[a], axis=1)))
    along = points[b] - points[a]
    c = int(np.argmax(np.linalg.norm(np.cross(points - points[a], along), axis=1)))
    d = int(np.argmax(np.abs((points - points[a]) @ np.cross(along, points[c] - points[a]))))
    return [a, b, c, d]


def _heights(points: Floats, faces: NDArray[np.int64], point: Floats) -> Floats:
    """How far `point` is outside of each face, in m."""
    a, b, c = (points[faces[:, corner]] for corner in range(3))
    normals = np.cross(b - a, c - a)
    sizes = np.maximum(np.linalg.norm(normals, axis=1), np.finfo(np.float64).tiny)
    heights: Floats = np.einsum("ij,ij->i", normals, point - a) / sizes
    return heights


def _outward(points: Floats, faces: NDArray[np.int64], inside: Floats) -> NDArray[np.int64]:
    return np.where((_heights(points, faces, inside) > 0)[:, None], faces[:, ::-1], faces)


def _plane(normal: Vector) -> Surface:
    up = np.array(normal)
    across = np.cross(up, np.eye(3)[np.argmin(np.abs(up))])
    across /= np.linalg.norm(across)
    u, v = across * PLANE_SIZE / 2, np.cross(up, across) * PLANE_SIZE / 2
    return Surface(np.array([-u - v, u - v, u + v, v - u]), np.array([[0, 1, 2], [0, 2, 3]]))


def _terrain(heights: Floats, spacing_x: float, spacing_y: float) -> Surface:
    rows, columns = heights.shape
    x, y = np.meshgrid(
        (np.arange(columns) - (columns - 1) / 2) * spacing_x, (np.arange(rows) - (rows - 1) / 2) * spacing_y
    )
    corner = np.arange(rows * columns).reshape(rows, columns)
    a, b = corner[:-1, :-1].ravel(), corner[:-1, 1:].ravel()
    c, d = corner[1:, 1:].ravel(), corner[1:, :-1].ravel()
    return Surface(
        np.stack([x, y, heights], axis=-1).reshape(-1, 3),
        np.concatenate([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)]),
    )
