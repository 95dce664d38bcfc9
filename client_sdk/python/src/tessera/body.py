"""Bodies, to add to a world before it is loaded, or to spawn into a running one."""

from __future__ import annotations

import enum
import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from tessera._proto import world_pb2
from tessera._proto.world_pb2 import Shape
from tessera.position import (
    IDENTITY,
    PositionLike,
    Vector,
    VectorLike,
    WorldPosition,
    quaternion_message,
    vector_message,
    world_pose_message,
)
from tessera.shape import moments_of


class Motion(enum.IntEnum):
    """How a body moves."""

    DYNAMIC = world_pb2.MOTION_DYNAMIC  # forces, contacts and joints
    STATIC = world_pb2.MOTION_STATIC  # never moves
    KINEMATIC = world_pb2.MOTION_KINEMATIC  # moved by targets and by the velocity that it is given; other bodies cannot push it


@dataclass
class Surface:
    """How the surface of a body holds and carries what touches it. Vectors are in the body frame."""

    direction: VectorLike = (0.0, 0.0, 0.0)  # of `Body.friction`, not 0: it then differs by direction
    second_friction: float = 0.0  # Coulomb coefficient across the direction
    torsional_friction: float = 1.0  # with a patch: it resists spinning by 3 pi / 16 of their product
    patch_radius: float = 0.0  # m; a contact has the larger of its two
    rolling_friction: float = 0.0  # m: the torque that resists rolling, by the normal force; likewise
    velocity: VectorLike = (0.0, 0.0, 0.0)  # m/s: of a conveyor belt
    running: VectorLike = (0.0, 0.0, 0.0)  # m/s: the axis that a track runs around

    def message(self) -> world_pb2.Surface:
        """The surface on the wire."""
        return world_pb2.Surface(
            direction=vector_message(self.direction, "direction"),
            second_friction=self.second_friction,
            torsional_friction=self.torsional_friction,
            patch_radius=self.patch_radius,
            rolling_friction=self.rolling_friction,
            velocity=vector_message(self.velocity, "velocity"),
            running=vector_message(self.running, "running"),
        )


class Program:
    """A program of a body, with parameters and inputs by their names: `Program("character", step=0.3, x=1.0)`. A number
    that is a body is, as in a joint, its place in the list of bodies plus one.

    `kind` may be the name of a program in WebAssembly, of a `module` that the world has or gets with the body: its bytes,
    or its file. OSError where that cannot be read.
    """

    def __init__(
        self, kind: str, module: bytes | str | os.PathLike[str] | None = None, /, **numbers: float
    ) -> None:
        self.kind = kind
        self.module = module if module is None or isinstance(module, bytes) else Path(module).read_bytes()
        self.name = ""
        self.numbers = numbers

    def named(self, name: str) -> Program:
        """The same, with a name, which tells the programs of a body apart."""
        self.name = name
        return self

    def message(self) -> world_pb2.Program:
        """The program on the wire."""
        return world_pb2.Program(
            kind=self.kind,
            name=self.name,
            numbers=[
                world_pb2.NamedNumber(name=name, value=float(value)) for name, value in self.numbers.items()
            ],
        )


@dataclass
class Body:
    """The initial state of one rigid body. Units: m, kg, s, rad; velocities are along the world's axes.

    Without `inertia`, the body is a solid of uniform density (see `moments_of()`) with its centre of mass at
    the origin of the body frame. Bounds are checked by the cluster, which names the field.
    """

    name: str  # unique in the world
    shape: Shape
    mass: float = 1.0  # kg; of dynamic bodies, > 0
    position: PositionLike = WorldPosition()  # of the body frame
    orientation: VectorLike = IDENTITY  # of the body frame, x y z w
    motion: Motion = Motion.DYNAMIC
    linear_velocity: VectorLike = (0.0, 0.0, 0.0)  # of the centre of mass, m/s
    angular_velocity: VectorLike = (0.0, 0.0, 0.0)  # rad/s
    inertia: VectorLike | None = None  # principal moments about the centre of mass, kg m^2
    centre: VectorLike = (0.0, 0.0, 0.0)  # of mass, in the body frame
    principal_axes: VectorLike = IDENTITY  # rotation to the body frame, x y z w
    friction: float = 0.5  # Coulomb coefficient; a contact has the smaller of its two
    restitution: float = 0.0  # 0 to 1; the two of a contact are multiplied
    linear_damping: float = 0.0  # fraction of the velocity lost per second, 0 to 1
    angular_damping: float = 0.0  # likewise
    category: int = 1  # collision bits: two bodies collide if each one's category ...
    mask: int = 0xFFFFFFFF  # ... matches the other one's mask
    gravity: bool = True
    assembly: int = 0  # bodies of the same assembly, not 0, do not collide
    surface: Surface | None = None  # none: one like any other
    trigger: bool = False  # it notices what overlaps it, and touches nothing
    user_data: bytes = b""  # at most 1024 bytes, which the world keeps with the body and does not look at
    programs: Sequence[Program] = ()  # at most 8; the body must not be static

    def message(self, shape_place: int = 0) -> world_pb2.Body:
        """The body on the wire; `shape_place` is the index of its shape in the table of a world."""
        return world_pb2.Body(
            name=self.name,
            properties=world_pb2.BodyProperties(
                motion=self.motion.value,
                shape=shape_place,
                mass=self.mass,
                inertia=vector_message(self._moments(), "inertia"),
                centre=vector_message(self.centre, "centre"),
                principal_axes=quaternion_message(self.principal_axes, "principal_axes"),
                friction=self.friction,
                restitution=self.restitution,
                linear_damping=self.linear_damping,
                angular_damping=self.angular_damping,
                category=self.category,
                mask=self.mask,
                no_gravity=not self.gravity,
                assembly=self.assembly,
                surface=None if self.surface is None else self.surface.message(),
                trigger=self.trigger,
            ),
            pose=world_pose_message(self.position, self.orientation),
            linear_velocity=vector_message(self.linear_velocity, "linear_velocity"),
            angular_velocity=vector_message(self.angular_velocity, "angular_velocity"),
            user_data=self.user_data,
            programs=[program.message() for program in self.programs],
        )

    def modules(self) -> list[bytes]:
        """The modules of its programs, each once."""
        return list(dict.fromkeys(program.module for program in self.programs if program.module is not None))

    def _moments(self) -> VectorLike:
        if self.inertia is not None:
            return self.inertia
        moments: Vector = (1.0, 1.0, 1.0)  # ignored for bodies that no force moves
        if self.motion is Motion.DYNAMIC:
            moments = moments_of(self.shape, self.mass)
        return moments if all(map(math.isfinite, moments)) else (1.0, 1.0, 1.0)
