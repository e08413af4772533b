"""Campaign `travel`: whole journeys with path lengths as in Table II, Shoal beside leader-follower, same seeds."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from companion.formation import VirtualFormation
from companion.mission import Mission, TransformConfig
from sim.baselines import LeaderFollower
from sim.campaign import Campaign, Cell, Limit, at_least, at_most, least, mean, ratio, share
from sim.points import Conditions, Swarm, box_width, forming_mission, random_starts

Array = NDArray[np.float64]

SIGHT_M = 20.0
SIGMA_M = 0.05
PACE_MPS = 0.28  # the outermost point of 15 keeps under 0.5 m/s in the turn
TURN_RADIUS_M = {6: 12.0, 15: 15.0}
WAY_M = {6: 58.5, 15: 70.5}  # of the centre: with forming in the middle of the box as long as the paper's mean
FORMING_S = 150.0  # enough for fixed roles, which take longest
ASIDE_M = 5.0  # between the box of a displaced start and the centre of the formation
LIMIT_S = 300.0  # for forming, or for closing up after the journey
TRACE_S = 0.2
TRANSFORMS = (TransformConfig(shape="diamond", at_m=5.0), TransformConfig(shape="triangle", at_m=30.0))


@dataclass(frozen=True, slots=True)
class Method:
    """A way to form and travel: fixed roles, or a form of the competition with its exponent and how far it must see."""

    title: str
    key: str
    form: str = "price"
    exponent: float = 1.2
    fixed: bool = False
    sight: float = SIGHT_M


FIXED = Method("fixed roles", "fixed", fixed=True)
SOM = Method("`som`", "som", form="som", sight=math.inf)
PRICE = Method("`price`, p = 1.2", "price")
EVEN = Method("`price`, p = 2", "even", exponent=2.0)
METHODS = (FIXED, SOM, PRICE, EVEN)


@dataclass(frozen=True, slots=True)
class Journey:
    """Who travels where: so many vehicles, a bend of the way in degrees, whether the formation turns or transforms."""

    count: int
    displaced: bool = False
    bend_deg: float = 45.0
    turn: bool = False
    transform: bool = False

    def mission(self, method: Method, forming_s: float = FORMING_S) -> Mission:
        """A way with one bend half-way; a displaced start shortens it, so that lengths stay comparable."""
        radius, bend = TURN_RADIUS_M[self.count], math.radians(self.bend_deg)
        way = WAY_M[self.count] - (box_width(self.count) if self.displaced else 0.0)
        leg = (way + radius * (2.0 * math.tan(bend / 2.0) - bend)) / 2.0
        mission = forming_mission(
            self.count,
            method.exponent,
            method.form,
            forming_s=forming_s,
            waypoints_m=((leg, 0.0), (leg + leg * math.cos(bend), leg * math.sin(bend))),
            pace_mps=PACE_MPS,
            turn_radius_m=radius,
            turn=self.turn,
        )
        if not self.transform:
            return mission
        # Points may all but stand while others pass them: these vehicles need no steerage way.
        agile = replace(mission.limits, steerage_speed_mps=0.05)
        return replace(mission, transform=TRANSFORMS, limits=agile)

    def starts(self, seed: int) -> Array:
        """Random places (J, 3) m in a box about the formation, or beside it."""
        aside = box_width(self.count) + ASIDE_M if self.displaced else 0.0
        moved: Array = random_starts(seed, self.count) - np.array((0.0, aside, 0.0))
        return moved


@dataclass(frozen=True, slots=True)
class Swum:
    """What each vehicle swam (J,) m, rest included, whether the formation was whole, and the least separation, m."""

    lengths: Array
    whole: bool
    separation: float


def swim(journey: Journey, method: Method, seed: int, full: bool) -> Swum:
    """One journey, swum in `full` or until the formation stands; then the way of its point is still added for each.

    What is left between a vehicle and its point at the end counts too, so that a generous radius gains nothing.
    """
    kind = LeaderFollower if method.fixed else Swarm
    mission = journey.mission(method, FORMING_S if full else 2.0 * LIMIT_S)
    group = kind(mission, journey.starts(seed), seed, Conditions(method.sight, SIGMA_M))
    if full:
        group.run(group.minds[0].virtual.end_s, lambda: False)
    whole = group.run(LIMIT_S)
    lengths = group.lengths + np.nan_to_num(group.rest())
    if not full:
        ahead = ways(mission)
        held = [decision.point if decision is not None else None for decision in group.decisions]
        lengths = lengths + [0.0 if point is None else ahead[point] for point in held]
    return Swum(lengths, whole, group.separation)


def ways(mission: Mission) -> Array:
    """How far each point travels (L,) m."""
    virtual = VirtualFormation(mission)
    begun = mission.schedule.start_s + mission.schedule.forming_s
    times = np.linspace(begun, virtual.end_s, math.ceil((virtual.end_s - begun) / TRACE_S) + 2)
    trace = np.array([virtual.at(time).points for time in times])
    return np.asarray(np.linalg.norm(np.diff(trace, axis=0), axis=2).sum(axis=0))


def run(journey: Journey, full: bool, seed: int) -> Mapping[str, float]:
    """All methods from the same start: mean and standard deviation of the lengths of a team."""
    sample: dict[str, float] = {}
    swums = {method.key: swim(journey, method, seed, full) for method in METHODS}
    for key, swum in swums.items():
        sample |= {f"{key} mean": float(swum.lengths.mean()), f"{key} sd": float(swum.lengths.std())}
    sample["whole"] = float(all(swum.whole for swum in swums.values()))
    sample["separation"] = min(swum.separation for swum in swums.values())
    return sample


FIGURES = (
    share("all whole", "whole"),
    *(mean(f"mean, {method.title} (m)", f"{method.key} mean") for method in METHODS),
    *(mean(f"sd, {method.title} (m)", f"{method.key} sd") for method in METHODS),
    *(ratio(f"sd of {method.title} over fixed roles'", f"{method.key} sd", "fixed sd") for method in METHODS[1:]),
    ratio(f"mean of {EVEN.title} over fixed roles'", "even mean", "fixed mean"),
    least("least separation (m)", "separation"),
)
EVENNESS = f"sd of {EVEN.title} over fixed roles'"
COST = f"mean of {EVEN.title} over fixed roles'"


def _asked(count: int, turn: bool) -> dict[str, Limit]:
    lower = {(6, False): 0.35, (15, False): 0.45, (6, True): 0.25, (15, True): 0.15}[count, turn]
    return {"all whole": at_least(1.0), EVENNESS: at_most(1.0 - lower), COST: at_most(1.0)}


def _cells() -> list[Cell]:
    cells = []
    kinds = [
        ("translation", False, 45.0, False),
        ("translation", True, 45.0, False),
        ("turning by 45 deg", False, 45.0, True),
        ("turning by 45 deg", True, 45.0, True),
        ("turning by 90 deg", False, 90.0, True),
    ]
    for count, many, some, few in ((6, 300, 100, 20), (15, 50, 12, 3)):
        for title, displaced, bend, turn in kinds:
            journey = Journey(count, displaced, bend, turn)
            name = f"J = {count}, {'displaced' if displaced else 'centred'}, {title}"
            cells.append(Cell(name, partial(run, journey, False), some if displaced else many, _asked(count, turn)))
            if not displaced and bend < 90.0:
                cells.append(Cell(f"{name}, in full", partial(run, journey, True), few, _asked(count, turn)))
    return cells


CAMPAIGN = Campaign(
    name="travel",
    title="Whole journeys: lengths of Shoal and of leader-follower",
    text=(
        "Vehicles form a triangle from random starts, in a box over the place of the formation (centred) or beside it "
        "(displaced), and travel a way with one bend, with or without turning. Path lengths are those of the paper's "
        "Table II: about 64 m for 6 vehicles, 77 m for 15. All methods swim from the same starts in the same water: "
        "point dynamics at up to 0.5 m/s, neighbours seen within 20 m (`som`: all of them, which it needs) with 0.05 m "
        "of noise an axis. Lengths are "
        "integrated until each vehicle reaches its point, and the rest is added; sd is the standard deviation within "
        "a team. A vehicle that has reached its point travels with it: the way of its point is added for the journey, "
        "and the cases \"in full\" swim every metre of it instead. Limits are asked of p = 2, the most even exponent. "
        "Where the formation turns, the ways of its own points differ, the more the further it turns, and the "
        "competition knows only the ways to them; the displaced box lies outside the bend, where the longest ways to "
        "come are those of the vehicles with the longest ways to go."
    ),
    figures=FIGURES,
    cells=_cells(),
)  # fmt: skip
