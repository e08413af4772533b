"""Campaign swarm: the competition without messages in point dynamics, over group size, range, noise and bad sight."""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from sim.baselines import assign, distances
from sim.campaign.campaign import Campaign, Cell
from sim.campaign.figures import Limit, at_least, at_most, least, ratio, share
from sim.points import SPEED, Conditions, Swarm, forming_mission, random_starts

LIMIT_S = 900.0  # a run that is not done by then has failed
HOLD_S = 5.0  # points must stay filled for so long
EXPONENTS = {6: 1.3, 15: 1.3, 50: 1.2}
SEEDS = {6: 1000, 15: 1000, 50: 200}
RANGES = (math.inf, 20.0, 10.0, 5.0)
TRAVEL = {
    6: (1.005, 1.005, 1.04, 1.15),
    15: (1.006, 1.025, 1.11, 1.28),
    50: (1.006, 1.08, 1.23, 1.48),
}


def form(seed: int, count: int, conditions: Conditions) -> dict[str, float]:
    """One start to one formation: whether it stood, ways and time beside what is possible, and the least distance."""
    starts = random_starts(seed, count)
    swarm = Swarm(forming_mission(count, EXPONENTS[count]), starts, seed, conditions)
    ways = distances(swarm.points, starts)
    rows = np.arange(count)
    filled = swarm.run(LIMIT_S)
    length, time = float(swarm.lengths.sum() + np.nansum(swarm.rest())), swarm.now
    stands = filled and all(_stays(swarm) for _ in range(round(HOLD_S)))
    return {
        "success": stands,
        "travel_m": length if stands else math.nan,
        "optimum_m": float(ways[rows, assign(swarm.points, starts)].sum()),
        "time_s": time if stands else math.nan,
        "bound_s": float(ways[rows, assign(swarm.points, starts, "bottleneck")].max()) / SPEED,
        "separation_m": swarm.separation,
    }


# Whether a second later the points are still filled.
def _stays(swarm: Swarm) -> bool:
    swarm.run(1.0, lambda: False)
    return swarm.filled(1.0)


def _cells() -> list[Cell]:
    cells = []
    for count, limits in TRAVEL.items():
        for reach, limit in zip(RANGES, limits, strict=True):
            for sigma in (0.0, 0.1, 0.2):
                asked: dict[str, Limit] = {
                    "success": at_least(0.999),
                    "travel / optimum": at_most(limit),
                    "closest (m)": at_least(1.0),
                }
                if reach >= 20.0 and count <= 15:
                    asked["time / bound"] = at_most(1.1)
                run = partial(form, count=count, conditions=Conditions(reach, sigma))
                cells.append(Cell(f"J = {count}, r = {reach:g} m, sigma {sigma:g} m", run, SEEDS[count], asked))
    whole = {"success": at_least(0.999), "closest (m)": at_least(1.0)}
    for count in (6, 15):
        for reach in RANGES:
            run = partial(form, count=count, conditions=Conditions(reach, 0.1, missed=0.1))
            cells.append(Cell(f"J = {count}, r = {reach:g} m, 10 % missed", run, 1000, whole))
    biased = {"success": at_least(0.97)}
    run = partial(form, count=15, conditions=Conditions(10.0, 0.1, bias=0.3))
    cells.append(Cell("J = 15, r = 10 m, own position off by 0.3 m an axis", run, 1000, biased))
    return cells


CAMPAIGN = Campaign(
    "swarm",
    "Forming without messages, in point dynamics",
    "Vehicles that see each other within r, with noise of sigma an axis, decide each for itself, twice a second and "
    "in its own time, and go at most 0.5 m/s. Starts are random, at least 2 m apart, in a square of 20 m for 6 "
    "vehicles, 30 m for 15 and 50 m for 50, about a triangle with 5 m between points; exponent p = 1.3, for 50 "
    "vehicles 1.2. A run succeeds when all points are filled within 900 s and stay so for 5 s. Travel is the sum of "
    "ways swum and of what is left to the points, over the least possible sum of straight ways; time is over that of "
    "the bottleneck assignment at top speed. The last rows lose a tenth of all detections, or have each own position "
    "off by a constant that is normal with 0.3 m an axis.",
    [
        share("success", "success"),
        ratio("travel / optimum", "travel_m", "optimum_m", ".4f"),
        ratio("time / bound", "time_s", "bound_s"),
        least("closest (m)", "separation_m"),
    ],
    _cells(),
)
