"""How far a fleet swam to form up, beside the least ways there are: straight ones, and those of a hull that must turn.

A vehicle's way counts over ground, from the start of forming until it holds the point it is matched to when the
formation stands and is within the arrival radius of it, where waiting hulls circle; the straight rest to the point is
added. A generous radius gains nothing then, and circling a point is not taken for a way to it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from sim.history import Array, History

TURNING_RADIUS_M = 1.25  # of the hull in still water, at full rudder and any speed: docs/hull.md
_ARC = np.linspace(0.0, math.tau, 721)


@dataclass(frozen=True, slots=True)
class Ways:
    """Sums over the fleet, m: what was swum, the least straight ways, and the least ways of hulls (`hull_ways`)."""

    swum_m: float
    straight_m: float
    hull_m: float


def ways(history: History, arrival_radius_m: float, start_s: float, formed_s: float | None) -> Ways | None:
    """The ways of forming from `start_s`; None unless the formation stood, `formed_s` later."""
    if formed_s is None:
        return None
    first = int(np.searchsorted(history.time, start_s))
    stood = int(np.searchsorted(history.time, start_s + formed_s))
    position, points = history.position[first], history.points[first]
    distance = np.linalg.norm(history.points[stood][:, None] - history.position[stood][None], axis=2)
    swum = 0.0
    for point, vehicle in zip(*linear_sum_assignment(distance), strict=True):
        span = slice(first, stood + 1)
        away = np.linalg.norm(history.points[span, point] - history.position[span, vehicle], axis=1)
        arrived = np.flatnonzero((away <= arrival_radius_m) & (history.decided[span, vehicle] == point))
        arrival = int(arrived[0]) if len(arrived) else stood - first
        travelled = history.travelled[:, vehicle]
        swum += float(travelled[first + arrival] - travelled[first] + away[arrival])
    straight = np.linalg.norm(position[:, None] - points[None], axis=2)
    bound = hull_ways(position, history.euler[first, :, 2], points, TURNING_RADIUS_M, arrival_radius_m)
    return Ways(swum, _least_sum(straight), _least_sum(bound))


def hull_ways(position: Array, yaw: Array, points: Array, radius: float, arrival_radius_m: float) -> Array:
    """Least ways (N, L) m of hulls with a turning radius to points, measured as above, final heading free.

    An arc at full rudder to either side, then straight (Dubins, 1957, with free final heading): straight over the
    point, or from anywhere on the arc that lies within the arrival radius. Positions (N, 3), yaw (N,) and points (L, 3)
    in the mission frame; a depth to change adds as the other leg of a right triangle. Still water, and steady turns.
    """
    straight = np.linalg.norm(points[None] - position[:, None], axis=2)
    best = np.full(straight.shape, np.inf)
    for side in (1.0, -1.0):
        course = yaw[:, None] + side * _ARC
        north = position[:, :1] + side * radius * (np.sin(course) - np.sin(yaw)[:, None])
        east = position[:, 1:2] - side * radius * (np.cos(course) - np.cos(yaw)[:, None])
        dn, de = points[:, 0, None] - north[:, None], points[:, 1, None] - east[:, None]
        rest = np.hypot(dn, de)
        off = np.abs(np.remainder(np.arctan2(de, dn) - course[:, None] + math.pi, math.tau) - math.pi)
        open_end = (off <= _ARC[1]) | (rest <= arrival_radius_m)
        best = np.minimum(best, np.where(open_end, radius * _ARC + rest, np.inf).min(axis=2))
    level = np.hypot(best, points[None, :, 2] - position[:, None, 2])
    return np.where(straight <= arrival_radius_m, straight, level)


def _least_sum(cost: Array) -> float:
    return float(cost[linear_sum_assignment(cost)].sum())
