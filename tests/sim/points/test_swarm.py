"""Whole groups in point dynamics, each vehicle deciding alone: do they fill the formation, at what travel, how near?"""

from __future__ import annotations

import math

import numpy as np
import pytest

from companion.scene import Phase
from sim.baselines import assign, distances
from sim.points import SPEED, Conditions, Swarm, forming_mission, random_starts


def group(seed: int, count: int, form: str = "price", exponent: float = 1.2, **conditions: float) -> Swarm:
    """Vehicles at random about the place of a triangle."""
    sea = Conditions(**conditions)  # type: ignore[arg-type]
    return Swarm(forming_mission(count, exponent, form), random_starts(seed, count), seed, sea)


def least_travel(swarm: Swarm) -> float:
    ways = distances(swarm.points, swarm.positions)
    return float(ways[np.arange(swarm.count), assign(swarm.points, swarm.positions)].sum())


@pytest.mark.parametrize(
    ("count", "reach", "seeds", "at_most"),
    [
        (6, math.inf, 12, 1.01),
        (6, 10.0, 12, 1.06),
        (6, 5.0, 8, 1.3),
        (15, math.inf, 3, 1.02),
        (15, 20.0, 4, 1.04),
        (15, 10.0, 3, 1.2),
    ],
)
def test_every_start_becomes_a_formation(count: int, reach: float, seeds: int, at_most: float) -> None:
    travel = optimum = 0.0
    for seed in range(seeds):
        swarm = group(seed, count, sensing_range=reach, sigma=0.1 * (seed % 3))
        optimum += least_travel(swarm)
        assert swarm.run(300.0), f"start {seed}: points left empty after {swarm.now:.0f} s"
        assert swarm.separation >= 1.0, f"start {seed}"
        travel += float(swarm.lengths.sum() + np.nansum(swarm.rest()))
    assert 1.0 - 1e-9 <= travel / optimum <= at_most


@pytest.mark.parametrize(("reach", "missed", "bias"), [(10.0, 0.1, 0.0), (5.0, 0.1, 0.0), (10.0, 0.0, 0.3)])
def test_bad_sight_costs_ways_but_no_point(reach: float, missed: float, bias: float) -> None:
    for seed in range(2 if bias else 4):
        swarm = group(seed, 15 if bias else 6, sensing_range=reach, sigma=0.1, missed=missed, bias=bias)
        assert swarm.run(300.0), f"start {seed}"
        assert swarm.separation >= 1.0


def test_it_travels_a_corner_as_one_and_nobody_changes_points() -> None:
    mission = forming_mission(
        6, forming_s=60.0, waypoints_m=((20.0, 0.0), (20.0, 20.0)), pace_mps=0.3, turn_radius_m=10.0
    )
    swarm = Swarm(mission, random_starts(2, 6), 2, Conditions(20.0, 0.05))
    assert swarm.run(60.0)
    swarm.run(65.0 - swarm.now, lambda: False)
    held = [decision.point for decision in swarm.decisions if decision is not None]
    while (decision := swarm.decisions[0]) is not None and decision.phase is not Phase.DONE:
        swarm.step()
        assert [each.point for each in swarm.decisions if each is not None] == held
        assert swarm.filled(0.3), f"at {swarm.now:.1f} s"


@pytest.mark.parametrize("count", [6, 15])
def test_a_vehicle_that_dies_on_its_way_is_replaced_by_the_spare(count: int) -> None:
    """It drifts with the current and must neither keep its point empty nor be run into."""
    for seed in range(3):
        places = np.vstack((random_starts(seed, count), [[17.0, 17.0, 2.0]]))
        sea = Conditions(20.0, 0.05, current=(0.05, 0.0, 0.0))
        swarm = Swarm(forming_mission(count, vehicles=count + 1), places, seed, sea)
        swarm.run(3.0, lambda: False)
        swarm.dead.add(int(np.nanargmax(swarm.rest())))
        assert swarm.run(150.0), f"start {seed}"
        assert swarm.separation >= 1.0


def test_same_seed_same_swim() -> None:
    runs = []
    for _ in range(2):
        swarm = group(5, 6, sensing_range=10.0, sigma=0.1, missed=0.1)
        swarm.run(60.0)
        runs.append((swarm.now, swarm.positions.tobytes(), swarm.lengths.tobytes()))
    assert runs[0] == runs[1]


def test_som_forms_up_as_well_when_everybody_sees_everybody() -> None:
    assert all(group(seed, 6, "som").run(90.0) for seed in range(4))


def test_no_point_is_reached_faster_than_a_vehicle_swims() -> None:
    swarm = group(1, 6)
    assert swarm.run(60.0)
    assert swarm.lengths.max() <= SPEED * swarm.now + 1e-9
