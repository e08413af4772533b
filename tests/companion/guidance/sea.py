"""A small sea for guidance: kinematic hulls with rudder and speed lag, a noisy neighbour sensor, a log of tracks."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from companion.guidance import Guidance, GuidanceConfig, Mode
from companion.mission import LimitsConfig
from companion.perception import Motion, Perception
from companion.scene import Attitude, Decision, Phase, Scene, Sighting

Array = NDArray[np.float64]
TICK_S = 0.1
SUBSTEPS = 2


@dataclass(frozen=True)
class Water:
    """What the sea does to everyone."""

    current: tuple[float, float] = (0.0, 0.0)
    sigma: float = 0.07
    sensing_range: float = 20.0
    turning_radius: float = 1.3
    heading_lag: float = 1.0
    yaw_rate_lag: float = 0.4
    speed_lag: float = 1.8
    depth_lag: float = 3.0


@dataclass
class Log:
    """Tracks (T, N, 3) m, headings and speeds through water (T, N), modes and setpoints of each tick."""

    times: Array
    position: Array
    heading: Array
    speed: Array
    modes: list[list[Mode]]
    scenes: list[Scene]

    def separations(self, since: float = 0.0) -> Array:
        """Least distance between any two centres at each tick, m."""
        rows = self.times >= since
        gap = self.position[rows, :, None] - self.position[rows, None, :]
        distance = np.sqrt((gap**2).sum(axis=3))
        distance[:, np.arange(distance.shape[1]), np.arange(distance.shape[1])] = np.inf
        closest: Array = distance.min(axis=(1, 2))
        return closest


Decide = Callable[[float, int, Scene], Decision]


def standing(target: Array, point: int = 0) -> Decision:
    """A decision for a point that stands still."""
    return Decision(Phase.FORMING, point, target[None], target, np.zeros(3), None)


def moving(target: Array, velocity: Array, point: int = 0) -> Decision:
    """A decision for a point on its way."""
    return Decision(Phase.TRAVEL, point, target[None], target, velocity, None)


class Sea:
    """Hulls (N) with a companion each, except the first `drifting` ones, which nobody steers."""

    def __init__(
        self,
        starts: Array,
        headings: Array,
        seed: int = 0,
        water: Water | None = None,
        drifting: int = 0,
        config: GuidanceConfig | None = None,
    ) -> None:
        self.water = water or Water()
        self.random = np.random.default_rng(seed)
        self.position = np.array(starts, dtype=float)
        self.count = len(starts)
        self.drifting = drifting
        self.heading = np.array(headings, dtype=float)
        self.rate = np.zeros(self.count)
        self.speed = np.zeros(self.count)
        self.guidance = [Guidance(LimitsConfig(), config, seed, i) for i in range(self.count)]
        self.perception = [Perception() for _ in range(self.count)]
        self.log_error = self.random.uniform(0.95, 1.05, self.count)
        self.compass_error = np.radians(self.random.uniform(-2.0, 2.0, self.count))
        self.now = 0.0

    def run(self, until: float, decide: Decide) -> Log:
        """Runs to the time `until`, s; setpoints act one tick after the sighting that they are made of."""
        times, position, heading, speed, modes, scenes = [], [], [], [], [], []
        pending = np.stack((self.heading, self.position[:, 2], np.zeros(self.count)), axis=1)
        while self.now < until - 1e-9:
            commands = pending
            pending = np.stack((self.heading, self.position[:, 2], np.zeros(self.count)), axis=1)
            row: list[Mode] = []
            for i in range(self.drifting, self.count):
                scene = self.perception[i].step(self.now, self._sight(i), self._motion(i))
                setpoint = self.guidance[i].step(self.now, scene, decide(self.now, i, scene))
                pending[i] = setpoint.heading, setpoint.depth, setpoint.speed
                row.append(self.guidance[i].status.mode)
                if i == self.drifting:
                    scenes.append(scene)
            times.append(self.now)
            position.append(self.position.copy())
            heading.append(self.heading.copy())
            speed.append(self.speed.copy())
            modes.append(row)
            for _ in range(SUBSTEPS):
                self._swim(commands, TICK_S / SUBSTEPS)
            self.now = round(self.now + TICK_S, 6)
        return Log(np.array(times), np.array(position), np.array(heading), np.array(speed), modes, scenes)

    def _swim(self, commands: Array, step: float) -> None:
        water = self.water
        error = np.remainder(commands[:, 0] - self.heading + math.pi, math.tau) - math.pi
        limit = np.maximum(self.speed, 0.0) / water.turning_radius
        wanted = np.clip(error / water.heading_lag, -limit, limit)
        self.rate += (wanted - self.rate) * step / water.yaw_rate_lag
        self.heading += self.rate * step
        self.speed += (commands[:, 2] - self.speed) * step / water.speed_lag
        self.position[:, 0] += (self.speed * np.cos(self.heading) + water.current[0]) * step
        self.position[:, 1] += (self.speed * np.sin(self.heading) + water.current[1]) * step
        climb = np.clip((commands[:, 1] - self.position[:, 2]) / water.depth_lag, -0.3 * self.speed, 0.3 * self.speed)
        self.position[:, 2] += climb * step

    def _sight(self, i: int) -> Sighting:
        relative = np.delete(self.position, i, axis=0) - self.position[i]
        relative = relative[(relative**2).sum(axis=1) < self.water.sensing_range**2]
        self.random.shuffle(relative)
        sigma = self.water.sigma
        return Sighting(
            self.now,
            self.position[i] + self.random.normal(0.0, sigma, 3),
            sigma,
            relative + self.random.normal(0.0, sigma, relative.shape),
            self.water.sensing_range,
        )

    def _motion(self, i: int) -> Motion:
        attitude = Attitude(0.0, 0.0, float(self.heading[i] + self.compass_error[i] + self.random.normal(0.0, 0.01)))
        depth = float(self.position[i, 2] + self.random.normal(0.0, 0.01))
        return Motion(self.now, attitude, depth, float(self.speed[i] * self.log_error[i]))


def scattered(seed: int, count: int, box: float = 24.0, apart: float = 4.0, depth: float = 2.0) -> tuple[Array, Array]:
    """Random starts (count, 3) at least `apart` m from each other in a square box, and random headings (count,)."""
    random = np.random.default_rng((seed, 1))
    starts: list[Array] = []
    while len(starts) < count:
        candidate = np.array((*random.uniform(-box / 2.0, box / 2.0, 2), depth))
        if all(float(np.hypot(*(candidate - other)[:2])) >= apart for other in starts):
            starts.append(candidate)
    return np.array(starts), random.uniform(-math.pi, math.pi, count)
