"""The timetable of a journey: how fast the formation's centre goes where, so that a vehicle can follow every point.

In a turn or a transformation the centre goes as fast as the slowest point needs for a vehicle to keep steerage way, and
no faster than the fastest point may go.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from companion.formation.path import Track, round_corners, through, with_stops
from companion.formation.transform import Bounds, Span, bodies, progress
from companion.mission import Mission

Array = NDArray[np.float64]

RESERVE = 0.2  # share of the top speed that no point uses, left to a vehicle for closing on its point
STEERAGE_RESERVE = 0.5  # share of the steerage speed by which every point exceeds it: a current may push from behind
RAMP_S = 8.0  # time to come from rest to the pace: a hull's own lag several times over
STEP_SHARE = 0.1  # step of the worked-out journey as a share of lambda
LEAST_SPEED = 0.05  # of the centre, as a share of the pace, however sharp the turn
_STRAIGHT = 1e-9  # rad/m: a way that turns less is straight
_BETWEEN = 1e-3  # share by which a point may go faster between two samples than at them
_BLOCK = 1024  # samples worked on at once: bounds memory


class Timetable(NamedTuple):
    """Times (K,) s, rising; states (K, 5): north, east, down m, heading rad, transformations done; rates (K, 5) a s."""

    times: Array
    states: Array
    rates: Array


def permitted_speed(mission: Mission) -> float:
    """The most that a point may go, m/s."""
    return max(mission.path.pace_mps, (1.0 - RESERVE) * mission.limits.top_speed_mps)


def needed_speed(mission: Mission) -> float:
    """The least that a travelling point should go, m/s."""
    return min(mission.path.pace_mps, (1.0 + STEERAGE_RESERVE) * mission.limits.steerage_speed_mps)


def travel_gain(mission: Mission) -> float:
    """How fast the formation gains speed, m/s^2."""
    return mission.path.pace_mps / RAMP_S


def bounds_on(mission: Mission, steepest: float) -> Bounds:
    """What points may do while they transform, on a path of which the steepest slope is given."""
    slope = max(mission.limits.slope_max - steepest, 0.0)
    return Bounds(needed_speed(mission), permitted_speed(mission), travel_gain(mission), slope)


def way_of(mission: Mission, shapes: Array) -> Track:
    """The path of the mission, sampled well below lambda."""
    path = mission.path
    heading = None if path.heading_deg is None else math.radians(path.heading_deg)
    reach = float(np.linalg.norm(shapes, axis=2).max(initial=0.0))
    step = STEP_SHARE * path.step_m / (1.0 + reach / path.turn_radius_m)
    join = through if path.curve == "spline" else round_corners
    track = join(path.corners(), path.turn_radius_m, min(step, 0.1 * path.turn_radius_m), heading)
    if path.turn:
        return track
    return replace(track, heading=np.full_like(track.heading, track.heading[0]), turning=np.zeros_like(track.turning))


def travel(track: Track, shapes: Array, spans: Sequence[Span], before: int, mission: Mission) -> Timetable:
    """The travel along a track from time 0, with transformations at `spans` of it, after `before` at the start."""
    jumps = [span.first for span in spans if span.last <= span.first]
    track = with_stops(track, jumps)
    done, slope = progress(track.along, spans)
    done += before
    speed = _speed(track, shapes, done, slope, mission)
    length, mean = np.diff(track.along), 0.5 * (speed[:-1] + speed[1:])
    times = np.concatenate(((0.0,), np.cumsum(np.divide(length, mean, out=np.zeros_like(length), where=mean > 0.0))))
    states = np.column_stack((track.position, track.heading, done))
    rates = np.column_stack((track.tangent, track.turning, slope)) * speed[:, None]
    return Timetable(times, states, rates)


# Speed (K,) of the centre: the pace, but what the slowest and the fastest point need, reached smoothly.
def _speed(track: Track, shapes: Array, done: Array, slope: Array, mission: Mission) -> Array:
    pace, permitted, needed = mission.path.pace_mps, permitted_speed(mission), needed_speed(mission)
    least, most = np.ones(len(done)), np.ones(len(done))
    changing = np.flatnonzero((np.abs(track.turning) > _STRAIGHT) | (slope != 0.0))
    for first in range(0, len(changing), _BLOCK):
        block = changing[first : first + _BLOCK]
        rates = np.column_stack((track.tangent[block], track.turning[block], slope[block]))
        moved = np.sqrt((velocities(shapes, track.heading[block], done[block], rates) ** 2).sum(axis=2))
        least[block], most[block] = np.maximum(moved.min(axis=1), 1e-6), moved.max(axis=1)
    speed = np.maximum(
        np.minimum(np.maximum(pace, needed / least), (1.0 - _BETWEEN) * permitted / most), LEAST_SPEED * pace
    )
    speed[0] = speed[-1] = 0.0
    steps = 2.0 * travel_gain(mission) * np.diff(track.along)
    squares = (speed**2).tolist()
    for i, gain in enumerate(steps.tolist()):
        squares[i + 1] = min(squares[i + 1], squares[i] + gain)
    for i in range(len(steps) - 1, -1, -1):
        squares[i] = min(squares[i], squares[i + 1] + float(steps[i]))
    limited: Array = np.sqrt(np.array(squares))
    return limited


def offsets(body: Array, heading: Array) -> Array:
    """The body (K, L, 3) turned to the headings (K,): metres from the centre in the mission frame."""
    cosine, sine = np.cos(heading)[:, None], np.sin(heading)[:, None]
    forward, right = body[..., 0], body[..., 1]
    return np.stack((cosine * forward - sine * right, sine * forward + cosine * right, body[..., 2]), axis=2)


def velocities(shapes: Array, heading: Array, done: Array, rates: Array) -> Array:
    """Velocities (K, L, 3) of all points, for rates (K, 5) as in Timetable."""
    body, ways = bodies(shapes, done)
    moved = offsets(ways * rates[:, 4, None, None], heading) + rates[:, None, :3]
    offset = offsets(body, heading)
    moved[..., 0] -= rates[:, 3, None] * offset[..., 1]
    moved[..., 1] += rates[:, 3, None] * offset[..., 0]
    return np.asarray(moved)
