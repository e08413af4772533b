"""Keeping clear: the heading and speed nearest to the preferred ones whose whole arc respects the barrier.

The barrier is the rule n v >= -(d - d_safe) / T between two centres, with full responsibility: others are taken to
keep their velocity, since from outside nobody can tell a hull that gives way from one that does not. A hull with a
rudder cannot choose its velocity at once, so the rule is not asked of a velocity but of the arc that follows a
setpoint: the distance at each time t ahead must be at least d_safe + (d - d_safe) exp(-t / T).
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from companion.guidance.config import BarrierConfig, HullConfig
from companion.scene import OwnPose, Vector

Array = NDArray[np.float64]

TIMES = 10  # moments ahead at which distances are taken
TURNS = 24  # headings tried, evenly round the compass from the preferred one


@dataclass(frozen=True, slots=True)
class Hazard:
    """Something to keep clear of: position (3,) m, velocity (3,) m/s over ground, least distance between centres m.

    It is taken to keep its speed and, for `turn_memory_s`, its turn rate, rad/s.
    """

    position: Vector
    velocity: Vector
    safe: float
    turn_rate: float = 0.0


@dataclass(frozen=True, slots=True)
class Choice:
    """Heading and speed through water, by how much the barrier still falls short, m, and the hazard that binds."""

    heading: float
    speed: float
    shortfall: float = 0.0
    binding: Hazard | None = None


class Barrier:
    """Chooses among arcs; remembers only to which side it last gave way."""

    def __init__(self, config: BarrierConfig, hull: HullConfig, steerage: float, top: float) -> None:
        self._config, self._hull = config, hull
        self._steerage, self._top = steerage, top
        self._times = config.horizon_s * (np.arange(1, TIMES + 1) / TIMES) ** 1.5
        self._decay = np.exp(-self._times / config.time_constant_s)
        self._lag = hull.speed_lag_s * (1.0 - np.exp(-self._times / hull.speed_lag_s))
        turns = np.arange(TURNS) * (math.tau / TURNS)
        self._turns = np.where(turns > math.pi, turns - math.tau, turns)
        self._turn_cost = (1.0 - np.cos(self._turns)) * np.where(self._turns < 0.0, 1.0 + config.left_penalty, 1.0)
        self._given_way = 0.0

    def choose(self, own: OwnPose, heading: float, speed: float, hazards: Iterable[Hazard]) -> Choice:
        """The allowed heading and speed nearest to the preferred ones; the least evil if none is allowed."""
        reach = (self._top + math.hypot(own.current[0], own.current[1])) * self._config.horizon_s
        near = [hazard for hazard in hazards if self._may_meet(own, hazard, reach)]
        if not near:
            self._given_way = 0.0
            return Choice(heading, speed)
        relative = np.array([hazard.position for hazard in near]) - own.position
        velocity = np.array([hazard.velocity for hazard in near])[:, :2]
        safe = np.array([hazard.safe for hazard in near])
        distance = np.sqrt((relative * relative).sum(axis=1))
        needed = safe[:, None] + (distance - safe)[:, None] * self._decay
        gap_n, gap_e = self._gaps(own, relative, velocity, np.array([hazard.turn_rate for hazard in near]))

        def shortfall(headings: Array, speeds: Array) -> Array:
            north, east = self._arcs(own, headings, speeds)
            squared = (gap_n - north[:, None, :]) ** 2 + (gap_e - east[:, None, :]) ** 2 + relative[:, 2, None] ** 2
            short: Array = (needed - np.sqrt(squared)).max(axis=2)
            return short

        short = shortfall(np.array((heading,)), np.array((speed,)))[0]
        if short.max() <= 0.0:
            self._given_way *= 0.9
            return Choice(heading, speed)
        speeds = np.unique(np.array((self._steerage, speed, self._top)))
        all_turns = np.repeat(self._turns, len(speeds))
        all_speeds = np.tile(speeds, TURNS)
        short = shortfall(heading + all_turns, all_speeds)
        worst = np.maximum(short.max(axis=1), 0.0)
        cost = (
            20.0 * worst
            + np.repeat(self._turn_cost, len(speeds))
            + 0.5 * np.abs(all_speeds - speed) / self._top
            + self._config.swing_penalty * (1.0 - np.cos(all_turns - self._given_way))
        )
        best = int(cost.argmin())
        self._given_way = float(all_turns[best])
        return Choice(
            heading + self._given_way, float(all_speeds[best]), float(worst[best]), near[int(short[best].argmax())]
        )

    def _may_meet(self, own: OwnPose, hazard: Hazard, reach: float) -> bool:
        dn, de, dd = (hazard.position - own.position).tolist()
        vn, ve, _ = hazard.velocity.tolist()
        room: float = hazard.safe + reach + math.hypot(vn, ve) * self._config.horizon_s
        return bool(abs(dd) < hazard.safe and dn * dn + de * de < room * room)

    def _gaps(self, own: OwnPose, relative: Array, velocity: Array, rate: Array) -> tuple[Array, Array]:
        """Where the hazards will be (N, TIMES), north and east from here, m, as the water under us sees them."""
        rate = np.where(np.abs(rate) < 1e-3, 1e-3, rate)[:, None]
        turning = np.minimum(self._times, self._config.turn_memory_s)
        angle = rate * turning
        sine, cosine = np.sin(angle), np.cos(angle)
        rest = self._times - turning
        forward, right = sine / rate + rest * cosine, (1.0 - cosine) / rate + rest * sine
        vn, ve = velocity[:, 0, None], velocity[:, 1, None]
        gap_n = relative[:, 0, None] + forward * vn - right * ve - own.current[0] * self._times
        gap_e = relative[:, 1, None] + forward * ve + right * vn - own.current[1] * self._times
        return gap_n, gap_e

    def _arcs(self, own: OwnPose, headings: Array, speeds: Array) -> tuple[Array, Array]:
        """Ways through water (C, TIMES) north and east, m: turn at the turning radius, then straight on.

        Speed follows its setpoint with the hull's lag; a turn begins half a heading lag late.
        """
        through = own.velocity - own.current
        now = math.hypot(through[0], through[1])
        length = speeds[:, None] * self._times + (now - speeds)[:, None] * self._lag
        radius = self._hull.turning_radius_m
        yaw = own.attitude.yaw
        turn = np.remainder(headings - yaw + math.pi, math.tau) - math.pi
        late = 0.5 * self._hull.heading_lag_s * now
        side = np.where(turn < 0.0, -1.0, 1.0)[:, None]
        angle = np.minimum(np.maximum(length - late, 0.0) / radius, np.abs(turn)[:, None])
        straight = length - radius * angle
        before = np.minimum(straight, late)
        after = straight - before
        forward = radius * np.sin(angle) + before + after * np.cos(turn)[:, None]
        right = side * radius * (1.0 - np.cos(angle)) + after * np.sin(turn)[:, None]
        cosine, sine = math.cos(yaw), math.sin(yaw)
        return forward * cosine - right * sine, forward * sine + right * cosine
