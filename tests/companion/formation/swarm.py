"""A swarm of points: vehicles that go straight to their target, each with its own Formation and nothing else shared.

Each sees those within range as unnamed noisy positions, and decides in its own time. What this leaves out on purpose
is motion (rule 7 and hulls): it is about decisions.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from companion.formation import Formation, Tuning
from companion.mission import FormationConfig, LimitsConfig, Mission, PathConfig, ScheduleConfig
from companion.scene import Attitude, Decision, Neighbour, OwnPose, Scene

Array = NDArray[np.float64]
SPEED = 0.5  # m/s
TICK_S = 0.5  # between two decisions of a vehicle


def mission(count: int, form: str = "price", exponent: float = 1.2, shape: str = "triangle", **path: Any) -> Mission:
    """A mission that forms at once and, with waypoints, travels after 100 s."""
    return Mission(
        name="swarm",
        seed=7,
        vehicles=count,
        formation=FormationConfig(shape=shape, form=form, exponent=exponent, spacing_m=5.0),
        path=PathConfig(**path),
        schedule=ScheduleConfig(start_s=0.0, forming_s=100.0),
        limits=LimitsConfig(top_speed_mps=SPEED, steerage_speed_mps=0.2, safe_distance_m=1.15),
    )


def starts(seed: int, count: int, apart: float = 2.0) -> Array:
    """Random places (J, 3) m in a box as wide as the group needs, `apart` m or more from each other."""
    random = np.random.default_rng((seed, count))
    width = {3: 15.0, 6: 20.0, 15: 30.0, 50: 50.0}[count]
    places: list[Array] = []
    while len(places) < count:
        place = np.array([*random.uniform(-width / 2, width / 2, 2), 2.0])
        if all(float(np.linalg.norm(place - other)) >= apart for other in places):
            places.append(place)
    return np.array(places)


@dataclass
class Swarm:
    """Vehicles of a mission: positions (J, 3) m, decisions and lengths (J,) m so far, at `now` s."""

    mission: Mission
    positions: Array
    seed: int = 0
    sensing_range: float = float("inf")
    sigma: float = 0.0
    missed: float = 0.0  # share of detections that drop out
    hover: bool = True  # else a vehicle circles the point that it waits on, as a hull with fins must
    current: tuple[float, float, float] = (0.0, 0.0, 0.0)  # the vehicles make up for it, a dead one drifts
    now: float = 0.0
    dead: set[int] = field(default_factory=set)

    def __post_init__(self) -> None:
        count = len(self.positions)
        tuning = Tuning.derive(self.mission, 0.0) if self.hover else Tuning.derive(self.mission)
        self.minds = [Formation(self.mission, vehicle, tuning) for vehicle in range(count)]
        self.decisions: list[Decision | None] = [None] * count
        self.lengths = np.zeros(count)
        self.yaw = np.random.default_rng((self.seed, 1)).uniform(-np.pi, np.pi, count)
        self._random = np.random.default_rng((self.seed, 2))
        self._ticks = 0

    def scene(self, vehicle: int) -> Scene:
        """What one vehicle sees now."""
        own = self.positions[vehicle]
        pose = OwnPose(own, np.zeros(3), Attitude(0.0, 0.0, 0.0), self.sigma, self.now, np.array(self.current))
        relative = np.delete(self.positions, vehicle, axis=0) - own
        relative = relative + self.sigma * self._random.standard_normal(relative.shape)
        near = np.linalg.norm(relative, axis=1) <= self.sensing_range
        near &= self._random.random(len(relative)) >= self.missed
        seen = self._random.permutation(relative[near])
        others = tuple(Neighbour(own + offset, np.zeros(3), self.sigma, 0.0, 0.0) for offset in seen)
        return Scene(self.now, pose, others, (), self.sensing_range)

    def step(self) -> None:
        """One decision of each vehicle, in turn within the tick, and the way that follows."""
        count = len(self.positions)
        parts = 5
        for part in range(parts):
            self.now = (self._ticks + part / parts) * TICK_S
            for vehicle in range(part, count, parts):
                if vehicle not in self.dead:
                    self.decisions[vehicle] = self.minds[vehicle].step(self.now, self.scene(vehicle))
            self._move(TICK_S / parts)
        self._ticks += 1
        self.now = self._ticks * TICK_S

    def run(self, limit_s: float, until: Callable[[], bool] | None = None) -> bool:
        """Steps until the condition (all points filled) holds; False when it does not within `limit_s`."""
        end = self.now + limit_s
        while self.now < end:
            self.step()
            if (until or self.filled)():
                return True
        return False

    def filled(self, within: float = 0.1) -> bool:
        """Whether every point has a vehicle of its own that means to be there."""
        points = self.minds[0].virtual.at(self.now).points
        within = within if self.hover else 2.5
        held = {
            decision.point
            for vehicle, decision in enumerate(self.decisions)
            if decision is not None
            and decision.point is not None
            and vehicle not in self.dead
            and float(np.linalg.norm(points[decision.point] - self.positions[vehicle])) <= within
        }
        return len(held) == len(points)

    def _move(self, elapsed: float) -> None:
        for vehicle, decision in enumerate(self.decisions):
            if vehicle in self.dead:
                self.positions[vehicle] += elapsed * np.array(self.current)
            elif decision is not None and decision.target is not None:
                if self.hover:
                    way = decision.target - self.positions[vehicle] + elapsed * decision.target_velocity
                    length = float(np.linalg.norm(way))
                    move = way * min(1.0, SPEED * elapsed / max(length, 1e-9))
                else:
                    move = self._swim(vehicle, decision, elapsed)
                move = self._keep_clear(vehicle, move / elapsed) * elapsed
                self.positions[vehicle] += move
                self.lengths[vehicle] += float(np.linalg.norm(move))

    # Barrier half-planes: the distance to each hull shrinks no faster than it may while the other does likewise.
    def _keep_clear(self, vehicle: int, velocity: Array) -> Array:
        safe = self.mission.limits.safe_distance_m + 3.0 * self.sigma
        away = np.delete(self.positions, vehicle, axis=0) - self.positions[vehicle]
        distance = np.linalg.norm(away, axis=1)
        for index in np.flatnonzero(distance < safe + 2.0 * SPEED):
            normal = away[index] / max(distance[index], 1e-9)
            excess = float(velocity @ normal) - 0.5 * (distance[index] - safe)
            if excess > 0.0:
                aside = np.array([-normal[1], normal[0], 0.0])  # to starboard of whoever is ahead
                velocity = velocity - excess * normal + min(excess, 0.5 * SPEED) * aside
        speed = float(np.linalg.norm(velocity))
        return velocity * min(1.0, SPEED / max(speed, 1e-9))

    # A hull that turns with a radius of 1.4 m, at steerage speed near its point, and never stops.
    def _swim(self, vehicle: int, decision: Decision, elapsed: float) -> Array:
        assert decision.target is not None
        way = decision.target - self.positions[vehicle]
        distance = float(np.hypot(way[0], way[1]))
        pace = float(np.linalg.norm(decision.target_velocity))
        speed = float(np.clip(pace + 0.25 * (distance - 1.5), 0.2, SPEED))
        bearing = np.arctan2(way[1], way[0])
        course = bearing if distance > 3.0 or pace > 0.05 else bearing + np.arctan2(1.5, max(distance - 1.5, 0.01))
        turn = (course - self.yaw[vehicle] + np.pi) % (2 * np.pi) - np.pi
        self.yaw[vehicle] += float(np.clip(turn, -speed / 1.4 * elapsed, speed / 1.4 * elapsed))
        return elapsed * np.array([speed * np.cos(self.yaw[vehicle]), speed * np.sin(self.yaw[vehicle]), 0.0])
