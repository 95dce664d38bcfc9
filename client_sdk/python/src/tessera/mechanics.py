"""What is conserved: momentum, angular momentum and energy of bodies, and their centre of mass.

    mechanics = tessera.Mechanics(simulation, prefix="robot::")
    simulation.step(60)
    print(mechanics.sums().energy)  # J
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tessera.any_client import AnyClient
from tessera.body import Motion
from tessera.errors import NotFound
from tessera.position import ORIGIN, Floats, SectorLike, relative_to, to_quaternion, to_vector
from tessera.queries import body_states
from tessera.results import BodyStates
from tessera.rotation import inverse, product, turned


@dataclass(frozen=True)
class Sums:
    """Of all bodies together; vectors along the world's axes."""

    tick: int
    mass: float  # kg
    centre: Floats  # [3], of mass, m from the centre of the sector
    momentum: Floats  # [3], kg m/s
    angular_momentum: Floats  # [3], kg m^2/s, about the centre of mass
    kinetic: float  # J
    potential: float  # J, of uniform gravity, 0 in the centre of the sector; not a number with central gravity

    @property
    def energy(self) -> float:
        """Kinetic and potential (J)."""
        return self.kinetic + self.potential


class Mechanics:
    """Knows masses and moments of inertia of bodies, as they are when it is made."""

    def __init__(self, client: AnyClient, prefix: str = "", sector: SectorLike = ORIGIN) -> None:
        """Of the dynamic bodies whose names begin with `prefix`; positions are relative to the centre of `sector`. NotFound
        if there are none.
        """
        self._client = client
        self._sector = sector
        states = client.ask_one(body_states(prefix=prefix))
        found = [body for body in client.catalogue(states.ids, with_shapes=False).bodies if body.properties.motion == Motion.DYNAMIC]
        if not found:
            raise NotFound(f"there is no dynamic body whose name begins with {prefix!r}")
        properties = [body.properties for body in found]
        self.ids = np.array([body.id for body in found], dtype=np.uint64)
        self._query = body_states(self.ids)
        self.masses: Floats = np.array([one.mass for one in properties])
        self._moments: Floats = np.array([to_vector(one.inertia) for one in properties])
        self._centres: Floats = np.array([to_vector(one.centre) for one in properties])
        axes = [one.principal_axes if one.HasField("principal_axes") else None for one in properties]
        self._axes: Floats = np.array([(0, 0, 0, 1) if one is None else to_quaternion(one) for one in axes], dtype=np.float64)
        settings = client.status().settings
        self._size = settings.sector_size
        is_uniform = settings.WhichOneof("gravity") == "uniform_gravity"
        gravity = to_vector(settings.uniform_gravity) if is_uniform else (np.nan, np.nan, np.nan)
        weighs = np.array([not one.no_gravity for one in properties])
        self._weights: Floats = np.where(weighs[:, np.newaxis], self.masses[:, np.newaxis] * np.array(gravity), 0.0)

    def sums(self, states: BodyStates | None = None) -> Sums:
        """At the present tick, or that of `states`, which have all of the bodies (KeyError)."""
        now = (self._client.ask_one(self._query) if states is None else states).of(self.ids)
        places = relative_to(now.sectors, now.local, self._sector, self._size) + turned(now.orientations, self._centres)
        mass = float(self.masses.sum())
        moved = self.masses[:, np.newaxis] * now.linear_velocities
        centre = (self.masses[:, np.newaxis] * places).sum(axis=0) / mass
        principal = product(now.orientations, self._axes)
        spins = turned(inverse(principal), now.angular_velocities)
        own = turned(principal, self._moments * spins)
        kinetic = (moved * now.linear_velocities).sum() / 2 + (self._moments * spins**2).sum() / 2
        return Sums(
            tick=now.tick,
            mass=mass,
            centre=centre,
            momentum=moved.sum(axis=0),
            angular_momentum=(np.cross(places - centre, moved) + own).sum(axis=0),
            kinetic=float(kinetic),
            potential=-float((self._weights * places).sum()),
        )
