"""Grades a run: lengths, separations, times and tracking errors of a history, and a verdict on each criterion."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from companion.scene import Phase
from sim.forming import ways
from sim.history import Array, History
from sim.scenario import CriteriaConfig


@dataclass(frozen=True, slots=True)
class Verdict:
    """One criterion: what was measured, what was asked for, both as text, and whether it holds."""

    name: str
    measured: str
    required: str
    holds: bool


@dataclass(frozen=True, slots=True)
class Ticks:
    """How the firmware of a fleet kept its time: its longest tick, s, and how many ticks were missed."""

    worst_s: float
    missed: int


@dataclass(frozen=True, slots=True)
class Grade:
    """Figures of a run; None where the run never came to what a figure measures.

    Lengths are metres over ground from the start of the run to its end. `tracking_rms_m` is the distance to the point
    that each vehicle decided for, `tracking_best_rms_m` that of the matching with the least sum of distances, both
    over all vehicles and all samples of steady travel. `forming_ratio` is the way swum until each vehicle reached its
    point, rest included, over the least possible sum of straight ways, `forming_ratio_hull` over the least sum of what
    hulls can swim that must turn from the headings they start with (`sim.forming`).
    """

    points_filled: int
    collisions: int
    min_separation_m: float | None
    mean_length_m: float
    sd_length_m: float
    forming_time_s: float | None
    forming_ratio: float | None
    forming_ratio_hull: float | None
    tracking_rms_m: float | None
    tracking_best_rms_m: float | None
    tracking_max_m: float | None
    verdicts: tuple[Verdict, ...]

    @property
    def success(self) -> bool:
        """Whether every criterion holds."""
        return all(verdict.holds for verdict in self.verdicts)


def grade(
    history: History,
    criteria: CriteriaConfig,
    start_s: float,
    failures: Mapping[int, str] | None = None,
    ticks: Ticks | None = None,
) -> Grade:
    """Figures and verdicts of a history; `start_s` is the start of forming by the mission's clock.

    `failures` tells why firmware or companion of a vehicle (number) ended before the run did; any is a miss, and so is
    a tick that the firmware missed.
    """
    matched = match_points(history)
    steady = steady_travel(history, criteria.settling_s)
    decided_error = history.tracking_error()[steady]
    points = history.points.shape[1]
    filled = points_filled(history, matched, criteria)
    collisions = count_collisions(history.separation, criteria.separation_m)
    separation = float(np.min(history.separation)) if history.separation.size else None
    lengths = history.travelled[-1]
    forming_time = forming_end(history, matched, criteria, start_s)
    formed = ways(history, criteria.arrival_radius_m, start_s, forming_time)
    tracking = _rms(decided_error)
    wanted = points if criteria.points_filled is None else criteria.points_filled
    verdicts = [
        Verdict("points filled", f"{filled} of {points}", f"at least {wanted}", filled >= wanted),
        Verdict(
            "collisions",
            f"{collisions} (closest hulls {_spell(separation, 'm')})",
            f"at most {criteria.collisions} under {criteria.separation_m:g} m",
            collisions <= criteria.collisions,
        ),
    ]
    if criteria.forming_time_s is not None:
        holds = forming_time is not None and forming_time <= criteria.forming_time_s
        verdicts.append(
            Verdict("forming time", _spell(forming_time, "s"), f"at most {criteria.forming_time_s:g} s", holds)
        )
    if criteria.tracking_rms_m is not None:
        wanted_holders = min(points, history.position.shape[1])  # spares hold none
        holders = np.isfinite(decided_error).sum(axis=1)
        undecided = int(np.sum(np.maximum(wanted_holders - holders, 0)))
        holds = tracking is not None and tracking <= criteria.tracking_rms_m and undecided == 0
        measured = _spell(tracking, "m RMS") + (f", {undecided} samples without a point" if undecided else "")
        verdicts.append(Verdict("tracking error", measured, f"at most {criteria.tracking_rms_m:g} m RMS", holds))
    if failures:
        text = "; ".join(f"vehicle {vehicle}: {cause}" for vehicle, cause in sorted(failures.items()))
        verdicts.append(Verdict("programs", text, "all run to the end", False))
    if ticks is not None:
        measured = f"{ticks.missed} missed, the longest {1e3 * ticks.worst_s:.1f} ms"
        verdicts.append(Verdict("firmware ticks", measured, "none missed", ticks.missed == 0))
    best = matched[steady]
    return Grade(
        points_filled=filled,
        collisions=collisions,
        min_separation_m=separation,
        mean_length_m=float(np.mean(lengths)),
        sd_length_m=float(np.std(lengths)),
        forming_time_s=forming_time,
        forming_ratio=None if formed is None else _over(formed.swum_m, formed.straight_m),
        forming_ratio_hull=None if formed is None else _over(formed.swum_m, formed.hull_m),
        tracking_rms_m=tracking,
        tracking_best_rms_m=_rms(best),
        tracking_max_m=float(np.nanmax(decided_error)) if np.isfinite(decided_error).any() else None,
        verdicts=tuple(verdicts),
    )


def match_points(history: History) -> Array:
    """Distance (T, L) m of each point to the vehicle of its own, by the matching with the least sum at each time."""
    out = np.full(history.points.shape[:2], np.inf)
    for k, (points, position) in enumerate(zip(history.points, history.position, strict=True)):
        distance = np.linalg.norm(points[:, None] - position[None], axis=2)
        rows, columns = linear_sum_assignment(distance)
        out[k, rows] = distance[rows, columns]
    return out


def steady_travel(history: History, settling_s: float) -> NDArray[np.bool_]:
    """Mask (T,) of the samples in travel, the first `settling_s` seconds of it left out."""
    travel = history.during(Phase.TRAVEL)
    if not travel.any():
        return travel
    begun = float(history.time[travel][0])
    return travel & np.asarray(history.time >= begun + settling_s)


def points_filled(history: History, matched: Array, criteria: CriteriaConfig) -> int:
    """How many points have a vehicle of their own all through the last `hold_s` of travel, or of a run without any."""
    travel = history.during(Phase.TRAVEL)
    phase, radius = (travel, criteria.fill_radius_m) if travel.any() else (~travel, criteria.arrival_radius_m)
    last = phase & (history.time >= history.time[phase][-1] - criteria.hold_s)
    return int(np.sum(np.all(matched[last] <= radius, axis=0)))


def count_collisions(separation: Array, limit: float) -> int:
    """How many times a pair of hulls came nearer than `limit` m; separation (T, P) m. Staying near counts once."""
    near = separation < limit
    if not near.size:
        return 0
    return int(np.sum(near[0]) + np.sum(near[1:] & ~near[:-1]))


def forming_end(history: History, matched: Array, criteria: CriteriaConfig, start_s: float) -> float | None:
    """Seconds from the start of forming to the first moment from which on all points stay filled for `hold_s`."""
    time = history.time
    if not matched.shape[1] or time[-1] < start_s:
        return None
    good = np.all(matched <= criteria.arrival_radius_m, axis=1) & (time >= start_s)
    since = np.inf
    for now, whole in zip(time, good, strict=True):
        since = min(since, float(now)) if whole else np.inf
        if now - since >= criteria.hold_s - 1e-9:
            return since - start_s
    return None


def _over(way: float, optimum: float) -> float | None:
    return way / optimum if optimum > 0.0 else None


def _rms(errors: Array) -> float | None:
    known = errors[np.isfinite(errors)]
    return float(np.sqrt(np.mean(known**2))) if known.size else None


def _spell(value: float | None, unit: str) -> str:
    return "never" if value is None else f"{value:.2f} {unit}"
