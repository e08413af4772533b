"""One vehicle's decisions: what each rule is for, what bad input gets, and what equal input gets."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from companion.formation import Formation, Tuning, rules
from companion.formation.rules import Known, Look, Memory, Senses
from companion.scene import Attitude, Neighbour, OwnPose, Phase, Scene
from tests.companion.formation.missions import mission

Array = NDArray[np.float64]

LINE = mission(3, shape="column")  # points at 5, 0 and -5 m north
POINTS = np.array([(5.0, 0.0, 2.0), (0.0, 0.0, 2.0), (-5.0, 0.0, 2.0)])
ALL = np.arange(3)
ME = np.array((0.0, -8.0, 2.0))
HOVER = Tuning.derive(replace(LINE, limits=replace(LINE.limits, waiting_radius_m=0.0)))
SWIM = Tuning.derive(LINE)


def scene(now: float, own: Any, others: Any = (), reach: float = math.inf, sigma: float = 0.05) -> Scene:
    pose = OwnPose(np.array(own, dtype=float), np.zeros(3), Attitude(0.0, 0.0, 0.0), sigma, now)
    rows = np.array(others, dtype=float).reshape(-1, 3)
    return Scene(now, pose, tuple(Neighbour(row, np.zeros(3), sigma, 0.0, 0.0) for row in rows), (), reach)


def senses(own: Any, *others: Any, sight: float = math.inf) -> Senses:
    places = np.array((own, *others), dtype=float)
    return Senses(places, np.full(len(places), 0.1), 0, np.zeros(3), sight)


def ways(seen: Senses) -> Array:
    return rules.distances(seen.positions, POINTS)


def test_sense_counts_each_hull_once_and_never_itself() -> None:
    seen = scene(0.0, (0, 0, 2), [(9, 0, 2), (9.1, 0.1, 2), (0.1, 0, 2), (math.nan, 0, 2), (4, math.inf, 2), (3, 3, 2)])
    stale = replace(seen.neighbours[0], position=np.array([-9.0, 0.0, 2.0]), age=1.5)
    found = rules.sense(replace(seen, neighbours=(*seen.neighbours, stale)), HOVER)
    assert found is not None
    assert found.positions.tolist() == [[0.0, 0.0, 2.0], [3.0, 3.0, 2.0], [9.0, 0.0, 2.0]]
    assert found.me == 0


def test_a_drifting_hull_is_dead_and_a_circling_one_is_not() -> None:
    current = (0.1, 0.0, 0.0)

    def looks(path: list[tuple[float, float, float]]) -> list[Look]:
        return [Look(float(i), ME, np.array((place, (40.0, 40.0, 2.0)))) for i, place in enumerate(path[:-1])]

    def verdict(path: list[tuple[float, float, float]]) -> bool:
        seen = replace(senses(ME, path[-1]), current=np.array(current))
        return bool(rules.dead(seen, len(path) - 1.0, looks(path), ways(seen), SWIM)[1])

    drifting = [(20.0 + 0.1 * i, 7.0, 2.0) for i in range(6)]
    circling = [
        (20.0 + 1.5 * math.cos(0.2 / 1.5 * i) + 0.1 * i, 7.0 + 1.5 * math.sin(0.2 / 1.5 * i), 2.0) for i in range(6)
    ]
    waiting = [(0.1 * i, 0.2, 2.0) for i in range(6)]
    assert verdict(drifting)
    assert not verdict(circling)
    assert not verdict(waiting), "on a point nobody can tell"
    assert not verdict(drifting[:4]), "not watched for long enough"


def test_memory_keeps_a_point_out_of_sight_and_frees_one_that_looks_empty() -> None:
    far, near = senses((5, 0, 2), sight=8.0), senses((0, 0, 2), sight=8.0)
    crowd = senses((5, 0, 2), (5, 3, 2), (5, -3, 2), sight=8.0)
    seen = senses((5, 0, 2), (-4.8, 0.1, 2), sight=20.0)
    memory = rules.remember(Memory.blank(3), 1.0, seen, ways(seen), HOVER)
    assert memory.occupied.tolist() == pytest.approx([math.nan, math.nan, 1.0], nan_ok=True)
    memory = rules.remember(memory, 2.0, far, ways(far), HOVER)
    assert rules.candidates(memory, 2.0, far, ways(far), None, HOVER).tolist() == [0, 1]
    assert rules.candidates(memory, 2.0, crowd, ways(crowd), None, HOVER).tolist() == [0, 1, 2], "three need three"
    for look in range(3):
        assert memory.occupied[2] == 1.0, f"look {look}: one that drops out frees nothing"
        assert rules.candidates(memory, 2.0, near, ways(near), None, HOVER).tolist() == [0, 1], (
            "nobody was seen to leave"
        )
        memory = rules.remember(memory, 3.0 + look, near, ways(near), HOVER)
    assert np.isnan(memory.occupied).all()


def test_a_point_whose_vehicle_is_seen_to_leave_is_free_at_once() -> None:
    before, after = senses((0, 0, 2), (-4.8, 0.1, 2)), senses((0, 0, 2), (-4.8, 2.2, 2))
    memory = rules.remember(Memory.blank(3), 1.0, before, ways(before), HOVER)
    memory = rules.remember(memory, 1.5, after, ways(after), HOVER)
    assert rules.candidates(memory, 1.5, after, ways(after), None, HOVER).tolist() == [0, 1, 2]


def test_a_detection_that_drops_out_leaves_the_vehicle_in_mind_for_a_second() -> None:
    both, alone = senses((0, 0, 2), (3, 3, 2), sight=9.0), senses((0, 0, 2), sight=9.0)
    moved, gone = senses((0, 0, 2), (3.2, 3.2, 2), sight=9.0), senses((0, 0, 2), (8.9, 0, 2), sight=9.0)
    known = both.known(1.0, Known.nobody())
    assert rules.linger(known, 1.5, alone, HOVER).positions.tolist() == [[3.0, 3.0, 2.0]]
    assert alone.joined(rules.linger(known, 1.5, alone, HOVER)).positions.tolist() == both.positions.tolist()
    assert len(rules.linger(known, 2.1, alone, HOVER).times) == 0, "too long ago"
    assert len(rules.linger(known, 1.5, moved, HOVER).times) == 0, "it is that one"
    assert len(rules.linger(gone.known(1.0, Known.nobody()), 1.5, alone, HOVER).times) == 0, "it may be out of sight"


def test_a_vehicle_on_a_point_does_not_leave_for_one_out_of_sight() -> None:
    seen = senses((4.0, 4.0, 2.0), (5.1, 0.0, 2.0), sight=8.0)
    row = rules.costs(seen, ways(seen), None, False, ALL, HOVER)[1]
    assert row[2] == rules.FORBIDDEN
    assert row[0] < row[1] < rules.FORBIDDEN


def test_a_far_point_of_my_own_is_worth_a_little_more() -> None:
    far, near = senses((0.0, 10.0, 2.0)), senses((0.0, 2.0, 2.0))
    plain = rules.costs(far, ways(far), None, False, ALL, HOVER)[0]
    mine = rules.costs(far, ways(far), 1, False, ALL, HOVER)[0]
    assert mine[1] == pytest.approx((10.0 - 0.3) ** 1.2)
    assert mine[::2].tolist() == plain[::2].tolist()
    assert rules.costs(near, ways(near), 1, False, np.array([1]), HOVER)[0, 0] == pytest.approx(2.0**1.2)


def test_team_mates_out_of_sight_are_allowed_for() -> None:
    """Alone, a vehicle takes the nearest point; with a better one in sight, the next."""
    free = np.zeros(3)

    def winner(rows: list[list[float]], hidden: Array, chosen: list[int], rank: list[int]) -> int | None:
        return rules.compete(np.array(rows), hidden, 0, np.array(chosen), np.array(rank), 3)

    assert winner([[1.0, 2.0, 3.0]], free, [0, 1, 2], [0, 1, 2]) == 0
    assert winner([[1.0, 2.0, 9.0], [0.5, 9.0, 9.0]], free, [0, 1, 2], [2, 0, 1]) == 1
    assert winner([[1.0], [0.5]], np.zeros(1), [1], [0, 1, 2]) is None


def test_a_point_that_nobody_else_can_be_near_to_is_filled_by_who_sees_it() -> None:
    seen = senses((0.0, 4.2, 2.0), sight=6.0)
    hidden = rules.hidden_costs(seen, ways(seen), ALL, HOVER)
    assert hidden[1] == pytest.approx((6.0 - 4.2) ** 1.2)
    assert hidden[0] == hidden[2] == 0.0, "beyond sight somebody may be as near as can be"
    nearer = senses((3.2, 2.0, 2.0), sight=5.5)
    cost = rules.costs(nearer, ways(nearer), None, False, ALL, HOVER)
    hidden = rules.hidden_costs(nearer, ways(nearer), ALL, HOVER)
    assert rules.compete(cost, hidden, 0, ALL, ALL, 3) == 0


def test_spares_travel_along_behind_and_take_a_point_that_becomes_free() -> None:
    five = replace(mission(3, shape="column", waypoints_m=((60.0, 0.0),)), vehicles=5)
    five = replace(five, formation=replace(five.formation, point_count=3))
    mind = Formation(five, 4)
    for tick in range(100):
        now = 100.0 + 0.5 * tick
        points = mind.virtual.at(now).points
        place = points[2] - (4.0, 1.0, 0.0)
        here = points if tick < 50 else points[:2]
        decision = mind.step(now, scene(now, place, here))
        if tick < 50:
            assert decision.point is None
            assert decision.reason == "no free point: travelling in reserve"
            assert decision.target is not None
            np.testing.assert_allclose(decision.target, points[2] - (5.0, 0.0, 0.0))
            np.testing.assert_allclose(decision.target_velocity, mind.virtual.at(now).velocities[2], atol=1e-9)
    assert decision.point == 2


def test_a_mission_from_waiting_to_done() -> None:
    shared = mission(3, shape="column", waypoints_m=((8.0, 0.0),))
    shared = replace(shared, schedule=replace(shared.schedule, start_s=2.0, forming_s=3.0))
    mind = Formation(shared, 0)
    seen: list[tuple[Phase, int | None]] = []
    for tick in range(int((mind.virtual.end_s + 1.0) * 10)):
        now = 0.1 * tick
        points = mind.virtual.at(now).points
        decision = mind.step(now, scene(now, points[2] + (0.0, 1.0, 0.0), points[:2]))
        if decision.phase is Phase.WAITING:
            assert decision.reason == "waiting for the start"
            assert decision.target is None
        else:
            assert decision.reason == ""
            assert decision.tracking_error == pytest.approx(1.0)
            assert decision.target is not None
            np.testing.assert_array_equal(decision.target, points[2])
        if not seen or seen[-1] != (decision.phase, decision.point):
            seen.append((decision.phase, decision.point))
    assert seen == [(Phase.WAITING, None), (Phase.FORMING, 2), (Phase.TRAVEL, 2), (Phase.DONE, 2)]


def test_bad_input_is_a_hold_with_its_reason_and_good_input_ends_it() -> None:
    mind = Formation(mission(3, shape="column", waypoints_m=((30.0, 0.0),)), 0)

    def at(now: float, reason: str = "", **changes: Any) -> None:
        decision = mind.step(now, replace(scene(now, (0.2, 0.0, 2.0)), **changes))
        assert decision.reason == reason
        assert (decision.target is None) == bool(reason)
        assert np.isfinite(decision.points).all()

    good = scene(0.0, (0.2, 0.0, 2.0)).own
    assert good is not None
    at(10.0)
    at(10.1, "own position is unknown", own=None)
    at(10.2, "own position is unknown", own=replace(good, position=np.array([0.0, math.nan, 2.0])))
    at(10.3)
    at(10.4, "scene is stale", stamp=9.0)
    at(10.5, "scene is stale", stamp=math.nan)
    at(math.nan, "clock is not finite")
    at(10.6)
    at(9.0, "clock jumped")
    at(9.9, "clock jumped")
    at(10.1)
    at(3700.0, "clock jumped")
    at(3700.5, "clock jumped")
    at(3701.1)
    at(11.0, "clock jumped")
    at(12.1)


def test_more_vehicles_than_points_leaves_the_worst_placed_without() -> None:
    mind = Formation(mission(3, shape="column"), 3)
    others = [(5.0, 1.0, 2.0), (0.0, 1.0, 2.0), (-5.0, 1.0, 2.0)]
    decision = mind.step(1.0, scene(1.0, (0.0, 15.0, 2.0), others))
    assert decision.point is None
    assert decision.reason == "no free point"
    assert decision.target is None
    decision = mind.step(1.1, scene(1.1, (0.0, 15.0, 2.0), others[:2]))
    assert decision.point is None, "a detection may drop out"
    for tick in range(12, 40):
        decision = mind.step(0.1 * tick, scene(0.1 * tick, (0.0, 15.0, 2.0), others[:2]))
    assert decision.point == 2


def test_two_that_see_the_same_never_want_the_same_point() -> None:
    """With nothing hidden and no noise, everybody imagines everybody else rightly."""
    for case in range(60):
        places = np.random.default_rng(case).uniform(-10.0, 10.0, (6, 3))
        minds = [Formation(mission(6), vehicle) for vehicle in range(6)]
        points = [
            mind.step(1.0, scene(1.0, places[i], np.delete(places, i, axis=0))).point for i, mind in enumerate(minds)
        ]
        assert sorted(points) == list(range(6)), f"case {case}"  # type: ignore[type-var]


def test_the_order_in_which_neighbours_are_listed_says_nothing() -> None:
    for case in range(30):
        random = np.random.default_rng(case)
        places = random.uniform(-10.0, 10.0, (6, 3))
        first, second = Formation(mission(6), 0), Formation(mission(6), 5)
        for tick in range(5):
            now = 0.5 * tick
            one = first.step(now, scene(now, places[0], places[1:], 12.0))
            other = second.step(now, scene(now, places[0], random.permutation(places[1:]), 12.0))
            assert one.point == other.point


anything = st.floats(allow_nan=True, allow_infinity=True)
triple = st.tuples(anything, anything, anything).map(np.array)
poses = st.builds(OwnPose, triple, triple, st.just(Attitude(0.0, 0.0, 0.0)), anything, anything, triple)
neighbours = st.lists(st.builds(Neighbour, triple, triple, anything, anything, anything), max_size=8).map(tuple)
scenes = st.builds(Scene, anything, st.none() | poses, neighbours, st.just(()), anything)
near = st.builds(
    lambda places, reach: (places, reach),
    st.lists(st.tuples(*[st.floats(-40.0, 40.0)] * 3), min_size=1, max_size=8),
    st.sampled_from([0.0, 3.0, 10.0, math.inf]),
)


@settings(max_examples=60)
@given(st.sampled_from(["price", "som", "paper"]), st.lists(st.tuples(anything, scenes | near), max_size=6))
def test_whatever_comes_in_a_sound_decision_comes_out(form: str, inputs: list[tuple[float, Any]]) -> None:
    first, second = (Formation(mission(3, form, waypoints_m=((30.0, 0.0),)), vehicle) for vehicle in (0, 1))
    steady = 1.0
    with np.errstate(all="ignore"):
        for now, given_input in inputs:
            if isinstance(given_input, Scene):
                what = given_input
            else:
                places, reach = given_input
                steady += 0.1
                now, what = steady, scene(steady, places[0], places[1:], reach)
            decision = first.step(now, what)
            assert decision.point is None or 0 <= decision.point < 3
            assert np.isfinite(decision.points).all()
            assert np.isfinite(decision.target_velocity).all()
            assert (decision.target is None) == bool(decision.reason)
            assert decision.target is None or np.isfinite(decision.target).all()
            assert decision.tracking_error is None or math.isfinite(decision.tracking_error)
            assert second.step(now, what).point == decision.point
