"""The mission file: what all vehicles of one swim share, and what it must fulfil before any of them starts."""

from __future__ import annotations

import math
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from companion.config import Problem, load
from companion.config.options import option, section
from companion.shapes import SHAPES, centred

DECISION_PERIOD_S = 0.1  # of every companion: ten decisions a second

_OWN_POINTS = "points"


@dataclass(frozen=True, slots=True, kw_only=True)
class FormationConfig:
    """The shape to form, and how vehicles compete for its points."""

    shape: str = option("Shape of the formation", default="triangle", choices=(*SHAPES, _OWN_POINTS))
    point_count: int | None = option(
        "Number of points; as many as vehicles when absent", default=None, low=1, high=1000
    )
    spacing_m: float = option("Distance between neighbouring points", default=5.0, low=1.0, high=100.0, unit="m")
    points_m: tuple[tuple[float, ...], ...] = option(
        'Points of shape "points": lists of forward, right and, if wanted, down',
        default=(),
        low=-1000.0,
        high=1000.0,
        unit="m",
        lengths=(2, 3),
    )
    form: str = option("Form of the competition", default="price", choices=("price", "som", "paper"))
    exponent: float = option("Exponent p of the cost of a distance", default=1.2, low=1.0, high=2.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class PathConfig:
    """Where the formation is formed and the way it then travels; no waypoints: it stays where it is."""

    origin_m: tuple[float, float, float] = option(
        "Centre of the formation while it forms: north, east, down",
        default=(0.0, 0.0, 2.0),
        low=-1e4,
        high=1e4,
        unit="m",
    )
    heading_deg: float | None = option(
        "Heading of the formation while it forms; that of the first leg when absent",
        default=None,
        low=-360.0,
        high=360.0,
        unit="deg",
    )
    waypoints_m: tuple[tuple[float, ...], ...] = option(
        "Corners of the path after the origin: lists of north, east and, if it changes, down",
        default=(),
        low=-1e4,
        high=1e4,
        unit="m",
        lengths=(2, 3),
    )
    pace_mps: float = option(
        "Speed of the formation's centre over ground", default=0.35, above=0.0, high=2.0, unit="m/s"
    )
    turn: bool = option("Whether the formation turns with its path; else it keeps its heading", default=True)
    turn_radius_m: float = option(
        "Radius of the centre's arc round a corner", default=12.0, above=0.0, high=1e3, unit="m"
    )
    step_m: float = option(
        "Longest way a point may go between two decisions (lambda, eqs 9 and 10)",
        default=1.0,
        above=0.0,
        high=50.0,
        unit="m",
    )

    def corners(self) -> NDArray[np.float64]:
        """Origin and waypoints (W + 1, 3), m: north, east, down; a waypoint without depth keeps the one before."""
        corners = [list(self.origin_m)]
        for waypoint in self.waypoints_m:
            corners.append([*waypoint[:2], waypoint[2] if len(waypoint) == 3 else corners[-1][2]])
        return np.array(corners)


@dataclass(frozen=True, slots=True, kw_only=True)
class ScheduleConfig:
    """When things happen, in seconds of the mission's clock."""

    start_s: float = option("Start of forming", default=5.0, low=0.0, high=86400.0, unit="s")
    forming_s: float = option("Time for forming before travel begins", default=90.0, low=0.0, high=86400.0, unit="s")


@dataclass(frozen=True, slots=True, kw_only=True)
class LimitsConfig:
    """What every vehicle of the mission is able and allowed to do."""

    top_speed_mps: float = option("Highest speed guidance asks for", default=0.65, above=0.0, high=2.0, unit="m/s")
    steerage_speed_mps: float = option(
        "Least speed at which the fins steer", default=0.2, above=0.0, high=2.0, unit="m/s"
    )
    waiting_radius_m: float = option(
        "Radius of the circle in which a vehicle waits on its point", default=1.9, low=0.0, high=50.0, unit="m"
    )
    safe_distance_m: float = option("Least distance between two vehicles", default=1.15, low=0.3, high=50.0, unit="m")
    depth_min_m: float = option("Least depth of a point", default=0.3, low=0.0, high=100.0, unit="m")
    depth_max_m: float = option("Greatest depth allowed", default=30.0, low=0.5, high=100.0, unit="m")


@dataclass(frozen=True, slots=True, kw_only=True)
class Mission:
    """All that vehicles share: this file and a clock."""

    name: str = option("Name of the mission", default="mission", pattern="[A-Za-z0-9][A-Za-z0-9_.-]{0,63}")
    seed: int = option("Seed of every random draw", default=1, low=0, high=2**63 - 1)
    vehicles: int = option("Number of vehicles", low=1, high=250)
    formation: FormationConfig = section("The shape and the competition for its points", FormationConfig)
    path: PathConfig = section("The way to travel", PathConfig)
    schedule: ScheduleConfig = section("The times of the phases", ScheduleConfig)
    limits: LimitsConfig = section("Abilities and bounds of the vehicles", LimitsConfig)

    def points(self) -> NDArray[np.float64]:
        """Points of the formation (L, 3), m, body of the formation (forward, right, down), about their mean."""
        shape = self.formation
        if shape.shape == _OWN_POINTS:
            return centred(np.array([(*point, 0.0)[:3] for point in shape.points_m]))
        return centred(SHAPES[shape.shape](shape.point_count or self.vehicles, shape.spacing_m))

    def generator(self, vehicle: int, purpose: str) -> np.random.Generator:
        """The random numbers of one vehicle for one purpose, the same on every machine for the same mission."""
        key = (vehicle, zlib.crc32(purpose.encode()))
        return np.random.Generator(np.random.PCG64(np.random.SeedSequence(self.seed, spawn_key=key)))

    def problems(self) -> Iterator[Problem]:
        """The checks between settings."""
        shape = self.formation
        if (shape.shape == _OWN_POINTS) != bool(shape.points_m):
            must = 'must hold at least one point for shape "points", and be absent for any other shape'
            yield Problem("formation", "points_m", list(shape.points_m), must)
            return
        if shape.shape == _OWN_POINTS and shape.point_count not in (None, len(shape.points_m)):
            must = f"must be absent or the length of points_m ({len(shape.points_m)})"
            yield Problem("formation", "point_count", shape.point_count, must)
            return
        points = self.points()
        if self.vehicles < len(points):
            yield Problem("", "vehicles", self.vehicles, f"must be at least the number of points ({len(points)})")
        yield from _spacing_problems(self, points)
        yield from _speed_problems(self, points)
        yield from _path_problems(self, points)


def load_mission(path: Path | str) -> Mission:
    """Reads a mission file; raises ConfigError with every problem found in it."""
    return load(Mission, path)


# Points must leave room between vehicles, and a step must not carry a point half-way to its neighbour.
def _spacing_problems(mission: Mission, points: NDArray[np.float64]) -> Iterator[Problem]:
    if len(points) < 2:
        return
    distances = np.linalg.norm(points[:, None] - points[None], axis=2) + np.diag(np.full(len(points), np.inf))
    nearest = float(distances.min())
    shape, safe = mission.formation, mission.limits.safe_distance_m
    key, value = ("points_m", list(shape.points_m)) if shape.points_m else ("spacing_m", shape.spacing_m)
    if nearest < safe - 1e-9:
        i, j = np.unravel_index(int(distances.argmin()), distances.shape)
        text = f"points {i} and {j} are {nearest:.3g} m apart, must be at least limits.safe_distance_m ({safe:g} m)"
        yield Problem("formation", key, value, text)
    if mission.path.step_m >= nearest / 2:
        text = f"must be under half the distance of the nearest points ({nearest / 2:.3g} m), else vehicles swap points"
        yield Problem("path", "step_m", mission.path.step_m, text)


# The fastest point of the formation must be no faster than a vehicle, in a turn too.
def _speed_problems(mission: Mission, points: NDArray[np.float64]) -> Iterator[Problem]:
    path, limits = mission.path, mission.limits
    if limits.steerage_speed_mps >= limits.top_speed_mps:
        text = f"must be under top_speed_mps ({limits.top_speed_mps:g} m/s)"
        yield Problem("limits", "steerage_speed_mps", limits.steerage_speed_mps, text)
    if not path.waypoints_m:
        return
    if path.pace_mps > limits.top_speed_mps:
        text = f"must be at most limits.top_speed_mps ({limits.top_speed_mps:g} m/s)"
        yield Problem("path", "pace_mps", path.pace_mps, text)
        return
    fastest = path.pace_mps
    if path.turn and len(_turns(path)) and np.abs(_turns(path)).max() > 1e-6:
        # Rigid turn at the rate pace / radius: the speed of a point is that rate times its distance from the pivot.
        pivots = [np.hypot(points[:, 0], path.turn_radius_m + side * points[:, 1]).max() for side in (1.0, -1.0)]
        fastest = path.pace_mps * float(max(pivots)) / path.turn_radius_m
        if fastest > limits.top_speed_mps:
            text = (
                f"the outer point goes {fastest:.3g} m/s in a turn at pace_mps = {path.pace_mps:g}, "
                f"must be at most limits.top_speed_mps ({limits.top_speed_mps:g} m/s): widen the turn or slow down"
            )
            yield Problem("path", "turn_radius_m", path.turn_radius_m, text)
    if fastest * DECISION_PERIOD_S > path.step_m:
        text = f"must be at least the way of the fastest point in {DECISION_PERIOD_S:g} s"
        yield Problem("path", "step_m", path.step_m, f"{text} ({fastest * DECISION_PERIOD_S:.3g} m)")


# Every leg must hold the arcs of its two corners, and every point must stay within the depths allowed.
def _path_problems(mission: Mission, points: NDArray[np.float64]) -> Iterator[Problem]:
    path, limits = mission.path, mission.limits
    corners = path.corners()
    legs = np.linalg.norm(np.diff(corners[:, :2], axis=0), axis=1)
    if (legs <= 1e-6).any():
        index = int(np.argmax(legs <= 1e-6))
        text = "must lie away from the corner before it (path too short)"
        yield Problem("path", f"waypoints_m[{index}]", list(path.waypoints_m[index]), text)
        return
    turns = _turns(path)
    if len(turns) and np.abs(turns).max() > math.radians(170):
        index = int(np.abs(turns).argmax())
        text = f"must not turn the path by more than 170 deg (it does by {abs(math.degrees(turns[index])):.0f} deg)"
        yield Problem("path", f"waypoints_m[{index}]", list(path.waypoints_m[index]), text)
        return
    arcs = np.concatenate(([0.0], path.turn_radius_m * np.tan(np.abs(turns) / 2), [0.0]))
    for index, leg in enumerate(legs):
        need = arcs[index] + arcs[index + 1]
        if leg < need - 1e-9:
            text = f"leg of {leg:.3g} m is too short for its arcs, must be at least {need:.3g} m (or turn tighter)"
            yield Problem("path", f"waypoints_m[{index}]", list(path.waypoints_m[index]), text)
    depths = corners[:, 2][:, None] + points[:, 2]
    for index, row in enumerate(depths):
        if row.min() < limits.depth_min_m or row.max() > limits.depth_max_m:
            key, value = (
                ("origin_m", path.origin_m)
                if index == 0
                else (f"waypoints_m[{index - 1}]", path.waypoints_m[index - 1])
            )
            text = (
                f"points reach from {row.min():.3g} to {row.max():.3g} m depth, "
                f"must be from {limits.depth_min_m:g} to {limits.depth_max_m:g} m (limits.depth_min_m, depth_max_m)"
            )
            yield Problem("path", key, list(value), text)


# How far the path turns at each inner corner (W - 1,), rad, positive to starboard.
def _turns(path: PathConfig) -> NDArray[np.float64]:
    legs = np.diff(path.corners()[:, :2], axis=0)
    headings = np.arctan2(legs[:, 1], legs[:, 0])
    return np.asarray((np.diff(headings) + np.pi) % (2 * np.pi) - np.pi)
