"""Transformation: which point of one shape goes where in the next, how near points come, how fast it can be done.

Every point goes straight from its place in the old shape to one in the new, in the formation's body, all of them
leaving and arriving together with one smooth share of the way. Matched for the least sum of squares, no two points
come nearer to each other than 1 / sqrt(2) of the spacing: two ways that did would do better exchanged.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from companion.formation.auction import auction
from companion.mission import Mission

Array = NDArray[np.float64]

EASE_SPEED = 1.5  # greatest slope of the eased share 3 u^2 - 2 u^3 ...
EASE_BEND = 6.0  # ... and its greatest curvature
_COST_DIGITS = 6  # of squared distances, m^2: arithmetic that differs in its last digit must not match otherwise


class Span(NamedTuple):
    """When a transformation happens: from `first` to `last`, m along the path, or s of the clock where it `stands`."""

    first: float
    last: float
    stands: bool


class TransformError(ValueError):
    """Transformation `index` of a mission cannot be done; `key` is the setting to change, `text` how."""

    def __init__(self, index: int, key: str, text: str) -> None:
        super().__init__(f"transform[{index}] {key}: {text}")
        self.index, self.key, self.text = index, key, text


def shapes(mission: Mission) -> Array:
    """All shapes (S, L, 3) m of a mission, body of the formation; point l of one becomes point l of the next.

    Where points jump they keep the order of the new shape. Raises TransformError for another number of points.
    """
    found = [mission.points()]
    for index, config in enumerate(mission.transform):
        new = mission.transformed(index)
        if len(new) != len(found[0]):
            text = f"must have as many points as the formation ({len(found[0])}), has {len(new)}"
            raise TransformError(index, "points_m", text)
        found.append(new if config.jump else matched(found[-1], new))
    return np.array(found)


def matched(old: Array, new: Array) -> Array:
    """The points (L, 3) m of `new` in the order in which those of `old` go there, by least squares."""
    costs = [[round(sum((a - b) ** 2 for a, b in zip(p, q, strict=True)), _COST_DIGITS) for q in new.tolist()]
             for p in old.tolist()]  # fmt: skip
    return np.asarray(new[list(auction(costs).winner)])


def nearest(old: Array, new: Array) -> tuple[float, int, int]:
    """Least distance, m, between two points on their straight simultaneous ways, and which two; inf for less than two.

    With equal shapes, that of the points of a shape.
    """
    if len(old) < 2:
        return math.inf, 0, 0
    first, second = np.triu_indices(len(old), 1)
    before, after = old[first] - old[second], new[first] - new[second]
    change = after - before
    square = np.maximum((change * change).sum(axis=1), 1e-12)
    share = np.clip(-(before * change).sum(axis=1) / square, 0.0, 1.0)
    distance = np.linalg.norm(before + share[:, None] * change, axis=1)
    pair = int(distance.argmin())
    return float(distance[pair]), int(first[pair]), int(second[pair])


class Bounds(NamedTuple):
    """What points may do on their way: speeds ahead and at most m/s, gain of speed m/s^2, metres down a metre ahead."""

    needed: float
    permitted: float
    gain: float
    slope: float


def least_length(ways: Array, bounds: Bounds, pace: float, headed: bool = True) -> float:
    """Least length of the path, m, on which points can go their `ways` (L, 3) m; inf where there is none.

    On a straight path some speed of the centre then lets every point make the speed needed ahead while none goes faster
    than permitted, and at the pace none gains speed faster than allowed. Ahead is the first axis, or any direction
    where the formation is not `headed` along its path.
    """
    if not headed:
        ways = np.linalg.norm(ways, axis=1)[:, None] * np.array((1.0, 0.0, 0.0)) + ways * np.array((0.0, 0.0, 1.0))
    farthest = float(np.linalg.norm(ways, axis=1).max(initial=0.0))

    def flies(length: float) -> bool:
        moved = EASE_SPEED / length * ways
        ahead = 1.0 + (moved[:, 0] if headed else -moved[:, 0])
        fastest = float(np.linalg.norm(moved + np.array((1.0, 0.0, 0.0)), axis=1).max())
        level = bool((np.abs(moved[:, 2]) <= bounds.slope * ahead).all())
        return level and bool(bounds.permitted * ahead.min() >= bounds.needed * fastest)

    short = long = max(pace * math.sqrt(EASE_BEND * farthest / bounds.gain), 1e-3)
    while not flies(long):
        short, long = long, 2.0 * long
        if long > 1e4 * (1.0 + farthest):
            return math.inf
    while long - short > 1e-3:
        middle = 0.5 * (short + long)
        short, long = (short, middle) if flies(middle) else (middle, long)
    return math.ceil(long * 100.0) / 100.0


def least_duration(ways: Array, bounds: Bounds) -> float:
    """Least time, s, in which points of a standing formation can go their `ways`, vehicles keeping steerage way."""
    farthest = float(np.linalg.norm(ways, axis=1).max(initial=0.0))
    deepest = float(np.abs(ways[:, 2]).max(initial=0.0))
    swum = max(farthest / bounds.permitted, deepest / (bounds.slope * bounds.needed))
    return max(EASE_SPEED * swum, math.sqrt(EASE_BEND * farthest / bounds.gain), 1e-3)


def bodies(shapes: Array, done: Array) -> tuple[Array, Array]:
    """The formation's body (K, L, 3) m and its change for each further transformation, where `done` (K,) are done."""
    index = np.minimum(done.astype(int), len(shapes) - 1)
    ways = shapes[np.minimum(index + 1, len(shapes) - 1)] - shapes[index]
    return shapes[index] + (done - index)[:, None, None] * ways, ways


def progress(along: Array, spans: Sequence[Span]) -> tuple[Array, Array]:
    """How many of the transformations are done (K,) at places (K,) m, one under way by its share; its slope, 1/m.

    Where points jump, at the last of equal places they have jumped.
    """
    done, slope = np.zeros(len(along)), np.zeros(len(along))
    for span in spans:
        if span.last <= span.first:
            done[np.searchsorted(along, span.first, side="right") - 1 :] += 1.0
            continue
        share = np.clip((along - span.first) / (span.last - span.first), 0.0, 1.0)
        done += share * share * (3.0 - 2.0 * share)
        slope += 6.0 * share * (1.0 - share) / (span.last - span.first)
    return done, slope
