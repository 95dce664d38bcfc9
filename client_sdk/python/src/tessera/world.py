"""Worlds as data: built in Python, or read from files."""

from __future__ import annotations

import enum
import os
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from google.protobuf.message import DecodeError

from tessera import compiled
from tessera._proto import world_pb2
from tessera.body import Body
from tessera.errors import InvalidArgument, NotFound, from_number
from tessera.joint import Joint
from tessera.position import (
    IDENTITY,
    ORIGIN,
    PositionLike,
    SectorLike,
    VectorLike,
    position_message,
    sector_message,
    vector_message,
    world_pose_message,
)
from tessera.program import run

NOTE = "note: "  # how the program begins a line about an unsupported element
REPAIRED = "repaired: "  # and one about a fault of the file


class Precision(enum.IntEnum):
    """The floating-point precision of a simulation."""

    FLOAT32 = world_pb2.PRECISION_FLOAT32
    FLOAT64 = world_pb2.PRECISION_FLOAT64


class SeamPolicy(enum.IntEnum):
    """How contacts across borders between sectors are solved."""

    ISLAND = world_pb2.SEAM_POLICY_ISLAND  # each island is solved as a unit, over any number of sectors
    CLONE = world_pb2.SEAM_POLICY_CLONE  # every sector solves its own bodies and clones, for comparison


@dataclass
class CentralGravity:
    """A planet: `surface` m/s^2 towards `centre` at `radius` metres; decreases with the square outside."""

    centre: PositionLike
    surface: float = 9.81
    radius: float = 6.371e6


@dataclass
class FrameKey:
    """Where a frame is at one time, in the axes that its `position` and `orientation` make. It goes smoothly from one
    key to the next; velocities that are not given are those with which accelerations do not jump, and 0 at both ends of
    a path that does not loop.
    """

    time: float  # s since tick 0; of the first: 0
    position: VectorLike  # m
    orientation: VectorLike = IDENTITY
    velocity: VectorLike | None = None  # m/s, of its origin
    spin: VectorLike | None = None  # rad/s, about its origin

    def message(self) -> world_pb2.FrameKey:
        result = world_pb2.FrameKey(time=self.time)
        pose = world_pose_message((0.0, 0.0, 0.0), self.orientation)
        result.pose.orientation.CopyFrom(pose.orientation)
        result.pose.position.CopyFrom(vector_message(self.position, "position"))
        if self.velocity is not None:
            result.velocity.CopyFrom(vector_message(self.velocity, "velocity"))
        if self.spin is not None:
            result.spin.CopyFrom(vector_message(self.spin, "spin"))
        return result


@dataclass
class MovingFrame:
    """A frame with sectors of its own: a train, a ship, a station. What is in it has `frame=n`, its place in
    `Settings(frames=...)` from 1 on, in `WorldPosition`. It moves in the world, or in the frame of its `position`, which
    must be listed before it; all is along the axes of that.
    """

    name: str
    position: PositionLike = (0.0, 0.0, 0.0)  # at tick 0
    orientation: VectorLike = IDENTITY
    velocity: VectorLike = (0.0, 0.0, 0.0)  # m/s, of its origin at tick 0
    spin: VectorLike = (0.0, 0.0, 0.0)  # rad/s, about its origin; it stays
    falls: bool = False  # its origin, as a body would: on an orbit around a planet
    legs: Sequence[tuple[float, VectorLike]] = ()  # s, and m/s^2 of its origin; one after the other, from tick 0 on
    # It goes through all of these, ascending by time, and has no velocity, spin or legs then. After the last it goes on as
    # it goes there; if it loops, it begins anew, and the last key has the pose of the first.
    keys: Sequence[FrameKey] = ()
    loops: bool = False
    # The place of a body in the world's list, from 1 on: the frame goes where that goes, and neither falls nor has
    # velocities, legs and keys. `position` (m) and `orientation` are those of the frame in the body frame.
    carrier: int = 0
    # m, in the frame: of the box in which islands come into it, and outside of which they leave
    region: VectorLike | None = None
    region_centre: VectorLike = (0.0, 0.0, 0.0)

    def message(self) -> world_pb2.MovingFrame:
        result = world_pb2.MovingFrame(
            name=self.name,
            start=world_pose_message(self.position, self.orientation),
            velocity=vector_message(self.velocity, "velocity"),
            spin=vector_message(self.spin, "spin"),
            falls=self.falls,
            legs=[
                world_pb2.FrameLeg(seconds=seconds, acceleration=vector_message(acceleration, "acceleration"))
                for seconds, acceleration in self.legs
            ],
            keys=[key.message() for key in self.keys],
            loops=self.loops,
        )
        if self.carrier:
            pose = world_pose_message(self.position, self.orientation)
            result.ClearField("start")
            result.carrier.body = self.carrier
            result.carrier.pose.position.CopyFrom(pose.position.local)
            result.carrier.pose.orientation.CopyFrom(pose.orientation)
        if self.region is not None:
            result.region_size.CopyFrom(vector_message(self.region, "region"))
            result.region_centre.CopyFrom(vector_message(self.region_centre, "region_centre"))
        return result


EARTH = (0.0, 0.0, -9.81)  # m/s^2


class Settings:
    """The settings of a world.

        tessera.Settings(sector_size=64, sleep_after=0, gravity=(0, 0, 0))

    `gravity` is the same acceleration everywhere (m/s^2), or a planet's. `frames` are those that move. The
    others are the fields of WorldSettings in proto/world.proto; worlds/README.md has their meanings, units and
    bounds. What is not given has its default, which the cluster knows. Bounds are checked by the cluster,
    which names the field.

    Raises ValueError for a name that is no setting, TypeError for a value of another kind.
    """

    __slots__ = ("_message",)  # nothing that is set later would be heeded

    def __init__(
        self, gravity: VectorLike | CentralGravity = EARTH, frames: Sequence[MovingFrame] = (), **values: float
    ) -> None:
        self._message = world_pb2.WorldSettings(frames=[frame.message() for frame in frames])
        for name, value in values.items():
            field = world_pb2.WorldSettings.DESCRIPTOR.fields_by_name.get(name)
            if field is None or field.message_type is not None:
                raise ValueError(f"there is no setting {name!r}")
            setattr(self._message, name, value)
        if isinstance(gravity, CentralGravity):
            self._message.central_gravity.centre.CopyFrom(position_message(gravity.centre))
            self._message.central_gravity.surface = gravity.surface
            self._message.central_gravity.radius = gravity.radius
        else:
            self._message.uniform_gravity.CopyFrom(vector_message(gravity, "gravity"))

    def message(self) -> world_pb2.WorldSettings:
        """The settings on the wire: those that were given."""
        result = world_pb2.WorldSettings()
        result.CopyFrom(self._message)
        return result


class World:
    """The initial state of a world, before it is loaded.

        world = tessera.World("yard", tessera.Settings(sector_size=64))
        world.add(tessera.Body("ground", tessera.plane(), motion=tessera.Motion.STATIC))
        world.add(tessera.Body("crate", tessera.box(1, 1, 1), mass=10, position=(0, 0, 5)))
        client.load(world)

    `anchor` is the sector around which the world is located. `message` is the serialisable world
    (proto/world.proto), and may be changed directly. `notices` lists the unsupported elements of the file,
    `repairs` its faults that were mended.
    """

    def __init__(
        self, name: str = "world", settings: Settings | None = None, anchor: SectorLike = ORIGIN
    ) -> None:
        self.message = world_pb2.World(
            name=name, settings=(settings or Settings()).message(), anchor=sector_message(anchor)
        )
        self.notices: list[str] = []
        self.repairs: list[str] = []
        self._shapes: dict[bytes, int] = {}  # indices of the shapes added here

    @classmethod
    def read(cls, path: str | os.PathLike[str], options: Sequence[str] = ()) -> World:
        """Reads an SDF, URDF or MJCF file, or NAME.pb, which `write()` and `tessera convert` write.

        `options` are those of `tessera convert`, such as `("--shift", "2^40,0,0")`. With them, or where this package
        has no compiled parts, the program `tessera` reads the file (see `tessera.program`); a world is the same, bit
        for bit, whoever reads it.

        Raises NotFound if the file or the program is missing, and InvalidArgument, with what is wrong, for a file that
        is refused.
        """
        if Path(path).suffix == ".pb" and not options:
            return cls._of_message(Path(path))
        if not options and compiled.is_there():
            return cls._read_here(path)
        with tempfile.TemporaryDirectory(prefix="tessera-") as folder:
            converted = Path(folder) / "world.pb"
            said = run("convert", os.fspath(path), str(converted), *options)
            world = cls()
            world.message.ParseFromString(converted.read_bytes())
        lines = said.splitlines()
        world.notices = [line.removeprefix(NOTE) for line in lines if line.startswith(NOTE)]
        world.repairs = [line.removeprefix(REPAIRED) for line in lines if line.startswith(REPAIRED)]
        return world

    @classmethod
    def _of_message(cls, path: Path) -> World:
        world = cls()
        try:
            world.message.ParseFromString(path.read_bytes())
        except FileNotFoundError:
            raise NotFound(f"{path}: there is no such file") from None
        except DecodeError:
            raise InvalidArgument(f"{path} is no world (a message tessera.v1.World)") from None
        return world

    @classmethod
    def _read_here(cls, path: str | os.PathLike[str]) -> World:
        code, failure, message, notices, repairs = compiled.native().read_world(os.fspath(path))
        if code != 0:
            raise from_number(code, failure)
        world = cls()
        world.message.ParseFromString(message)
        world.notices, world.repairs = notices, repairs
        return world

    @property
    def precision(self) -> Precision:
        """Of its settings; by default FLOAT32."""
        given = self.message.settings
        return Precision(given.precision) if given.HasField("precision") else Precision.FLOAT32

    def with_precision(self, precision: Precision) -> World:
        """This world, or if it has another precision, a copy that has this one."""
        if self.precision is precision:
            return self
        other = World()
        other.message.CopyFrom(self.message)
        other.message.settings.precision = precision.value
        return other

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes the world to NAME.pb, which `tessera load` and `tessera run` accept."""
        Path(path).write_bytes(self.message.SerializeToString())

    def add(self, body: Body) -> None:
        """Adds a body. Equal shapes are stored once."""
        self.message.bodies.append(body.message(self._place_of(body.shape)))
        modules = self.message.settings.modules
        modules.extend(module for module in body.modules() if module not in modules)

    def add_joint(self, joint: Joint) -> None:
        """Adds a joint between bodies of this world. NotFound if it refers to another body."""
        message = joint.message()
        message.properties.child = self._body_number(joint.child)
        if joint.parent is not None:
            message.properties.parent = self._body_number(joint.parent)
        self.message.joints.append(message)

    def _place_of(self, shape: world_pb2.Shape) -> int:
        key = shape.SerializeToString(deterministic=True)
        if key not in self._shapes:
            self._shapes[key] = len(self.message.shapes)
            self.message.shapes.append(shape)
        return self._shapes[key]

    def _body_number(self, name: str | int) -> int:
        """The index of a body plus one, by which joints of a world refer to it."""
        for place, body in enumerate(self.message.bodies):
            if body.name == name:
                return place + 1
        raise NotFound(f'the world has no body "{name}"')
