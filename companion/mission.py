"""The mission file: what all vehicles of one swim share, and what it must fulfil before any of them starts."""

from __future__ import annotations

import math
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from companion.config import MISSING, Problem, load
from companion.config.options import option, section
from companion.shapes import SHAPES, centred, tilted

DECISION_PERIOD_S = 0.1  # of every companion: ten decisions a second

SLOWER, FASTER = 0.7, 1.2  # s and f of eq 8: Table I

_OWN_POINTS = "points"


def _own_points() -> Any:
    return option(
        'Points of shape "points": lists of forward, right and, if wanted, down; or the name of a CSV file of them',
        default=(),
        low=-1000.0,
        high=1000.0,
        unit="m",
        lengths=(2, 3),
        csv=True,
    )


def _tilt(meaning: str) -> Any:
    return option(meaning, default=0.0, low=-90.0, high=90.0, unit="deg")


@dataclass(frozen=True, slots=True, kw_only=True)
class FormationConfig:
    """The shape to form, and how vehicles compete for its points."""

    shape: str = option("Shape of the formation", default="triangle", choices=(*SHAPES, _OWN_POINTS))
    point_count: int | None = option(
        "Number of points; as many as vehicles when absent", default=None, low=1, high=1000
    )
    spacing_m: float = option("Distance between neighbouring points", default=5.0, low=1.0, high=100.0, unit="m")
    points_m: tuple[tuple[float, ...], ...] = _own_points()
    pitch_deg: float = _tilt("Tilt of the shape: points ahead lie higher")
    roll_deg: float = _tilt("Tilt of the shape: points to starboard lie deeper")
    form: str = option("Form of the competition", default="price", choices=("price", "som", "paper"))
    exponent: float = option("Exponent p of the cost of a distance", default=1.2, low=1.0, high=2.0)
    slower: tuple[int, ...] = option("Points, from 0, that are to be reached slower (s of eq 8)", default=(), low=0)
    faster: tuple[int, ...] = option("Points, from 0, that are to be reached faster (f of eq 8)", default=(), low=0)
    slower_factor: float = option(
        "s of eq 8: share of the usual approach speed toward slower points", default=SLOWER, above=0.0, high=1.0
    )
    faster_factor: float = option(
        "f of eq 8: the same toward faster points, as far as top speed allows", default=FASTER, low=1.0, high=3.0
    )

    def problems(self) -> Iterator[Problem]:
        """The checks between settings."""
        yield from _own_points_problems(self.shape, self.points_m)
        if self.shape == _OWN_POINTS and self.point_count not in (None, len(self.points_m)):
            must = f"must be absent or the length of points_m ({len(self.points_m)})"
            yield Problem("", "point_count", self.point_count, must)
        for point in sorted(set(self.slower) & set(self.faster)):
            yield Problem("", "faster", list(self.faster), f"point {point} must not be in slower as well")


@dataclass(frozen=True, slots=True, kw_only=True)
class TransformConfig:
    """One change of shape, in the order in which they happen; each needs a place (at_m) or a time (at_s).

    Points go straight to their places in the new shape, all arriving at once; with jump, they are there at once and
    vehicles compete for them anew.
    """

    shape: str = option("Shape that the formation takes", choices=(*SHAPES, _OWN_POINTS))
    spacing_m: float | None = option(
        "Distance between neighbouring points; that of [formation] when absent",
        default=None,
        low=1.0,
        high=100.0,
        unit="m",
    )
    points_m: tuple[tuple[float, ...], ...] = _own_points()
    pitch_deg: float = _tilt("Tilt of the shape: points ahead lie higher")
    roll_deg: float = _tilt("Tilt of the shape: points to starboard lie deeper")
    at_m: float | None = option(
        "Where on its way the formation's centre is when it begins", default=None, low=0.0, high=1e6, unit="m"
    )
    at_s: float | None = option("When it begins by the mission's clock", default=None, low=0.0, high=1e6, unit="s")
    duration_s: float | None = option(
        "How long it takes; as short as the vehicles' speeds allow when absent",
        default=None,
        above=0.0,
        high=86400.0,
        unit="s",
    )
    jump: bool = option("Points jump to the new shape, as in the paper, instead of going there", default=False)

    def problems(self) -> Iterator[Problem]:
        """The checks between settings."""
        yield from _own_points_problems(self.shape, self.points_m)
        if (self.at_m is None) == (self.at_s is None):
            text = "exactly one of at_m (a place on the path) and at_s (a time) must be given"
            yield Problem("", "at_m", MISSING if self.at_m is None else self.at_m, text)
        if self.jump and self.duration_s is not None:
            yield Problem("", "duration_s", self.duration_s, "must be absent where points jump")


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
        "Points of the path after the origin: lists of north, east and, if it changes, down; or the name of a CSV file",
        default=(),
        low=-1e4,
        high=1e4,
        unit="m",
        lengths=(2, 3),
        csv=True,
    )
    curve: str = option(
        "How the path joins its points: straight legs with arcs for corners, or a smooth curve through all of them",
        default="legs",
        choices=("legs", "spline"),
    )
    pace_mps: float = option(
        "Speed of the formation's centre over ground", default=0.35, above=0.0, high=2.0, unit="m/s"
    )
    turn: bool = option("Whether the formation turns with its path; else it keeps its heading", default=True)
    turn_radius_m: float = option(
        "Radius of the centre's arc round a corner of legs", default=12.0, above=0.0, high=1e3, unit="m"
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
    safe_length_m: float | None = option(
        "Safe travelling length of a vehicle (S): a longer mission is warned of",
        default=None,
        above=0.0,
        high=1e7,
        unit="m",
    )
    max_length_m: float | None = option(
        "Maximal travelling length of a vehicle (S_max): a longer mission is refused",
        default=None,
        above=0.0,
        high=1e7,
        unit="m",
    )
    forming_length_m: float | None = option(
        "Way allowed for forming within S and S_max; as far as top speed takes a vehicle in forming_s when absent",
        default=None,
        low=0.0,
        high=1e7,
        unit="m",
    )
    current_mps: float = option(
        "Strongest current expected: points are checked to stay within the vehicles' speeds in it",
        default=0.0,
        low=0.0,
        high=2.0,
        unit="m/s",
    )
    slope_max: float = option(
        "Steepest way of a point: metres up or down for each metre ahead", default=0.12, above=0.0, high=100.0
    )
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
    transform: tuple[TransformConfig, ...] = option("Changes of shape, in the order in which they happen", default=())
    schedule: ScheduleConfig = section("The times of the phases", ScheduleConfig)
    limits: LimitsConfig = section("Abilities and bounds of the vehicles", LimitsConfig)

    def points(self) -> NDArray[np.float64]:
        """Points of the formation (L, 3), m, body of the formation (forward, right, down), about their mean."""
        shape = self.formation
        return _points(shape, shape.point_count or self.vehicles, shape.spacing_m)

    def transformed(self, index: int) -> NDArray[np.float64]:
        """Points as `points`, in the shape's own order, that transformation `index` leads to."""
        shape = self.transform[index]
        return _points(shape, len(self.points()), shape.spacing_m or self.formation.spacing_m)

    def nearest_m(self) -> float:
        """Least distance between two points in any shape of the mission, m; the spacing where there are no two."""
        nearest = self.formation.spacing_m
        for points in (self.points(), *map(self.transformed, range(len(self.transform)))):
            apart = np.linalg.norm(points[:, None] - points[None], axis=2)[~np.eye(len(points), dtype=bool)]
            nearest = min(nearest, float(apart.min(initial=math.inf)))
        return nearest

    def pace_factors(self) -> NDArray[np.float64]:
        """Factor (L,) of the approach speed toward each point: s, 1 or f of eq 8."""
        factors = np.ones(len(self.points()))
        factors[list(self.formation.slower)] = self.formation.slower_factor
        factors[list(self.formation.faster)] = self.formation.faster_factor
        return factors

    def generator(self, vehicle: int, purpose: str) -> np.random.Generator:
        """The random numbers of one vehicle for one purpose, the same on every machine for the same mission."""
        key = (vehicle, zlib.crc32(purpose.encode()))
        return np.random.Generator(np.random.PCG64(np.random.SeedSequence(self.seed, spawn_key=key)))

    def problems(self) -> Iterator[Problem]:
        """The checks between settings: what makes it impossible to fly."""
        from companion.formation.checks import problems  # they work the journey out, and so read missions themselves

        return problems(self)

    def warnings(self) -> Iterator[Problem]:
        """What can be flown but hardly be meant, of a mission without problems."""
        from companion.formation.checks import warnings

        return warnings(self)


def load_mission(path: Path | str) -> Mission:
    """Reads a mission file; raises ConfigError with every problem found in it."""
    return load(Mission, path)


def _points(shape: FormationConfig | TransformConfig, count: int, spacing: float) -> NDArray[np.float64]:
    if shape.shape == _OWN_POINTS:
        points = np.array([(*point, 0.0)[:3] for point in shape.points_m])
    else:
        points = SHAPES[shape.shape](count, spacing)
    return centred(tilted(points, math.radians(shape.pitch_deg), math.radians(shape.roll_deg)))


def _own_points_problems(shape: str, points: tuple[tuple[float, ...], ...]) -> Iterator[Problem]:
    if (shape == _OWN_POINTS) != bool(points):
        must = 'must hold at least one point for shape "points", and be absent for any other shape'
        yield Problem("", "points_m", list(points), must)
