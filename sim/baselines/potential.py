"""The paper's motion among others (Algorithm 2, lines 6 to 8): every hull repels like a charge of the same sign.

The force is that of Khatib's field, k (1/d - 1/d0) / d^2 within d0 of a hull, and adds to the velocity. The paper gives
no constants; at strength 1, k is such that a vehicle that swims straight at another is held off at the safe distance.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.points.motion import limited, preferred_velocity

Array = NDArray[np.float64]

REACH = 2.0  # d0, where the field ends, in safe distances


@dataclass(slots=True)
class PotentialField:
    """How one vehicle moves; a drop-in for sim.points.Motion. `speed` m/s is the most it can."""

    speed: float
    safe: float  # distance at which a field of strength 1 stops a vehicle at full speed, m
    random: np.random.Generator
    strength: float = 1.0

    def velocity(self, now: float, way: Array, drift: Array, hulls: Array, sigma: float) -> Array:
        """Velocity (3,) m/s, as of every Mover: attraction and repulsion in sum."""
        velocity = limited(preferred_velocity(way, drift, self.speed), self.speed)
        if len(hulls):
            distance = np.maximum(np.sqrt((hulls * hulls).sum(axis=1)), 1e-3)
            push = self._force(distance) / self._force(np.array(self.safe)) * self.speed * self.strength
            velocity = velocity - (push / distance) @ hulls
        return limited(velocity, self.speed)

    def _force(self, distance: Array) -> Array:
        force: Array = np.maximum(1.0 / distance - 1.0 / (REACH * self.safe), 0.0) / distance**2
        return force
