"""Transformations: from shape to shape at a place or a time, together, clear of each other, as vehicles can follow."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from companion.config import ConfigError, from_table
from companion.formation import Formation, VirtualFormation, VirtualState
from companion.formation.transform import matched, nearest
from companion.mission import Mission
from companion.scene import Attitude, Decision, Neighbour, OwnPose, Phase, Scene
from companion.shapes import SHAPES, tilted

Array = NDArray[np.float64]

PERIOD_S = 0.1
START_S, FORMING_S = 5.0, 20.0
NARROW: list[dict[str, Any]] = [
    {"shape": "column", "spacing_m": 4.0, "at_m": 10.0},
    {"shape": "triangle", "at_m": 60.0},
]


def mission(transform: list[dict[str, Any]], length: float = 110.0, **tables: dict[str, Any]) -> Mission:
    table: dict[str, Any] = {
        "vehicles": 6,
        "path": {"waypoints_m": [[length, 0.0]]} if length else {},
        "schedule": {"start_s": START_S, "forming_s": FORMING_S},
        "transform": transform,
    }
    for name, values in tables.items():
        table[name] = {**table.get(name, {}), **values}
    return from_table(Mission, table, "f.toml")


def outcome(table: dict[str, Any]) -> tuple[Mission | None, tuple[str, ...]]:
    try:
        return from_table(Mission, table, "f.toml"), ()
    except ConfigError as error:
        return None, error.lines


def journey(virtual: VirtualFormation) -> tuple[Array, list[VirtualState]]:
    times = np.arange(0.0, virtual.end_s + 5.0, PERIOD_S)
    return times, [virtual.at(float(now)) for now in times]


def width(points: Array) -> float:
    return float(np.ptp(points[:, 1]))


def test_a_triangle_passes_a_narrow_place_as_a_column() -> None:
    virtual = VirtualFormation(mission(NARROW))
    first, second = virtual.spans
    assert (first.first, second.first) == (10.0, 60.0)
    assert first.last < 50.0
    times, states = journey(virtual)
    centre = np.array([state.points[:, 0].mean() for state in states])
    widths = np.array([width(state.points) for state in states])
    assert widths[centre < 10.0].min() == pytest.approx(10.0)
    assert widths[(centre > first.last) & (centre < 60.0)].max() < 1e-5
    assert widths[centre > second.last].min() == pytest.approx(10.0)
    first_places, last_places = (sorted(map(tuple, np.round(states[i].points, 3).tolist())) for i in (0, -1))
    np.testing.assert_allclose(np.array(last_places) - first_places, np.tile((110.0, 0.0, 0.0), (6, 1)), atol=2e-3)
    speeds = np.array([np.linalg.norm(state.velocities, axis=1) for state in states])
    under_way = (centre > 5.0) & (centre < 105.0)
    assert speeds[under_way].min() > 0.29, "every vehicle keeps steerage way of 0.2 m/s and half as much again"
    assert speeds.max() <= 0.8 * 0.65, "and none needs its last fifth of speed"
    assert times[-1] > 300.0


def test_it_transforms_at_a_time_and_for_as_long_as_the_mission_says() -> None:
    virtual = VirtualFormation(mission([{"shape": "column", "at_s": 60.0, "duration_s": 150.0}]))
    times, states = journey(virtual)
    moving = times[[not rigid(state.points, states[0].points) for state in states]]
    back = times[[not rigid(state.points, states[-1].points) for state in states]]
    assert moving[0] == pytest.approx(60.0, abs=2.0)
    assert back[-1] == pytest.approx(210.0, abs=2.0)


def rigid(points: Array, others: Array) -> bool:
    return bool(np.abs((points - points[0]) - (others - others[0])).max() < 1e-3)


@pytest.mark.parametrize("at_s", [6.0, 300.0])
def test_it_transforms_where_it_stands(at_s: float) -> None:
    virtual = VirtualFormation(
        mission([{"shape": "line", "at_s": at_s, "spacing_m": 3.0}], 20.0, schedule={"forming_s": 80.0})
    )
    [span] = virtual.spans
    assert span.stands
    before, middle, after = (virtual.at(now) for now in (span.first, 0.5 * (span.first + span.last), span.last))
    np.testing.assert_allclose(middle.points, 0.5 * (before.points + after.points), atol=1e-9)
    assert np.ptp(after.points[:, 0]) < 1e-9
    assert width(after.points) == pytest.approx(15.0)
    assert middle.phase is (Phase.FORMING if at_s < 80.0 else Phase.TRAVEL)
    assert virtual.at(virtual.end_s).phase is Phase.DONE


def test_it_takes_any_list_of_points_in_three_dimensions() -> None:
    own = [[6.0, 0.0, 2.0], [0.0, 5.0, 0.0], [0.0, -5.0, 0.0], [-6.0, 0.0, -1.0], [0.0, 0.0, 3.0], [0.0, 0.0, -4.0]]
    virtual = VirtualFormation(
        mission([{"shape": "points", "points_m": own, "at_m": 5.0}], 140.0, path={"origin_m": [0.0, 0.0, 8.0]})
    )
    end = virtual.at(virtual.end_s).points - (140.0, 0.0, 8.0)
    assert sorted(map(tuple, np.round(end, 6).tolist())) == sorted(map(tuple, own))


def test_a_tetrahedron_has_equal_edges_and_its_tip_ahead() -> None:
    points = SHAPES["tetrahedron"](4, 3.0)
    apart = np.linalg.norm(points[:, None] - points[None], axis=2)[np.triu_indices(4, 1)]
    np.testing.assert_allclose(apart, 3.0)
    assert (points[1:, 0] < points[0, 0] - 2.0).all()
    twenty = SHAPES["tetrahedron"](20, 3.0)
    np.testing.assert_allclose(np.unique(np.round(twenty[:, 0], 6), return_counts=True)[1], [10, 6, 3, 1])


def test_a_tilted_shape_keeps_its_distances() -> None:
    flat = SHAPES["triangle"](6, 5.0)
    up = tilted(flat, math.radians(30.0), 0.0)
    assert up[0, 2] == pytest.approx(flat[0, 0] * -0.5), "what is ahead is higher"
    assert up[-1, 2] - up[0, 2] == pytest.approx(0.5 * (flat[0, 0] - flat[-1, 0])), "what is behind is deeper"
    side = tilted(flat, 0.0, math.radians(30.0))
    np.testing.assert_allclose(side[:, 2], 0.5 * flat[:, 1], atol=1e-12)
    both = tilted(flat, 0.4, -0.3)
    np.testing.assert_allclose(
        np.linalg.norm(both[:, None] - both[None], axis=2),
        np.linalg.norm(flat[:, None] - flat[None], axis=2),
        atol=1e-9,
    )


def test_points_that_jump_are_there_at_once() -> None:
    virtual = VirtualFormation(mission([{"shape": "line", "at_m": 10.0, "jump": True}], 30.0))
    times, states = journey(virtual)
    jumped = [state.jumps for state in states]
    at = jumped.index(1)
    assert set(jumped) == {0, 1}
    assert states[at].points[:, 0].mean() == pytest.approx(10.0, abs=0.1)
    assert width(states[at - 1].points) == pytest.approx(10.0)
    assert width(states[at].points) == pytest.approx(25.0)
    assert np.abs(states[at].points - states[at - 1].points).max() > 5.0
    assert times[at] < virtual.end_s


shapes = st.sampled_from(sorted(SHAPES))


@st.composite
def missions(draw: st.DrawFn) -> Mission:
    """Any mission of up to two transformations of any kind along legs or a curve; where it cannot be flown, another."""
    here, heading = np.array((0.0, 0.0, 15.0)), draw(st.floats(-math.pi, math.pi))
    waypoints = []
    for _ in range(draw(st.integers(1, 3))):
        leg = draw(st.floats(70.0, 140.0))
        here = here + leg * np.array((math.cos(heading), math.sin(heading), draw(st.floats(-0.04, 0.04))))
        heading += draw(st.floats(-1.5, 1.5))
        waypoints.append(here.tolist())
    begin = 0.0
    changes: list[dict[str, Any]] = []
    for _ in range(draw(st.integers(0, 2))):
        change = {
            "shape": draw(shapes),
            "spacing_m": draw(st.floats(2.0, 6.0)),
            "pitch_deg": draw(st.floats(-15.0, 15.0)),
        }
        kind = draw(st.sampled_from(["place", "time", "jump", "forming"]))
        begin += draw(st.floats(0.0, 40.0))
        if kind == "forming" and not changes:
            change["at_s"] = draw(st.floats(5.0, 20.0))
        elif kind == "time":
            change |= {"at_s": 90.0 + 3.0 * begin, "duration_s": draw(st.floats(150.0, 250.0))}
        else:
            change |= {"at_m": begin, "jump": kind == "jump"}
        begin += 0.0 if kind in ("jump", "forming") else 80.0
        changes.append(change)
    table = {
        "vehicles": draw(st.integers(1, 8)),
        "formation": {"shape": draw(shapes)},
        "path": {
            "origin_m": [0.0, 0.0, 15.0],
            "waypoints_m": waypoints,
            "curve": draw(st.sampled_from(["legs", "spline"])),
            "pace_mps": draw(st.floats(0.25, 0.45)),
            "turn_radius_m": draw(st.floats(6.0, 25.0)),
            "turn": draw(st.booleans()),
            "step_m": 0.8,
        },
        "transform": changes,
        "limits": {"slope_max": 0.3},
    }
    wanted, lines = outcome(table)
    assert all(line.startswith("f.toml: ") for line in lines)
    assume(wanted is not None)
    assert wanted is not None
    return wanted


@settings(max_examples=40)
@given(missions())
def test_whatever_the_mission_its_points_can_be_followed(wanted: Mission) -> None:
    virtual = VirtualFormation(wanted)
    permitted = max(wanted.path.pace_mps, 0.8 * 0.65)
    for begin in np.linspace(0.0, virtual.end_s, 50):
        states = [virtual.at(float(begin) + 0.02 * k) for k in range(3)]
        points = np.array([state.points for state in states])
        assert max(np.linalg.norm(state.velocities, axis=1).max() for state in states) <= permitted + 1e-3
        assert nearest(points[0], points[0])[0] >= 1.15 - 1e-6
        assert points[..., 2].min() >= 0.3 - 1e-3
        if len({state.jumps for state in states}) == 1:
            np.testing.assert_allclose((points[2] - points[0]) / 0.04, states[1].velocities, atol=5e-3)
            assert np.linalg.norm(states[2].velocities - states[0].velocities, axis=1).max() < 0.04 * 0.25
    assert virtual.at(virtual.end_s).jumps == sum(change.jump for change in wanted.transform)


@given(st.integers(2, 12), shapes, shapes, st.floats(-1.0, 1.0))
def test_points_keep_clear_of_each_other_on_the_way_to_another_shape(
    count: int, old: str, new: str, roll: float
) -> None:
    first, second = (SHAPES[name](count, 5.0) for name in (old, new))
    first, second = first - first.mean(axis=0), second - second.mean(axis=0)
    went = matched(first, second)
    assert sorted(map(tuple, went.tolist())) == sorted(map(tuple, second.tolist()))
    assert nearest(first, went)[0] >= 5.0 / math.sqrt(2.0) - 1e-3
    cost = ((first[:, None] - second[None]) ** 2).sum(axis=2)
    assert ((first - went) ** 2).sum() == pytest.approx(cost[linear_sum_assignment(cost)].sum(), abs=1e-3)


def test_the_nearest_two_points_of_a_way_are_found() -> None:
    old, new = np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0]]), np.array([[8.0, 0.0, 0.0], [2.0, 3.0, 0.0]])
    distance, *pair = nearest(old, new)
    shares = np.linspace(0.0, 1.0, 10001)[:, None]
    sampled = np.linalg.norm((1 - shares) * (old[0] - old[1]) + shares * (new[0] - new[1]), axis=1).min()
    assert distance == pytest.approx(sampled, abs=1e-4)
    assert pair == [0, 1]
    assert nearest(old[:1], new[:1])[0] == math.inf


@pytest.mark.parametrize(
    ("transform", "tables", "said"),
    [
        ({"at_m": 10.0}, {}, "transform[0]] shape: must be given (Shape that the formation takes; one of triangle, "),
        (
            {"shape": "column"},
            {},
            "transform[0]] at_m: exactly one of at_m (a place on the path) and at_s (a time) must",
        ),
        ({"shape": "column", "at_m": 1.0, "at_s": 9.0}, {}, "transform[0]] at_m = 1: exactly one of at_m"),
        (
            {"shape": "points", "points_m": [[0, 0], [0, 5]], "at_m": 10.0},
            {},
            "transform[0]] points_m = [[0, 0], [0, 5]]: must have as many points as the formation (6), has 2",
        ),
        ({"shape": "column", "at_m": 111.0}, {}, "transform[0]] at_m = 111: must be on the path, which is 110 m long"),
        (
            {"shape": "column", "at_m": 100.0},
            {},
            "transform[0]] at_m = 100: takes 47.8 m of the path from 100.0 m on, which is 110.0 m long: must begin",
        ),
        (
            {"shape": "column", "at_m": 10.0, "duration_s": 20.0},
            {},
            "transform[0]] duration_s = 20: must be at least 125.9 s",
        ),
        ({"shape": "column", "at_s": 1.0}, {}, "transform[0]] at_s = 1: must be at or after schedule.start_s (5 s)"),
        (
            {"shape": "column", "at_s": 10.0},
            {},
            "transform[0]] at_s = 10: lasts until 48.5 s, must end before travel begins at 25 s (or form for longer)",
        ),
        (
            {"shape": "column", "at_s": 10.0, "duration_s": 1.0, "jump": True},
            {},
            "transform[0]] duration_s = 1: must be absent where points jump",
        ),
        (
            {"shape": "column", "spacing_m": 1.0, "at_m": 10.0},
            {"path": {"step_m": 0.2}},
            "transform[0]] spacing_m = 1: points 0 and 1 are 1 m apart, must be at least limits.safe_distance_m",
        ),
        (
            {"shape": "column", "at_m": 10.0},
            {"limits": {"steerage_speed_mps": 0.64}, "path": {"pace_mps": 0.65}},
            'transform[0]] shape = "column": no point may go under 0.65 m/s (steerage way) or over 0.65 m/s',
        ),
        (
            {"shape": "column", "at_m": 10.0, "pitch_deg": 40.0, "jump": True},
            {},
            'transform[0]] shape = "column": points reach from -6.03 to 10 m depth, must be from 0.3 to 30 m',
        ),
        (
            {"shape": "tetrahedron", "at_m": 10.0},
            {"path": {"origin_m": [0, 0, 8], "waypoints_m": [[100, 0, 25]]}},
            'transform[0]] shape = "tetrahedron": no point may go under 0.3 m/s (steerage way) or over 0.52 m/s',
        ),
    ],
)
def test_a_wrong_transformation_gets_one_line_that_says_what_to_change(
    transform: dict[str, Any], tables: dict[str, Any], said: str
) -> None:
    with pytest.raises(ConfigError) as caught:
        mission([transform], **tables)
    [line] = caught.value.lines
    assert line.startswith(f"f.toml: [{said}")


def test_transformations_come_one_after_the_other() -> None:
    with pytest.raises(ConfigError) as caught:
        mission([NARROW[0], {"shape": "line", "at_m": 30.0}])
    assert str(caught.value) == (
        "f.toml: [transform[1]] at_m = 30: must begin after transform[0] has ended (44.8 m along the path, at 146.7 s)"
    )


def scene(now: float, own: Array, others: Array) -> Scene:
    pose = OwnPose(own, np.zeros(3), Attitude(0.0, 0.0, 0.0), 0.0, now)
    return Scene(now, pose, tuple(Neighbour(other, np.zeros(3), 0.0, 0.0, 0.0) for other in others))


def decide(mind: Formation, now: float, places: Array) -> Decision:
    return mind.step(now, scene(now, places[0], places[1:]))


def test_vehicles_compete_anew_where_points_jump_and_hold_where_the_clock_does() -> None:
    wanted = mission([{"shape": "line", "at_s": 40.0, "jump": True}], 0.0)
    minds = [Formation(wanted, vehicle) for vehicle in range(6)]
    places = minds[0].virtual.at(30.0).points
    held: dict[float, list[int | None]] = {}
    for now in np.arange(30.0, 44.0, 0.5).tolist():
        decisions = [decide(minds[i], now, np.roll(places, -i, axis=0)) for i in range(6)]
        assert {decision.reason for decision in decisions} == {""}, (
            "a jump that the mission declares is none of the clock"
        )
        held[now] = [decision.point for decision in decisions]
        if now >= 40.0:
            assert sum(decision.tracking_error or 0.0 for decision in decisions) < 1.2 * least_sum(
                decisions[0].points, places
            )
    assert held[30.0] == held[39.5] == [0, 1, 2, 3, 4, 5]
    assert sorted(point for point in held[40.0] if point is not None) == [0, 1, 2, 3, 4, 5]
    assert held[40.0] == held[43.5] != held[39.5]
    assert decide(minds[0], 20.0, places).reason == "clock jumped"


def least_sum(points: Array, places: Array) -> float:
    ways = np.linalg.norm(points[:, None] - places[None], axis=2)
    return float(ways[linear_sum_assignment(ways)].sum())


def test_a_vehicle_keeps_its_point_while_the_shape_changes() -> None:
    wanted = mission(NARROW)
    minds = [Formation(wanted, vehicle) for vehicle in range(6)]
    kept = set()
    for now in np.arange(30.0, minds[0].virtual.end_s, 1.0):
        places = minds[0].virtual.at(float(now)).points
        for vehicle in range(6):
            order = [vehicle, *(other for other in range(6) if other != vehicle)]
            decision = minds[vehicle].step(float(now), scene(float(now), places[vehicle], places[order[1:]]))
            kept.add((vehicle, decision.point, decision.reason))
    assert kept - {(vehicle, vehicle, "") for vehicle in range(6)} <= {(v, None, "clock jumped") for v in range(6)}


def test_s_and_f_travel_with_the_decision() -> None:
    wanted = mission([], 0.0, formation={"slower": [1], "faster": [2], "faster_factor": 1.5})
    assert wanted.pace_factors().tolist() == [1.0, 0.7, 1.5, 1.0, 1.0, 1.0]
    for point, factor in enumerate(wanted.pace_factors()):
        mind = Formation(wanted, point)
        places = np.roll(mind.virtual.at(10.0).points, -point, axis=0)
        decision = decide(mind, 10.0, places)
        assert (decision.point, decision.pace_factor) == (point, factor)
