"""The distributed competition, rule by rule: how a vehicle finds its own point from what it sees, without any message.

Vehicles share the mission and the clock. Each sees itself and those within range, does not know who they are, and
imagines their decisions by making them with the same rules. Each rule is a pure function of what it is given. Rule 7,
motion, is guidance's. Positions are (north, east, down) tuples of floats, m: at this size faster than arrays.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from math import dist

from companion.formation.auction import auction
from companion.formation.tuning import Tuning
from companion.scene import Neighbour, Scene

Point = tuple[float, float, float]

FAR_M = 2e3  # a longer way costs no more: keeps every cost finite
FORBIDDEN = math.inf  # cost of a way not to be taken unless there is no other


@dataclass(frozen=True, slots=True)
class Rival:
    """A vehicle as a competitor: its position and two sigmas of it, m."""

    position: Point
    margin: float


@dataclass(frozen=True, slots=True)
class Senses:
    """What rule 1 says: this vehicle, the others in no order that matters, the water, and how far sight reaches, m."""

    me: Rival
    others: tuple[Rival, ...]
    current: Point
    sight: float


def sense(scene: Scene, tuning: Tuning) -> Senses | None:
    """Rule 1, sense: the own position and the vehicles seen, each once; None when the own position is unknown."""
    own = scene.own
    position = None if own is None else _point(own.position.tolist())
    if own is None or position is None:
        return None
    sigma = _sigma(own.sigma, tuning)
    seen = sorted(filter(None, (_rival(other, tuning) for other in scene.neighbours)), key=lambda r: r.position)
    others: list[Rival] = []
    for rival in seen:
        if dist(rival.position, position) >= tuning.duplicate_m and not _is_double(rival, others, tuning.duplicate_m):
            others.append(rival)
    reach = scene.sensing_range if scene.sensing_range > 0.0 else 0.0
    return Senses(
        Rival(position, tuning.near_sigmas * sigma),
        tuple(others),
        _point(own.current.tolist()) or (0.0, 0.0, 0.0),
        reach - tuning.sight_sigmas * sigma,
    )


@dataclass(frozen=True, slots=True)
class Look:
    """Where vehicles were seen at an earlier time, s."""

    time: float
    positions: tuple[Point, ...]


def dead(
    rival: Rival, now: float, looks: Sequence[Look], points: Sequence[Point], current: Point, tuning: Tuning
) -> bool:
    """Rule 2, dead: a vehicle on no point that only drifted for a while; competing, it keeps a point empty."""
    if not looks or now - looks[0].time < tuning.dead_window_s:
        return False
    if _nearest(rival.position, points)[1] <= tuning.occupied_m + rival.margin:
        return False
    x, y, z = rival.position
    for look in looks:
        age = now - look.time
        origin = (x - current[0] * age, y - current[1] * age, z - current[2] * age)
        drift = tuning.dead_speed_mps * age + rival.margin
        if not any(dist(origin, position) <= drift for position in look.positions):
            return False
    return True


@dataclass(frozen=True, slots=True)
class Memory:
    """Of each point: when a vehicle was last seen on it (None: it is free), and how often in a row it looked empty."""

    occupied: tuple[float | None, ...]
    empty: tuple[int, ...]

    @staticmethod
    def blank(count: int) -> Memory:
        """All points free, none looked at."""
        return Memory((None,) * count, (0,) * count)


def remember(memory: Memory, now: float, senses: Senses, points: Sequence[Point], tuning: Tuning) -> Memory:
    """Rule 3, memory: a point out of sight is as last seen, else vehicles would set out for points long taken."""
    occupied, empty = list(memory.occupied), list(memory.empty)
    certain = senses.sight - tuning.circling_m
    for i, point in enumerate(points):
        if any(dist(point, other.position) <= tuning.occupied_m + other.margin for other in senses.others):
            occupied[i], empty[i] = now, 0
        elif dist(point, senses.me.position) <= certain:
            empty[i] += 1
            if empty[i] >= tuning.empty_looks:
                occupied[i] = None
        else:
            empty[i] = 0
    return Memory(tuple(occupied), tuple(empty))


def candidates(
    memory: Memory, now: float, senses: Senses, points: Sequence[Point], vehicles: int, tuning: Tuning
) -> list[int]:
    """Rule 4, candidates: all points but those taken by somebody out of sight, but one for each vehicle in sight."""
    certain = senses.sight - tuning.circling_m
    taken = [
        (time, i)
        for i, time in enumerate(memory.occupied)
        if time is not None and time < now and dist(points[i], senses.me.position) > certain
    ]
    if not taken:
        return list(range(len(points)))
    taken.sort()
    forgotten = max(vehicles - (len(points) - len(taken)), 0)
    excluded = {i for _, i in taken[forgotten:]}
    return [i for i in range(len(points)) if i not in excluded]


def cost_row(
    rival: Rival,
    mine: int | None,
    calm: bool,
    senses: Senses,
    points: Sequence[Point],
    chosen: Sequence[int],
    tuning: Tuning,
) -> list[float]:
    """Rule 5, cost: d^p, less for my own point (`mine`) while it is far, forbidden for who would leave a point unseen.

    In a `calm`, points beyond sight all cost the same.
    """
    ways = [dist(rival.position, points[i]) for i in chosen]
    longest = min(FAR_M, max(senses.sight, 0.0)) if calm else FAR_M
    row = [min(way, longest) ** tuning.exponent for way in ways]
    if mine is not None and mine in chosen:
        at = chosen.index(mine)
        if tuning.hysteresis_beyond_m < ways[at] < longest:
            row[at] = (ways[at] - tuning.hysteresis_m) ** tuning.exponent
    home, away = _nearest(rival.position, points)
    if away <= tuning.parked_m + rival.margin:
        # Where on its circle a vehicle happens to be says nothing about which point is the better for it.
        if home in chosen:
            at = chosen.index(home)
            row[at] = (tuning.parked_share * ways[at]) ** tuning.exponent
        # A vehicle that left its point for one that others do not see would fill one hole and open another.
        for at, i in enumerate(chosen):
            if i != home and max(ways[at], dist(points[i], senses.me.position)) > senses.sight:
                row[at] = FORBIDDEN
    return row


def compete(costs: Sequence[Sequence[float]], me: int, chosen: Sequence[int], rank: Sequence[int]) -> int | None:
    """Rule 6, compete: the point that vehicle `me` wins in the price form, None if there are too few.

    `costs` are one row for each vehicle, `rank` is the points' order of presentation. Team-mates out of sight cost the
    same everywhere: the auction leaves vacant, at no cost, as many points as there are of them.
    """
    presented = sorted(range(len(chosen)), key=lambda at: rank[chosen[at]])
    dearest = 1.0 + len(costs) * max((cost for row in costs for cost in row if cost < FORBIDDEN), default=0.0)
    rows = [[min(cost, dearest) for cost in row] for row in zip(*costs, strict=True)]
    winner = auction(rows, order=presented).winner
    return chosen[winner.index(me)] if me in winner else None


def _nearest(position: Point, points: Sequence[Point]) -> tuple[int, float]:
    ways = [dist(position, point) for point in points]
    nearest = min(ways)
    return ways.index(nearest), nearest


# Whether one of `others`, sorted by north, is the same hull.
def _is_double(rival: Rival, others: Sequence[Rival], duplicate: float) -> bool:
    for other in reversed(others):
        if rival.position[0] - other.position[0] >= duplicate:
            return False
        if dist(rival.position, other.position) < duplicate:
            return True
    return False


def _rival(other: Neighbour, tuning: Tuning) -> Rival | None:
    position = _point(other.position.tolist())
    if position is None or not other.age <= tuning.age_limit_s:
        return None
    return Rival(position, tuning.near_sigmas * _sigma(other.sigma, tuning))


def _point(values: list[float]) -> Point | None:
    if len(values) == 3 and all(map(math.isfinite, values)):
        return (values[0], values[1], values[2])
    return None


def _sigma(sigma: float, tuning: Tuning) -> float:
    return sigma if 0.0 <= sigma < tuning.sigma_limit_m else tuning.sigma_limit_m
