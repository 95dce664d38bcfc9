"""Collision shapes. Lengths in metres, in the frame of the body."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from tessera._proto.world_pb2 import Geometry, PartMaterial, Shape
from tessera.position import IDENTITY, Vector, VectorLike, pose_message, vector_message

Placed: TypeAlias = tuple[Shape, VectorLike] | tuple[Shape, VectorLike, VectorLike]
"""A shape with its position (m) and orientation (x y z w, default identity) in the body frame."""


def box(x: float, y: float, z: float) -> Shape:
    """A box with these edges."""
    return _one(Geometry(box=Geometry.Box(size=vector_message((x, y, z), "size"))))


def sphere(radius: float) -> Shape:
    return _one(Geometry(sphere=Geometry.Sphere(radius=radius)))


def capsule(radius: float, length: float) -> Shape:
    """A cylinder along z closed by two hemispheres; `length` is that of the cylinder without them."""
    return _one(Geometry(capsule=Geometry.Capsule(radius=radius, length=length)))


def cylinder(radius: float, length: float) -> Shape:
    """A cylinder along z, centred."""
    return _one(Geometry(cylinder=Geometry.Cylinder(radius=radius, length=length)))


def ellipsoid(x: float, y: float, z: float) -> Shape:
    """An ellipsoid with these radii."""
    return _one(Geometry(ellipsoid=Geometry.Ellipsoid(radii=vector_message((x, y, z), "radii"))))


def plane(normal: VectorLike = (0, 0, 1)) -> Shape:
    """The half space below a plane through the origin; `normal` has unit length. For static bodies only."""
    return _one(Geometry(plane=Geometry.Plane(normal=vector_message(normal, "normal"))))


def convex_hull(points: ArrayLike) -> Shape:
    """The hull of points [n, 3]: at least 4, not all in a plane."""
    return _one(Geometry(convex_hull=Geometry.ConvexHull(points=_rows(points))))


def triangle_mesh(vertices: ArrayLike, triangles: ArrayLike) -> Shape:
    """A surface without interior, of vertices [n, 3] and triangles [m, 3]. For static bodies only."""
    indices = np.asarray(triangles, dtype=np.uint32).ravel().tolist()
    return _one(Geometry(triangle_mesh=Geometry.TriangleMesh(vertices=_rows(vertices), indices=indices)))


def height_field(heights: ArrayLike, spacing_x: float, spacing_y: float) -> Shape:
    """A terrain of heights [rows, columns], centred in x (along columns) and y. For static bodies only."""
    samples = np.asarray(heights, dtype=np.float64)
    if samples.ndim != 2:
        raise ValueError(
            f"heights: an array [rows, columns] is expected, not one of {samples.ndim} dimensions"
        )
    rows, columns = samples.shape
    return _one(
        Geometry(
            height_field=Geometry.HeightField(
                columns=columns,
                rows=rows,
                spacing_x=spacing_x,
                spacing_y=spacing_y,
                heights=samples.ravel().tolist(),
            )
        )
    )


def compound(parts: Iterable[Placed]) -> Shape:
    """Several shapes as one."""
    whole = Shape()
    for shape, position, *turn in parts:
        if len(shape.parts) != 1:
            raise ValueError("parts: each must be a shape of one part")
        part = shape.parts[0]
        whole.parts.add(
            geometry=part.geometry,
            pose=pose_message(position, turn[0] if turn else IDENTITY),
            material=part.material if part.HasField("material") else None,
        )
    return whole


def trigger(shape: Shape, *, category: int = 1, mask: int = 0xFFFFFFFF) -> Shape:
    """The shape as a trigger: it notices what overlaps it, and touches nothing.

    Its collision bits count in the place of its body's. It adds neither mass nor inertia.
    """
    noticing = Shape()
    noticing.CopyFrom(shape)
    for part in noticing.parts:
        part.material.CopyFrom(PartMaterial(category=category, mask=mask, trigger=True))
    return noticing


def moments_of(shape: Shape, mass: float) -> Vector:
    """The principal moments of inertia (kg m^2) of a solid of uniform density.

    Exact for one box, sphere, capsule, cylinder or ellipsoid; others have those of their bounding sphere.
    Triggers do not count beside other parts.
    """
    if solid := [part for part in shape.parts if not part.material.trigger]:
        shape = Shape(parts=solid)
    alone = len(shape.parts) == 1 and not shape.parts[0].HasField("pose")
    single = shape.parts[0].geometry if alone else None
    kind = single.WhichOneof("kind") if single else None
    if single is None or kind not in ("box", "capsule", "cylinder", "ellipsoid"):
        return _ball(mass, bounding_radius(shape))
    if kind == "box":
        size = single.box.size
        return _about(mass / 12, size.x, size.y, size.z)
    if kind == "ellipsoid":
        radii = single.ellipsoid.radii
        return _about(mass / 5, radii.x, radii.y, radii.z)
    if kind == "cylinder":
        r, length = single.cylinder.radius, single.cylinder.length
        across = mass * (3 * r * r + length * length) / 12
        return (across, across, mass * r * r / 2)
    return _capsule(mass, single.capsule.radius, single.capsule.length)


def bounding_radius(shape: Shape) -> float:
    """The radius of a sphere around the body frame's origin that contains the shape; infinite for a plane."""
    radius = 0.0
    for part in shape.parts:
        p = part.pose.position
        radius = max(radius, math.hypot(p.x, p.y, p.z) + _radius(part.geometry))
    return radius


def _one(geometry: Geometry) -> Shape:
    return Shape(parts=[Shape.Part(geometry=geometry)])


def _rows(points: ArrayLike) -> list[float]:
    rows = np.asarray(points, dtype=np.float64)
    if rows.ndim != 2 or rows.shape[1] != 3:
        raise ValueError(f"points: an array [n, 3] is expected, not one of shape {rows.shape}")
    flat: list[float] = rows.ravel().tolist()
    return flat


def _about(factor: float, x: float, y: float, z: float) -> Vector:
    return (factor * (y * y + z * z), factor * (x * x + z * z), factor * (x * x + y * y))


def _ball(mass: float, radius: float) -> Vector:
    moment = 0.4 * mass * radius * radius
    return (moment, moment, moment)


def _capsule(mass: float, r: float, length: float) -> Vector:
    """A cylinder and two half balls, whose centres of mass are 3/8 of a radius from their flat sides."""
    middle = mass * length / (length + r * 4 / 3)
    ends = mass - middle
    across = middle * (3 * r * r + length * length) / 12 + ends * (
        0.4 * r * r + length * length / 4 + 3 * length * r / 8
    )
    return (across, across, middle * r * r / 2 + ends * 0.4 * r * r)


def _radius(geometry: Geometry) -> float:
    kind = geometry.WhichOneof("kind")
    if kind == "box":
        size = geometry.box.size
        return math.hypot(size.x, size.y, size.z) / 2
    if kind == "sphere":
        return geometry.sphere.radius
    if kind == "capsule":
        return geometry.capsule.length / 2 + geometry.capsule.radius
    if kind == "cylinder":
        return math.hypot(geometry.cylinder.length / 2, geometry.cylinder.radius)
    if kind == "ellipsoid":
        radii = geometry.ellipsoid.radii
        return max(radii.x, radii.y, radii.z)
    if kind == "convex_hull":
        points = np.asarray(geometry.convex_hull.points).reshape(-1, 3)
        return float(np.linalg.norm(points, axis=1).max(initial=0))
    return math.inf  # shapes of static bodies only need no moments
