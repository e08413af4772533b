"""What a swarm did, as arrays for pictures; and a virtual formation that moves in steps, as the paper's does."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from companion.formation import VirtualFormation, VirtualState
from companion.scene import Phase
from sim.points import Swarm

Array = NDArray[np.float64]

PERIOD_S = 0.5


@dataclass(frozen=True, slots=True)
class Trace:
    """T moments: times (T,) s, positions (T, J, 3) and points (T, L, 3) m, held (T, J) the point of each, -1 for none.

    Positions are NaN while a vehicle is not in the water.
    """

    times: Array
    positions: Array
    points: Array
    held: NDArray[np.int64]

    def errors(self) -> Array:
        """Tracking error (T, J) m: distance of each vehicle to the point that it holds (Remark 4.1)."""
        own = np.take_along_axis(self.points, np.maximum(self.held, 0)[:, :, None], axis=1)
        return np.where(self.held >= 0, np.linalg.norm(self.positions - own, axis=2), np.nan)

    def at(self, time: float) -> int:
        """The moment nearest to a time, s."""
        return int(np.abs(self.times - time).argmin())


def record(swarm: Swarm, until_s: float, each: Callable[[Swarm], None] = lambda swarm: None) -> Trace:
    """Steps the swarm until a time, calling `each` before every step."""
    times: list[float] = []
    rows: list[tuple[Array, Array, list[int]]] = []
    while swarm.now < until_s - 1e-9:
        if not times or swarm.now >= times[-1] + PERIOD_S - 1e-9:
            positions = swarm.positions.copy()
            positions[list(swarm.absent)] = np.nan
            away = swarm.absent | swarm.dead
            own = [None if decision is None else decision.point for decision in swarm.decisions]
            held = [-1 if point is None or i in away else point for i, point in enumerate(own)]
            times.append(swarm.now)
            rows.append((positions, swarm.points.copy(), held))
        each(swarm)
        swarm.step()
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    return Trace(np.array(times), *columns)


class SteppedFormation(VirtualFormation):
    """Algorithm 2 as printed: the virtual formation stands until all are there, then jumps by |dT| along its way."""

    def __init__(self, of: VirtualFormation, begun_s: float, step_m: float) -> None:
        self.__dict__.update(copy.copy(of).__dict__)
        times = np.linspace(begun_s, of.end_s, math.ceil((of.end_s - begun_s) / 0.1) + 1)
        centre = np.array([of.at(time).points.mean(axis=0) for time in times])
        along = np.concatenate(((0.0,), np.cumsum(np.linalg.norm(np.diff(centre, axis=0), axis=1))))
        self.steps = math.ceil(along[-1] / step_m - 1e-6)
        self._stops = np.interp(np.minimum(step_m * np.arange(self.steps + 1), along[-1]), along, times)
        self.taken = 0

    def jump(self) -> None:
        """One step (eq 9), while there are any."""
        self.taken = min(self.taken + 1, self.steps)

    def at(self, now: float) -> VirtualState:
        """Where the formation stands, at any time."""
        state = super().at(float(self._stops[self.taken]))
        return state._replace(velocities=np.zeros_like(state.velocities), phase=Phase.FORMING)


def by_steps(swarm: Swarm, step_m: float) -> SteppedFormation:
    """Gives all vehicles of a swarm one virtual formation that moves in steps."""
    mission = swarm.mission
    stepped = SteppedFormation(swarm.minds[0].virtual, mission.schedule.start_s + mission.schedule.forming_s, step_m)
    for mind in swarm.minds:
        mind.virtual = stepped
    return stepped
