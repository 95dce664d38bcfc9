"""A pendulum swings up and stays there: energy is pumped in until it can reach the top, where a PD law catches it.

The motor is too weak to lift the bar at once. Controller and world are in one process: a tick is one call.
"""

from __future__ import annotations

import math

import tessera

LENGTH, MASS = 1.0, 1.0  # m, kg, of a bar that is held at one end
GRAVITY = 9.81
EFFORT_MAX = 2.0  # N m; to hold the bar level takes 4.9
STIFFNESS, DAMPING = 15.0, 4.0  # of the PD law
TICKS = 600

INERTIA = MASS * LENGTH**2 / 3  # about the hinge, kg m^2
TOP = MASS * GRAVITY * LENGTH  # J, above the bottom


def pendulum() -> tessera.World:
    """A bar that hangs from a hinge about y in the origin; its angle is 0 there."""
    along_y = (0, 0, math.sqrt(0.5), math.sqrt(0.5))  # turns the x axis of the joint
    moments = (MASS * LENGTH**2 / 12, MASS * LENGTH**2 / 12, 1e-3)
    world = tessera.World("pendulum", tessera.Settings(sleep_after=0))
    world.add(tessera.Body("bar", tessera.box(0.05, 0.05, LENGTH), MASS, (0, 0, -LENGTH / 2), inertia=moments))
    world.add_joint(
        tessera.Joint(
            tessera.JointType.REVOLUTE,
            "bar",
            name="hinge",
            in_parent_turned=along_y,
            in_child=(0, 0, LENGTH / 2),
            in_child_turned=along_y,
            axes=[tessera.Axis(effort_max=EFFORT_MAX)],
        )
    )
    return world


def effort(angle: float, rate: float) -> float:
    """What the motor gives (N m), at an angle from the bottom."""
    from_top = math.remainder(angle - math.pi, 2 * math.pi)
    if abs(from_top) < 0.25:
        return -STIFFNESS * from_top - DAMPING * rate
    energy = INERTIA * rate**2 / 2 + TOP / 2 * (1 - math.cos(angle))
    return math.copysign(EFFORT_MAX, rate) if energy < TOP else 0.0


def main() -> None:
    with tessera.Simulation(pendulum()) as simulation:
        hinge = simulation.find_joints("hinge")[0].id
        states = tessera.queries.joint_states([hinge])
        angle = rate = 0.0
        for tick in range(TICKS):
            drive = tessera.Drive(tessera.DriveMode.EFFORT, max(-EFFORT_MAX, min(EFFORT_MAX, effort(angle, rate))))
            found = simulation.step(commands=[tessera.commands.set_drive(hinge, drive)], queries=[states])[states]
            angle, rate = found.positions[0, 0], found.rates[0, 0]
            if tick % 60 == 59:
                print(f"{(tick + 1) / 60:4.0f} s: {math.degrees(angle):7.1f} degrees from the bottom")
        print(f"at the end, {math.degrees(math.remainder(angle - math.pi, 2 * math.pi)):.2f} degrees from the top")


if __name__ == "__main__":
    main()
