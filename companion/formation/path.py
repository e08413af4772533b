"""The way of the formation's centre, legs joined by arcs or a smooth curve, with the formation's heading along it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

EASE = 0.5  # the formation's turn begins and ends over this share of the radius, so that no point's speed jumps
_LEAST_LEG = 1e-9  # m


@dataclass(frozen=True, slots=True)
class Track:
    """Samples along the way.

    `along` (K,) m is the length of way, `position` (K, 3) m, `tangent` (K, 3) of unit length, mission frame; `heading`
    (K,) rad is the formation's, unwrapped, and `turning` (K,) rad/m how it changes along the way.
    """

    along: Array
    position: Array
    tangent: Array
    heading: Array
    turning: Array

    def steepest(self, first: float = 0.0) -> float:
        """Greatest slope of the way from `first` m on: metres up or down for each metre ahead."""
        tangent = self.tangent[np.searchsorted(self.along, min(first, self.along[-1])) :]
        return float((np.abs(tangent[:, 2]) / np.maximum(np.hypot(tangent[:, 0], tangent[:, 1]), 1e-9)).max())


def round_corners(corners: Array, radius: float, step: float, heading: float | None) -> Track:
    """The way through `corners` (C, 3) m with arcs of `radius` m instead of corners, sampled every `step` m or less.

    An arc that does not fit its legs gets the largest radius that does. `heading` rad is the formation's at the
    start, None for the first leg's; from another one it turns to the tangent while it travels, by at most one
    radian in `radius`. Raises ValueError where the way turns straight back.
    """
    kept = _apart(corners)
    return _track(_pieces(kept, radius, step) if len(kept) > 1 else [], kept[0], radius, heading)


def through(corners: Array, radius: float, step: float, heading: float | None) -> Track:
    """The smooth curve through all of `corners` (C, 3) m, sampled every `step` m or less.

    A natural cubic spline over the lengths of the chords: its curvature has no steps. `radius` m and `heading` as in
    round_corners; the radius is none of the curve's.
    """
    kept = _apart(corners)
    return _track(_spline(kept, step) if len(kept) > 1 else [], kept[0], radius, heading)


def with_stops(track: Track, places: Sequence[float]) -> Track:
    """The same track with two more samples at each of the places, m along it."""
    if not places:
        return track
    along = np.sort(np.concatenate((track.along, np.repeat(places, 2))))
    rows = np.column_stack((track.position, track.tangent, track.heading, track.turning))
    rows = np.column_stack([np.interp(along, track.along, column) for column in rows.T])
    tangent = rows[:, 3:6] / np.linalg.norm(rows[:, 3:6], axis=1)[:, None]
    return Track(along, rows[:, :3], tangent, rows[:, 6], rows[:, 7])


# Corners (C, 3) without those that repeat the one before.
def _apart(corners: Array) -> Array:
    legs = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    return np.asarray(corners[np.concatenate(((True,), legs > _LEAST_LEG))])


# A track from pieces of positions (K, 3) and tangents (K, 3) that join; without any, it stays at `place`.
def _track(pieces: list[tuple[Array, Array]], place: Array, radius: float, heading: float | None) -> Track:
    start = heading if heading is not None else 0.0
    if not pieces:
        return Track(np.zeros(1), place[None, :], np.array([[1.0, 0.0, 0.0]]), np.array([start]), np.zeros(1))
    position = np.concatenate([piece[0] for piece in pieces])
    tangent = np.concatenate([piece[1] for piece in pieces])
    length = np.linalg.norm(np.diff(position, axis=0), axis=1)
    new = np.concatenate(((True,), length > _LEAST_LEG))
    position, tangent = position[new], tangent[new]
    along = np.concatenate(((0.0,), np.cumsum(np.linalg.norm(np.diff(position, axis=0), axis=1))))
    course = _course(tangent, start)
    eased, turning = _eased(along, course, EASE * radius)
    if heading is not None:
        off = math.remainder(heading - eased[0], math.tau)
        way = max(abs(off) * radius * math.pi / 2.0, _LEAST_LEG)
        angle = math.pi * np.minimum(along / way, 1.0)
        eased = eased + off * 0.5 * (1.0 + np.cos(angle))
        turning = turning - off * 0.5 * math.pi / way * np.sin(angle)
    return Track(along, position, tangent, eased, turning)


# Straight legs and arcs in turn: positions (K, 3) and tangents (K, 3) of each.
def _pieces(corners: Array, radius: float, step: float) -> list[tuple[Array, Array]]:
    legs = np.diff(corners, axis=0)
    lengths = np.linalg.norm(legs, axis=1)
    directions = legs / lengths[:, None]
    count = len(legs)
    pieces: list[tuple[Array, Array]] = []
    here = corners[0]
    for i in range(count):
        if i == count - 1:
            pieces.append(_straight(here, corners[-1], directions[i], step))
            break
        angle = math.acos(float(np.clip(directions[i] @ directions[i + 1], -1.0, 1.0)))
        if angle > math.radians(179.0):
            raise ValueError(f"path turns straight back at {corners[i + 1].tolist()}: insert a waypoint beside it")
        room = min(lengths[i] * (1.0 if i == 0 else 0.5), lengths[i + 1] * (1.0 if i + 2 == count else 0.5))
        cut = min(radius * math.tan(angle / 2.0), float(room))
        pieces.append(_straight(here, corners[i + 1] - cut * directions[i], directions[i], step))
        here = corners[i + 1] + cut * directions[i + 1]
        if angle > 1e-6:
            fitting, before, after = cut / math.tan(angle / 2.0), directions[i], directions[i + 1]
            pieces.append(_arc(corners[i + 1] - cut * before, before, after, fitting, step))
    return pieces


def _straight(first: Array, last: Array, direction: Array, step: float) -> tuple[Array, Array]:
    count = max(math.ceil(float(np.linalg.norm(last - first)) / step), 1)
    share = np.linspace(0.0, 1.0, count + 1)[:, None]
    return first + share * (last - first), np.repeat(direction[None, :], count + 1, axis=0)


# From `first` in direction `before` round to direction `after`.
def _arc(first: Array, before: Array, after: Array, radius: float, step: float) -> tuple[Array, Array]:
    angle = math.acos(float(np.clip(before @ after, -1.0, 1.0)))
    inward = after - math.cos(angle) * before
    inward = inward / np.linalg.norm(inward)
    turned = np.linspace(0.0, angle, max(math.ceil(radius * angle / step), 1) + 1)[:, None]
    sine, cosine = np.sin(turned), np.cos(turned)
    return first + radius * (sine * before + (1.0 - cosine) * inward), cosine * before + sine * inward


# Pieces of the natural cubic spline through corners (C, 3), over the lengths of its chords.
def _spline(corners: Array, step: float) -> list[tuple[Array, Array]]:
    chords = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    slopes = np.diff(corners, axis=0) / chords[:, None]
    bends = _bends(chords, slopes)
    pieces: list[tuple[Array, Array]] = []
    for i, chord in enumerate(chords.tolist()):
        first, last = bends[i], bends[i + 1]
        linear = slopes[i] - chord * (2.0 * first + last) / 6.0
        longest = chord * float(np.linalg.norm(slopes[i]) + chord * np.linalg.norm([first, last], axis=1).max())
        t = np.linspace(0.0, chord, max(math.ceil(longest / step), 1) + 1)[:, None]
        cube = (last - first) / chord
        position = corners[i] + t * (linear + t * (first / 2.0 + t * cube / 6.0))
        tangent = linear + t * (first + t * cube / 2.0)
        pieces.append((position, tangent / np.maximum(np.linalg.norm(tangent, axis=1), 1e-12)[:, None]))
    return pieces


# Second derivatives (C, 3) of the spline at its corners: Thomas' algorithm for the tridiagonal system.
def _bends(chords: Array, slopes: Array) -> Array:
    bends = np.zeros((len(chords) + 1, 3))
    right, above = np.zeros_like(bends), np.zeros(len(bends))
    for i in range(1, len(chords)):
        diagonal = 2.0 * (chords[i - 1] + chords[i]) - chords[i - 1] * above[i - 1]
        above[i] = chords[i] / diagonal
        right[i] = (6.0 * (slopes[i] - slopes[i - 1]) - chords[i - 1] * right[i - 1]) / diagonal
    for i in range(len(chords) - 1, 0, -1):
        bends[i] = right[i] - above[i] * bends[i + 1]
    return bends


# Direction of the tangent in the horizontal, unwrapped; where the way is vertical, what it was before.
def _course(tangent: Array, start: float) -> Array:
    level = np.hypot(tangent[:, 0], tangent[:, 1]) > 1e-6
    course = np.arctan2(tangent[:, 1], tangent[:, 0])
    last = np.maximum.accumulate(np.where(level, np.arange(len(level)), -1))
    first = course[level.argmax()] if level.any() else start
    unwrapped: Array = np.unwrap(np.where(last >= 0, course[last], first))
    return unwrapped


# The mean of the course over `width` m before and after, whose rate of change has no steps, and that rate.
def _eased(along: Array, course: Array, width: float) -> tuple[Array, Array]:
    area = np.concatenate(((0.0,), np.cumsum(0.5 * (course[1:] + course[:-1]) * np.diff(along))))
    left = along[-1] - along
    half = np.maximum(np.minimum(np.minimum(0.5 * width, along), left), 1e-3)
    widening = np.where(half < along, 0.0, 1.0) - np.where(half < left, 0.0, 1.0)  # the rate of change of half
    before, after = np.maximum(along - half, 0.0), np.minimum(along + half, along[-1])
    mean = (np.interp(after, along, area) - np.interp(before, along, area)) / (after - before)
    ends = np.interp(after, along, course) * (1.0 + widening) - np.interp(before, along, course) * (1.0 - widening)
    return mean, (ends - 2.0 * widening * mean) / (2.0 * half)
