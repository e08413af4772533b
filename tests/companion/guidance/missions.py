"""What the tests and the campaign let vehicles do: form up from random starts, travel round a corner, swap places."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from companion.formation import VirtualFormation
from companion.mission import FormationConfig, Mission, PathConfig, ScheduleConfig
from companion.scene import Decision, Scene
from tests.companion.guidance.sea import Log, Sea, Water, scattered, standing

Array = NDArray[np.float64]

CORNER = Mission(
    name="corner",
    vehicles=6,
    formation=FormationConfig(shape="triangle", spacing_m=5.0),
    path=PathConfig(origin_m=(0.0, 0.0, 2.0), waypoints_m=((22.0, 0.0), (22.0, 20.0))),
    schedule=ScheduleConfig(start_s=0.0, forming_s=30.0),
)
STEADY_S = 80.0  # of the corner: every vehicle has had the time to find its point


@dataclass(frozen=True)
class Outcome:
    """A log, the points (T, N, 3) m where the vehicles should be, and horizontal distances (T, N) m from them."""

    log: Log
    points: Array
    error: Array


def _outcome(log: Log, points: Array) -> Outcome:
    off = log.position - points
    return Outcome(log, points, np.hypot(off[..., 0], off[..., 1]))


def form(seed: int, current: tuple[float, float], seconds: float = 60.0) -> Outcome:
    """Six vehicles from random starts to the points of a triangle, assigned for the least sum of d^1.2."""
    starts, headings = scattered(seed, 6)
    points = CORNER.points() + np.array((0.0, 0.0, 2.0))
    distance = np.linalg.norm(starts[:, None] - points[None], axis=2)
    own = points[linear_sum_assignment(distance**1.2)[1]]
    sea = Sea(starts, headings, seed, Water(current=current))
    log = sea.run(seconds, lambda now, i, scene: standing(own[i], i))
    return _outcome(log, np.broadcast_to(own, log.position.shape))


def travel(seed: int, current: tuple[float, float]) -> Outcome:
    """Six vehicles, near their points already, travel with the virtual formation round a corner."""
    virtual = VirtualFormation(CORNER)
    random = np.random.default_rng(seed)
    starts = virtual.at(0.0).points + np.append(random.uniform(-1.0, 1.0, (6, 2)), np.zeros((6, 1)), axis=1)
    sea = Sea(starts, random.uniform(-math.pi, math.pi, 6), seed, Water(current=current))

    def decide(now: float, i: int, scene: Scene) -> Decision:
        state = virtual.at(now)
        return Decision(state.phase, i, state.points, state.points[i], state.velocities[i], None)

    log = sea.run(virtual.end_s - 10.0, decide)
    return _outcome(log, np.array([virtual.at(float(now)).points for now in log.times]))


def swap(count: int, seed: int, radius: float = 8.0, seconds: float = 60.0) -> Outcome:
    """Vehicles on a circle, each bound for the opposite place."""
    angles = np.arange(count) * math.tau / count
    starts = np.stack((radius * np.cos(angles), radius * np.sin(angles), np.full(count, 2.0)), axis=1)
    goals = starts * np.array((-1.0, -1.0, 1.0))
    log = Sea(starts, angles + math.pi, seed).run(seconds, lambda now, i, scene: standing(goals[i], i))
    return _outcome(log, np.broadcast_to(goals, log.position.shape))
