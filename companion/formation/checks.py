"""What must hold between the settings of a mission, told with what to change; and what is worth a warning."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from companion.config import Problem
from companion.formation import transform
from companion.formation.timetable import RAMP_S, permitted_speed
from companion.formation.transform import TransformError
from companion.formation.virtual import VirtualFormation
from companion.mission import DECISION_PERIOD_S, Mission, PathConfig

Array = NDArray[np.float64]

_TOLERANCE = 1e-3  # m/s or m: rounding of a worked-out journey
_SHARPEST_DEG = 170.0  # turn of a path at a corner


def problems(mission: Mission) -> Iterator[Problem]:
    """What makes it impossible to fly the mission, each setting being good by itself."""
    points = mission.points()
    if mission.vehicles < len(points):
        yield Problem("", "vehicles", mission.vehicles, f"must be at least the number of points ({len(points)})")
    for key in ("slower", "faster"):
        named = getattr(mission.formation, key)
        if max(named, default=0) >= len(points):
            yield Problem("formation", key, list(named), f"must hold numbers of points, from 0 to {len(points) - 1}")
    limits, path = mission.limits, mission.path
    if limits.steerage_speed_mps >= limits.top_speed_mps:
        text = f"must be under top_speed_mps ({limits.top_speed_mps:g} m/s)"
        yield Problem("limits", "steerage_speed_mps", limits.steerage_speed_mps, text)
    if path.waypoints_m and path.pace_mps > limits.top_speed_mps:
        text = f"must be at most limits.top_speed_mps ({limits.top_speed_mps:g} m/s)"
        yield Problem("path", "pace_mps", path.pace_mps, text)
    safe, most = limits.safe_length_m, limits.max_length_m
    if safe is not None and most is not None and safe > most:
        yield Problem("limits", "safe_length_m", safe, f"must be at most max_length_m ({most:g} m)")
    bent = list(_path_problems(path))
    yield from bent
    try:
        yield from _distance_problems(mission)
        if bent:
            return
        virtual = VirtualFormation(mission)
    except TransformError as error:
        config = mission.transform[error.index]
        value = getattr(config, error.key)
        yield Problem(
            f"transform[{error.index}]", error.key, list(value) if error.key == "points_m" else value, error.text
        )
        return
    yield from _journey_problems(mission, virtual)


def warnings(mission: Mission) -> Iterator[Problem]:
    """What can be flown but hardly be meant, of a mission without problems."""
    virtual = VirtualFormation(mission)
    survey = _survey(virtual, mission)
    limits = mission.limits
    length = _forming_length(mission) + survey.length
    if limits.safe_length_m is not None and length > limits.safe_length_m:
        text = f"vehicles may have to travel {length:.0f} m ({_lengths(mission, survey)}), further than is safe (S)"
        yield Problem("limits", "safe_length_m", limits.safe_length_m, text)
    slowest, fastest = survey.slowest - limits.current_mps, survey.fastest + limits.current_mps
    in_current = f" through water in limits.current_mps = {limits.current_mps:g}" if limits.current_mps else ""
    if slowest < limits.steerage_speed_mps - _TOLERANCE and math.isfinite(slowest):
        text = (
            f"a point slows down to {max(slowest, 0.0):.2f} m/s{in_current} at {survey.slowest_s:.0f} s, "
            f"{survey.slowest_m:.0f} m along the path; vehicles keep steerage way only from "
            f"{limits.steerage_speed_mps:g} m/s on: turn wider, bring points nearer or travel faster"
        )
        yield Problem("path", "pace_mps", mission.path.pace_mps, text)
    if limits.current_mps and fastest > limits.top_speed_mps + _TOLERANCE:
        text = f"a point goes up to {fastest:.2f} m/s{in_current}, vehicles no more than {limits.top_speed_mps:g} m/s"
        yield Problem("limits", "top_speed_mps", limits.top_speed_mps, text)
    for index, span in enumerate(virtual.spans):
        if span.stands and span.last > span.first:
            config = mission.transform[index]
            text = "the formation stands while it transforms, with points slower than steerage way: do it on the way"
            yield Problem(f"transform[{index}]", "at_s", config.at_s, text)


# Points must leave room between vehicles, and a step must not carry a point half-way to its neighbour, in every shape
# and on the way from one to the next.
def _distance_problems(mission: Mission) -> Iterator[Problem]:
    shapes = transform.shapes(mission)
    least, safe, step = math.inf, mission.limits.safe_distance_m, mission.path.step_m
    for index, new in enumerate(shapes):
        config = mission.transform[index - 1] if index else mission.formation
        section = f"transform[{index - 1}]" if index else "formation"
        key, value = ("points_m", list(config.points_m)) if config.points_m else ("spacing_m", config.spacing_m)
        stood, first, second = transform.nearest(new, new)
        old = new if not index or mission.transform[index - 1].jump else shapes[index - 1]
        near = transform.nearest(old, new)[0] if stood >= safe else stood
        least = min(least, near)
        if stood < safe - 1e-9:
            text = f"points {first} and {second} are {stood:.3g} m apart, must be at least limits.safe_distance_m"
            yield Problem(section, key, value, f"{text} ({safe:g} m)")
        elif near < safe - 1e-9:
            text = f"points come within {near:.3g} m of each other on the way, must be at least limits.safe_distance_m"
            yield Problem(section, key, value, f"{text} ({safe:g} m): space them wider, or let them jump")
    if step >= least / 2:
        text = f"must be under half the distance of the nearest points ({least / 2:.3g} m), else vehicles swap points"
        yield Problem("path", "step_m", step, text)


# Corners must lie apart, the path must not turn back, and every leg must hold the arcs of its two corners.
def _path_problems(path: PathConfig) -> Iterator[Problem]:
    legs = np.diff(path.corners()[:, :2], axis=0)
    lengths = np.linalg.norm(legs, axis=1)

    def problem(index: int, text: str) -> Problem:
        return Problem("path", f"waypoints_m[{index}]", list(path.waypoints_m[index]), text)

    if (lengths <= 1e-6).any():
        yield problem(int(np.argmax(lengths <= 1e-6)), "must lie away from the corner before it (path too short)")
        return
    if path.curve != "legs":
        return
    headings = np.arctan2(legs[:, 1], legs[:, 0])
    turns = np.abs((np.diff(headings) + np.pi) % (2 * np.pi) - np.pi)
    if len(turns) and turns.max() > math.radians(_SHARPEST_DEG):
        index = int(turns.argmax())
        text = f"must not turn the path by more than 170 deg (it does by {math.degrees(turns[index]):.0f} deg)"
        yield problem(index, text)
        return
    arcs = np.concatenate(([0.0], path.turn_radius_m * np.tan(turns / 2), [0.0]))
    for index, leg in enumerate(lengths):
        need = arcs[index] + arcs[index + 1]
        if leg < need - 1e-9:
            text = f"leg of {leg:.3g} m is too short for its arcs, must be at least {need:.3g} m"
            yield problem(index, f'{text} (or turn tighter, or curve = "spline")')


# Depths, speeds and lengths of the journey as it will be.
def _journey_problems(mission: Mission, virtual: VirtualFormation) -> Iterator[Problem]:
    limits, path, survey = mission.limits, mission.path, _survey(virtual, mission)
    yield from _depth_problems(mission, virtual)
    if virtual.steepest > limits.slope_max + _TOLERANCE:
        text = f"must be at least the steepest slope of the path ({virtual.steepest:.2g}): make that more level"
        yield Problem("limits", "slope_max", limits.slope_max, text)
    permitted = permitted_speed(mission)
    if survey.fastest > permitted + _TOLERANCE:
        text = (
            f"the outer point goes {survey.fastest:.3g} m/s in a turn, {survey.fastest_m:.0f} m along the path, "
            f"however slow the centre, must be at most {permitted:.3g} m/s: turn wider or bring points nearer"
        )
        yield Problem("path", "turn_radius_m", path.turn_radius_m, text)
    if survey.fastest * DECISION_PERIOD_S > path.step_m:
        text = f"must be at least the way of the fastest point in {DECISION_PERIOD_S:g} s"
        yield Problem("path", "step_m", path.step_m, f"{text} ({survey.fastest * DECISION_PERIOD_S:.3g} m)")
    length = _forming_length(mission) + survey.length
    if limits.max_length_m is not None and length > limits.max_length_m:
        text = (
            f"must be at least what a vehicle may have to travel, {length:.0f} m ({_lengths(mission, survey)}): "
            "shorten the path, or lower limits.forming_length_m if they form in less"
        )
        yield Problem("limits", "max_length_m", limits.max_length_m, text)


# Every point must stay within the depths allowed: told of the corner, or of the transformation that takes it out.
def _depth_problems(mission: Mission, virtual: VirtualFormation) -> Iterator[Problem]:
    limits, path = mission.limits, mission.path
    low, high, worst, done, centre = math.inf, -math.inf, _TOLERANCE, 0.0, np.zeros(3)
    for stretch in virtual.stretches():
        tops, bottoms = stretch.points[..., 2].min(axis=1), stretch.points[..., 2].max(axis=1)
        low, high = min(low, float(tops.min())), max(high, float(bottoms.max()))
        excess = np.maximum(limits.depth_min_m - tops, bottoms - limits.depth_max_m)
        at = int(excess.argmax())
        if excess[at] > worst:
            worst, done, centre = float(excess[at]), float(stretch.done[at]), stretch.points[at].mean(axis=0)
    if worst <= _TOLERANCE:
        return
    allowed = f"must be from {limits.depth_min_m:g} to {limits.depth_max_m:g} m (limits.depth_min_m, depth_max_m)"
    text = f"points reach from {low:.3g} to {high:.3g} m depth, {allowed}"
    if done > 0.0:
        index = math.ceil(done) - 1
        yield Problem(f"transform[{index}]", "shape", mission.transform[index].shape, text)
        return
    corner = int(np.linalg.norm(path.corners() - centre, axis=1).argmin())
    key, value = (f"waypoints_m[{corner - 1}]", path.waypoints_m[corner - 1]) if corner else ("origin_m", path.origin_m)
    yield Problem("path", key, list(value), text)


@dataclass(slots=True)
class _Survey:
    """A journey's extremes: `length` is the longest way of a point, jumps included, m; speeds m/s, places m, times s.

    Slow points count only where the formation is under way: not as it gains speed, stops or stands.
    """

    length: float = 0.0
    fastest: float = 0.0
    fastest_m: float = 0.0
    slowest: float = math.inf
    slowest_m: float = 0.0
    slowest_s: float = 0.0


def _survey(virtual: VirtualFormation, mission: Mission) -> _Survey:
    survey = _Survey()
    ways, centre = np.zeros(virtual.shapes.shape[1]), 0.0
    begin = mission.schedule.start_s + mission.schedule.forming_s + RAMP_S
    end = virtual.travel_end_s - RAMP_S
    last: Array | None = None
    for stretch in virtual.stretches():
        points = stretch.points if last is None else np.concatenate((last[None], stretch.points))
        steps = np.diff(points, axis=0)
        ways += np.sqrt((steps * steps).sum(axis=2)).sum(axis=0)
        along = np.cumsum(np.linalg.norm(steps.mean(axis=1), axis=1))
        along = centre + (along if last is not None else np.concatenate(((0.0,), along)))
        centre, last = float(along[-1]), stretch.points[-1]
        speeds = np.sqrt((stretch.velocities**2).sum(axis=2))
        most = speeds.max(axis=1)
        if most.max() > survey.fastest:
            survey.fastest, survey.fastest_m = float(most.max()), float(along[most.argmax()])
        least = np.where((stretch.times > begin) & (stretch.times < end), speeds.min(axis=1), math.inf)
        if least.min() < survey.slowest:
            at = int(least.argmin())
            survey.slowest, survey.slowest_m, survey.slowest_s = (
                float(least[at]),
                float(along[at]),
                float(stretch.times[at]),
            )
    survey.length = float(ways.max())
    return survey


def _forming_length(mission: Mission) -> float:
    limits, forming_s = mission.limits, mission.schedule.forming_s
    return limits.top_speed_mps * forming_s if limits.forming_length_m is None else limits.forming_length_m


def _lengths(mission: Mission, survey: _Survey) -> str:
    return f"{survey.length:.0f} m with the formation and {_forming_length(mission):.0f} m of forming"
