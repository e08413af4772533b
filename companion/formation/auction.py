"""The price form of the competition: a SOM whose winners pay, which is Bertsekas' auction, with its certificate.

Each point in turn is presented to the vehicles. The winner is the vehicle with the least cost plus price; its price
rises by as much as the second best is worse, plus epsilon (a conscience: DeSieno 1988), and the point that it held
before is presented again. At the end every point has the vehicle that is best for it at these prices, within epsilon,
so the total is within L epsilon of the least possible one (Bertsekas 1988), in whatever order the points came.

It runs compiled where kernel.c was built, and as it stands here where not, with the same answer to the bit. Plain
floats: for a handful of vehicles one row of an array costs more than the whole row in a list.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from heapq import heappush, heapreplace
from operator import add

import numpy as np
from numpy.typing import NDArray

from companion.formation import kernel

EPSILON = 1e-4  # least rise of a price, in units of the cost (m^p): far below any noise, far above rounding
_RESOLUTION = 1e-12  # least rise of a price as a share of the dearest cost: floats tell no finer steps apart for sure
_COARSENING = 5.0  # each round of bidding is finer by this, so that a price war ends in few bids
_FIRST_ROUND = 1.0 / 64.0  # step of the first round as a share of the dearest cost
_INFINITY = float("inf")


@dataclass(frozen=True, slots=True)
class Auction:
    """Who won, and the proof: winner[l] is the column of point l, -1 for none; prices[j] >= 0 belong to the columns.

    `total` is the cost of the assignment and `bound` a lower bound of every assignment's (the dual value at these
    prices).
    """

    winner: tuple[int, ...]
    prices: tuple[float, ...]
    total: float
    bound: float

    @property
    def gap(self) -> float:
        """How far from the optimum this assignment can be at most, in units of the cost."""
        return self.total - self.bound


_COMPILED = kernel.load()


def backend() -> str:
    """Which form runs on this machine: "compiled" or "interpreted"."""
    return "interpreted" if _COMPILED is None else "compiled"


def auction(
    costs: Sequence[Sequence[float]] | NDArray[np.float64],
    seats: Sequence[int] | None = None,
    order: Sequence[int] | NDArray[np.int_] | None = None,
    epsilon: float = EPSILON,
) -> Auction:
    """Assigns each of L points to one of the columns, each of which has room for `seats[j]` points (1 when None).

    `costs` (L rows of J finite numbers, none below 0) are what each column asks for each point. Seats may outnumber
    points: empty ones are filled with points that cost nothing. Points may outnumber seats: those whose absence makes
    the rest cheapest get -1. `order` is the order of presentation, which decides only between equals. Raises ValueError
    for a column without a seat.
    """
    if seats is not None and min(seats, default=1) < 1:
        raise ValueError(f"seats = {list(seats)}: must be at least 1 each")
    table = costs if _COMPILED is None else np.array(costs, dtype=float, order="C")
    if _COMPILED is None or not (isinstance(table, np.ndarray) and table.size):
        return interpreted(costs, seats, order, epsilon)
    room = None if seats is None else np.array(seats, dtype=np.int32)
    presented = None if order is None else np.array(order, dtype=np.int32)
    winner, prices, total, bound = _COMPILED.auction(table, room, presented, epsilon, _COARSENING)
    return Auction(tuple(winner), tuple(prices), total, bound)


def ways(points: NDArray[np.float64], vehicles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Straight ways (L, J) m from vehicles (J, 3) to points (L, 3)."""
    if _COMPILED is not None:
        return _COMPILED.ways(points, vehicles)
    away = points[:, None] - vehicles
    lengths: NDArray[np.float64] = np.sqrt(away[..., 0] ** 2 + away[..., 1] ** 2 + away[..., 2] ** 2)
    return lengths


def interpreted(
    costs: Sequence[Sequence[float]] | NDArray[np.float64],
    seats: Sequence[int] | None = None,
    order: Sequence[int] | NDArray[np.int_] | None = None,
    epsilon: float = EPSILON,
) -> Auction:
    """The same as `auction`, in Python."""
    table = costs.tolist() if isinstance(costs, np.ndarray) else costs
    count = len(table)
    columns = len(table[0]) if count else 0
    room = list(seats) if seats is not None else [1] * columns
    if not count or not columns:
        return Auction((-1,) * count, (0.0,) * columns, 0.0, 0.0)
    rows = [list(row) for row in table]
    spare = sum(room) - count
    rows += [[0.0] * columns] * spare
    if spare < 0:
        room.append(-spare)
        for row in rows:
            row.append(0.0)
    presented = [*(map(int, order) if order is not None else range(count)), *range(count, len(rows))]
    prices = [0.0] * len(room)
    winner = _bid_from_coarse_to_fine(rows, room, prices, presented, epsilon)
    total = least = paid = 0.0
    for row, column in zip(rows, winner, strict=True):
        total += row[column]
        least += min(map(add, row, prices))
    for price, places in zip(prices, room, strict=True):
        paid += price * places
    shown = tuple(column if column < columns else -1 for column in winner[:count])
    return Auction(shown, tuple(prices[:columns]), total, least - paid)


# A price war (points alike, too few vehicles alike) climbs by one step a bid: settle it in coarse steps first.
def _bid_from_coarse_to_fine(
    rows: list[list[float]], room: list[int], prices: list[float], presented: list[int], epsilon: float
) -> list[int]:
    dearest = max(map(max, rows))
    epsilon = max(epsilon, dearest * _RESOLUTION)
    step = dearest * _FIRST_ROUND
    while step > epsilon * _COARSENING:
        _bid(rows, room, prices, presented, step)
        step /= _COARSENING
    return _bid(rows, room, prices, presented, epsilon)


# One round of bidding from the given prices, which it raises.
def _bid(rows: list[list[float]], room: list[int], prices: list[float], presented: list[int], step: float) -> list[int]:
    held: list[list[tuple[float, int]]] = [[] for _ in room]  # of each column a heap of (paid, point)
    winner = [-1] * len(rows)
    queue = presented[::-1]
    while queue:
        point = queue.pop()
        values = list(map(add, rows[point], prices))
        best = min(values)
        column = values.index(best)
        values[column] = _INFINITY
        second = min(values)
        rise = second - best + step if second < _INFINITY else step
        paid = (prices[column] + rise, point)
        seats = held[column]
        winner[point] = column
        if len(seats) < room[column]:
            heappush(seats, paid)
        else:
            queue.append(heapreplace(seats, paid)[1])
        if len(seats) == room[column]:
            prices[column] = seats[0][0]
    return winner
