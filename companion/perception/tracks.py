"""Neighbour tracks without identities: gated nearest neighbour, constant-velocity Kalman filters, M-of-N to confirm."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from companion.perception.config import TrackConfig
from companion.scene import Neighbour

Array = NDArray[np.float64]


class Tracks:
    """All tracks as arrays, one row a track.

    The axes of a track share one covariance [[pp, pv], [pv, vv]], since each sighting sees all three equally well.
    """

    def __init__(self, config: TrackConfig) -> None:
        self._config = config
        self.restart()

    def restart(self) -> None:
        """Forgets all tracks."""
        self._clock: float | None = None
        self._position: Array = np.zeros((0, 3))
        self._velocity: Array = np.zeros((0, 3))
        self._course: Array = np.zeros((0, 3))
        self._covariance: Array = np.zeros((0, 3))
        self._seen: Array = np.zeros(0)
        self._history: NDArray[np.int64] = np.zeros(0, dtype=np.int64)
        self._confirmed: NDArray[np.bool_] = np.zeros(0, dtype=np.bool_)
        self._stride_start: Array = np.zeros((0, 3))
        self._travelled: Array = np.zeros(0)

    def predict(self, now: float) -> None:
        """Moves every track on to `now`, s, and drops those unseen for too long."""
        elapsed = 0.0 if self._clock is None else now - self._clock
        self._clock = now
        if not len(self._seen) or elapsed <= 0.0:
            return
        if now - float(self._seen.min()) > self._config.age_limit_s:
            self._keep(now - self._seen <= self._config.age_limit_s)
        self._position = self._position + self._velocity * elapsed
        share = min(elapsed / self._config.course_memory_s, 1.0)
        self._course = self._course + share * (self._velocity - self._course)
        pp, pv, vv = self._covariance.T
        noise = self._config.acceleration_noise**2
        pp = pp + 2.0 * elapsed * pv + elapsed**2 * vv + noise * elapsed**3 / 3.0
        pv = pv + elapsed * vv + noise * elapsed**2 / 2.0
        self._covariance = np.stack((pp, pv, vv + noise * elapsed), axis=1)

    def update(self, now: float, stamp: float, detections: Array, sigma: float) -> None:
        """Takes one sighting of `stamp`: detections (N, 3) m in the mission frame, finite, noise sigma m an axis."""
        variance = max(sigma, 1e-3) ** 2
        expected = self._position - self._velocity * (now - stamp)
        rows, columns = self._associate(expected, detections, variance)
        self._correct(rows, detections[columns] - expected[rows], variance)
        hit = np.zeros(len(self._seen), dtype=np.int64)
        hit[rows] = 1
        self._seen[rows] = stamp
        self._history = ((self._history << 1) | hit) & ((1 << self._config.confirm_of) - 1)
        self._confirmed |= _count_bits(self._history) >= self._config.confirm_hits
        if len(columns) < len(detections):
            free = np.ones(len(detections), dtype=np.bool_)
            free[columns] = False
            self._begin(stamp, detections[free], variance)
        faded = ~self._confirmed & (self._history == 0)
        if faded.any():
            self._keep(~faded)

    def neighbours(self, now: float) -> tuple[Neighbour, ...]:
        """The confirmed tracks."""
        rows = np.flatnonzero(self._confirmed)
        return tuple(
            Neighbour(*values)
            for values in zip(
                self._position[rows],
                self._velocity[rows],
                np.sqrt(self._covariance[rows, 0]).tolist(),
                np.maximum(now - self._seen[rows], 0.0).tolist(),
                self._travelled[rows].tolist(),
                self._turn_rate(rows).tolist(),
                strict=True,
            )
        )

    def _turn_rate(self, rows: NDArray[np.intp]) -> Array:
        """Turn rates (N,) rad/s of the courses, drawn toward 0 where speed is no more than its own error."""
        vn, ve = self._velocity[rows, 0], self._velocity[rows, 1]
        cn, ce = self._course[rows, 0], self._course[rows, 1]
        along, across = cn * vn + ce * ve, cn * ve - ce * vn
        trust = along / (np.abs(along) + 2.0 * self._covariance[rows, 2])
        rate = np.arctan2(across, along) * np.maximum(trust, 0.0) / self._config.course_memory_s
        limited: Array = np.clip(rate, -self._config.turn_limit_radps, self._config.turn_limit_radps)
        return limited

    def _associate(
        self, expected: Array, detections: Array, variance: float
    ) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Pairs (track, detection), nearest first, no row or column twice, none beyond its gate."""
        if not len(self._seen) or not len(detections):
            return np.zeros(0, dtype=np.intp), np.zeros(0, dtype=np.intp)
        offset = expected[:, None, :] - detections[None, :, :]
        distance = np.sqrt((offset * offset).sum(axis=2))
        deviation = np.sqrt(self._covariance[:, 0] + variance)
        gate = np.maximum(self._config.gate_floor_m, self._config.gate_sigmas * deviation)
        rows, columns = np.nonzero(distance < gate[:, None])
        order = np.argsort(distance[rows, columns], kind="stable")
        pairs: list[tuple[int, int]] = []
        used_rows: set[int] = set()
        used_columns: set[int] = set()
        for row, column in zip(rows[order].tolist(), columns[order].tolist(), strict=True):
            if row not in used_rows and column not in used_columns:
                used_rows.add(row)
                used_columns.add(column)
                pairs.append((row, column))
        index = np.array(pairs, dtype=np.intp).reshape(-1, 2)
        return index[:, 0], index[:, 1]

    def _correct(self, rows: NDArray[np.intp], error: Array, variance: float) -> None:
        if not len(rows):
            return
        pp, pv, vv = self._covariance[rows].T
        gain, gain_velocity = pp / (pp + variance), pv / (pp + variance)
        self._position[rows] += gain[:, None] * error
        self._velocity[rows] += gain_velocity[:, None] * error
        self._covariance[rows] = np.stack((pp * (1.0 - gain), pv * (1.0 - gain), vv - gain_velocity * pv), axis=1)
        step = self._position[rows] - self._stride_start[rows]
        length = np.sqrt((step * step).sum(axis=1))
        done = length >= self._config.stride_m
        if done.any():
            self._travelled[rows[done]] += length[done]
            self._stride_start[rows[done]] = self._position[rows[done]]

    def _begin(self, stamp: float, detections: Array, variance: float) -> None:
        detections = detections[: max(self._config.tracks_limit - len(self._seen), 0)]
        count = len(detections)
        start = np.tile((variance, 0.0, self._config.start_speed_sigma_mps**2), (count, 1))
        self._position = np.concatenate((self._position, detections))
        self._velocity = np.concatenate((self._velocity, np.zeros((count, 3))))
        self._course = np.concatenate((self._course, np.zeros((count, 3))))
        self._covariance = np.concatenate((self._covariance, start))
        self._seen = np.concatenate((self._seen, np.full(count, stamp)))
        self._history = np.concatenate((self._history, np.ones(count, dtype=np.int64)))
        self._confirmed = np.concatenate((self._confirmed, np.zeros(count, dtype=np.bool_)))
        self._stride_start = np.concatenate((self._stride_start, detections))
        self._travelled = np.concatenate((self._travelled, np.zeros(count)))

    def _keep(self, rows: NDArray[np.bool_]) -> None:
        self._position, self._velocity = self._position[rows], self._velocity[rows]
        self._course = self._course[rows]
        self._covariance, self._seen, self._history = self._covariance[rows], self._seen[rows], self._history[rows]
        self._confirmed, self._travelled = self._confirmed[rows], self._travelled[rows]
        self._stride_start = self._stride_start[rows]


def _count_bits(values: NDArray[np.int64]) -> NDArray[np.int64]:
    return np.array([value.bit_count() for value in values.tolist()], dtype=np.int64)


def distinct(detections: Array, spacing: float) -> NDArray[np.bool_]:
    """Marks (N,) the detections that have no earlier one within `spacing` m."""
    count = len(detections)
    if count < 2:
        return np.ones(count, dtype=np.bool_)
    offset = detections[:, None, :] - detections[None, :, :]
    near = (offset * offset).sum(axis=2) < spacing * spacing
    marks: NDArray[np.bool_] = ~np.tril(near, -1).any(axis=1)
    return marks
