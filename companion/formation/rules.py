"""The distributed competition, rule by rule: how a vehicle finds its own point from what it sees, without any message.

Vehicles share the mission and the clock. Each sees itself and those within range, does not know who they are, and
imagines their decisions by making them with the same rules. Each rule is a pure function of what it is given. Rule 7,
motion, is guidance's.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from companion.formation.auction import auction
from companion.formation.tuning import Tuning
from companion.scene import Scene

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

FAR_M = 2e3  # a longer way costs no more: keeps every cost finite
FORBIDDEN = math.inf  # cost of a way not to be taken unless there is no other


@dataclass(frozen=True, slots=True)
class Senses:
    """What rule 1 says: the vehicles seen, this one in row `me`, in an order that all vehicles share.

    `positions` (N, 3) m and `margins` (N,) m, two sigmas of them; `current` (3,) m/s; what is nearer than `sight` m is
    seen for sure.
    """

    positions: Array
    margins: Array
    me: int
    current: Array
    sight: float

    def without(self, rows: Mask) -> Senses:
        """The same without some of the others."""
        kept = ~rows
        kept[self.me] = True
        if kept.all():
            return self
        me = int(np.count_nonzero(kept[: self.me]))
        return Senses(self.positions[kept], self.margins[kept], me, self.current, self.sight)

    def known(self, now: float, lingering: Known) -> Known:
        """Those seen now, and those who linger."""
        seen = np.delete(self.positions, self.me, axis=0), np.delete(self.margins, self.me)
        return Known(
            np.vstack((seen[0], lingering.positions)),
            np.concatenate((seen[1], lingering.margins)),
            np.concatenate((np.full(len(seen[1]), now), lingering.times)),
        )

    def joined(self, lingering: Known) -> Senses:
        """The same with those who linger."""
        positions = np.vstack((self.positions, lingering.positions))
        return replace(self, positions=positions, margins=np.concatenate((self.margins, lingering.margins)))


def sense(scene: Scene, tuning: Tuning) -> Senses | None:
    """Rule 1, sense: the own position and the vehicles seen, each once; None when the own position is unknown."""
    own = scene.own
    if own is None or own.position.shape != (3,) or not np.isfinite(own.position).all():
        return None
    sigma = _sigma(own.sigma, tuning)
    others = [
        (*other.position.tolist(), _sigma(other.sigma, tuning))
        for other in scene.neighbours
        if other.position.shape == (3,) and other.age <= tuning.age_limit_s
    ]
    rows = np.array([(*own.position.tolist(), sigma), *others])
    away = own.position - rows[:, :3]
    apart = np.einsum("ij,ij->i", away, away) >= tuning.duplicate_m**2  # false for what is no number
    apart &= np.isfinite(rows).all(axis=1)
    apart[0] = True
    rows = _distinct(rows[apart], tuning.duplicate_m)
    order = np.lexsort(rows[:, 2::-1].T)
    reach = scene.sensing_range if scene.sensing_range > 0.0 else 0.0
    current = own.current if np.isfinite(own.current).all() else np.zeros(3)
    margins = tuning.near_sigmas * rows[order, 3]
    me = int(np.flatnonzero(order == 0)[0])
    return Senses(rows[order, :3], margins, me, current, reach - tuning.aside_m - tuning.sight_sigmas * sigma)


@dataclass(frozen=True, slots=True)
class Known:
    """Vehicles known of (K,): where each was last seen (K, 3) m, how surely m, and when s."""

    positions: Array
    margins: Array
    times: Array

    @staticmethod
    def nobody() -> Known:
        """Not one."""
        return Known(np.empty((0, 3)), np.empty(0), np.empty(0))


def linger(known: Known, now: float, senses: Senses, tuning: Tuning) -> Known:
    """Rule 1, sense: those in plain sight a moment ago and not now, with nobody about: a detection dropped out."""
    if not len(known.times):
        return known
    age = now - known.times
    reach = tuning.top_speed_mps * age
    here = np.delete(senses.positions, senses.me, axis=0)
    near = (reach + 2.0 * known.margins + tuning.duplicate_m)[:, None]  # both places are uncertain
    found = (distances(known.positions, here) <= near).any(axis=1)
    away = distances(known.positions, senses.positions[senses.me, None])[:, 0]
    kept = ~found & (age <= tuning.age_limit_s) & (away <= senses.sight - reach) & (away > tuning.duplicate_m)
    return Known(known.positions[kept], known.margins[kept], known.times[kept])


@dataclass(frozen=True, slots=True)
class Look:
    """Where vehicles were seen at an earlier time, s: others (N, 3) m from `me` (3,) m."""

    time: float
    me: Array
    others: Array


def dead(senses: Senses, now: float, looks: Sequence[Look], ways: Array, tuning: Tuning) -> Mask:
    """Rule 2, dead: a vehicle on no point that only drifted for a while; competing, it keeps a point empty.

    `ways` (N, L) m are those from the vehicles to the points. A look says nothing of a place that was out of sight, but
    the longer half of the while must have been watched.
    """
    still: Mask = np.zeros(len(ways), dtype=bool)
    if not looks or now - looks[0].time < tuning.dead_window_s:
        return still
    doubted = ways.min(axis=1) > tuning.occupied_m + senses.margins
    doubted[senses.me] = False
    rows = np.flatnonzero(doubted)
    watched = np.zeros(len(rows))
    for look in looks:
        if not len(rows):
            return still
        age = now - look.time
        origin = senses.positions[rows] - senses.current * age
        drift = tuning.dead_speed_mps * age + 2.0 * senses.margins[rows]  # both places are uncertain
        there = (distances(origin, look.others) <= drift[:, None]).any(axis=1)
        kept = there | (distances(origin, look.me[None])[:, 0] > senses.sight)
        rows, watched = rows[kept], np.where(there, np.maximum(watched, age), watched)[kept]
    still[rows] = watched >= 0.5 * tuning.dead_window_s
    return still


@dataclass(frozen=True, slots=True)
class Memory:
    """Of each point (L,): when a vehicle was last seen on it (NaN: it is free), and how often in a row it was empty."""

    occupied: Array
    empty: NDArray[np.int_]

    @staticmethod
    def blank(count: int) -> Memory:
        """All points free, none looked at."""
        return Memory(np.full(count, np.nan), np.zeros(count, dtype=int))


def remember(memory: Memory, now: float, senses: Senses, ways: Array, tuning: Tuning) -> Memory:
    """Rule 3, memory: a point out of sight is as last seen, else vehicles would set out for points long taken."""
    taken = ways <= (tuning.occupied_m + senses.margins)[:, None]
    taken[senses.me] = False
    full = taken.any(axis=0)
    looked = ~full & (ways[senses.me] <= senses.sight - tuning.circling_m)
    empty = np.where(looked, memory.empty + 1, 0)
    occupied = np.where(full, now, np.where(empty >= tuning.empty_looks, np.nan, memory.occupied))
    return Memory(occupied, empty)


def candidates(
    memory: Memory, now: float, senses: Senses, ways: Array, mine: int | None, tuning: Tuning
) -> NDArray[np.intp]:
    """Rule 4, candidates: all points but those taken by somebody not seen now; one at least for each vehicle in sight.

    Not seen is who is out of sight, or who was on a point and is nowhere near it now: a detection that dropped out.
    """
    hidden = ways[senses.me] > senses.sight - tuning.circling_m
    gone = tuning.occupied_m + tuning.top_speed_mps * (now - memory.occupied)  # as far as who was there can be by now
    left = ways <= gone + senses.margins[:, None]
    left[senses.me] = False
    taken = (memory.occupied < now) & (hidden | ~left.any(axis=0))
    if mine is not None:
        taken[mine] &= hidden[mine]
    rows = np.flatnonzero(taken)
    forgotten = max(len(senses.positions) - (len(taken) - len(rows)), 0)
    oldest_first = rows[np.argsort(memory.occupied[rows], kind="stable")]
    taken[oldest_first[:forgotten]] = False
    return np.flatnonzero(~taken)


def costs(senses: Senses, ways: Array, mine: int | None, calm: bool, chosen: NDArray[np.intp], tuning: Tuning) -> Array:
    """Rule 5, cost (N, C) of the points chosen: d^p, less for my own point while it is far.

    Forbidden for who would leave a point for one unseen. `mine` is my point so far; in a `calm`, points beyond sight
    all cost the same.
    """
    there = ways[:, chosen]
    longest = min(FAR_M, max(senses.sight, 0.0)) if calm else FAR_M
    effort = np.minimum(there, FAR_M)
    effort[senses.me] = np.minimum(effort[senses.me], longest)
    for own in np.flatnonzero(chosen == (-1 if mine is None else mine)).tolist():
        if tuning.hysteresis_beyond_m < there[senses.me, own] < longest:
            effort[senses.me, own] -= tuning.hysteresis_m
    home = ways.argmin(axis=1)
    parked = ways.min(axis=1) <= tuning.parked_m + senses.margins
    # Where on its circle a vehicle happens to be says nothing about which point is the better for it.
    at_home = parked[:, None] & (chosen == home[:, None])
    effort[at_home] = tuning.parked_share * there[at_home]
    cost: Array = effort**tuning.exponent
    # A vehicle that left its point for one that others do not see would fill one hole and open another.
    unseen = np.maximum(there, ways[senses.me, chosen]) > senses.sight
    cost[parked[:, None] & ~at_home & unseen] = FORBIDDEN
    return cost


def hidden_costs(senses: Senses, ways: Array, chosen: NDArray[np.intp], tuning: Tuning) -> Array:
    """Rule 6, what a team-mate out of sight pays (C,): it is at least as far from a point as the edge of my sight.

    So those in sight fill the points that nobody else can be near to, and leave the ones beyond to others.
    """
    sight = min(senses.sight, FAR_M)
    cost: Array = np.maximum(sight - ways[senses.me, chosen], 0.0) ** tuning.exponent
    return cost


def compete(
    cost: Array, hidden: Array, me: int, chosen: NDArray[np.intp], rank: NDArray[np.intp], points: int
) -> int | None:
    """Rule 6, compete: the place that vehicle `me` wins in the price form, None if there are too few.

    `cost` (N, C) has a row for each vehicle in sight, `hidden` (C,) is the cost of any other; `rank` (L,) is the order
    of presentation of the places. Places from number `points` on are the reserve, for those who find no point.
    """
    presented = np.argsort(rank[chosen], kind="stable")
    finite = cost[cost < FORBIDDEN]
    dearest = 1.0 + len(cost) * float(finite.max(initial=0.0))
    rows = np.minimum(cost, dearest)
    rows[:, chosen >= points] += dearest
    seats = [1] * len(cost)
    if len(chosen) > len(cost):
        rows = np.vstack((rows, hidden))
        seats.append(len(chosen) - len(cost))
    winner = auction(rows.T, seats, presented).winner
    return int(chosen[winner.index(me)]) if me in winner else None


def distances(vehicles: Array, points: Array) -> Array:
    """Ways (N, L) m from vehicles (N, 3) to points (L, 3)."""
    offset = vehicles[:, None] - points
    ways: Array = np.sqrt(np.einsum("ijk,ijk->ij", offset, offset))
    return ways


# The rows whose first three columns are no place of an earlier row, within `spacing` m.
def _distinct(rows: Array, spacing: float) -> Array:
    if len(rows) < 3:
        return rows
    near = distances(rows[:, :3], rows[:, :3]) < spacing
    first = ~np.tril(near, -1).any(axis=1)
    return rows if first.all() else rows[first]


def _sigma(sigma: float, tuning: Tuning) -> float:
    return sigma if 0.0 <= sigma < tuning.sigma_limit_m else tuning.sigma_limit_m
