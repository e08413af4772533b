"""Grades of histories made by hand, where every figure is known beforehand."""

from dataclasses import replace

import numpy as np
import pytest

from companion.scene import Phase
from sim.forming import hull_ways
from sim.grade import Ticks, count_collisions, grade
from sim.history import stack
from sim.scenario import CriteriaConfig
from tests.sim.synthetic import FORMING_S, PACE, START_S, TRAVEL_S, deciding, fleet_swims

CRITERIA = CriteriaConfig(tracking_rms_m=0.5, forming_time_s=60.0)


def holds(result: object) -> dict[str, bool]:
    return {verdict.name: verdict.holds for verdict in result.verdicts}  # type: ignore[attr-defined]


def test_a_perfect_swim() -> None:
    result = grade(stack(fleet_swims()), CRITERIA, START_S)
    assert result.success
    assert result.points_filled == 3
    assert result.collisions == 0
    assert result.mean_length_m == pytest.approx(10.0 + PACE * TRAVEL_S)
    assert result.sd_length_m == pytest.approx(0.0, abs=1e-9)
    assert result.tracking_rms_m == pytest.approx(0.0, abs=1e-9)
    assert result.forming_ratio == pytest.approx(1.0, rel=1e-6)
    # 10 m in 20 s: all within the arrival radius of 2.5 m once 7.5 m are swum.
    assert result.forming_time_s == pytest.approx(15.0, abs=0.11)


def test_circling_a_point_is_no_way_to_it() -> None:
    """Vehicles that arrive 1.9 m aside of their points and swim round them until travel begins: 10 m each, no more."""
    circling = [
        replace(s, travelled=s.travelled + 0.35 * max(s.now - 25.0, 0.0)) if s.phase is Phase.FORMING else s
        for s in fleet_swims()
    ]
    assert grade(stack(circling), CRITERIA, START_S).forming_ratio == pytest.approx(1.0, rel=1e-6)


def test_a_point_passed_on_the_way_to_another_is_not_reached() -> None:
    """Vehicle 1 is near its point from second 20 on, but holds it from second 24 on, 1 m of way later."""
    snapshots = fleet_swims()
    for k, s in enumerate(snapshots):
        apart = np.array([(0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (10.0 * (s.now < 28.0), 0.0, 0.0)])  # all stand from 28 on
        way = s.travelled + np.array([1.0 * (s.now >= 22.0), 0.0, 10.0 * (s.now >= 28.0)])
        snapshots[k] = deciding(
            replace(s, position=s.position - apart, travelled=way), [0 if s.now >= 24.0 else 1, 1, 2]
        )
    assert grade(stack(snapshots), CRITERIA, START_S).forming_ratio == pytest.approx(41.0 / 40.0, rel=1e-6)


def test_the_least_ways_of_a_hull_that_must_turn() -> None:
    position, radius = np.zeros((1, 3)), 1.25
    points = np.array([(10.0, 0.0, 0.0), (-10.0, 0.0, 0.0), (3.0, 0.0, 4.0), (-2.0, 0.0, 0.0)])
    ahead, astern, below, near = hull_ways(position, np.zeros(1), points, radius, 2.5)[0]
    assert (ahead, below, near) == pytest.approx((10.0, 5.0, 2.0), abs=0.02)
    # The tangent from the point to the turning circle is as long as the way astern: both end on the circle.
    assert astern == pytest.approx(radius * (np.pi + 2.0 * np.arctan(radius / 10.0)) + 10.0, abs=0.02)
    assert hull_ways(position, np.array([np.pi]), points, radius, 2.5)[0, 1] == pytest.approx(10.0, abs=0.02)


def test_a_constant_offset_is_the_tracking_error() -> None:
    offset = np.array([(0.3, 0.0, 0.0), (0.0, 0.4, 0.0), (0.0, 0.0, 0.0)])
    result = grade(stack(fleet_swims(offset)), CRITERIA, START_S)
    assert result.tracking_rms_m == pytest.approx(np.sqrt((0.3**2 + 0.4**2) / 3))
    assert result.tracking_best_rms_m == pytest.approx(result.tracking_rms_m)
    assert result.tracking_max_m == pytest.approx(0.4)
    assert result.success


def test_decisions_that_differ_from_where_vehicles_are_show_in_the_error() -> None:
    snapshots = [deciding(s, [2, 0, 1]) for s in fleet_swims()]
    result = grade(stack(snapshots), CRITERIA, START_S)
    assert result.tracking_best_rms_m == pytest.approx(0.0, abs=1e-9)
    assert result.tracking_rms_m is not None
    assert result.tracking_rms_m > 4.0
    assert not holds(result)["tracking error"]


def test_an_unfilled_point() -> None:
    offset = np.array([(0.0, 0.0, 0.0), (0.0, 1.2, 0.0), (0.0, 0.0, 0.0)])
    result = grade(stack(fleet_swims(offset)), CRITERIA, START_S)
    assert result.points_filled == 2
    assert holds(result) == {
        "points filled": False, "collisions": True, "forming time": True, "tracking error": False
    }  # fmt: skip
    assert not result.success


def test_a_vehicle_without_a_point_fails_tracking() -> None:
    snapshots = [deciding(s, [0, 1, None]) if s.now > 80 else s for s in fleet_swims()]
    assert not holds(grade(stack(snapshots), CRITERIA, START_S))["tracking error"]


def test_a_spare_vehicle_holds_no_point_and_fails_nothing() -> None:
    snapshots = [deciding(replace(s, points=s.points[:2]), [0, 1, None]) for s in fleet_swims()]
    result = grade(stack(snapshots), CRITERIA, START_S)
    assert result.points_filled == 2
    assert result.success


def test_a_known_collision() -> None:
    snapshots = fleet_swims()
    # Vehicles 1 and 3 (pair index 1) touch for a second, part, and touch once more.
    for k in [*range(300, 310), *range(400, 402)]:
        snapshots[k] = replace(snapshots[k], separation=np.array([5.0, 0.05, 5.0]))
    result = grade(stack(snapshots), CRITERIA, START_S)
    assert result.collisions == 2
    assert result.min_separation_m == pytest.approx(0.05)
    assert not holds(result)["collisions"]


def test_collisions_are_counted_a_pair_at_a_time() -> None:
    separation = np.array([[0.1, 1.0], [0.1, 0.2], [1.0, 0.2], [0.29, 1.0]])
    assert count_collisions(separation, 0.3) == 3
    assert count_collisions(np.zeros((5, 0)), 0.3) == 0


def test_a_fleet_that_never_forms() -> None:
    snapshots = [replace(s, position=s.position * 0.0 + [0, 0, 2]) for s in fleet_swims()]
    result = grade(stack(snapshots), CRITERIA, START_S)
    assert result.forming_time_s is None
    assert result.forming_ratio is None
    assert not holds(result)["forming time"]


def test_a_run_that_ends_before_travel_is_graded_by_where_it_stands() -> None:
    snapshots = [s for s in fleet_swims() if s.phase is not Phase.TRAVEL]
    result = grade(stack(snapshots), CRITERIA, START_S)
    assert result.points_filled == 3
    assert result.tracking_rms_m is None
    assert not holds(result)["tracking error"]
    assert result.forming_time_s is not None
    assert result.forming_time_s < FORMING_S


def test_a_program_that_ends_or_a_tick_that_is_missed_is_no_success() -> None:
    history = stack(fleet_swims())
    result = grade(history, CRITERIA, START_S, {2: "watchdog"}, Ticks(0.004, 0))
    assert [v.name for v in result.verdicts if not v.holds] == ["programs"]
    result = grade(history, CRITERIA, START_S, {}, Ticks(0.012, 1))
    assert [v.name for v in result.verdicts if not v.holds] == ["firmware ticks"]
