"""Drives a pendulum of two bars in lock step, and looks at it with a fan of rays: one message there and back a tick."""

import math

import matplotlib.pyplot as plt
import numpy as np

import tessera

TICKS = 240


def pendulum() -> tessera.World:
    """Two bars in a row along x, each 1 m long, on hinges about y, the first of which is at the origin."""
    along_y = (0, 0, math.sqrt(0.5), math.sqrt(0.5))  # turns the x axis of the joint
    model = tessera.World("pendulum")
    for n in range(2):
        model.add(tessera.Body(f"bar_{n}", tessera.box(0.9, 0.1, 0.1), position=(n + 0.5, 0, 0)))
        model.add_joint(
            tessera.Joint(
                tessera.JointType.REVOLUTE,
                child=f"bar_{n}",
                parent=f"bar_{n - 1}" if n else None,
                name=f"hinge_{n}",
                in_parent=(0.5 if n else 0, 0, 0),
                in_parent_turned=along_y,
                in_child=(-0.5, 0, 0),
                in_child_turned=along_y,
                axes=[tessera.Axis(effort_max=100)],
            )
        )
    return model


angles = np.linspace(-1, 1, 101)  # of the rays, rad from straight down
down = np.stack([np.sin(angles), np.zeros(101), -np.cos(angles)], axis=1)

with tessera.Cluster(servers=2, store=False) as cluster, cluster.connect() as client:
    client.load(tessera.World("empty"))
    arm = client.spawn(pendulum(), prefix="arm::", position=(0, 0, 3))
    scan = tessera.queries.rays((0, 0, 6), down, 10)
    state = tessera.queries.joint_states(arm.joints)
    positions, distances = [], []
    for tick in range(TICKS):
        targets = [0.5 * math.sin(tick / 20), 0.5 * math.cos(tick / 20)]  # rad
        drives = tessera.commands.set_drives(
            arm.joints, targets, tessera.DriveMode.SERVO, stiffness=400, damping=40
        )
        answers = client.step(commands=drives, queries=[scan, state])
        positions.append(answers[state].positions[:, 0])
        distances.append(answers[scan].distances)

figure, (above, below) = plt.subplots(2)
above.plot(positions)
above.set_ylabel("rad")
below.imshow(np.array(distances).T, aspect="auto")
below.set_xlabel("tick")
plt.show()
