"""Whole groups in point dynamics, each vehicle deciding alone: do they fill the formation, and at what travel?"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment

from companion.scene import Phase
from tests.companion.formation.swarm import SPEED, Swarm, mission, starts


def least_travel(swarm: Swarm) -> float:
    points = swarm.minds[0].virtual.at(0.0).points
    ways = np.linalg.norm(points[:, None] - swarm.positions[None], axis=2)
    return float(ways[linear_sum_assignment(ways)].sum())


@pytest.mark.parametrize(
    ("count", "reach", "seeds", "at_most"),
    [
        (6, math.inf, 16, 1.01),
        (6, 20.0, 16, 1.01),
        (6, 10.0, 16, 1.08),
        (15, math.inf, 2, 1.01),
        (15, 20.0, 3, 1.05),
        (15, 10.0, 3, 1.25),
    ],
)
def test_every_start_becomes_a_formation(count: int, reach: float, seeds: int, at_most: float) -> None:
    travel = optimum = 0.0
    for seed in range(seeds):
        swarm = Swarm(mission(count), starts(seed, count), seed, reach, sigma=0.1 * (seed % 2))
        optimum += least_travel(swarm)
        assert swarm.run(150.0), f"start {seed}: points left empty after {swarm.now:.0f} s"
        travel += float(swarm.lengths.sum())
    assert 1.0 <= travel / optimum <= at_most


def test_detections_that_drop_out_do_no_harm() -> None:
    for seed in range(6):
        swarm = Swarm(mission(6), starts(seed, 6), seed, 10.0, sigma=0.05, missed=0.1)
        assert swarm.run(150.0), f"start {seed}"


@pytest.mark.parametrize("reach", [math.inf, 20.0, 10.0])
def test_vehicles_that_cannot_hover_fill_the_formation_and_keep_their_points(reach: float) -> None:
    for seed in range(3):
        swarm = Swarm(mission(6), starts(seed, 6), seed, reach, sigma=0.1, hover=False)
        assert swarm.run(90.0), f"start {seed}"
        swarm.run(15.0, lambda: False)
        held = [decision.point for decision in swarm.decisions if decision is not None]
        for _ in range(60):
            swarm.step()
            assert [decision.point for decision in swarm.decisions if decision is not None] == held
            assert swarm.filled()


def test_it_travels_a_corner_as_one_and_nobody_changes_points() -> None:
    swarm = Swarm(
        mission(6, waypoints_m=((20.0, 0.0), (20.0, 20.0)), pace_mps=0.3, turn_radius_m=10.0),
        starts(2, 6),
        2,
        20.0,
        sigma=0.05,
        hover=False,
    )
    assert swarm.run(100.0)
    swarm.run(130.0 - swarm.now, lambda: False)
    held = [decision.point for decision in swarm.decisions if decision is not None]
    errors = []
    while (decision := swarm.decisions[0]) is not None and decision.phase is Phase.TRAVEL:
        swarm.step()
        assert [each.point for each in swarm.decisions if each is not None] == held
        errors.append([each.tracking_error or 0.0 for each in swarm.decisions if each is not None])
    assert np.max(errors) < 3.0
    assert swarm.filled()


def test_a_vehicle_that_dies_on_its_way_is_replaced_by_the_spare() -> None:
    """Seven for six points; one dies under way and drifts with the current: it must not keep its point empty."""
    for seed in range(4):
        seven = replace(mission(6), vehicles=7)
        seven = replace(seven, formation=replace(seven.formation, point_count=6))
        places = np.vstack((starts(seed, 6), [[13.0, 13.0, 2.0]]))
        swarm = Swarm(seven, places, seed, 20.0, sigma=0.05, current=(0.05, 0.0, 0.0))
        swarm.run(3.0, lambda: False)
        errors = [decision.tracking_error or 0.0 for decision in swarm.decisions if decision is not None]
        swarm.dead.add(int(np.argmax(errors)))
        assert swarm.run(60.0), f"start {seed}"


def test_same_seed_same_swim() -> None:
    runs = []
    for _ in range(2):
        swarm = Swarm(mission(6), starts(5, 6), 5, 10.0, sigma=0.1)
        swarm.run(60.0)
        runs.append((swarm.now, swarm.positions.tobytes(), swarm.lengths.tobytes()))
    assert runs[0] == runs[1]


def test_som_forms_up_as_well_when_everybody_sees_everybody() -> None:
    filled = sum(Swarm(mission(6, "som"), starts(seed, 6), seed).run(90.0) for seed in range(4))
    assert filled == 4


def test_no_point_is_reached_faster_than_a_vehicle_swims() -> None:
    swarm = Swarm(mission(6), starts(1, 6), 1)
    assert swarm.run(60.0)
    assert swarm.lengths.max() <= SPEED * swarm.now + 1e-9
