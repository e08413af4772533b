"""Assignments of points to vehicles by somebody who sees everything: Hungarian, least squares, bottleneck, greedy."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

Array = NDArray[np.float64]
Indices = NDArray[np.intp]


def distances(points: Array, vehicles: Array) -> Array:
    """Straight ways (L, J) m from vehicles (J, 3) to points (L, 3)."""
    away: Array = np.sqrt(((points[:, None] - vehicles[None]) ** 2).sum(axis=2))
    return away


def hungarian(ways: Array) -> Indices:
    """The least sum of ways."""
    return np.asarray(linear_sum_assignment(ways)[1])


def least_squares(ways: Array) -> Indices:
    """The least sum of squared ways, which is the paper's energy function (eq 11)."""
    return np.asarray(linear_sum_assignment(ways**2)[1])


def bottleneck(ways: Array) -> Indices:
    """The least longest way, and among those the least sum."""
    steps = np.unique(ways)
    low, high = 0, len(steps) - 1
    while low < high:
        middle = (low + high) // 2
        long = ways > steps[middle]
        low, high = (low, middle) if not long[linear_sum_assignment(long)].any() else (middle + 1, high)
    return hungarian(np.where(ways > steps[low], 1.0 + ways.sum(), ways))


def greedy(ways: Array) -> Indices:
    """Always the nearest pair of those left."""
    left = ways.copy()
    column = np.full(len(ways), -1)
    for _ in range(min(ways.shape)):
        row, nearest = np.unravel_index(int(left.argmin()), left.shape)
        column[row] = nearest
        left[row, :] = left[:, nearest] = np.inf
    return column


ASSIGNMENTS: dict[str, Callable[[Array], Indices]] = {
    "hungarian": hungarian,
    "least squares": least_squares,
    "bottleneck": bottleneck,
    "greedy": greedy,
}


def assign(points: Array, vehicles: Array, by: str = "hungarian") -> Indices:
    """The vehicle (L,) of each point, of as many vehicles as points; raises KeyError for an unknown way."""
    return ASSIGNMENTS[by](distances(points, vehicles))
