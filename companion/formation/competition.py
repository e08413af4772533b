"""The three forms of one competition for the points of a formation, by name, as seen by somebody who sees everything.

`paper` is Algorithm 1 as printed, to show what it does; `som` is Algorithm 1 repaired; `price` is the SOM with a
conscience, which is an auction and finds the least total (P + d)^p. Vehicles at sea compete by `rules` instead.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from companion.formation.auction import auction, ways
from companion.formation.som import PAPER, SOM, SomSettings, organise, real, real_lengths

Array = NDArray[np.float64]
FORMS = ("price", "som", "paper")


@dataclass(frozen=True, slots=True)
class Assignment:
    """Who takes which point: vehicle[l] and point[j] are None for nobody and nothing.

    `complete` when as many points are taken as there can be; `length_m` is the sum of the straight ways. `gap` and
    `prices` (J,), price form only, certify the answer: no assignment costs less than this one's cost minus `gap`.
    `exhausted` are vehicles sent further than their max_length (S_max): a finding to act on, not an exclusion.
    """

    vehicle: tuple[int | None, ...]
    point: tuple[int | None, ...]
    complete: bool
    length_m: float
    gap: float | None = None
    prices: tuple[float, ...] = ()
    sweeps: int = 0
    exhausted: tuple[int, ...] = ()


def compete(
    points: Array,
    vehicles: Array,
    form: str = "price",
    exponent: float = 1.2,
    seed: int | tuple[int, ...] = 0,
    travelled: Array | None = None,
    settings: SomSettings | None = None,
    urgency: Array | None = None,
) -> Assignment:
    """Assigns points (L, 3) to vehicles (J, 3), both m in the mission frame; rows that are no places take no part.

    `travelled` (J,) m is P, the lengths so far, and counts toward the cost (P + d)^p; `seed` sets the order in which
    points are presented; `urgency` (L,), below, at or above 0, gives points s, nothing or f in `som` and `paper`
    (eq 8), and changes nothing in who takes which point at the least cost. Raises ValueError for an unknown form.
    """
    if form not in FORMS:
        raise ValueError(f"form = {form!r}: must be one of {', '.join(FORMS)}")
    points = np.asarray(points, dtype=float).reshape(-1, 3)
    vehicles = np.asarray(vehicles, dtype=float).reshape(-1, 3)
    before = np.zeros(len(vehicles)) if travelled is None else real_lengths(np.asarray(travelled, dtype=float))
    base = settings or (PAPER if form == "paper" else SOM)
    if form == "price":
        winner, certificate = _by_price(points, vehicles, exponent, seed, before)
        return _assignment(points, vehicles, winner, before, base, *certificate)
    outcome = organise(points, vehicles, replace(base, exponent=exponent), seed, before, urgency)
    return _assignment(points, vehicles, list(outcome.winner), before, base, sweeps=outcome.sweeps)


def _by_price(
    points: Array, vehicles: Array, exponent: float, seed: int | tuple[int, ...], before: Array
) -> tuple[list[int], tuple[float, tuple[float, ...]]]:
    fit_points, fit_vehicles = np.flatnonzero(real(points)), np.flatnonzero(real(vehicles))
    costs = before[fit_vehicles] + ways(points[fit_points], vehicles[fit_vehicles])
    if exponent != 1.0:
        costs **= exponent
    order = np.random.default_rng(seed).permutation(len(fit_points))
    result = auction(costs, order=order)
    winner = [-1] * len(points)
    for row, column in enumerate(result.winner):
        winner[int(fit_points[row])] = int(fit_vehicles[column]) if column >= 0 else -1
    prices = np.zeros(len(vehicles))
    prices[fit_vehicles] = result.prices if len(fit_points) else 0.0
    return winner, (result.gap, tuple(prices.tolist()))


def _assignment(
    points: Array,
    vehicles: Array,
    winner: list[int],
    before: Array,
    settings: SomSettings,
    gap: float | None = None,
    prices: tuple[float, ...] = (),
    sweeps: int = 0,
) -> Assignment:
    point: list[int | None] = [None] * len(vehicles)
    length = 0.0
    exhausted: list[int] = []
    for index, vehicle in enumerate(winner):
        if vehicle >= 0:
            point[vehicle] = index
            way = float(np.linalg.norm(points[index] - vehicles[vehicle]))
            length += way
            if before[vehicle] + way >= settings.max_length_m:
                exhausted.append(vehicle)
    taken = sum(vehicle >= 0 for vehicle in winner)
    possible = min(int(real(rows).sum()) for rows in (points, vehicles))
    holders = tuple(vehicle if vehicle >= 0 else None for vehicle in winner)
    return Assignment(holders, tuple(point), taken == possible, length, gap, prices, sweeps, tuple(sorted(exhausted)))
