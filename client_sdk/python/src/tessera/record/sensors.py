"""What programs measure: with the names of its numbers, and as messages for tools that draw.

Of Foxglove's well-known schemas, `LaserScan` has the distances of a `ranger` with one row, `PointCloud` what one
with rows, or a depth camera, meets, and `LocationFix` where a `satellite` says that it is.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tessera._proto import query_pb2
from tessera.frame import ProgramSample
from tessera.record.schema import LaserScan, LocationFix, PackedElementField, PointCloud
from tessera.record.topics import NANOSECONDS
from tessera.results import FoundProgram

NUMBERS_MAX = 64
"""Programs with more values than that are told by their drawings alone."""

WIDEST = 3.0  # rad, of what is seen through a plane
FIRST_RANGE = 2  # its place in the values of a ranger


class Drawing(NamedTuple):
    """How a program is drawn."""

    topic: str  # without its place: "scan"
    kind: Any  # of messages
    fill: Callable[[Any, FoundProgram, NDArray[np.float64]], None]


def drawing_of(found: FoundProgram) -> Drawing | None:
    """None for a program that is not drawn."""
    if found.kind == "satellite":
        return Drawing("fix", LocationFix, _fill_fix)
    if found.kind != "ranger":
        return None
    if found.parameters["rows"] > 1 or found.parameters["plane"] >= 0.5:
        return Drawing("points", PointCloud, _fill_points)
    return Drawing("scan", LaserScan, _fill_scan)


def draw(drawing: Drawing, found: FoundProgram, sample: ProgramSample, time: int) -> Any:
    """The message of a sample, at `time` ns."""
    message = drawing.kind(frame_id=found.body_name)
    message.timestamp.seconds, message.timestamp.nanos = divmod(time, NANOSECONDS)
    drawing.fill(message, found, sample.values)
    return message


def named(found: FoundProgram, sample: ProgramSample) -> query_pb2.FoundPrograms.Found:
    """The values of a sample by their names."""
    message = query_pb2.FoundPrograms.Found(
        body=found.body,
        program=found.program,
        kind=found.kind,
        name=found.body_name,
        program_name=found.name,
    )
    for name, value in zip(found.values, sample.values.tolist()):
        message.values.add(name=name, value=value)
    return message


def _fill_scan(message: Any, found: FoundProgram, values: NDArray[np.float64]) -> None:
    numbers = found.parameters
    ranges = values[FIRST_RANGE:]
    half = numbers["angle"] / 2 if len(ranges) > 1 else 0.0
    message.start_angle, message.end_angle = numbers["heading"] - half, numbers["heading"] + half
    message.ranges.extend(np.where(ranges < numbers["most"], ranges, np.inf).tolist())
    _mount(message.pose, numbers)


def _fill_points(message: Any, found: FoundProgram, values: NDArray[np.float64]) -> None:
    numbers = found.parameters
    ranges = values[FIRST_RANGE:]
    met = ranges < numbers["most"]
    points = (directions(numbers)[: len(ranges)] * ranges[:, None])[met].astype("<f4")
    message.point_stride = 12
    for place, name in enumerate("xyz"):
        message.fields.add(name=name, offset=4 * place, type=PackedElementField.FLOAT32)
    message.data = points.tobytes()
    _mount(message.pose, numbers)


def _fill_fix(message: Any, found: FoundProgram, values: NDArray[np.float64]) -> None:
    by_name = dict(zip(found.values, values.tolist()))
    message.latitude, message.longitude = by_name["latitude"], by_name["longitude"]
    message.altitude = by_name["height"]
    level, upright = found.parameters["noise"] ** 2, found.parameters["height_noise"] ** 2
    message.position_covariance.extend((level, 0, 0, 0, level, 0, 0, 0, upright))
    message.position_covariance_type = LocationFix.DIAGONAL_KNOWN


def directions(numbers: dict[str, float]) -> NDArray[np.float64]:
    """Of the rays of a ranger with these parameters [r, 3], in its own frame: lpss/programs/ray_fan.h."""
    rays, rows = int(numbers["rays"]), int(numbers["rows"])
    if numbers["plane"] >= 0.5:
        across = np.tan(min(numbers["angle"], WIDEST) / 2) * ((2 * np.arange(rays) + 1) / rays - 1)
        upwards = np.tan(min(numbers["row_angle"], WIDEST) / 2) * ((2 * np.arange(rows) + 1) / rows - 1)
        grid = np.stack(np.broadcast_arrays(1.0, across[None, :], upwards[:, None]), axis=-1).reshape(-1, 3)
        unit: NDArray[np.float64] = grid / np.linalg.norm(grid, axis=1, keepdims=True)
        return unit
    heading = _fan(numbers["heading"], numbers["angle"], rays)[None, :]
    rise = _fan(numbers["elevation"], numbers["row_angle"], rows)[:, None]
    parts = (np.cos(rise) * np.cos(heading), np.cos(rise) * np.sin(heading), np.sin(rise))
    rays_of_rows: NDArray[np.float64] = np.stack(np.broadcast_arrays(*parts), axis=-1).reshape(-1, 3)
    return rays_of_rows


def _fan(middle: float, angle: float, count: int) -> NDArray[np.float64]:
    return middle + angle * (np.linspace(-0.5, 0.5, count) if count > 1 else np.zeros(1))


def _mount(pose: Any, numbers: dict[str, float]) -> None:
    """The place and turn of a sensor in its body."""
    pose.position.x, pose.position.y, pose.position.z = (numbers[name] for name in "xyz")
    half = [numbers[name] / 2 for name in ("roll", "pitch", "yaw")]
    (sr, sp, sy), (cr, cp, cy) = np.sin(half).tolist(), np.cos(half).tolist()
    turn = pose.orientation
    turn.x, turn.y = sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy
    turn.z, turn.w = cr * cp * sy - sr * sp * cy, cr * cp * cy + sr * sp * sy
