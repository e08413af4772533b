"""Own pose: position fixes fused with heading, speed through water and depth, which also tells the current."""

from __future__ import annotations

import math

import numpy as np

from companion.perception.config import PoseConfig
from companion.scene import Attitude, OwnPose, Vector


class PoseFilter:
    """Kalman filter over position and current, north and east.

    Both axes see the same noise at the same times, so they share one 2x2 covariance [[pp, pc], [pc, cc]]. Heading and
    speed through water enter as the known motion, position fixes as measurements; depth has a filter of its own.
    """

    def __init__(self, config: PoseConfig) -> None:
        self._config = config
        self.restart()

    def restart(self) -> None:
        """Forgets everything, as before the first fix."""
        self._clock: float | None = None
        self._position: tuple[float, float] | None = None
        self._current = (0.0, 0.0)
        self._covariance = (0.0, 0.0, 0.0)
        self._fix_time = -math.inf
        self._motion_time = -math.inf
        self._outliers = 0
        self._attitude = Attitude(0.0, 0.0, 0.0)
        self._water_velocity = (0.0, 0.0)
        self._depth: float | None = None
        self._depth_time = 0.0
        self._sink = 0.0

    def predict(self, now: float) -> None:
        """Carries position along with the known motion to `now`, s."""
        elapsed = 0.0 if self._clock is None else now - self._clock
        self._clock = now
        if self._position is None or elapsed <= 0.0:
            return
        (px, py), (cx, cy), (ux, uy) = self._position, self._current, self._water_velocity
        self._position = (px + (ux + cx) * elapsed, py + (uy + cy) * elapsed)
        pp, pc, cc = self._covariance
        pp += 2.0 * pc * elapsed + cc * elapsed**2 + self._config.speed_noise**2 * elapsed
        self._covariance = (pp, pc + cc * elapsed, cc + self._config.current_noise**2 * elapsed)

    def motion(self, stamp: float, attitude: Attitude, speed: float, depth: float | None) -> None:
        """Takes attitude, speed through water along the hull m/s, and depth m (None: no reading)."""
        along = speed * math.cos(attitude.pitch)
        self._attitude = attitude
        self._water_velocity = (along * math.cos(attitude.yaw), along * math.sin(attitude.yaw))
        self._motion_time = stamp
        if depth is not None:
            self._filter_depth(stamp, depth)

    def fix(self, now: float, stamp: float, position: Vector, sigma: float) -> bool:
        """Takes a position fix (3,) made at `stamp`; False when it was an outlier and not believed."""
        if self._depth is None:
            self._depth = float(position[2])
        variance = max(sigma, 1e-3) ** 2
        if self._position is None:
            self._start(now, position, variance)
            return True
        lag = min(max(now - stamp, 0.0), self._config.fix_limit_s)
        vx, vy = self._velocity()
        ex = float(position[0]) + vx * lag - self._position[0]
        ey = float(position[1]) + vy * lag - self._position[1]
        pp, pc, cc = self._covariance
        total = pp + variance
        if ex * ex + ey * ey > self._config.gate_sigmas**2 * total:
            self._outliers += 1
            if self._outliers < self._config.outliers_to_restart:
                return False
            self._start(now, position, variance)
            return True
        self._outliers = 0
        gain, gain_current = pp / total, pc / total
        self._position = (self._position[0] + gain * ex, self._position[1] + gain * ey)
        self._current = (self._current[0] + gain_current * ex, self._current[1] + gain_current * ey)
        self._covariance = (pp * (1.0 - gain), pc * (1.0 - gain), cc - gain_current * pc)
        self._fix_time = stamp
        return True

    def pose(self, now: float) -> OwnPose | None:
        """The pose now, or None when fixes or motion are older than their limits."""
        known = (
            self._position is not None
            and self._depth is not None
            and now - self._fix_time <= self._config.fix_limit_s
            and now - self._motion_time <= self._config.motion_limit_s
        )
        if not known:
            return None
        assert self._position is not None
        vx, vy = self._velocity()
        return OwnPose(
            position=np.array((self._position[0], self._position[1], self._depth)),
            velocity=np.array((vx, vy, self._sink)),
            attitude=self._attitude,
            sigma=math.sqrt(self._covariance[0]),
            stamp=now,
            current=np.array((self._current[0], self._current[1], 0.0)),
        )

    def _velocity(self) -> tuple[float, float]:
        return self._water_velocity[0] + self._current[0], self._water_velocity[1] + self._current[1]

    def _start(self, now: float, position: Vector, variance: float) -> None:
        self._position = (float(position[0]), float(position[1]))
        self._covariance = (variance, 0.0, self._config.current_sigma_mps**2)
        self._current = (0.0, 0.0)
        self._fix_time = now
        self._outliers = 0

    def _filter_depth(self, stamp: float, depth: float) -> None:
        elapsed = stamp - self._depth_time
        if self._depth is None or not 0.0 < elapsed < 2.0:
            if self._depth is None or elapsed >= 2.0:
                self._depth, self._depth_time, self._sink = depth, stamp, 0.0
            return
        alpha = self._config.depth_gain
        beta = alpha**2 / (2.0 - alpha)
        error = depth - (self._depth + self._sink * elapsed)
        self._depth += self._sink * elapsed + alpha * error
        self._sink += beta / elapsed * error
        self._depth_time = stamp
