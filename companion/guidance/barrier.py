"""Keeping clear: the heading and speed nearest to the preferred ones whose whole arc respects the barrier.

The barrier is the rule n v >= -(d - d_safe) / T between two centres. A hull with a rudder cannot choose its velocity at
once, so the rule is not asked of a velocity but of the arc that follows a setpoint: the distance at each time t ahead
must be at least d_safe + (d - d_safe) exp(-t / T). Responsibility is full toward what does not react. Toward a hull
that does, it is a share of what the preferred course falls short by, for the other hull does the same; what is left to
it is no more than the margin kept beyond the mission's safe distance, and is short again at the next tick.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from companion.guidance.config import BarrierConfig, HullConfig
from companion.guidance.others import Hazard
from companion.guidance.steering import Course
from companion.scene import OwnPose

Array = NDArray[np.float64]

TIMES = 10  # moments ahead at which distances are taken
TURNS = 24  # headings tried, evenly round the compass from the preferred one
TURNING_ON = 0.6  # a preferred heading further off than this, rad, is a turn of its own, no circle


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
        self._given_way = 0.0

    def choose(self, own: OwnPose, preferred: Course, hazards: Iterable[Hazard]) -> Choice:
        """The allowed heading and speed nearest to the preferred course; the least evil if none is allowed."""
        reach = (self._top + math.hypot(own.current[0], own.current[1])) * self._config.horizon_s
        near = [hazard for hazard in hazards if self._may_meet(own, hazard, reach)]
        if not near:
            self._given_way = 0.0
            return Choice(preferred.heading, preferred.speed)
        sea = self._look_ahead(own, near, self._config.stand_on_m if preferred.in_step else 0.0)
        short = sea.shortfall(*self._arcs(own, *_single(preferred)))[0]
        if short.max() <= 0.0:
            self._given_way *= 0.9
            return Choice(preferred.heading, preferred.speed)
        speeds = np.array(sorted({self._steerage, preferred.speed, self._top}))
        turns = np.concatenate((np.repeat(self._turns, len(speeds)), np.zeros(len(speeds))))
        all_speeds = np.tile(speeds, TURNS + 1)
        rates = np.zeros(len(turns))
        rates[-len(speeds) :] = preferred.turn_rate
        shared = np.array([hazard.reacts for hazard in near])
        theirs = np.where(shared, np.clip((1.0 - self._config.responsibility) * short, 0.0, self._config.margin_m), 0.0)
        short = sea.shortfall(*self._arcs(own, preferred.heading + turns, all_speeds, rates)) - theirs
        worst = np.maximum(short.max(axis=1), 0.0)
        speed_cost = self._config.patient_speed_cost if preferred.patient else self._config.speed_cost
        cost = (
            20.0 * worst
            + 1.0
            - np.cos(turns)
            + self._config.left_penalty * (turns < 0.0)
            + speed_cost * np.abs(all_speeds - preferred.speed) / self._top
            + self._config.swing_penalty * (1.0 - np.cos(turns - self._given_way))
        )
        best = int(cost.argmin())
        self._given_way = float(turns[best])
        return Choice(
            preferred.heading + self._given_way,
            float(all_speeds[best]),
            float(worst[best]),
            near[int(short[best].argmax())],
        )

    def _look_ahead(self, own: OwnPose, near: list[Hazard], relief: float) -> _Sea:
        """Where the hazards will be, as the water under us sees them, and the distance they need, less `relief` m."""
        relative = np.array([hazard.position for hazard in near]) - own.position
        velocity = np.array([hazard.velocity for hazard in near])[:, :2]
        rate = np.array([hazard.turn_rate for hazard in near])
        safe = np.array([hazard.safe - relief for hazard in near])
        rate = np.where(np.abs(rate) < 1e-3, 1e-3, rate)[:, None]
        memory = np.array([math.inf if hazard.circles else self._config.turn_memory_s for hazard in near])
        turning = np.minimum(self._times, memory[:, None])
        angle = rate * turning
        sine, cosine = np.sin(angle), np.cos(angle)
        rest = self._times - turning
        forward, right = sine / rate + rest * cosine, (1.0 - cosine) / rate + rest * sine
        vn, ve = velocity[:, 0, None], velocity[:, 1, None]
        north = relative[:, 0, None] + forward * vn - right * ve - own.current[0] * self._times
        east = relative[:, 1, None] + forward * ve + right * vn - own.current[1] * self._times
        distance = np.sqrt((relative * relative).sum(axis=1))
        steady = np.array([0.0 if hazard.circles else self._config.doubt for hazard in near])[:, None]
        doubt = steady * np.sqrt((velocity * velocity).sum(axis=1))[:, None] * self._times
        needed = safe[:, None] + (distance - safe)[:, None] * self._decay + np.minimum(doubt, self._config.doubt_max_m)
        return _Sea(north, east, relative[:, 2, None] ** 2, needed)

    def _may_meet(self, own: OwnPose, hazard: Hazard, reach: float) -> bool:
        dn, de, dd = (hazard.position - own.position).tolist()
        vn, ve, _ = hazard.velocity.tolist()
        room: float = hazard.safe + reach + math.hypot(vn, ve) * self._config.horizon_s
        return bool(abs(dd) < hazard.safe and dn * dn + de * de < room * room)

    def _arcs(self, own: OwnPose, headings: Array, speeds: Array, rates: Array) -> tuple[Array, Array]:
        """Ways through water (C, TIMES) north and east, m: turn at the turning radius, then straight on.

        Speed follows its setpoint with the hull's lag; a turn begins half a heading lag late. Where a rate is given,
        the hull turns on from its present heading at that rate instead.
        """
        through = own.velocity - own.current
        now = math.hypot(through[0], through[1])
        length = speeds[:, None] * self._times + (now - speeds)[:, None] * self._lag
        yaw = own.attitude.yaw
        turn = np.remainder(headings - yaw + math.pi, math.tau) - math.pi
        circling = (np.abs(rates) > 1e-3) & (np.abs(turn) < TURNING_ON)
        late = np.where(circling, 0.0, 0.5 * self._hull.heading_lag_s * now)[:, None]
        with np.errstate(divide="ignore"):
            radius = np.where(circling, speeds / np.abs(rates), self._hull.turning_radius_m)[:, None]
        side = np.where(np.where(circling, rates, turn) < 0.0, -1.0, 1.0)[:, None]
        end = np.where(circling, math.inf, np.abs(turn))[:, None]
        angle = np.minimum(np.maximum(length - late, 0.0) / radius, end)
        straight = length - radius * angle
        before = np.minimum(straight, late)
        after = straight - before
        forward = radius * np.sin(angle) + before + after * np.cos(turn)[:, None]
        right = side * radius * (1.0 - np.cos(angle)) + after * np.sin(turn)[:, None]
        cosine, sine = math.cos(yaw), math.sin(yaw)
        return forward * cosine - right * sine, forward * sine + right * cosine


@dataclass(frozen=True, slots=True)
class _Sea:
    """Ways of the hazards (N, TIMES) north and east, squared depth difference (N, 1), distances needed (N, TIMES)."""

    north: Array
    east: Array
    depth_squared: Array
    needed: Array

    def shortfall(self, north: Array, east: Array) -> Array:
        """By how much each of the ways (C, TIMES) falls short of each hazard's distance, m, (C, N)."""
        squared = (self.north - north[:, None]) ** 2 + (self.east - east[:, None]) ** 2 + self.depth_squared
        short: Array = (self.needed - np.sqrt(squared)).max(axis=2)
        return short


def _single(course: Course) -> tuple[Array, Array, Array]:
    return np.array((course.heading,)), np.array((course.speed,)), np.array((course.turn_rate,))
