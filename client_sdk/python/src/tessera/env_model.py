"""What an environment knows of its model: bodies, joints, where they are at first, and what drives them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tessera._proto import world_pb2
from tessera.body import Motion
from tessera.errors import InvalidArgument
from tessera.joint import DriveMode, JointType
from tessera.position import Floats, to_quaternion, to_vector
from tessera.rotation import inverse, product, turned
from tessera.world import World

_AXES = {
    JointType.FIXED: 0,
    JointType.REVOLUTE: 1,
    JointType.PRISMATIC: 1,
    JointType.BALL: 0,
    JointType.UNIVERSAL: 2,
    JointType.SCREW: 1,
}
_UNBOUNDED = ("plane", "ground")


@dataclass(frozen=True)
class ModelAxis:
    """An axis of a joint of the model."""

    name: str  # of the joint; of a universal joint, with ".1" or ".2"
    joint: int  # its place among the joints of the model
    axis: int  # 1 or 2
    position: float  # at first, rad or m
    lower: float
    upper: float
    velocity_max: float
    effort_max: float
    mode: DriveMode  # of the file
    stiffness: float  # of the servo of the file
    damping: float
    leader: int  # the place of the axis that it follows; -1: none
    multiplier: float


@dataclass(frozen=True)
class EnvModel:
    """A model whose origin is in the centre of the sector (0, 0, 0)."""

    world: World  # its bodies and joints
    bodies: Sequence[str]  # names of those that can move, in their order
    moving: NDArray[np.intp]  # their places among all bodies of the model
    positions: Floats  # [b, 3], m, of those, at first
    orientations: Floats  # [b, 4]
    linear_velocities: Floats  # [b, 3]
    angular_velocities: Floats  # [b, 3]
    roots: Sequence[int]  # rows of those that are no joint's child
    axes: Sequence[ModelAxis]
    turned: dict[int, Floats] = field(default_factory=dict)  # orientations of ball joints, by place
    is_tree: bool = True  # no body is the child of two joints

    def axis_places(self, names: Iterable[str] | None) -> NDArray[np.intp]:
        """The places of axes by their names or those of their joints. Without names, of those that the file drives; if
        there is none, of all that follow no other.
        """
        if names is None:
            driven = [n for n, axis in enumerate(self.axes) if axis.mode is not DriveMode.FREE]
            free = [n for n, axis in enumerate(self.axes) if axis.leader < 0]
            return np.array(driven or free, dtype=np.intp)
        places: list[int] = []
        for name in names:
            found = [n for n, axis in enumerate(self.axes) if name in (axis.name, axis.name.rpartition(".")[0])]
            if not found:
                known = ", ".join(axis.name for axis in self.axes)
                raise InvalidArgument(f"actuators: the model has no joint {name!r} with an axis, but {known}")
            places += found
        return np.array(places, dtype=np.intp)


def split(given: World) -> tuple[World | None, World]:
    """The ground of a world file, which has no end, and what is to be copied. Without such ground, none."""
    shapes = given.message.shapes
    is_ground = [
        body.properties.motion == Motion.STATIC
        and any(part.geometry.WhichOneof("kind") in _UNBOUNDED for part in shapes[body.properties.shape].parts)
        for body in given.message.bodies
    ]
    if not any(is_ground):
        return None, given
    if any(body.programs for body in given.message.bodies):
        raise InvalidArgument("model: it has programs, and ground that has no end: give the ground as `scene`")
    places = {old: new for new, old in enumerate(n for n, is_it in enumerate(is_ground) if not is_it)}
    ground, model = World(), World()
    for world, wanted in ((ground, True), (model, False)):
        world.message.CopyFrom(given.message)
        del world.message.bodies[:]
        world.message.bodies.extend(
            body for body, is_it in zip(given.message.bodies, is_ground) if is_it is wanted
        )
    del ground.message.joints[:], ground.message.frames[:]
    for joint in model.message.joints:
        for end in ("parent", "child"):
            place = getattr(joint.properties, end)
            if place and place - 1 not in places:
                raise InvalidArgument(f"model: joint {joint.name!r} holds on to ground that has no end")
            setattr(joint.properties, end, places[place - 1] + 1 if place else 0)
    for frame in model.message.frames:
        frame.body = places.get(frame.body - 1, -1) + 1
    return ground, model


def env_model(world: World) -> EnvModel:
    """InvalidArgument for a model that is not in one sector, or has no body that can move."""
    bodies = world.message.bodies
    for body in bodies:
        sector = body.pose.position.sector
        if (sector.i, sector.j, sector.k) != (0, 0, 0):
            raise InvalidArgument(f"model: body {body.name!r} must be in the sector (0, 0, 0), relative to its centre")
    moving = np.array([n for n, body in enumerate(bodies) if body.properties.motion != Motion.STATIC], dtype=np.intp)
    if not len(moving):
        raise InvalidArgument("model: it has no body that can move")
    row_of = {int(place): row for row, place in enumerate(moving)}
    children = [row_of[joint.properties.child - 1] for joint in world.message.joints]
    moved = [bodies[n] for n in moving]
    axes, turns = _axes(world)
    return EnvModel(
        world=world,
        bodies=[body.name for body in moved],
        moving=moving,
        positions=np.array([to_vector(body.pose.position.local) for body in moved]),
        orientations=np.array([_orientation(body.pose) for body in moved]),
        linear_velocities=np.array([to_vector(body.linear_velocity) for body in moved]),
        angular_velocities=np.array([to_vector(body.angular_velocity) for body in moved]),
        roots=[row for row in range(len(moved)) if row not in children],
        axes=axes,
        turned=turns,
        is_tree=len(set(children)) == len(children),
    )


def _axes(world: World) -> tuple[list[ModelAxis], dict[int, Floats]]:
    axes: list[ModelAxis] = []
    turns: dict[int, Floats] = {}
    place_of: dict[tuple[int, int], int] = {}
    joints = world.message.joints
    for place, joint in enumerate(joints):
        kind = JointType(joint.properties.type)
        translation, rotation = _child_in_parent(world, joint)
        if kind is JointType.BALL:
            turns[place] = rotation
        for n in range(_AXES[kind]):
            place_of[place, n + 1] = len(axes)
            axes.append(_axis(joint, place, n, _AXES[kind], kind, translation, rotation))
    for (place, number), row in place_of.items():
        given = joints[place].properties.axes
        mimic = given[number - 1].mimic if len(given) >= number else None
        if mimic is not None and mimic.leader:
            leader = place_of[mimic.leader - 1, mimic.axis]
            axes[row] = ModelAxis(**{**vars(axes[row]), "leader": leader, "multiplier": mimic.multiplier})
    return axes, turns


def _axis(
    joint: world_pb2.Joint, place: int, n: int, count: int, kind: JointType, translation: Floats, rotation: Floats
) -> ModelAxis:
    given = joint.properties.axes[n] if n < len(joint.properties.axes) else world_pb2.JointAxis()
    drive = joint.drives[n] if n < len(joint.drives) else world_pb2.JointDrive()
    position = translation[0] if kind is JointType.PRISMATIC else 2 * np.arctan2(rotation[n], rotation[3])

    def bound(name: str, otherwise: float) -> float:
        return float(getattr(given, name)) if given.HasField(name) else otherwise

    return ModelAxis(
        name=joint.name if count == 1 else f"{joint.name}.{n + 1}",
        joint=place,
        axis=n + 1,
        position=float(position),
        lower=bound("lower", -np.inf),
        upper=bound("upper", np.inf),
        velocity_max=bound("velocity_max", np.inf),
        effort_max=bound("effort_max", np.inf),
        mode=DriveMode(drive.mode),
        stiffness=drive.stiffness,
        damping=drive.damping,
        leader=-1,
        multiplier=0.0,
    )


def _child_in_parent(world: World, joint: world_pb2.Joint) -> tuple[Floats, Floats]:
    """The child's frame of a joint in the parent's: translation and rotation; the nearer of two equal rotations."""
    properties = joint.properties
    bodies = world.message.bodies

    def frame(body: int, pose: Any) -> tuple[Floats, Floats]:
        local, rotation = np.array(to_vector(pose.position)), _orientation(pose)
        if body == 0:
            return local, rotation
        of = bodies[body - 1].pose
        held = _orientation(of)
        return np.array(to_vector(of.position.local)) + turned(held, local), product(held, rotation)

    parent, parent_turned = frame(properties.parent, properties.in_parent)
    child, child_turned = frame(properties.child, properties.in_child)
    back = inverse(parent_turned)
    rotation = product(back, child_turned)
    return turned(back, child - parent), rotation if rotation[3] >= 0 else -rotation


def _orientation(pose: Any) -> Floats:
    return np.array(to_quaternion(pose.orientation)) if pose.HasField("orientation") else np.array([0.0, 0.0, 0.0, 1.0])
