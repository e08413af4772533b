"""The paper's experiments, each once, for a picture: what is swum in Figs 4, 5, 6 and 8 and in the published case."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from companion.formation import SomSettings, organise
from companion.formation.virtual import VirtualFormation
from companion.mission import FormationConfig, Mission, PathConfig, TransformConfig
from sim.baselines import LeaderFollower, assign, distances
from sim.paper import printed
from sim.paper.trace import Trace, by_steps, record
from sim.points import Conditions, Swarm, forming_mission, random_starts
from sim.run import run
from sim.scenario import load_scenario

Array = NDArray[np.float64]

SEED = 4
CONDITIONS = Conditions(sensing_range=20.0, sigma=0.05)
START_M = np.array((12.0, 12.0, 0.0))  # of the formation's centre, and the middle of the box of starts
FORMING_S = 40.0

# Fig. 4: two obstacles (north, east, radius) leave a gap on the way that a triangle does not fit through.
OBSTACLES_M = ((33.5, 18.0, 7.0), (18.0, 33.5, 7.0))
GAP_M = 25.0  # north and east of its middle
NARROW_M = ((4.0, 1.5), (4.0, -1.5), (0.0, 1.5), (0.0, -1.5), (-4.0, 1.5), (-4.0, -1.5))
NARROW_AT_M, WIDE_AT_M = 0.0, 24.0  # of the centre's way

FAULT_STEP_M = printed.STEPS_M[1]
FAULT_WAIT_S = 40.0  # until the spare comes
FAULT_PACE_MPS = 0.25
SPARE_M = np.array((2.0, 16.0, 0.0))  # where the spare enters the water, from where the centre formed


def basin_mission(*waypoints: tuple[float, float], pace: float = 0.3, vehicles: int = 6) -> Mission:
    """Six points in one corner of the basin that travel through the waypoints without turning, as in eq 9."""
    return forming_mission(
        6,
        vehicles=vehicles,
        forming_s=FORMING_S,
        origin_m=(*START_M[:2], 2.0),
        heading_deg=45.0,
        waypoints_m=waypoints,
        pace_mps=pace,
        turn=False,
    )


def basin_starts(seed: int) -> Array:
    """Random starts (6, 3) m about the place of forming."""
    places: Array = random_starts(seed, 6) + START_M
    return places


def transformation_mission() -> Mission:
    """Fig. 4: triangle, two files through the gap, triangle again, in formation coordinates of heading 45 deg."""
    narrow = TransformConfig(shape="points", points_m=NARROW_M, at_m=NARROW_AT_M)
    wide = TransformConfig(shape="triangle", at_m=WIDE_AT_M)
    mission = basin_mission((GAP_M, GAP_M), (39.0, 39.0))
    agile = replace(mission.limits, steerage_speed_mps=0.05)  # points may all but stand while others pass them
    return replace(mission, transform=(narrow, wide), limits=agile)


def transformation(seed: int = SEED) -> Trace:
    """Fig. 4."""
    mission = transformation_mission()
    swarm = Swarm(mission, basin_starts(seed), seed, CONDITIONS)
    return record(swarm, VirtualFormation(mission).end_s + 5.0)


def clearance(trace: Trace) -> float:
    """Least distance of a vehicle's centre from an obstacle, m."""
    away = [
        np.hypot(trace.positions[:, :, 0] - north, trace.positions[:, :, 1] - east).min() - radius
        for north, east, radius in OBSTACLES_M
    ]
    return float(min(away))


def tracking(step_m: float | None, until_s: float = 125.0, seed: int = SEED) -> Trace:
    """Fig. 5: the way in steps of |dT|, taken as soon as all points are reached within D_min; or, None, smoothly."""
    mission = basin_mission((25.0, 20.0), (39.0, 39.0), pace=0.4)
    if step_m is None:
        return record(Swarm(mission, basin_starts(seed), seed, CONDITIONS), until_s)
    mission = replace(mission, path=replace(mission.path, step_m=3.0))  # lambda of Table I
    swarm = Swarm(mission, basin_starts(seed), seed, CONDITIONS)
    stepped = by_steps(swarm, step_m)
    return record(swarm, until_s, lambda swarm: stepped.jump() if swarm.filled(0.1) else None)


@dataclass(frozen=True, slots=True)
class Fault:
    """Fig. 6: what a team did whose vehicle `broken` stopped at `broken_s`; the spare came at `spare_s`."""

    trace: Trace
    broken: int
    broken_s: float
    spare_s: float
    chain: tuple[int | None, ...]


def fault(fixed: bool, seed: int = SEED) -> Fault:
    """Fig. 6: ten steps after the start of travel the vehicle on point 1 breaks, which leads two others in a chain."""
    mission = basin_mission((25.0, 20.0), (39.0, 39.0), pace=FAULT_PACE_MPS, vehicles=7)
    virtual = VirtualFormation(mission)
    begun = origin = virtual.at(FORMING_S).points.mean(axis=0)
    broken_s = FORMING_S
    while np.linalg.norm(virtual.at(broken_s).points.mean(axis=0) - begun) < printed.STEPS_TO_FAULT * FAULT_STEP_M:
        broken_s += 0.1
    spare_s = broken_s + FAULT_WAIT_S
    places = np.vstack((basin_starts(seed), origin + SPARE_M))
    kind = LeaderFollower if fixed else Swarm
    swarm = kind(mission, places, seed, CONDITIONS)
    swarm.absent.add(6)
    broken: list[int] = []

    def happen(swarm: Swarm) -> None:
        if swarm.now >= broken_s - 1e-9 and not broken:
            broken.extend(i for i, decision in enumerate(swarm.decisions) if decision and decision.point == 1)
            swarm.dead.update(broken)
        if swarm.now >= spare_s - 1e-9:
            swarm.absent.discard(6)

    trace = record(swarm, virtual.end_s + 30.0, happen)
    chain = LeaderFollower(mission, places, seed).leaders
    return Fault(trace, broken[0], broken_s, spare_s, chain)


@dataclass(frozen=True, slots=True)
class Voyage:
    """One run in full dynamics: its trace, the water, and its figures."""

    trace: Trace
    current_mps: tuple[float, float]
    travel_s: float
    tracking_rms_m: float
    separation_m: float
    forming_ratio: float
    whole: bool


def voyage(seed: int, make: str = "native", until_s: float | None = None) -> tuple[Voyage, tuple[float, float]]:
    """Fig. 8 in full dynamics: the firmware on simulated hulls; with it, mean and sd of the lengths of the team."""
    scenario = load_scenario("paper", seed)
    if until_s is not None:
        scenario = replace(scenario, config=replace(scenario.config, duration_s=until_s))
    outcome = run(scenario, make, threads=1)
    history, grade = outcome.history, outcome.grade(scenario)
    keep = slice(None, None, 5)
    trace = Trace(history.time[keep], history.position[keep], history.points[keep], history.decided[keep])
    schedule, water = scenario.mission.schedule, scenario.config.water
    begun = schedule.start_s + schedule.forming_s
    lengths = journey_lengths(trace, history.travelled[keep], begun, scenario.config.criteria.arrival_radius_m)
    figures = Voyage(
        trace,
        (water.north_mps, water.east_mps),
        begun,
        grade.tracking_rms_m if grade.tracking_rms_m is not None else float("nan"),
        grade.min_separation_m if grade.min_separation_m is not None else float("nan"),
        grade.forming_ratio if grade.forming_ratio is not None else float("nan"),
        grade.points_filled == scenario.mission.vehicles,
    )
    return figures, (float(lengths.mean()), float(lengths.std()))


def journey_lengths(trace: Trace, travelled: Array, begun_s: float, within_m: float) -> Array:
    """Way (J,) m of each vehicle to the point it travels with, the rest included, and from the start of travel on.

    A hull cannot stand still: what it swims in circles on its point while it waits for the others is no part of it.
    """
    start = trace.at(begun_s)
    errors = trace.errors()[: start + 1]
    lengths = travelled[-1] - travelled[start]
    for i in range(travelled.shape[1]):
        inside = np.flatnonzero((errors[:, i] <= within_m) & (trace.held[: start + 1, i] == trace.held[start, i]))
        arrival = int(inside[0]) if len(inside) else start
        lengths[i] += travelled[arrival, i] + np.nan_to_num(errors[arrival, i])
    return np.asarray(lengths)


@dataclass(frozen=True, slots=True)
class Case:
    """The published case: Shoal and fixed roles through it, and what Algorithm 1 makes of its starts."""

    trace: Trace
    lengths: Array
    fixed: Array
    optimum: float
    forming: float
    sweeps: int
    printed_arrived: int
    repaired_arrived: int


def case_mission() -> Mission:
    """Six points of a triangle with x to the east, moved twenty times without turning."""
    points = np.array([(y, x) for x, y in printed.CASE_POINTS])
    centre = points.mean(axis=0)
    corners = centre + np.cumsum([(dy, dx) for dx, dy in printed.CASE_MOVES], axis=0)
    mission = forming_mission(6, forming_s=FORMING_S)
    return replace(
        mission,
        formation=FormationConfig(shape="points", points_m=tuple(map(tuple, points.tolist()))),
        path=PathConfig(
            origin_m=(float(centre[0]), float(centre[1]), 2.0),
            heading_deg=0.0,
            waypoints_m=tuple(map(tuple, corners.tolist())),
            pace_mps=0.4,
            turn_radius_m=1.0,
            turn=False,
        ),
    )


def published_case(seed: int = SEED) -> Case:
    """Runs it in point dynamics, with everybody in sight and no noise, as there."""
    mission = case_mission()
    starts = np.array([(y, x, 2.0) for x, y in printed.CASE_VEHICLES])
    virtual = VirtualFormation(mission)
    points = virtual.at(0.0).points
    ways = distances(points, starts)
    optimum = float(ways[np.arange(6), assign(points, starts)].sum())
    swarm, team = Swarm(mission, starts, seed), LeaderFollower(mission, starts, seed)
    swarm.run(FORMING_S)
    forming = float(swarm.lengths.sum() + np.nansum(swarm.rest()))
    swarm = Swarm(mission, starts, seed)
    trace = record(swarm, virtual.end_s + 5.0)
    record(team, virtual.end_s + 5.0)
    settings = SomSettings(
        gain=printed.CASE_GAIN,
        radius_m=printed.CASE_RADIUS_M,
        breadth_m=printed.CASE_BREADTH_M,
        decay=printed.CASE_DECAY,
        max_sweeps=printed.CASE_SWEEPS,
    )
    as_printed = replace(settings, neighbours_follow=True, one_win_a_sweep=False, workload_weights=True)
    outcomes = [organise(points, starts, each, seed) for each in (as_printed, settings)]
    arrived = [sum(winner >= 0 for winner in outcome.winner) for outcome in outcomes]
    return Case(trace, swarm.lengths, team.lengths, optimum, forming, printed.CASE_SWEEPS, arrived[0], arrived[1])
