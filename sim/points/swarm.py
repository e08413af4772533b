"""A swarm of points: each vehicle has a Formation of its own, sees those within range, and shares mission and clock.

Decisions are asynchronous: every vehicle decides in its own time, twice a second. Motion is that of the paper: any
velocity up to the top speed, at once.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from companion.formation import Formation, Tuning
from companion.mission import Mission
from companion.scene import Attitude, Decision, Neighbour, OwnPose, Scene
from sim.points.motion import Motion, Mover
from sim.points.starts import SPEED

Array = NDArray[np.float64]

TICK_S = 0.5  # between two decisions of a vehicle
STEP_S = 0.1  # of motion
REACHED_M = 0.1  # from the point where the vehicle believes it to be
_STEPS = round(TICK_S / STEP_S)
_LEVEL = Attitude(0.0, 0.0, 0.0)
_STILL = np.zeros(3)


@dataclass(frozen=True, slots=True)
class Conditions:
    """What vehicles see, and how badly.

    `sigma` m is the noise an axis of relative positions, `missed` the share of detections that drop out, `bias` m the
    sigma an axis (north, east) of an error of the own position that each vehicle has all the time.
    """

    sensing_range: float = math.inf
    sigma: float = 0.0
    missed: float = 0.0
    bias: float = 0.0
    current: tuple[float, float, float] = (0.0, 0.0, 0.0)  # vehicles make up for it; a dead one drifts


class Swarm:
    """Vehicles of a mission: true positions (J, 3) m, decisions, and lengths (J,) m so far, at `now` s.

    `absent` are vehicles not yet in the water, `dead` those that stopped for good; both are sets of numbers to change
    at will. `velocities` (J, 3) m/s are those of the last step, `separation` m is the least true distance between two
    centres so far. `mover` makes, of top speed, safe distance and random numbers, how a vehicle moves.
    """

    def __init__(
        self,
        mission: Mission,
        starts: Array,
        seed: int,
        conditions: Conditions | None = None,
        mover: Callable[[float, float, np.random.Generator], Mover] = Motion,
    ) -> None:
        self.mission, self.conditions = mission, conditions or Conditions()
        self.positions: Array = np.array(starts, dtype=float)
        self.count = len(self.positions)
        self.now = 0.0
        self.decisions: list[Decision | None] = [None] * self.count
        self.lengths: Array = np.zeros(self.count)
        self.velocities: Array = np.zeros((self.count, 3))
        self.dead: set[int] = set()
        self.absent: set[int] = set()
        self.separation = math.inf
        self._random = np.random.default_rng((seed, 2))
        self._bias = np.zeros((self.count, 3))
        self._bias[:, :2] = self.conditions.bias * self._random.standard_normal((self.count, 2))
        tuning = Tuning.derive(mission)
        self.minds = [Formation(mission, vehicle, tuning) for vehicle in range(self.count)]
        safe = mission.limits.safe_distance_m
        self._motions = [mover(SPEED, safe, np.random.default_rng((seed, 3, i))) for i in range(self.count)]
        self._phase = self._random.permutation(self.count) % _STEPS
        self._steps = 0

    @property
    def points(self) -> Array:
        """The points of the formation (L, 3) m, now."""
        return self.minds[0].virtual.at(self.now).points

    def step(self) -> None:
        """The decisions that are due, and a step of motion of everybody."""
        offset = self.positions[None] - self.positions[:, None]
        distance = np.sqrt((offset * offset).sum(axis=2))
        self._note_separation(distance)
        near = distance <= self.conditions.sensing_range
        np.fill_diagonal(near, val=False)
        near[:, list(self.absent)] = False
        for vehicle in np.flatnonzero(self._phase == self._steps % _STEPS):
            if vehicle not in self.dead and vehicle not in self.absent:
                self.decisions[vehicle] = self._decide(vehicle, self._scene(vehicle, offset, near))
        self._move(offset, distance, near)
        self._steps += 1
        self.now = self._steps * STEP_S

    def run(self, limit_s: float, until: Callable[[], bool] | None = None) -> bool:
        """Steps until the condition (all points filled) holds; False when it does not within `limit_s`."""
        end, met = self.now + limit_s, until or self.filled
        while self.now < end - 1e-9:
            self.step()
            if met():
                return True
        return False

    def rest(self) -> Array:
        """What each vehicle still has to go to its point, as far as it knows (J,) m, NaN without a point."""
        away = np.full(self.count, np.nan)
        points = self.points
        for vehicle, decision in enumerate(self.decisions):
            if decision is not None and decision.point is not None and vehicle not in self.dead:
                away[vehicle] = math.dist(points[decision.point], self.positions[vehicle] + self._bias[vehicle])
        return away

    def filled(self, within: float = REACHED_M) -> bool:
        """Whether every point has a vehicle of its own that is there, as far as it knows."""
        away = self.rest()
        held = {
            decision.point
            for vehicle, decision in enumerate(self.decisions)
            if decision is not None and decision.point is not None and away[vehicle] <= within
        }
        return len(held) == len(self.points)

    def _decide(self, vehicle: int, scene: Scene) -> Decision:
        return self.minds[vehicle].step(self.now, scene)

    # What one vehicle sees now.
    def _scene(self, vehicle: int, offset: Array, near: NDArray[np.bool_]) -> Scene:
        conditions = self.conditions
        seen = np.flatnonzero(near[vehicle])
        if conditions.missed:
            seen = seen[self._random.random(len(seen)) >= conditions.missed]
        own = self.positions[vehicle] + self._bias[vehicle]
        others = own + offset[vehicle, self._random.permutation(seen)]
        if conditions.sigma:
            others = others + conditions.sigma * self._random.standard_normal(others.shape)
        pose = OwnPose(own, _STILL, _LEVEL, 0.0, self.now, np.array(conditions.current))
        neighbours = tuple(Neighbour(other, _STILL, conditions.sigma, 0.0, 0.0) for other in others)
        return Scene(self.now, pose, neighbours, (), conditions.sensing_range)

    def _move(self, offset: Array, distance: Array, near: NDArray[np.bool_]) -> None:
        conditions = self.conditions
        velocities = np.zeros((self.count, 3))
        close = near & (distance < self.mission.limits.safe_distance_m + 3.0 * conditions.sigma + 2.5 * SPEED)
        for vehicle, decision in enumerate(self.decisions):
            if vehicle in self.dead:
                velocities[vehicle] = conditions.current
                continue
            if vehicle in self.absent or decision is None:
                continue
            hulls = offset[vehicle, close[vehicle]]
            if conditions.sigma and len(hulls):
                hulls = hulls + conditions.sigma * self._random.standard_normal(hulls.shape)
            way, drift = np.zeros(3), decision.target_velocity
            if decision.target is not None:
                since = self.now - self._decided(vehicle)
                way = decision.target + since * drift - self.positions[vehicle] - self._bias[vehicle]
            else:
                drift = _STILL
            velocity = self._motions[vehicle].velocity(self.now, way, drift, hulls, conditions.sigma)
            velocities[vehicle] = velocity
            self.lengths[vehicle] += STEP_S * math.sqrt(velocity @ velocity)
        self.velocities = velocities
        self.positions += STEP_S * velocities

    # When a vehicle took its last decision, s.
    def _decided(self, vehicle: int) -> float:
        late = (self._steps - int(self._phase[vehicle])) % _STEPS
        return self.now - late * STEP_S

    def _note_separation(self, distance: Array) -> None:
        there = [vehicle for vehicle in range(self.count) if vehicle not in self.absent]
        among = distance[np.ix_(there, there)] if self.absent else distance
        if len(among) > 1:
            self.separation = min(self.separation, float(among[~np.eye(len(among), dtype=bool)].min()))
