"""Commands: what clients do to a world. Lists of them take effect at the beginning of one tick, in their order, or
none of them does.

    client.apply([
        tessera.commands.set_velocity("cart", (1, 0, 0)),
        tessera.commands.apply_impulse("crate", (0, 0, 5)),
        *tessera.commands.set_drives(joints, targets),
    ])

Each function makes a message of proto/command.proto, which may be changed. Units: m, kg, s, rad, N; vectors along the
world's axes. Bodies and joints are given by names or ids, also numpy's integers. A `ValueError` names an argument that
has not as many numbers as it must; bounds are checked by the cluster, which names the element of the list and the
field.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tessera._proto import world_pb2
from tessera._proto.command_pb2 import AddJoint, Model, Spawn
from tessera._proto.command_pb2 import Command as Command  # for annotations
from tessera.body import Body, Motion
from tessera.client_methods import adding, doing
from tessera.columns import put_numbers
from tessera.joint import Drive, DriveMode, Joint
from tessera.position import (
    IDENTITY,
    Floats,
    PositionLike,
    Vector,
    VectorLike,
    WorldPosition,
    position_message,
    quaternion_message,
    vector_fields,
    world_pose_message,
)
from tessera.references import BodyName, JointName, reference
from tessera.world import World

_ZERO: Vector = (0.0, 0.0, 0.0)


@dataclass
class PlacedBody:
    """A body that `set_state()` places."""

    body: BodyName
    position: PositionLike  # of the body frame
    orientation: VectorLike = IDENTITY  # x y z w
    linear_velocity: VectorLike = _ZERO  # m/s, of the centre of mass
    angular_velocity: VectorLike = _ZERO  # rad/s


@dataclass
class PlacedJoint:
    """A joint whose child `set_state()` places."""

    joint: JointName
    positions: float | VectorLike = ()  # by axis, rad or m; missing ones are 0
    rates: float | VectorLike = ()  # rad/s or m/s; likewise
    orientation: VectorLike | None = None  # of a ball joint: of the child's joint frame in the parent's


def spawn(
    what: Body | World,
    prefix: str = "",
    position: PositionLike | None = None,
    orientation: VectorLike | None = None,
) -> Command:
    """Adds a body, or a model: the bodies, joints, frames and modules of a `World`, as `World.read()` has it of a file.

    `prefix` comes before all names. With a `position`, or an `orientation` (x y z w), the origin of the model, which
    is the centre of its sector (0, 0, 0), comes there. AlreadyExists for a name in use, InvalidArgument, OutOfRange.
    """
    if isinstance(what, World):
        world = what.message
        model = Model(
            shapes=world.shapes,
            bodies=world.bodies,
            joints=world.joints,
            frames=world.frames,
            modules=world.settings.modules,
        )
    else:
        model = Model(shapes=[what.shape], bodies=[what.message()], modules=what.modules())
    is_placed = position is not None or orientation is not None
    pose = world_pose_message(WorldPosition() if position is None else position, orientation) if is_placed else None
    return Command(spawn=Spawn(model=model, prefix=prefix, pose=pose))


def remove(body: BodyName | None = None, *, prefix: str | None = None) -> Command:
    """Removes a body, or all bodies whose names begin with `prefix`, with their joints and frames. NotFound if
    there is none.
    """
    if (body is None) == (prefix is None):
        raise ValueError("body, prefix: one of them is expected")
    return Command(remove={"prefix": prefix} if body is None else {"body": reference(body)})


def set_velocity(body: BodyName, linear: VectorLike, angular: VectorLike = _ZERO) -> Command:
    """Sets the velocity of the centre of mass (m/s) and the angular velocity (rad/s). A kinematic body keeps them
    until another command changes them.
    """
    return _of(
        "set_velocity", body, linear=vector_fields(linear, "linear"), angular=vector_fields(angular, "angular")
    )


def apply_impulse(body: BodyName, impulse: VectorLike, lever: VectorLike = _ZERO) -> Command:
    """Applies `impulse` in N s and `lever` in m from the centre of mass."""
    return _of(
        "apply_impulse", body, impulse=vector_fields(impulse, "impulse"), lever=vector_fields(lever, "lever")
    )


def apply_force(body: BodyName, force: VectorLike, torque: VectorLike = _ZERO) -> Command:
    """Applies, for one tick, `force` in N and `torque` in N m."""
    return _of("apply_force", body, force=vector_fields(force, "force"), torque=vector_fields(torque, "torque"))


def set_force(
    body: BodyName, force: VectorLike | None, torque: VectorLike = _ZERO, *, body_axes: bool = False
) -> Command:
    """Pushes a dynamic body in every tick from now on, with `force` in N at its centre of mass and `torque` in N m,
    in the place of the force that it had; with a `force` of None, no longer. With `body_axes`, along the axes of
    the body frame, as a thruster does.
    """
    if force is None:
        return _of("set_force", body)
    lasting = {
        "force": vector_fields(force, "force"),
        "torque": vector_fields(torque, "torque"),
        "body_axes": body_axes,
    }
    return _of("set_force", body, force=lasting)


def tell_program(body: BodyName, *, program: int = 0, **numbers: float) -> Command:
    """Sets inputs and parameters of a program of a body by their names; `program` is its place on the body. It runs at
    the end of the tick, also where its body sleeps.
    """
    given = [{"name": name, "value": float(value)} for name, value in numbers.items()]
    return _of("tell_program", body, program=program, numbers=given)


def apply_radial_impulse(centre: PositionLike, radius: float, impulse: float, *, mask: int = 0) -> Command:
    """Pushes every dynamic body whose centre of mass is nearer than `radius` m (at most 4 sectors) away from
    `centre`: with `impulse` N s there, and evenly less down to none at the radius; less than 0 pulls. `mask` selects
    the collision categories, 0: all.
    """
    return Command(
        apply_radial_impulse={
            "centre": position_message(centre),
            "radius": float(radius),
            "impulse": float(impulse),
            "mask": int(mask),
        }
    )


def teleport(
    body: BodyName,
    position: PositionLike,
    orientation: VectorLike | None = None,
    linear_velocity: VectorLike | None = None,
    angular_velocity: VectorLike | None = None,
    *,
    alone: bool = False,
) -> Command:
    """Moves the body frame to a new pose, with these velocities; values that are not given stay the same.
    OutOfRange beyond 64-bit sectors.

    Moves this body only: FailedPrecondition for one that joints hold, unless `alone`, after which joints pull what
    they hold together. `set_state()` moves a robot as a whole.
    """
    given: dict[str, Any] = {
        "pose": world_pose_message(position, orientation),
        "keeps_orientation": orientation is None,
        "keeps_linear_velocity": linear_velocity is None,
        "keeps_angular_velocity": angular_velocity is None,
        "alone": alone,
    }
    if linear_velocity is not None:
        given["linear_velocity"] = vector_fields(linear_velocity, "linear_velocity")
    if angular_velocity is not None:
        given["angular_velocity"] = vector_fields(angular_velocity, "angular_velocity")
    return _of("teleport", body, **given)


def set_state(
    bodies: Iterable[PlacedBody] = (), joints: Iterable[PlacedJoint] = (), *, keeps_contacts: bool = False
) -> Command:
    """Places bodies, and what hangs on them by `joints`, in any order: the child of each comes to where its parent,
    which is the world or is placed by this command, and the joint's position put it. Only what is named moves.

    With `keeps_contacts`, contacts of bodies that stay in their sectors keep their impulses where they still touch:
    for small corrections.
    """
    return Command(
        set_state={
            "keeps_contacts": keeps_contacts,
            "bodies": [
                {
                    "body": reference(one.body),
                    "pose": world_pose_message(one.position, one.orientation),
                    "linear_velocity": vector_fields(one.linear_velocity, "linear_velocity"),
                    "angular_velocity": vector_fields(one.angular_velocity, "angular_velocity"),
                }
                for one in bodies
            ],
            "joints": [
                {
                    "joint": reference(one.joint),
                    "positions": np.atleast_1d(one.positions).tolist(),
                    "rates": np.atleast_1d(one.rates).tolist(),
                    "orientation": None
                    if one.orientation is None
                    else quaternion_message(one.orientation, "orientation"),
                }
                for one in joints
            ],
        }
    )


def set_properties(
    body: BodyName,
    *,
    motion: Motion | None = None,
    mass: float | None = None,
    inertia: VectorLike | None = None,
    friction: float | None = None,
    restitution: float | None = None,
    linear_damping: float | None = None,
    angular_damping: float | None = None,
    category: int | None = None,
    mask: int | None = None,
    gravity: bool | None = None,
    user_data: bytes | None = None,
    owner: str | None = None,
) -> Command:
    """Changes properties of a body, which are those of `Body`; what is not given stays as it is. `motion` may change
    between dynamic and kinematic. The `owner` is who may command the body by requests with this owner; "": nobody
    in particular.
    """
    return _of(
        "set_properties",
        body,
        motion=None if motion is None else motion.value,
        mass=mass,
        inertia=None if inertia is None else vector_fields(inertia, "inertia"),
        friction=friction,
        restitution=restitution,
        linear_damping=linear_damping,
        angular_damping=angular_damping,
        category=category,
        mask=mask,
        gravity=gravity,
        user_data=user_data,
        owner=owner,
    )


def set_kinematic_target(
    body: BodyName, position: PositionLike, orientation: VectorLike | None = None
) -> Command:
    """Makes a kinematic body move so that it reaches the pose at the end of the tick, at the velocity that this
    takes; it then stays there until the next target or velocity. Without an orientation, it keeps its own.
    """
    return _of(
        "set_kinematic_target",
        body,
        pose=world_pose_message(position, orientation),
        keeps_orientation=orientation is None,
    )


def set_surface_motion(body: BodyName, velocity: VectorLike, running: VectorLike = _ZERO) -> Command:
    """Starts or stops the moving surface of a body, in its frame and m/s: a conveyor belt (`velocity`), or a track,
    which runs around the axis `running`.
    """
    return _of(
        "set_surface_motion",
        body,
        velocity=vector_fields(velocity, "velocity"),
        running=vector_fields(running, "running"),
    )


def add_joint(joint: Joint) -> Command:
    """Connects two bodies of the world. AlreadyExists for a name in use, NotFound, InvalidArgument."""
    parent = None if joint.parent is None else reference(joint.parent)
    return Command(add_joint=AddJoint(joint=joint.message(), child=reference(joint.child), parent=parent))


def remove_joint(joint: JointName) -> Command:
    """Removes a joint."""
    return Command(remove_joint={"joint": reference(joint)})


def set_drive(joint: JointName, drive: Drive, axis: int = 1) -> Command:
    """Sets the drive of axis 1, or 2 of a universal joint; the other axis keeps its drive."""
    return Command(
        set_joint_drives={
            "joint": reference(joint),
            "drives": [{"axis": axis, "drive": drive.message()}],
        }
    )


def set_drives(
    joints: Sequence[JointName] | NDArray[Any],
    targets: ArrayLike,
    mode: DriveMode = DriveMode.POSITION,
    *,
    stiffness: ArrayLike = 0.0,
    damping: ArrayLike = 0.0,
    velocity: ArrayLike = 0.0,
    effort: ArrayLike = 0.0,
    axis: int = 1,
) -> list[Command]:
    """Drives n joints: values are of shape [n], or one for all. See `Drive`, also for the units. Where all joints are
    given by ids, it is one command, and takes a fraction of the time.
    """
    given = {
        "targets": targets,
        "stiffness": stiffness,
        "damping": damping,
        "velocities": velocity,
        "efforts": effort,
    }
    if isinstance(joints, np.ndarray) or not any(isinstance(name, str) for name in joints):
        ids = np.asarray(joints, dtype=np.uint64)
        command = Command(drive_joints={"axis": axis, "mode": mode.value})
        put_numbers(
            command.drive_joints, joints=ids, **{name: _array(values, len(ids), name) for name, values in given.items()}
        )
        return [command]
    names = list(joints)
    columns = [np.broadcast_to(_array(values, len(names), name), len(names)).tolist() for name, values in given.items()]
    result = []
    for name, *values in zip(names, *columns):
        command = Command()
        if isinstance(name, str):
            command.set_joint_drives.joint.name = name
        else:
            command.set_joint_drives.joint.id = int(name)
        drive = command.set_joint_drives.drives.add(axis=axis).drive
        drive.mode = mode.value
        drive.target, drive.stiffness, drive.damping, drive.velocity, drive.effort = values
        result.append(command)
    return result


class CommandMethods:
    """Methods of a client that are one command. Each returns the tick at which it takes effect, or what it makes."""

    spawn = adding(spawn)
    remove = doing(remove)
    set_velocity = doing(set_velocity)
    apply_impulse = doing(apply_impulse)
    apply_force = doing(apply_force)
    set_force = doing(set_force)
    tell_program = doing(tell_program)
    apply_radial_impulse = doing(apply_radial_impulse)
    teleport = doing(teleport)
    set_state = doing(set_state)
    set_properties = doing(set_properties)
    set_kinematic_target = doing(set_kinematic_target)
    set_surface_motion = doing(set_surface_motion)
    add_joint = adding(add_joint)
    remove_joint = doing(remove_joint)
    set_drive = doing(set_drive)
    set_drives = doing(set_drives)


def _of(kind: str, body: BodyName, **fields: Any) -> Command:
    """A command of that kind for a body; without the fields that are None."""
    return Command(**{kind: {"body": reference(body), **fields}})


def _array(values: ArrayLike, count: int, name: str) -> Floats:
    """Of one number, or of one for each of `count`."""
    array = np.asarray(values, dtype=np.float64)
    if array.ndim > 1 or (array.ndim == 1 and len(array) != count):
        raise ValueError(f"{name}: one number or {count} are expected, not an array of shape {array.shape}")
    return np.atleast_1d(array)
