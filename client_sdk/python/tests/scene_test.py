"""What drawing tools are told: the shapes of bodies, and where their frames are."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import tessera
from tessera._proto import query_pb2, tessera_pb2
from tessera.frame import BodyFrame, body_frame
from tessera.position import world_pose_message
from tessera.record.scene import scene, transforms
from tessera.record.surface import hull, surface_of

FAR = 2**62
QUARTER = 0.5**0.5  # x and w of a quarter turn about x


def drawn(shape: tessera.Shape, motion: tessera.Motion = tessera.Motion.DYNAMIC) -> Any:
    """The entity of one body of that shape."""
    body = query_pb2.FoundBodies.Found(id=7, name="thing")
    body.properties.motion = motion.value
    body.properties.shape = 3
    update = scene([body], {3: shape}, 1_500_000_000)
    (entity,) = update.entities
    assert (entity.id, entity.frame_id, entity.frame_locked) == ("thing", "thing", True)
    assert (entity.timestamp.seconds, entity.timestamp.nanos) == (1, 500_000_000)
    return entity


def xyz(message: Any) -> tuple[float, float, float]:
    return (message.x, message.y, message.z)


def frame_at(position: tessera.WorldPosition) -> BodyFrame:
    state = tessera_pb2.BodyState(id=7, pose=world_pose_message(position, (QUARTER, 0, 0, QUARTER)))
    return body_frame(3, tessera_pb2.BodyBatch(tick=3, bodies=[state]), 128)


def test_shapes_that_tools_know_are_told_by_name() -> None:
    assert xyz(drawn(tessera.box(1, 2, 3)).cubes[0].size) == (1, 2, 3)
    assert xyz(drawn(tessera.sphere(0.5)).spheres[0].size) == (1, 1, 1)
    assert xyz(drawn(tessera.ellipsoid(1, 2, 3)).spheres[0].size) == (2, 4, 6)
    (cylinder,) = drawn(tessera.cylinder(0.5, 3)).cylinders
    assert xyz(cylinder.size) == (1, 1, 3)
    assert (cylinder.bottom_scale, cylinder.top_scale) == (1, 1)


def test_capsule_is_a_cylinder_with_a_ball_at_each_end() -> None:
    turned = tessera.compound([(tessera.capsule(0.5, 3), (1, 2, 3), (QUARTER, 0, 0, QUARTER))])
    entity = drawn(turned)
    assert xyz(entity.cylinders[0].size) == (1, 1, 3)
    assert xyz(entity.cylinders[0].pose.position) == (1, 2, 3)
    ends = [xyz(ball.pose.position) for ball in entity.spheres]
    assert np.array(ends) == pytest.approx(np.array([(1, 3.5, 3), (1, 0.5, 3)]))


def test_parts_of_a_compound_keep_their_places() -> None:
    entity = drawn(tessera.compound([(tessera.box(1, 1, 1), (0, 0, -1)), (tessera.box(1, 1, 1), (0, 0, 1))]))
    assert [xyz(cube.pose.position) for cube in entity.cubes] == [(0, 0, -1), (0, 0, 1)]
    assert all(cube.pose.orientation.w == 1 for cube in entity.cubes)


def test_colours_tell_bodies_apart_and_what_is_static() -> None:
    still = drawn(tessera.box(1, 1, 1), tessera.Motion.STATIC).cubes[0].color
    moving = drawn(tessera.box(1, 1, 1)).cubes[0].color
    assert still.r == still.g == still.b
    assert len({moving.r, moving.g, moving.b}) == 3
    assert still.a == moving.a == 1


def test_all_that_was_drawn_before_goes() -> None:
    update = scene([], {}, 2_000_000_000)
    (deletion,) = update.deletions
    assert deletion.type == deletion.ALL
    assert deletion.timestamp.seconds == 2


def test_meshes_and_terrains_are_triangles() -> None:
    (triangles,) = drawn(tessera.triangle_mesh([(0, 0, 0), (5, 0, 1), (0, 5, 0)], [(0, 1, 2)])).triangles
    assert [xyz(point) for point in triangles.points] == [(0, 0, 0), (5, 0, 1), (0, 5, 0)]
    assert list(triangles.indices) == [0, 1, 2]

    part = tessera.height_field([[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]], 2, 3).parts[0]
    points, faces = surface_of(part.geometry)
    assert points.tolist() == [
        [-2, -1.5, 0],
        [0, -1.5, 1],
        [2, -1.5, 2],
        [-2, 1.5, 3],
        [0, 1.5, 4],
        [2, 1.5, 5],
    ]
    assert len(faces) == 4
    corners = points[faces]
    assert (np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2] > 0).all()


def test_plane_is_a_square_across_its_normal() -> None:
    points, faces = surface_of(tessera.plane((0, 0.6, 0.8)).parts[0].geometry)
    assert points @ np.array((0, 0.6, 0.8)) == pytest.approx(np.zeros(4), abs=1e-12)
    assert np.linalg.norm(points, axis=1) == pytest.approx(np.full(4, 100 * 2**0.5))
    assert faces.shape == (2, 3)


@pytest.mark.parametrize("seed", range(5))
def test_hull_has_all_points_inside_and_is_closed(seed: int) -> None:
    random = np.random.default_rng(seed)
    cube = np.array(np.meshgrid((-1, 1), (-1, 1), (-1, 1)), dtype=np.float64).reshape(3, -1).T
    points = np.concatenate([cube, random.uniform(-1, 1, (20, 3)), random.normal(0, 1, (10, 3))])
    surface = hull(points)
    a, b, c = (points[surface.triangles[:, corner]] for corner in range(3))
    normals = np.cross(b - a, c - a)
    outside = np.einsum("fi,pfi->pf", normals, points[:, None] - a) / np.linalg.norm(normals, axis=1)
    assert outside.max() < 1e-9
    edges = surface.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2).tolist()
    assert sorted(edges) == sorted([b, a] for a, b in edges)


def test_hull_of_a_cube_is_its_surface() -> None:
    points = np.array(np.meshgrid((-1, 1), (-1, 1), (-1, 1)), dtype=np.float64).reshape(3, -1).T
    surface = hull(points)
    a, b, c = (points[surface.triangles[:, corner]] for corner in range(3))
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2 == pytest.approx(24)


def test_frames_are_relative_to_a_sector_at_any_distance() -> None:
    near = transforms(frame_at(tessera.WorldPosition((0.1, 0.2, 0.3), (1, 0, 0))), {7: "thing"}, (0, 0, 0), 9)
    far = transforms(
        frame_at(tessera.WorldPosition((0.1, 0.2, 0.3), (FAR + 1, 0, 0))), {7: "thing"}, (FAR, 0, 0), 9
    )
    (here,), (there,) = near.transforms, far.transforms
    assert here.translation == there.translation
    assert xyz(here.translation) == (128.1, 0.2, 0.3)
    assert here.rotation.w == QUARTER
    assert (here.parent_frame_id, here.child_frame_id) == ("sector 0,0,0", "thing")
    assert there.parent_frame_id == f"sector {FAR},0,0"
    assert here.timestamp.nanos == 9


def test_body_without_a_name_has_no_frame() -> None:
    frame = frame_at(tessera.WorldPosition())
    assert len(transforms(frame, {}, (0, 0, 0), 0).transforms) == 0
