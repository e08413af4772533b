"""The simulator's neighbour sensor: an own position fix and the relative positions of the vehicles in range."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from companion.scene import Sighting

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class SightingModel:
    """Errors of the sensor: one-sigma noise an axis of the own fix and of a relative position, m; range, m.

    `missed` is the probability that a vehicle in range goes undetected in one reading.
    """

    range_m: float = 20.0
    fix_sigma_m: float = 0.05
    relative_sigma_m: float = 0.05
    missed: float = 0.0


class SightingSensor:
    """One vehicle's sensor, with a random stream of its own: what others draw never changes what this one sees."""

    def __init__(self, model: SightingModel, seed: int, vehicle: int) -> None:
        self.model = model
        self._vehicle = vehicle
        self._random = np.random.default_rng([seed, 0x516874, vehicle])

    def read(self, now: float, position: Array) -> Sighting:
        """A reading at true positions (N, 3) m, mission frame; neighbours come in random order, without identity.

        The same number of draws is made for every reading, whoever is in range.
        """
        model, me = self.model, self._vehicle
        count = len(position)
        noise = self._random.standard_normal((count, 3))
        detected = self._random.random(count) >= model.missed
        order = self._random.permutation(count)
        relative = position - position[me]
        seen = detected & (np.linalg.norm(relative, axis=1) <= model.range_m)
        seen[me] = False
        measured = relative + model.relative_sigma_m * noise
        return Sighting(
            stamp=now,
            position=position[me] + model.fix_sigma_m * noise[me],
            sigma=float(np.hypot(model.fix_sigma_m, model.relative_sigma_m)),
            relative=measured[order[seen[order]]],
            sensing_range=model.range_m,
        )
