"""Campaign central: the three forms of the competition as seen by somebody who sees everything, against the optimum."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment
from scipy.spatial.distance import cdist

from companion.formation import PAPER, PAPER_TYPICAL, SOM, SomSettings, compete, organise
from companion.formation.auction import auction, interpreted, ways
from companion.shapes import centred, triangle
from sim.campaign.campaign import Campaign, Cell
from sim.campaign.figures import Limit, at_least, at_most, mean, most, quantile, ratio, share
from sim.points import random_starts

Array = NDArray[np.float64]
SPACING_M = 5.0
DEPTHS_M = 10.0  # vehicles start anywhere down to this
REPEATS = 5


def places(seed: int, count: int) -> tuple[Array, Array]:
    """Points of a triangle and as many vehicles (count, 3) m at random round it, in three dimensions."""
    starts = random_starts(seed, count)
    starts[:, 2] = np.random.default_rng((seed, count, 3)).uniform(0.0, DEPTHS_M, count)
    middle = np.array((0.0, 0.0, 0.5 * DEPTHS_M))
    return middle + centred(triangle(count, SPACING_M)), starts


def price(seed: int, count: int) -> dict[str, float]:
    """The price form with p = 1 beside scipy's optimum: sums of ways, certificate, and time with distances included."""
    points, vehicles = places(seed, count)
    ours, theirs = [], []
    for _ in range(REPEATS if count <= 100 else 1):
        begun = time.perf_counter()
        result = auction(ways(points, vehicles))
        middle = time.perf_counter()
        table = cdist(points, vehicles)
        rows, columns = linear_sum_assignment(table)
        ours.append(middle - begun)
        theirs.append(time.perf_counter() - middle)
    optimum = float(table[rows, columns].sum())
    honest = -1e-9 * optimum <= result.total - optimum <= result.gap + 1e-9 * optimum
    sample = {
        "success": honest and sorted(result.winner) == list(range(count)),
        "total": result.total / optimum,
        "gap": result.gap / optimum,
        "ours_us": 1e6 * min(ours),
        "scipy_us": 1e6 * min(theirs),
    }
    if count <= 15:
        begun = time.perf_counter()
        interpreted(ways(points, vehicles))
        sample["python_us"] = 1e6 * (time.perf_counter() - begun)
    return sample


def weighed(seed: int, count: int, exponent: float) -> dict[str, float]:
    """The price form with an exponent: what evenness costs."""
    points, vehicles = places(seed, count)
    table = ways(points, vehicles)
    rows, columns = linear_sum_assignment(table)
    result = compete(points, vehicles, "price", exponent, seed)
    return {"success": result.complete, "total": result.length_m / float(table[rows, columns].sum())}


def organised(seed: int, count: int, settings: SomSettings) -> dict[str, float]:
    """Algorithm 1: whether every point got a vehicle, and the straight ways to them."""
    points, vehicles = places(seed, count)
    outcome = organise(points, vehicles, settings, seed)
    if not outcome.converged or min(outcome.winner) < 0:
        return {"success": 0.0, "total": math.nan}
    table = ways(points, vehicles)
    rows, columns = linear_sum_assignment(table)
    return {"success": 1.0, "total": float(table[rows, list(outcome.winner)].sum() / table[rows, columns].sum())}


REPAIRS = {
    "as printed, Table I for 6": PAPER,
    "as printed, Table I typical": PAPER_TYPICAL,
    "rows of Table I swapped: Go = 5, mu = 0.2": replace(PAPER, breadth_m=SOM.breadth_m, decay=SOM.decay),
    "winner only": replace(PAPER, neighbours_follow=False),
    "one win a sweep": replace(PAPER, one_win_a_sweep=True),
    "winner only, one win a sweep": replace(PAPER, neighbours_follow=False, one_win_a_sweep=True),
}


def _cells() -> list[Cell]:
    cells = []
    for count in (6, 15, 50, 100, 300, 1000):
        asked: dict[str, Limit] = {"success": at_least(1.0), "worst / optimum": at_most(1.0001)}
        if count == 15:
            asked |= {"us (median)": at_most(20.0), "interpreted, us": at_most(1000.0)}
        if count == 1000:
            asked["time / scipy's"] = at_most(0.5)
        cells.append(Cell(f"price, p = 1, J = {count}", partial(price, count=count), 300, asked))
    for count in (6, 15):
        for exponent in (1.2, 1.3, 2.0):
            run = partial(weighed, count=count, exponent=exponent)
            cells.append(Cell(f"price, p = {exponent:g}, J = {count}", run, 1000, {"success": at_least(1.0)}))
    for count in (6, 15):
        run = partial(organised, count=count, settings=SOM)
        cells.append(Cell(f"som, J = {count}", run, 10_000, {"success": at_least(1.0)}))
    for count in (6, 15):
        for name, settings in REPAIRS.items():
            run = partial(organised, count=count, settings=settings)
            cells.append(Cell(f"paper, J = {count}: {name}", run, 500))
    return cells


CAMPAIGN = Campaign(
    "central",
    "The competition as seen by somebody who sees everything",
    "Vehicles start at random about a triangle with 5 m between points, at depths down to 10 m: in a square of 20 m "
    "for 6 of them, 30 m for 15, 50 m for 50 and of the same density beyond. The optimum is that of scipy's "
    "linear_sum_assignment. A price run succeeds when every point has a vehicle of its own and the certificate is "
    "true: the optimum is no further away than the gap that the auction states. Times are those of one run with "
    "distances included on both sides, and of this machine; their ratio is that of the same run.",
    [
        share("success", "success"),
        mean("total / optimum", "total", ".4f"),
        most("worst / optimum", "total", ".6f"),
        most("gap / optimum", "gap", ".1e"),
        quantile("us (median)", "ours_us", 0.5, ".1f"),
        ratio("time / scipy's", "ours_us", "scipy_us", ".2f"),
        quantile("interpreted, us", "python_us", 0.5, ".0f"),
    ],
    _cells(),
)
