"""Vehicles among each other in the small sea: they wait, form up, travel and keep clear."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from companion.guidance import GuidanceConfig, Mode
from companion.guidance.others import hazards
from companion.mission import LimitsConfig
from companion.scene import Attitude, Neighbour, OwnPose, Scene
from tests.companion.guidance.missions import STEADY_S, form, swap, travel
from tests.companion.guidance.sea import Sea, Water, moving, standing

Array = NDArray[np.float64]
COLLISION_M = 1.15  # between centres: a hull's length and 0.3 m


@pytest.mark.parametrize(("current", "widest"), [((0.0, 0.0), 2.15), ((0.1, 0.0), 2.8)])
def test_a_waiting_vehicle_circles_its_point_steadily(current: tuple[float, float], widest: float) -> None:
    point = np.array((0.0, 0.0, 2.0))
    log = Sea(np.array(((9.0, 4.0, 2.0),)), np.array((2.0,)), 1, Water(current=current)).run(
        150.0, lambda now, i, scene: standing(point)
    )
    radius = np.hypot(log.position[:, 0, 0], log.position[:, 0, 1])
    settled = log.times > 60.0
    assert radius[settled].min() > 1.6
    assert radius[settled].max() < widest
    assert log.speed[settled].min() > 0.19
    turns = np.diff(np.unwrap(log.heading[settled, 0]))
    assert (turns > 0.0).mean() > 0.97
    first, second = (
        radius[(log.times >= 78.0) & (log.times < 113.0)],
        radius[(log.times >= 113.0) & (log.times < 148.0)],
    )
    assert np.abs(first[: len(second)] - second).max() < 0.25


def test_two_that_wait_side_by_side_come_into_step() -> None:
    points = np.array(((0.0, 0.0, 2.0), (0.0, 5.0, 2.0)))
    starts = points + np.array(((1.5, 0.0, 0.0), (-1.5, 0.0, 0.0)))
    log = Sea(starts, np.array((math.pi / 2.0, -math.pi / 2.0))).run(100.0, lambda now, i, scene: standing(points[i]))
    assert log.separations().min() > COLLISION_M
    assert log.separations(80.0).min() > 4.8
    assert abs(math.remainder(log.heading[-1, 0] - log.heading[-1, 1], math.tau)) < math.radians(10.0)


def test_the_way_to_a_standing_point_is_straight() -> None:
    point = np.array((0.0, 0.0, 2.0))
    log = Sea(np.array(((10.0, 0.0, 2.0),)), np.array((math.pi,))).run(40.0, lambda now, i, scene: standing(point))
    there = int((np.hypot(log.position[:, 0, 0], log.position[:, 0, 1]) < 2.5).argmax())
    way = np.hypot(*np.diff(log.position[: there + 1, 0, :2], axis=0).T).sum()
    assert way + 2.5 < 10.0 * 1.015


def test_who_reacts_and_who_stands_on() -> None:
    """A hull adrift and one that circles a standing point do not give way; one under way does."""
    current = np.array((0.1, 0.0, 0.0))
    own = OwnPose(np.array((-9.0, 0.0, 2.0)), np.zeros(3), Attitude(0.0, 0.0, 0.0), 0.05, 0.0, current)

    def other(north: float, east: float, velocity: tuple[float, float]) -> Neighbour:
        return Neighbour(np.array((north, east, 2.0)), np.array((*velocity, 0.0)) + current, 0.05, 0.0, 0.0)

    seen = (other(1.9, 0.0, (0.0, 0.35)), other(1.9, 0.0, (0.0, -0.35)), other(6.0, 0.0, (0.4, 0.0)),
            other(-6.0, 0.0, (0.0, 0.0)))  # fmt: skip
    decision, config = standing(np.array((0.0, 0.0, 2.0))), GuidanceConfig()
    found = list(hazards(Scene(0.0, own, seen), decision, LimitsConfig(), config))
    assert [hazard.circles for hazard in found] == [True, False, False, False]
    assert [hazard.reacts for hazard in found] == [False, True, True, False]
    under_way = moving(np.zeros(3), np.array((0.35, 0.0, 0.0)))
    assert not any(hazard.circles for hazard in hazards(Scene(0.0, own, seen), under_way, LimitsConfig(), config))


@pytest.mark.parametrize("seed", range(8))
def test_six_form_up_from_random_starts_without_coming_near(seed: int) -> None:
    outcome = form(seed, ((0.0, 0.0), (0.07, -0.07))[seed % 2], 50.0)
    assert outcome.log.separations().min() > COLLISION_M
    assert np.median(outcome.error[-1]) < 3.0


@pytest.mark.parametrize("current", [(0.0, -0.1), (-0.07, -0.07)])
def test_six_travel_round_a_corner_in_a_current(current: tuple[float, float]) -> None:
    outcome = travel(1, current)
    steady = outcome.error[outcome.log.times > STEADY_S]
    assert math.sqrt(float(np.mean(steady**2))) < 0.25
    assert outcome.log.separations().min() > COLLISION_M
    assert all(mode is Mode.FOLLOW for mode in outcome.log.modes[-1])


def test_two_head_on_pass_port_to_port_and_go_on() -> None:
    goals = np.array(((60.0, 0.0, 2.0), (-60.0, 0.0, 2.0)))
    course = np.array(((0.35, 0.0, 0.0), (-0.35, 0.0, 0.0)))
    starts = np.array(((-8.0, 0.0, 2.0), (8.0, 0.0, 2.0)))
    log = Sea(starts, np.array((0.0, math.pi))).run(25.0, lambda now, i, scene: moving(goals[i], course[i]))
    assert log.separations().min() > 1.4
    abeam = int(log.separations().argmin())
    assert log.position[abeam, 0, 1] > log.position[abeam, 1, 1]
    assert log.position[-1, 0, 0] > 4.0
    assert log.position[-1, 1, 0] < -4.0


def test_six_swap_places_across_a_circle() -> None:
    outcome = swap(6, 1, seconds=70.0)
    assert outcome.log.separations().min() > COLLISION_M
    assert (outcome.error.min(axis=0) < 2.0).all()


def test_a_drifting_hull_is_passed_at_a_distance() -> None:
    goal = np.array((60.0, 0.0, 2.0))
    starts = np.array(((0.0, 0.2, 2.0), (-10.0, 0.0, 2.0)))
    sea = Sea(starts, np.array((math.pi / 2.0, 0.0)), 3, Water(current=(-0.05, 0.0)), drifting=1)
    log = sea.run(55.0, lambda now, i, scene: moving(goal, np.array((0.35, 0.0, 0.0))))
    assert log.separations().min() > 1.4
    assert log.position[-1, 1, 0] > log.position[-1, 0, 0] + 5.0
    aside = np.abs(log.position[:, 1, 1])
    assert aside[-1] < aside.max() - 0.2  # on its way back
