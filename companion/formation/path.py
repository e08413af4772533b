"""The way of the formation's centre: straight legs joined by arcs, with the heading the formation has along it."""

from __future__ import annotations

import math
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


def round_corners(corners: Array, radius: float, step: float, heading: float | None) -> Track:
    """The way through `corners` (C, 3) m with arcs of `radius` m instead of corners, sampled every `step` m or less.

    An arc that does not fit its legs gets the largest radius that does. `heading` rad is the formation's at the
    start, None for the first leg's; from another one it turns to the tangent while it travels, by at most one
    radian in `radius`. Raises ValueError where the way turns straight back.
    """
    kept = [corners[0]]
    kept += [
        corner for corner, leg in zip(corners[1:], np.diff(corners, axis=0), strict=True) if leg @ leg > _LEAST_LEG**2
    ]
    start = heading if heading is not None else 0.0
    if len(kept) < 2:
        return Track(np.zeros(1), kept[0][None, :], np.array([[1.0, 0.0, 0.0]]), np.array([start]), np.zeros(1))
    pieces = _pieces(np.array(kept), radius, step)
    position = np.concatenate([piece[0] for piece in pieces])
    tangent = np.concatenate([piece[1] for piece in pieces])
    length = np.linalg.norm(np.diff(position, axis=0), axis=1)
    new = np.concatenate(((True,), length > _LEAST_LEG))
    position, tangent = position[new], tangent[new]
    along = np.concatenate(((0.0,), np.cumsum(np.linalg.norm(np.diff(position, axis=0), axis=1))))
    course = _course(tangent, start)
    eased = _eased(along, course, EASE * radius)
    if heading is not None:
        off = math.remainder(heading - eased[0], math.tau)
        way = max(abs(off) * radius * math.pi / 2.0, _LEAST_LEG)
        eased = eased + off * 0.5 * (1.0 + np.cos(math.pi * np.minimum(along / way, 1.0)))
    return Track(along, position, tangent, eased, np.gradient(eased, along))


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


# Direction of the tangent in the horizontal, unwrapped; where the way is vertical, what it was before.
def _course(tangent: Array, start: float) -> Array:
    level = np.hypot(tangent[:, 0], tangent[:, 1]) > 1e-6
    course = np.arctan2(tangent[:, 1], tangent[:, 0])
    last = np.maximum.accumulate(np.where(level, np.arange(len(level)), -1))
    first = course[level.argmax()] if level.any() else start
    unwrapped: Array = np.unwrap(np.where(last >= 0, course[last], first))
    return unwrapped


# The mean of the course over `width` m before and after: its rate of change then has no steps.
def _eased(along: Array, course: Array, width: float) -> Array:
    area = np.concatenate(((0.0,), np.cumsum(0.5 * (course[1:] + course[:-1]) * np.diff(along))))
    half = np.minimum(np.minimum(0.5 * width, along), along[-1] - along)
    ends = np.interp(along + half, along, area) - np.interp(along - half, along, area)
    eased: Array = np.where(half > 1e-6, ends / np.maximum(2.0 * half, 1e-6), course)
    return eased
