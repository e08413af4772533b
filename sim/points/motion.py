"""Rule 7 for points: toward the own point as fast as the others allow, by barrier half-planes.

A vehicle that may take any velocity at once takes the one nearest to the preferred one of which n v <= (d - d_safe) / T
holds for every hull seen, n being the direction to it and d its distance: then d comes no nearer to d_safe than
exponentially. Where a hull stands ahead, it gives way to the right; where it gets nowhere, it tries a random course.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

TIME_CONSTANT_S = 2.0  # T: with both of a pair giving way, the distance shrinks with half of it
SAFE_SIGMAS = 3.0  # added to the safe distance
SWEEPS = 12  # of the projection onto the half-planes
ASIDE = 0.5  # of what is lost ahead is turned to the right
PATIENCE_S = 3.0  # without progress ...
PROGRESS_M = 0.2
DETOUR_S = 2.0  # ... a random course for so long


class Mover(Protocol):
    """How one vehicle moves, from step to step."""

    def velocity(self, now: float, way: Array, drift: Array, hulls: Array, sigma: float) -> Array:
        """Velocity (3,) m/s at `now` s: `way` (3,) m is what lies ahead, `drift` (3,) the point's own velocity.

        `hulls` (N, 3) m are those seen near, relative to this vehicle, each axis with noise of `sigma` m.
        """


@dataclass(slots=True)
class Motion:
    """How one vehicle moves; `speed` m/s is the most it can."""

    speed: float
    safe: float  # least distance kept, m, without noise
    random: np.random.Generator
    _best: float = math.inf
    _since: float = 0.0
    _detour_until: float = -math.inf
    _detour: Array = field(default_factory=lambda: np.zeros(3))

    def velocity(self, now: float, way: Array, drift: Array, hulls: Array, sigma: float) -> Array:
        """Velocity (3,) m/s, as of every Mover; `sigma` widens the safe distance."""
        preferred = preferred_velocity(way, drift, self.speed)
        distance = math.sqrt(way @ way)
        hindered = len(hulls) > 0
        if hindered:
            preferred = self._detoured(now, distance, preferred)
        preferred = limited(preferred, self.speed)
        return self._clear(preferred, hulls, sigma) if hindered else preferred

    # A random course for a while, once giving way has brought nothing for too long.
    def _detoured(self, now: float, distance: float, preferred: Array) -> Array:
        if distance < self._best - PROGRESS_M or distance > self._best + 5.0:
            self._best, self._since = distance, now
        if distance < 0.3:
            self._since = now
        if now - self._since > PATIENCE_S:
            angle = self.random.uniform(-math.pi, math.pi)
            self._detour = self.speed * np.array((math.cos(angle), math.sin(angle), 0.0))
            self._detour_until = now + DETOUR_S
            self._best, self._since = distance, self._detour_until
        return self._detour if now < self._detour_until else preferred

    # The velocity nearest to the preferred one within all half-planes (Hildreth's method), and within reach.
    def _clear(self, preferred: Array, hulls: Array, sigma: float) -> Array:
        distance = np.sqrt((hulls * hulls).sum(axis=1))
        normal = hulls / np.maximum(distance, 1e-6)[:, None]
        room = (distance - self.safe - SAFE_SIGMAS * sigma) / TIME_CONSTANT_S
        excess = normal @ preferred - room
        binding = int(excess.argmax())
        if excess[binding] <= 0.0:
            return preferred
        ahead = normal[binding]
        preferred = preferred + min(excess[binding], self.speed) * ASIDE * np.array((-ahead[1], ahead[0], 0.0))
        velocity = preferred.tolist()
        rows = [(n, r) for n, r in zip(normal.tolist(), room.tolist(), strict=True)]
        force = [0.0] * len(rows)
        for _ in range(SWEEPS):
            for i, (n, r) in enumerate(rows):
                over = n[0] * velocity[0] + n[1] * velocity[1] + n[2] * velocity[2] - r
                change = max(over, -force[i])
                if change != 0.0:
                    force[i] += change
                    velocity = [velocity[k] - change * n[k] for k in range(3)]
        return limited(np.array(velocity), self.speed)


def preferred_velocity(way: Array, drift: Array, speed: float) -> Array:
    """What would be swum if nobody were near, (3,) m/s: with the point, and to it at full speed, slower on arrival."""
    distance = math.sqrt(way @ way)
    closing: Array = way * 2.0 if distance < 0.25 * speed else way * (speed / distance)
    return drift + closing


def limited(velocity: Array, speed: float) -> Array:
    """The velocity (3,) m/s, shortened where it exceeds the speed."""
    length = math.sqrt(velocity @ velocity)
    return velocity if length <= speed else velocity * (speed / length)
