"""Algorithm 2's virtual formation: the points of the formation as they move along the mission's path.

It waits and forms at the path's origin, then travels: it translates along the path, turns with its tangent unless the
mission says otherwise, and starts and stops smoothly. In a turn it goes as fast as its innermost point needs for a
vehicle to keep steerage way, and no faster than its outermost point may go. The whole journey is worked out beforehand
in steps shorter than lambda (eqs 9 and 10).
"""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from companion.formation.path import Track, round_corners
from companion.mission import Mission
from companion.scene import Phase

Array = NDArray[np.float64]

RESERVE = 0.2  # share of the top speed that no point uses, left to a vehicle for closing on its point
STEERAGE_RESERVE = 0.5  # share of the steerage speed by which every point exceeds it: a current may push from behind
RAMP_S = 8.0  # time to come from rest to the pace: a hull's own lag several times over
STEP_SHARE = 0.1  # step of the worked-out journey as a share of lambda
LEAST_SPEED = 0.05  # of the centre, as a share of the pace, however sharp the turn


class VirtualState(NamedTuple):
    """Points (L, 3) m and their velocities (L, 3) m/s, mission frame; heading rad, positive to starboard; phase."""

    points: Array
    velocities: Array
    heading: float
    phase: Phase


class VirtualFormation:
    """The mission's virtual formation at any time; the same for all vehicles, since they share mission and clock."""

    def __init__(self, mission: Mission) -> None:
        self._body = mission.points()
        self._start = mission.schedule.start_s
        self._travel = self._start + mission.schedule.forming_s
        self._track = _track(mission)
        speed = _speed_along(self._track, self._body, mission)
        self._times, self._rows = _timetable(self._track, speed)
        self._clock: list[float] = self._times.tolist()

    @property
    def end_s(self) -> float:
        """When the travel is over, s of the mission's clock."""
        return self._travel + self._clock[-1]

    @property
    def length_m(self) -> float:
        """Length of the centre's way."""
        return float(self._track.along[-1])

    def at(self, now: float) -> VirtualState:
        """The virtual formation at `now`, s; a time that is no number is taken as before the start."""
        since = now - self._travel if math.isfinite(now) else -math.inf
        row, phase = self._rows[0], Phase.TRAVEL
        if since < 0.0:
            phase = Phase.FORMING if now >= self._start else Phase.WAITING
        elif since >= self._clock[-1]:
            row, phase = self._rows[-1], Phase.DONE
        else:
            row = self._between(since)
        north, east, down, heading, vn, ve, vd, rate = row.tolist()
        cosine, sine = math.cos(heading), math.sin(heading)
        offset = self._body @ np.array(((cosine, sine, 0.0), (-sine, cosine, 0.0), (0.0, 0.0, 1.0)))
        points = offset + np.array((north, east, down))
        velocities = np.empty_like(offset)
        velocities[:, 0] = vn - rate * offset[:, 1]
        velocities[:, 1] = ve + rate * offset[:, 0]
        velocities[:, 2] = vd
        return VirtualState(points, velocities, heading, phase)

    # The journey's row at a time of travel: constant acceleration between two steps.
    def _between(self, since: float) -> Array:
        index = bisect_right(self._clock, since) - 1
        first, last = self._rows[index], self._rows[index + 1]
        duration = self._clock[index + 1] - self._clock[index]
        share = (since - self._clock[index]) / duration
        slow, fast = math.hypot(*first[4:7].tolist()), math.hypot(*last[4:7].tolist())
        way = share * (slow + 0.5 * share * (fast - slow)) / (0.5 * (slow + fast))
        row: Array = first + way * (last - first)
        row[4:] = first[4:] + share * (last[4:] - first[4:])
        return row


# The path of the mission with rounded corners, sampled well below lambda.
def _track(mission: Mission) -> Track:
    path = mission.path
    heading = None if path.heading_deg is None else math.radians(path.heading_deg)
    reach = float(np.linalg.norm(mission.points(), axis=1).max(initial=0.0))
    step = STEP_SHARE * path.step_m / (1.0 + reach / path.turn_radius_m)
    track = round_corners(path.corners(), path.turn_radius_m, min(step, 0.1 * path.turn_radius_m), heading)
    if path.turn:
        return track
    return replace(track, heading=np.full_like(track.heading, track.heading[0]), turning=np.zeros_like(track.turning))


# Speed of the centre at each sample: the pace, but what inner and outer points need in turns, reached smoothly.
def _speed_along(track: Track, body: Array, mission: Mission) -> Array:
    pace = mission.path.pace_mps
    permitted = max(pace, (1.0 - RESERVE) * mission.limits.top_speed_mps)
    needed = min(pace, (1.0 + STEERAGE_RESERVE) * mission.limits.steerage_speed_mps)
    turned = np.stack((np.cos(track.heading), np.sin(track.heading)), axis=1)
    offset_n = body[:, 0] * turned[:, :1] - body[:, 1] * turned[:, 1:]
    offset_e = body[:, 0] * turned[:, 1:] + body[:, 1] * turned[:, :1]
    swing = track.turning[:, None]
    moved = np.stack(
        (track.tangent[:, :1] - swing * offset_e, track.tangent[:, 1:2] + swing * offset_n), axis=2
    )  # of each point for each metre of the centre
    moved = np.sqrt((moved**2).sum(axis=2) + track.tangent[:, 2:] ** 2)
    least, most = np.maximum(moved.min(axis=1), 1e-6), moved.max(axis=1)
    speed = np.maximum(np.minimum(np.maximum(pace, needed / least), permitted / most), LEAST_SPEED * pace)
    speed[0] = speed[-1] = 0.0
    steps = 2.0 * pace / RAMP_S * np.diff(track.along)
    squares = (speed**2).tolist()
    for i, gain in enumerate(steps.tolist()):
        squares[i + 1] = min(squares[i + 1], squares[i] + gain)
    for i in range(len(steps) - 1, -1, -1):
        squares[i] = min(squares[i], squares[i + 1] + float(steps[i]))
    limited: Array = np.sqrt(squares)
    return limited


# Times (K,) s of travel, and rows (K, 8): position, heading, velocity of the centre, rate of turn.
def _timetable(track: Track, speed: Array) -> tuple[Array, Array]:
    if len(speed) < 2:
        row = np.concatenate((track.position[0], track.heading[:1], np.zeros(4)))
        return np.zeros(1), row[None, :]
    times = np.concatenate(((0.0,), np.cumsum(2.0 * np.diff(track.along) / (speed[:-1] + speed[1:]))))
    velocity = track.tangent * speed[:, None]
    rows = np.column_stack((track.position, track.heading, velocity, track.turning * speed))
    return times, rows
