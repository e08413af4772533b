"""The price form of the competition: a SOM whose winners pay, which is Bertsekas' auction, with its certificate.

Each point in turn is presented to the vehicles. The winner is the vehicle with the least cost plus price; its price
rises by as much as the second best is worse, plus epsilon (a conscience: DeSieno 1988), and the point that it held
before is presented again. At the end every point has the vehicle that is best for it at these prices, within epsilon,
so the total is within L epsilon of the least possible one (Bertsekas 1988), in whatever order the points came.

Plain floats: for a handful of vehicles one row of an array costs more than the whole row in a list.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from heapq import heappush, heapreplace
from operator import add

EPSILON = 1e-5  # least rise of a price, in units of the cost (m^p): far below any noise, far above rounding
_RESOLUTION = 1e-12  # least rise of a price as a share of the dearest cost: floats tell no finer steps apart for sure
_COARSENING = 100.0  # each round of bidding is finer by this, so that a price war ends in few bids
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


def auction(
    costs: Sequence[Sequence[float]],
    seats: Sequence[int] | None = None,
    order: Sequence[int] | None = None,
    epsilon: float = EPSILON,
) -> Auction:
    """Assigns each of L points to one of the columns, each of which has room for `seats[j]` points (1 when None).

    `costs` (L rows of J finite numbers, none below 0) are what each column asks for each point. Seats may outnumber
    points: empty ones are filled with points that cost nothing. Points may outnumber seats: those whose absence makes
    the rest cheapest get -1. `order` is the order of presentation, which decides only between equals.
    """
    count = len(costs)
    columns = len(costs[0]) if count else 0
    room = list(seats) if seats is not None else [1] * columns
    if not count or not sum(room):
        return Auction((-1,) * count, (0.0,) * columns, 0.0, 0.0)
    rows = [list(row) for row in costs]
    spare = sum(room) - count
    rows += [[0.0] * columns] * spare
    if spare < 0:
        room.append(-spare)
        for row in rows:
            row.append(0.0)
    presented = [*(order if order is not None else range(count)), *range(count, len(rows))]
    prices = [0.0] * len(room)
    winner = _bid_from_coarse_to_fine(rows, room, prices, presented, epsilon)
    total = sum(row[j] for row, j in zip(rows, winner, strict=True))
    bound = sum(min(map(add, row, prices)) for row in rows) - sum(p * s for p, s in zip(prices, room, strict=True))
    shown = tuple(j if j < columns else -1 for j in winner[:count])
    return Auction(shown, tuple(prices[:columns]), total, bound)


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
