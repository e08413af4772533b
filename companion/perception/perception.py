"""Perception: from the neighbour sensor and the firmware's telemetry to the scene that formation and guidance see."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from companion.perception.config import PerceptionConfig
from companion.perception.pose import PoseFilter
from companion.perception.tracks import Tracks, distinct
from companion.scene import Attitude, Scene, Sighting


@dataclass(frozen=True, slots=True)
class Motion:
    """The part of the firmware's telemetry that perception needs, and when it was true (`stamp`, s).

    `depth` m is down positive; `speed` m/s is through the water, along the hull.
    """

    stamp: float
    attitude: Attitude
    depth: float
    speed: float


@dataclass(slots=True)
class Counters:
    """What perception refused, by cause, since the start."""

    late_sightings: int = 0  # stamped before one already used
    early_sightings: int = 0  # stamped ahead of the clock
    bad_fixes: int = 0  # not finite
    outlier_fixes: int = 0  # too far from where the vehicle can be
    bad_detections: int = 0  # not finite, or beyond the sensor's range
    duplicate_detections: int = 0  # on top of another one, or of the vehicle itself
    bad_motion: int = 0  # attitude or speed not finite, or no hull's speed
    bad_depth: int = 0
    clock_jumps: int = 0  # backwards; everything starts anew


class Perception:
    """Keeps own pose and neighbour tracks up to date; `counters` tell what it refused.

    A pure function of its inputs and their order: same inputs, same scenes.
    """

    def __init__(self, config: PerceptionConfig | None = None) -> None:
        self.counters = Counters()
        self._config = config or PerceptionConfig()
        self._pose = PoseFilter(self._config.pose)
        self._tracks = Tracks(self._config.tracks)
        self._now = -math.inf
        self._sighting_time = -math.inf
        self._sensing_range = math.inf

    def step(self, now: float, sighting: Sighting | None, motion: Motion | None) -> Scene:
        """One tick: the newest sighting and telemetry, or None for what did not arrive, to the scene at `now`, s.

        Bad input is dropped and counted, never raised. `Scene.own` is None while fixes or motion are too old, and no
        neighbours are told then, since they are only known relative to it.
        """
        if now < self._now:
            self.counters.clock_jumps += 1
            self._pose.restart()
            self._tracks.restart()
            self._sighting_time = -math.inf
        self._now = now
        self._take_motion(motion)
        self._pose.predict(now)
        self._tracks.predict(now)
        if sighting is not None and self._in_time(now, sighting):
            self._take_sighting(now, sighting)
        own = self._pose.pose(now)
        if own is None:
            return Scene(stamp=now, own=None, sensing_range=self._sensing_range)
        return Scene(now, own, self._tracks.neighbours(now), (), self._sensing_range)

    def _take_motion(self, motion: Motion | None) -> None:
        if motion is None:
            return
        attitude = motion.attitude
        values = (motion.stamp, attitude.roll, attitude.pitch, attitude.yaw, motion.speed)
        if not all(map(math.isfinite, values)) or abs(motion.speed) > self._config.pose.speed_limit_mps:
            self.counters.bad_motion += 1
            return
        depth = motion.depth if math.isfinite(motion.depth) else None
        self.counters.bad_depth += depth is None
        self._pose.motion(motion.stamp, attitude, motion.speed, depth)

    def _in_time(self, now: float, sighting: Sighting) -> bool:
        """A sighting counts once, in order, and not before it can have been made."""
        if not math.isfinite(sighting.stamp) or sighting.stamp > now + self._config.stamp_tolerance_s:
            self.counters.early_sightings += 1
            return False
        if sighting.stamp <= self._sighting_time:
            self.counters.late_sightings += 1
            return False
        self._sighting_time = sighting.stamp
        return True

    def _take_sighting(self, now: float, sighting: Sighting) -> None:
        sigma = sighting.sigma if math.isfinite(sighting.sigma) and sighting.sigma >= 0.0 else 0.1
        self._sensing_range = sighting.sensing_range if sighting.sensing_range > 0.0 else 0.0
        if sighting.position is not None:
            if np.isfinite(sighting.position).all():
                believed = self._pose.fix(now, sighting.stamp, sighting.position, sigma)
                self.counters.outlier_fixes += not believed
            else:
                self.counters.bad_fixes += 1
        own = self._pose.pose(now)
        if own is not None:
            lag = min(max(now - sighting.stamp, 0.0), self._config.tracks.age_limit_s)
            seen_from = own.position - own.velocity * lag
            self._tracks.update(now, now - lag, seen_from + self._clean(sighting), math.hypot(sigma, own.sigma))

    def _clean(self, sighting: Sighting) -> NDArray[np.float64]:
        """The detections (N, 3) that can be hulls: finite, within range but for noise, no two on one spot."""
        relative: NDArray[np.float64] = np.asarray(sighting.relative, dtype=np.float64).reshape(-1, 3)
        reach = self._sensing_range + self._config.tracks.gate_floor_m
        with np.errstate(over="ignore"):
            good = np.isfinite(relative).all(axis=1) & ((relative * relative).sum(axis=1) <= reach * reach)
        if not good.all():
            relative = relative[good]
        apart = distinct(np.concatenate((np.zeros((1, 3)), relative)), self._config.tracks.duplicate_m)[1:]
        self.counters.bad_detections += int(len(good) - len(relative))
        self.counters.duplicate_detections += int(len(apart) - apart.sum())
        kept: NDArray[np.float64] = relative[apart]
        return kept
