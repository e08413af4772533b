"""The three forms of the competition, seen from above: what each finds, how often, and how it can be proven."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from companion.formation import PAPER, SOM, Assignment, SomSettings, compete, organise
from companion.formation.auction import EPSILON, auction
from companion.shapes import centred, triangle
from sim.points import random_starts as starts

Array = NDArray[np.float64]

DEEP = np.array([0.0, 0.0, 2.0])


def ways(points: Array, vehicles: Array) -> Array:
    return np.asarray(np.linalg.norm(points[:, None] - vehicles[None], axis=2))


def least(costs: Array) -> float:
    return float(costs[linear_sum_assignment(costs)].sum())


@pytest.mark.parametrize("exponent", [1.0, 1.2, 2.0])
def test_price_finds_the_optimum_and_proves_it(exponent: float) -> None:
    for case in range(150):
        random = np.random.default_rng(case)
        count = int(random.integers(1, 16))
        points, vehicles = random.uniform(0.0, 30.0, (2, count, 3))
        costs = ways(points, vehicles) ** exponent
        result = compete(points, vehicles, exponent=exponent, seed=case)
        cost = sum(costs[point, vehicle] for point, vehicle in enumerate(result.vehicle) if vehicle is not None)
        assert result.complete
        assert result.gap is not None
        assert -1e-9 <= result.gap <= count * EPSILON * 1.001
        assert cost - result.gap - 1e-6 <= least(costs) <= cost + 1e-9
        assert min(result.prices) >= 0.0


def test_the_order_of_presentation_does_not_matter_to_price() -> None:
    points, vehicles = centred(triangle(15, 5.0)) + DEEP, starts(3, 15)
    answers = {compete(points, vehicles, seed=seed).point for seed in range(20)}
    assert len(answers) == 1


@pytest.mark.parametrize(("points", "vehicles"), [(4, 9), (9, 4), (1, 6), (6, 1)])
def test_price_with_spare_vehicles_and_vacant_points(points: int, vehicles: int) -> None:
    for case in range(30):
        places = np.random.default_rng(case).uniform(0.0, 30.0, (points + vehicles, 3))
        costs = ways(places[:points], places[points:])
        result = compete(places[:points], places[points:], exponent=1.0)
        assert result.complete
        assert result.length_m == pytest.approx(least(costs), abs=1e-3)
        assert result.gap is not None
        assert result.gap <= max(points, vehicles) * EPSILON * 1.001


def test_a_price_war_ends_soon() -> None:
    """All points in a row on one side of all vehicles: every vehicle is as good as the other, for every point."""
    points = np.array([[100.0 + 5.0 * i, 0.0, 2.0] for i in range(15)])
    vehicles = np.array([[-5.0 * i, 0.0, 2.0] for i in range(15)])
    result = compete(points, vehicles, exponent=1.0)
    assert result.complete
    assert result.length_m == pytest.approx(least(ways(points, vehicles)), abs=1e-3)
    even = compete(points, vehicles, exponent=1.2)
    assert even.point == tuple(range(14, -1, -1)), "the foremost vehicle takes the farthest point: all ways alike"


def test_a_column_with_several_seats_takes_several_points() -> None:
    costs = [[1.0, 5.0], [2.0, 5.0], [4.0, 5.0]]
    result = auction(costs, seats=[1, 2])
    assert result.winner == (0, 1, 1)
    assert result.total == pytest.approx(11.0)
    assert result.gap <= 3 * EPSILON


def test_workload_gives_the_far_point_to_the_rested_vehicle() -> None:
    points = np.array([[0.0, 0.0, 2.0], [0.0, 10.0, 2.0]])
    vehicles = np.array([[0.0, 5.0, 2.0], [3.0, 5.0, 2.0]])
    for tired in (0, 1):
        travelled = np.array([40.0, 0.0] if tired == 0 else [0.0, 40.0])
        shifted = vehicles + np.array([0.0, 1.0 if tired == 0 else -1.0, 0.0])
        result = compete(points, shifted, exponent=2.0, travelled=travelled)
        taken = [float(ways(points, shifted)[point, v]) for v, point in enumerate(result.point) if point is not None]
        assert taken[tired] < taken[1 - tired]


def test_som_converges_from_every_start() -> None:
    travel, optimum = 0.0, 0.0
    for count, cases in ((6, 300), (15, 100)):
        points = centred(triangle(count, 5.0)) + DEEP
        for seed in range(cases):
            vehicles = starts(seed, count)
            result = compete(points, vehicles, "som", 1.0, seed)
            assert result.complete, f"{count} vehicles, start {seed}"
            assert result.sweeps <= 16
            travel += result.length_m
            optimum += least(ways(points, vehicles))
    assert 1.08 < travel / optimum < 1.18, "Algorithm 1 repaired reaches every point, but not by the least travel"


def test_paper_as_printed_does_not_converge() -> None:
    for count in (6, 15):
        points = centred(triangle(count, 5.0)) + DEEP
        printed = replace(PAPER, max_sweeps=80)
        complete = [
            compete(points, starts(seed, count), "paper", seed=seed, settings=printed).complete for seed in range(25)
        ]
        assert not any(complete), "G = (1 - mu)^t Go grows with mu = 5, and the group clumps before it can spread"


def test_each_repair_is_needed() -> None:
    """Repaired but for one row: the neighbours that follow, or a neuron that wins many points in a sweep."""
    points = centred(triangle(15, 5.0)) + DEEP
    for broken in (SomSettings(neighbours_follow=True), SomSettings(one_win_a_sweep=False)):
        assert not any(organise(points, starts(seed, 15), broken, seed).converged for seed in range(10))
    assert organise(points, starts(0, 15), SOM, 0).converged


def test_points_in_a_hurry_are_reached_in_fewer_sweeps() -> None:
    points = centred(triangle(6, 5.0)) + DEEP
    vehicles = starts(4, 6)
    sweeps = [
        organise(points, vehicles, SomSettings(slower=0.4, faster=1.8), 4, urgency=np.full(6, urgency)).sweeps
        for urgency in (1, 0, -1)
    ]
    assert sweeps[0] < sweeps[1] < sweeps[2]


def test_a_gain_that_cannot_be_stable_is_refused() -> None:
    for gain, faster in ((2.0, 1.2), (0.0, 1.2), (0.5, 4.1), (math.nan, 1.2)):
        with pytest.raises(ValueError, match="stability of eq 6"):
            SomSettings(gain=gain, faster=faster)


def test_an_unknown_form_is_refused() -> None:
    with pytest.raises(ValueError, match="must be one of price, som, paper"):
        compete(np.zeros((1, 3)), np.zeros((1, 3)), "leader")


def test_too_long_a_way_is_reported_not_excluded() -> None:
    points, vehicles = np.array([[0.0, 0.0, 2.0], [5.0, 0.0, 2.0]]), np.array([[0.0, 4.0, 2.0], [5.0, 4.0, 2.0]])
    for form in ("price", "som"):
        result = compete(points, vehicles, form, travelled=np.array([118.0, 10.0]))
        assert result.complete
        assert result.exhausted == (0,)


anything = st.floats(allow_nan=True, allow_infinity=True, width=64)
places = st.lists(st.tuples(anything, anything, anything), max_size=7).map(lambda rows: np.array(rows).reshape(-1, 3))


@given(places, places, st.sampled_from(["price", "som", "paper"]), st.integers(0, 3))
def test_whatever_comes_in_each_point_has_at_most_one_winner(
    points: Array, vehicles: Array, form: str, seed: int
) -> None:
    with np.errstate(all="ignore"):
        settings = replace(PAPER if form == "paper" else SOM, max_sweeps=20)
        result: Assignment = compete(points, vehicles, form, seed=seed, settings=settings)
        again = compete(points, vehicles, form, seed=seed, settings=settings)
    assert result == again
    taken = [vehicle for vehicle in result.vehicle if vehicle is not None]
    assert len(taken) == len(set(taken))
    for point, vehicle in enumerate(result.vehicle):
        if vehicle is not None:
            assert result.point[vehicle] == point
            assert np.isfinite([*points[point], *vehicles[vehicle]]).all()
    assert math.isfinite(result.gap or 0.0)
    assert all(map(math.isfinite, result.prices))
