"""Loads a world, pushes a crate, and plots the height of a tower's crates while it falls."""

import matplotlib.pyplot as plt

import tessera

with tessera.Cluster(servers=2) as cluster, cluster.connect() as client:
    client.load("worlds/tower.sdf")
    crates = [f"tower::box_{n}" for n in range(1, 11)]
    client.apply_impulse(crates[7], (800, 0, 0))
    path = client.trajectory(crates, ticks=180)

plt.plot(path.time, path.relative_to()[:, :, 2])
plt.xlabel("s")
plt.ylabel("m")
plt.show()
