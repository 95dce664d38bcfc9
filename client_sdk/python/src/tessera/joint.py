"""Joints, which connect two bodies, and their drives.

A joint has a frame on each of its two bodies; at its zero, the two coincide. Its first axis is the x axis of
that frame; the second axis of a universal joint is the y axis.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from tessera._proto import world_pb2
from tessera.position import IDENTITY, ORIGIN, SectorLike, VectorLike, pose_message, sector_message


class JointType(enum.IntEnum):
    """The type of a joint, which determines the free motions."""

    FIXED = world_pb2.JOINT_FIXED  # no free motion
    REVOLUTE = world_pb2.JOINT_REVOLUTE  # the angle about the axis
    PRISMATIC = world_pb2.JOINT_PRISMATIC  # the displacement along the axis
    BALL = world_pb2.JOINT_BALL  # all angles
    UNIVERSAL = world_pb2.JOINT_UNIVERSAL  # the angles about two axes
    SCREW = world_pb2.JOINT_SCREW  # the angle about the axis, coupled with the displacement along it


class DriveMode(enum.IntEnum):
    """How an axis is driven."""

    FREE = world_pb2.JointDrive.FREE
    VELOCITY = world_pb2.JointDrive.VELOCITY  # holds a velocity, with at most `effort_max`
    POSITION = world_pb2.JointDrive.POSITION  # moves to a position, with at most `velocity_max`, and holds it
    EFFORT = world_pb2.JointDrive.EFFORT  # applies an effort
    SERVO = world_pb2.JointDrive.SERVO  # stiffness (target - position) + damping (velocity - rate) + effort


@dataclass
class Drive:
    """`target` in rad/s or m/s, rad or m, N m or N, depending on `mode` and the type of axis."""

    mode: DriveMode = DriveMode.FREE
    target: float = 0.0
    stiffness: float = 0.0  # of a servo, as all that follows: N m/rad or N/m
    damping: float = 0.0  # N m s/rad or N s/m
    velocity: float = 0.0  # of its target, rad/s or m/s
    effort: float = 0.0  # on top, N m or N

    def message(self) -> world_pb2.JointDrive:
        return world_pb2.JointDrive(
            mode=self.mode.value,
            target=self.target,
            stiffness=self.stiffness,
            damping=self.damping,
            velocity=self.velocity,
            effort=self.effort,
        )


@dataclass
class Mimic:
    """What an axis follows: multiplier * (position of the leader - reference) + offset."""

    leader: int  # the id of another joint
    axis: int = 1  # of the leader
    multiplier: float = 1.0
    reference: float = 0.0  # rad or m, of the leader
    offset: float = 0.0  # rad or m

    def message(self) -> world_pb2.AxisMimic:
        return world_pb2.AxisMimic(
            leader=self.leader,
            axis=self.axis,
            multiplier=self.multiplier,
            reference=self.reference,
            offset=self.offset,
        )


@dataclass
class Axis:
    """One degree of freedom. Units: rad, N m and rad/s for an angle; m, N and m/s for a displacement."""

    lower: float = -math.inf  # for an angle, within [-pi, pi] if bounded
    upper: float = math.inf
    velocity_max: float = math.inf  # of a position drive
    effort_max: float = math.inf  # of every drive
    damping: float = 0.0  # effort per velocity
    friction: float = 0.0  # effort that resists any motion
    spring_stiffness: float = 0.0  # effort per way from the reference, back to it
    spring_reference: float = 0.0  # rad or m
    armature: float = 0.0  # kg m^2 or kg: a motor's rotor as the axis feels it, through its gear
    mimic: Mimic | None = None

    def message(self) -> world_pb2.JointAxis:
        result = world_pb2.JointAxis(
            damping=self.damping,
            friction=self.friction,
            spring_stiffness=self.spring_stiffness,
            spring_reference=self.spring_reference,
            armature=self.armature,
            mimic=None if self.mimic is None else self.mimic.message(),
        )
        for name in ("lower", "upper", "velocity_max", "effort_max"):
            if math.isfinite(getattr(self, name)):
                setattr(result, name, getattr(self, name))
        return result


@dataclass
class Joint:
    """A joint between two bodies, its frames in their body frames."""

    type: JointType
    child: str | int  # a dynamic body, by its name or its id
    parent: str | int | None = None  # none: the world
    name: str = ""  # a missing name is generated
    in_parent: VectorLike = (0.0, 0.0, 0.0)  # the joint frame's origin in the parent, m
    in_parent_turned: VectorLike = IDENTITY  # its rotation there, x y z w
    in_child: VectorLike = (0.0, 0.0, 0.0)
    in_child_turned: VectorLike = IDENTITY
    sector: SectorLike = ORIGIN  # if the parent is the world: `in_parent` is relative to its centre
    axes: Sequence[Axis] = field(default_factory=list)  # missing ones are free
    drives: Sequence[Drive] = field(default_factory=list)  # likewise
    pitch: float = 0.0  # of a screw, m/rad
    bodies_collide: bool = False  # parent and child with each other

    def message(self) -> world_pb2.Joint:
        """The joint on the wire, without its bodies."""
        return world_pb2.Joint(
            name=self.name,
            properties=world_pb2.JointProperties(
                type=self.type.value,
                anchor=sector_message(self.sector),
                in_parent=pose_message(self.in_parent, self.in_parent_turned),
                in_child=pose_message(self.in_child, self.in_child_turned),
                axes=[axis.message() for axis in self.axes],
                pitch=self.pitch,
                bodies_collide=self.bodies_collide,
            ),
            drives=[drive.message() for drive in self.drives],
        )
