"""The tables of the report on the paper: forms of the competition, Table II, the potential field, full dynamics."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from companion.formation import FORMS as FORMS_OF_COMPETITION
from companion.formation import VirtualFormation, compete
from sim.baselines import LeaderFollower, PotentialField, assign, distances
from sim.baselines.assignment import hungarian
from sim.campaign import Campaign, Cell, least, mean, ratio, share
from sim.campaign.travel import METHODS, Journey
from sim.campaign.travel import run as run_journey
from sim.paper.experiments import CONDITIONS, voyage
from sim.points import Motion, Mover, Swarm, forming_mission, random_starts

Array = NDArray[np.float64]

FORMS = {
    "least total (Hungarian)": ("hungarian", 1.0),
    "least squares": ("least squares", 1.0),
    "bottleneck": ("bottleneck", 1.0),
    "greedy": ("greedy", 1.0),
    "`price`, p = 1.2": ("price", 1.2),
    "`price`, p = 2": ("price", 2.0),
    "`som`": ("som", 1.0),
    "`paper`, as printed": ("paper", 1.0),
    "fixed roles": ("fixed", 1.0),
}
AT_SEA = "`price`, p = 1.2, at sea"
STARTS_A_SEED = 10  # where nobody has to swim
FORMING_FIGURES = (
    share("all points filled", "whole"),
    ratio("travel / optimum", "total", "optimum"),
    mean("sd (m)", "sd"),
    mean("longest (m)", "longest"),
)
NOT_WHOLE = {"whole": 0.0}
LIMIT_S = 150.0


def form(count: int, name: str, exponent: float, seed: int) -> Mapping[str, float]:
    """Straight ways to the points that one form of the competition gives to vehicles that all see all."""
    points = VirtualFormation(forming_mission(count)).at(0.0).points
    ways = distances(points, random_starts(seed, count))
    rows = np.arange(count)
    if name == "fixed":
        chosen = rows
    elif name in FORMS_OF_COMPETITION:
        winner = compete(points, random_starts(seed, count), name, exponent, seed).vehicle
        chosen = np.array([-1 if vehicle is None else vehicle for vehicle in winner])
    else:
        chosen = assign(points, random_starts(seed, count), name)
    return _forming(ways[rows, chosen], ways) if (chosen >= 0).all() else NOT_WHOLE


def form_at_sea(count: int, seed: int) -> Mapping[str, float]:
    """Ways really swum by vehicles that see 20 m far, with noise, and give way to each other."""
    swarm = Swarm(forming_mission(count), random_starts(seed, count), seed, CONDITIONS)
    ways = distances(swarm.points, swarm.positions)
    whole = swarm.run(LIMIT_S)
    return _forming(swarm.lengths + np.nan_to_num(swarm.rest()), ways) if whole else NOT_WHOLE


def _forming(lengths: Array, ways: Array) -> Mapping[str, float]:
    optimum = float(ways[np.arange(len(ways)), hungarian(ways)].sum())
    total, longest = float(lengths.sum()), float(lengths.max())
    return {"whole": 1.0, "total": total, "optimum": optimum, "sd": float(lengths.std()), "longest": longest}


def forms(counts: Sequence[int], seeds: int) -> Campaign:
    """Forming alone, from random starts."""
    cells = [
        Cell(f"J = {count}, {title}", partial(form, count, *which), STARTS_A_SEED * seeds)
        for count in counts
        for title, which in FORMS.items()
    ]
    cells += [Cell(f"J = {count}, {AT_SEA}", partial(form_at_sea, count), fewer(seeds, count)) for count in counts]
    return Campaign("forms", "Forms of the competition", "", FORMING_FIGURES, cells)


CASES: dict[str, dict[str, Any]] = {
    "centred, translation": {},
    "displaced, translation": {"displaced": True},
    "centred, turning by 45 deg": {"turn": True},
    "centred, transforming": {"transform": True},
}
LENGTH_FIGURES = tuple(
    figure
    for method in METHODS
    for figure in (mean(f"{method.key} mean", f"{method.key} mean"), mean(f"{method.key} sd", f"{method.key} sd"))
)


def journeys(counts: Sequence[int], seeds: int) -> Campaign:
    """The cases of Table II."""
    cells = [
        Cell(f"J = {count}, {title}", partial(run_journey, Journey(count, **options), False), fewer(seeds, count))
        for count in counts
        for title, options in CASES.items()
    ]
    return Campaign("journeys", "Table II", "", LENGTH_FIGURES, cells)


MOVERS: dict[str, Callable[[float, float, np.random.Generator], Mover]] = {
    "half-planes": Motion,
    "potential field": PotentialField,
    "potential field, half as strong": partial(PotentialField, strength=0.5),
    "potential field, a tenth as strong": partial(PotentialField, strength=0.1),
}
MOTION_FIGURES = (
    share("under 1 m", "near"),
    least("least separation (m)", "separation"),
    share("whole", "whole"),
    mean("time to whole (s)", "time", ".1f"),
    mean("mean length (m)", "length"),
)


def move(count: int, fixed: bool, mover: str, seed: int) -> Mapping[str, float]:
    """Forming, with a way of keeping clear of each other."""
    kind = LeaderFollower if fixed else Swarm
    swarm = kind(forming_mission(count), random_starts(seed, count), seed, CONDITIONS, MOVERS[mover])
    whole = swarm.run(LIMIT_S)
    return {
        "near": float(swarm.separation < 1.0),
        "separation": swarm.separation,
        "whole": float(whole),
        "time": swarm.now if whole else np.nan,
        "length": float((swarm.lengths + np.nan_to_num(swarm.rest())).mean()) if whole else np.nan,
    }


def motions(counts: Sequence[int], seeds: int) -> Campaign:
    """Half-planes against the potential field, for Shoal and for roles whose ways cross."""
    cells = [
        Cell(f"J = {count}, {who}, {mover}", partial(move, count, who != "Shoal", mover), fewer(seeds, count))
        for count in counts
        for who in ("Shoal", "fixed roles")
        for mover in MOVERS
    ]
    return Campaign("motions", "Motion among others", "", MOTION_FIGURES, cells)


def sail(make: str, seed: int) -> Mapping[str, float]:
    """The basin in full dynamics."""
    run, (length, spread) = voyage(seed, make)
    return {
        "mean": length,
        "sd": spread,
        "rms": run.tracking_rms_m,
        "separation": run.separation_m,
        "filled": float(run.whole),
    }


VOYAGE_FIGURES = (
    share("all points filled", "filled"),
    mean("mean length (m)", "mean"),
    mean("sd (m)", "sd"),
    mean("tracking error, steady (m RMS)", "rms", ".3f"),
    least("hull to hull, least (m)", "separation"),
)


def voyages(seeds: int) -> Campaign:
    """Full dynamics, in a tenth of the seeds."""
    cells = [Cell("six vehicles, native firmware", partial(sail, "native"), max(seeds // 10, 1))]
    return Campaign("voyages", "Full dynamics", "", VOYAGE_FIGURES, cells)


def fewer(seeds: int, count: int) -> int:
    """Seeds of a case: a third for large groups, whose vehicles think of many others."""
    return seeds if count <= 6 else max(seeds // 3, 1)
