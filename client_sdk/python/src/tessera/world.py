"""Worlds as data: built here, or read from files."""

from __future__ import annotations

import enum
import os
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from tessera._proto import world_pb2
from tessera.body import Body
from tessera.command import run
from tessera.errors import NotFound
from tessera.joint import Joint
from tessera.position import (
    ORIGIN,
    PositionLike,
    SectorLike,
    VectorLike,
    position_message,
    sector_message,
    vector_message,
)

NOTE = "note: "  # how the program begins a line about what it left out


class Precision(enum.IntEnum):
    """The numbers that a world is simulated in."""

    FLOAT32 = world_pb2.PRECISION_FLOAT32
    FLOAT64 = world_pb2.PRECISION_FLOAT64


class SeamPolicy(enum.IntEnum):
    """What happens at a border between sectors."""

    ISLAND = world_pb2.SEAM_POLICY_ISLAND  # islands are solved whole, over any number of sectors
    CLONE = world_pb2.SEAM_POLICY_CLONE  # every sector solves its own bodies and clones, for comparison


@dataclass
class CentralGravity:
    """A planet: `surface` m/s^2 towards `centre` at `radius` metres from it, less by the square outside."""

    centre: PositionLike
    surface: float = 9.81
    radius: float = 6.371e6


@dataclass
class Settings:
    """The knobs of a world. Defaults are a good start for bodies of 0.1 to 10 m.

    Bounds are checked by the cluster, which names the field.
    """

    precision: Precision = Precision.FLOAT32
    sector_size: float = 128.0  # m, edge of a sector; bounded by the precision
    time_step: float = 1 / 60  # s, 1e-5 to 0.1
    gravity: VectorLike | CentralGravity = (0.0, 0.0, -9.81)  # m/s^2
    seams: SeamPolicy = SeamPolicy.ISLAND
    clone_depth: int = 1  # of policy CLONE, 0 to 8
    island_cap: int = 4096  # larger islands across seams are coupled pass by pass
    shuffle: int = 0  # not 0: a seed; sectors change servers at random
    solver_iterations: int = 12  # passes over the contacts of an island, 1 to 1000
    substeps: int = 4  # small steps that these passes are divided among, 1 to 64
    adapt: bool = True  # fewer of them where an island carries little, more where it carries much
    warm_starting: float = 0.85  # of Bullet's own solver: share of the last impulses, 0 to 1
    split_from: float = 0.04  # of Bullet's own solver, m: deeper overlaps leave no velocity
    friction_in_two_directions: bool = True
    continuous_collision: bool = True  # sweep bodies that are fast for their size
    sleep_linear_speed: float = 0.05  # m/s; a body slower than both speeds ...
    sleep_angular_speed: float = 0.1  # rad/s
    sleep_after: float = 1.0  # s; ... for this long may sleep. 0: nothing ever sleeps

    def message(self) -> world_pb2.WorldSettings:
        """The settings on the wire."""
        values = {name: value for name, value in vars(self).items() if name != "gravity"}
        result = world_pb2.WorldSettings(**values)
        if isinstance(self.gravity, CentralGravity):
            result.central_gravity.centre.CopyFrom(position_message(self.gravity.centre))
            result.central_gravity.surface = self.gravity.surface
            result.central_gravity.radius = self.gravity.radius
        else:
            result.uniform_gravity.CopyFrom(vector_message(self.gravity, "gravity"))
        return result


class World:
    """A world at its start, before it is loaded.

        world = tessera.World("yard", tessera.Settings(sector_size=64))
        world.add(tessera.Body("ground", tessera.plane(), motion=tessera.Motion.STATIC))
        world.add(tessera.Body("crate", tessera.box(1, 1, 1), mass=10, position=(0, 0, 5)))
        client.load(world)

    `anchor` is the sector that the world lies around. `message` is the world on the wire (proto/world.proto):
    whoever wants to may change it there. `notices` name what a file has that is not simulated.
    """

    def __init__(
        self, name: str = "world", settings: Settings | None = None, anchor: SectorLike = ORIGIN
    ) -> None:
        self.message = world_pb2.World(
            name=name, settings=(settings or Settings()).message(), anchor=sector_message(anchor)
        )
        self.notices: list[str] = []
        self._shapes: dict[bytes, int] = {}  # places of those that were added here

    @classmethod
    def read(cls, path: str | os.PathLike[str], options: Sequence[str] = ()) -> World:
        """Reads an SDF or URDF file, or NAME.pb, which `write()` and `tessera convert` write.

        The program `tessera` reads it (see `tessera.command`): there is one reader of such files, so a
        world is the same, bit for bit, whoever loads it. `options` are those of `tessera convert`, such as
        `("--shift", "2^40,0,0")`.

        Raises NotFound where the program is not there, InvalidArgument, with its message, where it refuses.
        """
        with tempfile.TemporaryDirectory(prefix="tessera-") as folder:
            converted = Path(folder) / "world.pb"
            said = run("convert", os.fspath(path), str(converted), *options)
            world = cls()
            world.message.ParseFromString(converted.read_bytes())
        world.notices = [line.removeprefix(NOTE) for line in said.splitlines() if line.startswith(NOTE)]
        return world

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes the world to NAME.pb, which `tessera load` and `tessera run` take."""
        Path(path).write_bytes(self.message.SerializeToString())

    def add(self, body: Body) -> None:
        """Adds a body. Equal shapes are stored once."""
        self.message.bodies.append(body.message(self._place_of(body.shape)))

    def add_joint(self, joint: Joint) -> None:
        """Adds a joint between bodies of this world. NotFound where it names another."""
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
        """The place of a body plus one, by which joints of a world name it."""
        for place, body in enumerate(self.message.bodies):
            if body.name == name:
                return place + 1
        raise NotFound(f'the world has no body "{name}"')
