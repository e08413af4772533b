"""Guidance: from scene and decision to heading, depth and speed, clear of everything, or a hold with its reason."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from companion.guidance import steering
from companion.guidance.barrier import Barrier, Choice
from companion.guidance.config import GuidanceConfig
from companion.guidance.others import WORLD_M, hazards, sane
from companion.mission import LimitsConfig
from companion.scene import Decision, OwnPose, Scene, Setpoint


class Mode(Enum):
    """What guidance is doing."""

    HOLD = "hold"  # no thrust
    CIRCLE = "circle"  # coming to a standing point, or circling it
    FOLLOW = "follow"  # travelling with a moving point
    ESCAPE = "escape"  # a random heading, since no progress was made


@dataclass(frozen=True, slots=True)
class GuidanceStatus:
    """Why the last setpoint is what it is; `shortfall` is how much of the safe distance could not be kept, m."""

    mode: Mode
    reason: str = ""
    giving_way: bool = False
    shortfall: float = 0.0


class Guidance:
    """Steers one vehicle. `status` explains the last setpoint.

    A pure function of seed and inputs: same seed, same scenes and decisions, same setpoints.
    """

    def __init__(
        self, limits: LimitsConfig, config: GuidanceConfig | None = None, seed: int = 0, vehicle: int = 0
    ) -> None:
        self.status = GuidanceStatus(Mode.HOLD, "not started")
        self._limits = limits
        self._config = config or GuidanceConfig()
        self._random = np.random.default_rng((seed, vehicle, 0x6D))
        self._barrier = Barrier(
            self._config.barrier, self._config.hull, limits.steerage_speed_mps, limits.top_speed_mps
        )
        self._last = Setpoint(0.0, 0.0, 0.0)
        self._acceleration = _Acceleration(self._config.track.acceleration_lag_s)
        self._progress = _Progress(-math.inf, math.inf)
        self._escape_until = -math.inf
        self._escape_heading = 0.0

    def step(self, now: float, scene: Scene, decision: Decision) -> Setpoint:
        """One tick at `now`, s: heading rad within -pi..pi, depth m, speed through water m/s.

        Depth is within the mission's limits. Speed is between steerage and top speed, or exactly 0 for a hold;
        `status.reason` names why it holds. Neighbours and obstacles that are out of this world are left out.
        """
        reason = self._reason_to_hold(now, scene, decision)
        if reason or scene.own is None or decision.target is None:
            return self._hold(scene, reason)
        preferred, mode = self._prefer(now, scene.own, decision)
        preferred = self._hurry(scene.own, decision, preferred)
        if now < self._escape_until:
            mode, preferred = Mode.ESCAPE, steering.Course(self._escape_heading, self._limits.top_speed_mps)
        choice = self._barrier.choose(scene.own, preferred, hazards(scene, decision, self._limits, self._config))
        self._watch_progress(now, scene.own, decision, choice)
        self.status = GuidanceStatus(mode, decision.reason, choice.binding is not None, choice.shortfall)
        sinking = self._config.track.depth_lead_s * float(decision.target_velocity[2])
        depth = float(decision.target[2]) + sinking + self._vertical(scene.own, choice)
        self._last = Setpoint(
            steering.wrap(choice.heading),
            min(max(depth, self._limits.depth_min_m), self._limits.depth_max_m),
            min(max(choice.speed, self._limits.steerage_speed_mps), self._limits.top_speed_mps),
        )
        return self._last

    def _reason_to_hold(self, now: float, scene: Scene, decision: Decision) -> str:
        own, target = scene.own, decision.target
        if not math.isfinite(now) or not abs(now - scene.stamp) <= self._config.scene_limit_s:
            return "scene is stale"
        if own is None:
            return "own pose is unknown"
        angles = np.array((own.attitude.roll, own.attitude.pitch, own.attitude.yaw))
        if not sane(own.position, own.velocity, own.current, angles):
            return "own pose is out of this world"
        if target is None:
            return decision.reason or "no point to go to"
        if not sane(target, decision.target_velocity):
            return "point is out of this world"
        return ""

    def _hold(self, scene: Scene, reason: str) -> Setpoint:
        """No thrust; heading and depth as they are, or as last commanded where they are unknown."""
        self._acceleration.restart()
        self._progress = _Progress(-math.inf, math.inf)
        heading = self._last.heading
        if scene.own is not None and math.isfinite(scene.own.attitude.yaw):
            heading = steering.wrap(scene.own.attitude.yaw)
        self.status = GuidanceStatus(Mode.HOLD, reason)
        self._last = Setpoint(heading, self._last.depth, 0.0)
        return self._last

    def _prefer(self, now: float, own: OwnPose, decision: Decision) -> tuple[steering.Course, Mode]:
        """Heading and speed for an empty sea."""
        assert decision.target is not None
        position, target = _pair(own.position), _pair(decision.target)
        velocity, current = _pair(decision.target_velocity), _pair(own.current)
        steerage, top = self._limits.steerage_speed_mps, self._limits.top_speed_mps
        acceleration = self._acceleration.step(now, decision.point, velocity)
        if math.hypot(*velocity) < self._config.wait.still_mps:
            wait, hull = self._config.wait, self._config.hull
            radius = max(self._limits.waiting_radius_m, hull.turning_radius_m)
            return steering.circle(now, position, target, current, steerage, top, radius, wait, hull), Mode.CIRCLE
        yaw, track = own.attitude.yaw, self._config.track
        course = steering.follow(position, yaw, target, velocity, acceleration, current, steerage, top, track)
        return course, Mode.FOLLOW

    def _hurry(self, own: OwnPose, decision: Decision, course: steering.Course) -> steering.Course:
        """On the way to the point, closes on it faster or slower than usual if the mission says so (s and f, eq 8)."""
        assert decision.target is not None
        near = self._config.wait.near_radii * max(self._limits.waiting_radius_m, self._config.hull.turning_radius_m)
        away = math.hypot(*(own.position - decision.target)[:2].tolist())
        own_pace = math.hypot(*decision.target_velocity[:2].tolist())
        if not 0.0 < decision.pace_factor < WORLD_M or away < near or course.speed <= own_pace:
            return course
        speed = own_pace + decision.pace_factor * (course.speed - own_pace)
        speed = min(max(speed, self._limits.steerage_speed_mps), self._limits.top_speed_mps)
        return replace(course, speed=speed)

    def _watch_progress(self, now: float, own: OwnPose, decision: Decision, choice: Choice) -> None:
        """Starts an escape once giving way has kept the vehicle from coming nearer to its point for too long."""
        assert decision.target is not None
        escape = self._config.escape
        distance = math.hypot(*(own.position - decision.target)[:2].tolist())
        if choice.binding is None or distance < self._progress.distance - escape.progress_m:
            self._progress = _Progress(now, distance)
        elif now - self._progress.since > escape.patience_s:
            self._escape_heading = float(self._random.uniform(-math.pi, math.pi))
            self._escape_until = now + escape.duration_s
            self._progress = _Progress(now + escape.duration_s, distance)

    def _vertical(self, own: OwnPose, choice: Choice) -> float:
        """Depth offset, m, once headings alone no longer keep clear: away from the other hull, up or down.

        At equal depth, hulls on opposite headings choose opposite ways.
        """
        barrier = self._config.barrier
        if choice.binding is None or choice.shortfall < barrier.vertical_from_m:
            return 0.0
        above = float(choice.binding.position[2] - own.position[2])
        if abs(above) < 0.15:
            above = math.cos(own.attitude.yaw)
        return -math.copysign(barrier.vertical_offset_m, above)


@dataclass(slots=True)
class _Progress:
    since: float
    distance: float


class _Acceleration:
    """Estimate of the point's acceleration (north, east) m/s^2 from its velocity; starts anew with another point."""

    def __init__(self, lag: float) -> None:
        self._lag = lag
        self.restart()

    def restart(self) -> None:
        self._last: tuple[float, int | None, steering.Pair] | None = None
        self._value: steering.Pair = (0.0, 0.0)

    def step(self, now: float, point: int | None, velocity: steering.Pair) -> steering.Pair:
        if self._last is None or self._last[1] != point or not 0.0 < now - self._last[0] < 1.0:
            self._value = (0.0, 0.0)
        else:
            elapsed = now - self._last[0]
            gain = elapsed / (self._lag + elapsed)
            rate = [(velocity[i] - self._last[2][i]) / elapsed for i in (0, 1)]
            size = max(math.hypot(*rate) / 0.2, 1.0)  # a step in velocity is no turn
            self._value = (
                self._value[0] + gain * (rate[0] / size - self._value[0]),
                self._value[1] + gain * (rate[1] / size - self._value[1]),
            )
        self._last = (now, point, velocity)
        return self._value


def _pair(vector: np.ndarray[tuple[int], np.dtype[np.float64]]) -> steering.Pair:
    return float(vector[0]), float(vector[1])
