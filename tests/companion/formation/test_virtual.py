"""The virtual formation: where its points are at every time of the mission, and that a vehicle can follow them."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from companion.formation import VirtualFormation
from companion.formation.path import round_corners, through
from companion.mission import Mission
from companion.scene import Phase
from tests.companion.formation.missions import SPEED, mission

Array = NDArray[np.float64]

CORNER: dict[str, Any] = {"waypoints_m": ((30.0, 0.0), (30.0, 30.0)), "pace_mps": 0.3, "turn_radius_m": 12.0}
PERIOD_S = 0.1


def journey(of: Mission) -> tuple[VirtualFormation, Array, Array, Array, list[Phase]]:
    virtual = VirtualFormation(of)
    states = [virtual.at(float(now)) for now in np.arange(0.0, virtual.end_s + 5.0, PERIOD_S)]
    return (
        virtual,
        np.array([state.points for state in states]),
        np.array([state.velocities for state in states]),
        np.array([state.heading for state in states]),
        [state.phase for state in states],
    )


def test_it_waits_forms_travels_and_stops_at_the_last_waypoint() -> None:
    late = mission(6, **CORNER)
    late = replace(late, schedule=replace(late.schedule, start_s=5.0, forming_s=20.0))
    virtual, points, velocities, headings, phases = journey(late)
    order = [phase for i, phase in enumerate(phases) if i == 0 or phase is not phases[i - 1]]
    assert order == [Phase.WAITING, Phase.FORMING, Phase.TRAVEL, Phase.DONE]
    assert virtual.at(4.99).phase is Phase.WAITING
    assert virtual.at(5.0).phase is Phase.FORMING
    assert virtual.at(25.0).phase is Phase.TRAVEL
    assert virtual.at(virtual.end_s).phase is Phase.DONE
    np.testing.assert_allclose(points[0].mean(axis=0), (0.0, 0.0, 2.0), atol=1e-9)
    np.testing.assert_allclose(points[-1].mean(axis=0), (30.0, 30.0, 2.0), atol=1e-9)
    assert headings[0] == pytest.approx(0.0, abs=1e-9)
    assert headings[-1] == pytest.approx(math.pi / 2, abs=1e-9)
    assert not velocities[0].any()
    assert not velocities[-1].any()
    assert virtual.length_m == pytest.approx(60.0 - 2 * 12.0 + 12.0 * math.pi / 2, rel=1e-3)


def test_it_stays_rigid() -> None:
    _, points, _, _, _ = journey(mission(6, **CORNER))
    apart = np.linalg.norm(points[:, :, None] - points[:, None], axis=3)
    np.testing.assert_allclose(apart, np.broadcast_to(apart[0], apart.shape), atol=1e-9)


@pytest.mark.parametrize("radius", [12.0, 7.0, 3.0])
@pytest.mark.parametrize("heading_deg", [None, 90.0])
def test_a_vehicle_can_follow_every_point(radius: float, heading_deg: float | None) -> None:
    path = {**CORNER, "turn_radius_m": radius, "heading_deg": heading_deg}
    _, points, velocities, _, _ = journey(mission(6, **path))
    speeds = np.linalg.norm(velocities, axis=2)
    accelerations = np.linalg.norm(np.diff(velocities, axis=0), axis=2) / PERIOD_S
    steps = np.linalg.norm(np.diff(points, axis=0), axis=2)
    assert speeds.max() <= 0.8 * SPEED + 1e-4, "a fifth of the speed is left for closing on the point"
    assert accelerations.max() < 0.2, "no jump of velocity, at start, turn and stop"
    assert steps.max() < 1.0, "no step longer than lambda"
    measured = (points[2:] - points[:-2]) / (2 * PERIOD_S)
    np.testing.assert_allclose(measured, velocities[1:-1], atol=0.01)


def test_it_slows_down_in_a_turn_and_nowhere_else() -> None:
    _, _, velocities, headings, phases = journey(mission(6, **{**CORNER, "turn_radius_m": 7.0}))
    centre = np.linalg.norm(velocities.mean(axis=1), axis=1)
    turning = np.abs(np.gradient(headings)) > 1e-4
    travel = np.array([phase is Phase.TRAVEL for phase in phases])
    assert centre[travel & turning].min() < 0.26
    straight = centre[travel & ~turning]
    assert np.median(straight) == pytest.approx(0.3)


def test_the_innermost_point_keeps_steerage_way_where_the_turn_allows_it() -> None:
    wide = mission(6, waypoints_m=((40.0, 0.0), (40.0, 40.0)), pace_mps=0.31, turn_radius_m=20.0)
    wide = replace(wide, limits=replace(wide.limits, top_speed_mps=0.65))
    _, _, velocities, _, phases = journey(wide)
    speeds = np.linalg.norm(velocities, axis=2)
    ramp = int(9.0 / PERIOD_S)
    travel = np.flatnonzero([phase is Phase.TRAVEL for phase in phases])[ramp:-ramp]
    assert speeds[travel].min() > 0.29, "steerage way of 0.2 m/s and half as much again"
    assert speeds.max() <= 0.8 * 0.65 + 1e-4
    assert np.abs(np.diff(speeds, axis=0)).max() < 0.2 * PERIOD_S


def test_it_dives_along_a_path_in_three_dimensions() -> None:
    _, points, velocities, headings, _ = journey(
        mission(6, waypoints_m=((30.0, 0.0, 8.0), (60.0, 30.0, 4.0)), turn_radius_m=6.0)
    )
    depth = points.mean(axis=1)[:, 2]
    assert 7.5 < depth.max() < 7.95, "the corner is rounded in depth too"
    assert depth[-1] == pytest.approx(4.0)
    np.testing.assert_allclose(points[:, :, 2], np.repeat(depth[:, None], 6, axis=1), atol=1e-9)
    assert headings[-1] == pytest.approx(math.pi / 4)
    assert velocities[:, :, 2].max() > 0.05


@pytest.mark.parametrize("heading_deg", [None, 90.0])
def test_it_keeps_its_heading_where_the_mission_wants_it_to(heading_deg: float | None) -> None:
    sharp = mission(6, **{**CORNER, "turn": False, "turn_radius_m": 2.0, "heading_deg": heading_deg})
    virtual, points, velocities, headings, _ = journey(sharp)
    assert (headings == math.radians(heading_deg or 0.0)).all()
    offset = points - points[:, :1]
    np.testing.assert_allclose(offset, np.broadcast_to(offset[0], offset.shape), atol=1e-9)
    np.testing.assert_allclose(velocities, np.broadcast_to(velocities[:, :1], velocities.shape), atol=1e-9)
    np.testing.assert_allclose(points[-1].mean(axis=0)[:2], CORNER["waypoints_m"][-1], atol=1e-6)
    assert virtual.length_m > 20.0


def test_without_waypoints_it_stays_and_is_done_when_formed() -> None:
    virtual, points, velocities, headings, phases = journey(mission(6, heading_deg=90.0))
    assert phases[-1] is Phase.DONE
    assert headings[-1] == pytest.approx(math.pi / 2)
    assert not velocities.any()
    np.testing.assert_array_equal(points[0], points[-1])
    assert virtual.length_m == 0.0


def test_an_arc_that_does_not_fit_its_legs_gets_smaller() -> None:
    corners = np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [10.0, 4.0, 0.0], [20.0, 4.0, 0.0]])
    track = round_corners(corners, 12.0, 0.05, None)
    assert np.linalg.norm(np.diff(track.position, axis=0), axis=1).max() <= 0.051
    cosines = (track.tangent[1:] * track.tangent[:-1]).sum(axis=1)
    assert cosines.min() > math.cos(0.05), "no kink"
    np.testing.assert_allclose(track.position[-1], corners[-1])


def test_a_way_that_turns_straight_back_is_refused() -> None:
    corners = np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
    with pytest.raises(ValueError, match="turns straight back"):
        round_corners(corners, 2.0, 0.1, None)


@given(st.floats())
def test_it_answers_at_any_time(now: float) -> None:
    state = VIRTUAL.at(now)
    assert np.isfinite(state.points).all()
    assert np.isfinite(state.velocities).all()


VIRTUAL = VirtualFormation(mission(6, **CORNER))


BEND = np.array([[0.0, 0.0, 2.0], [30.0, 10.0, 4.0], [60.0, -10.0, 6.0], [90.0, 0.0, 6.0]])


def test_a_smooth_curve_goes_through_all_its_points_without_a_kink() -> None:
    track = through(BEND, 12.0, 0.1, None)
    for corner in BEND:
        assert np.linalg.norm(track.position - corner, axis=1).min() < 0.06
    steps = np.diff(track.position, axis=0)
    assert np.linalg.norm(steps, axis=1).max() <= 0.1
    cosines = (steps / np.linalg.norm(steps, axis=1)[:, None] * track.tangent[:-1]).sum(axis=1)
    assert cosines.min() > 1.0 - 1e-4, "the tangent is the direction of the way"
    curvature = np.linalg.norm(np.diff(track.tangent, axis=0), axis=1) / np.diff(track.along)
    assert np.abs(np.diff(curvature)).max() < 2e-3, "no step of curvature: nothing to slow down for at a point"
    np.testing.assert_allclose(np.gradient(track.heading, track.along), track.turning, atol=1e-3)


def test_a_smooth_curve_is_scipys_natural_spline() -> None:
    track = through(BEND, 12.0, 0.1, None)
    chords = np.concatenate(((0.0,), np.cumsum(np.linalg.norm(np.diff(BEND, axis=0), axis=1))))
    theirs = CubicSpline(chords, BEND, bc_type="natural")(np.linspace(0.0, chords[-1], 20001))
    away = [np.linalg.norm(theirs - place, axis=1).min() for place in track.position[::50]]
    assert max(away) < 0.01


def test_dense_points_make_the_curve_that_they_lie_on() -> None:
    angles = np.linspace(0.0, 1.5 * math.pi, 400)
    circle = np.stack((20.0 * np.sin(angles), 20.0 * (1.0 - np.cos(angles)), np.full(400, 3.0)), axis=1)
    track = through(circle, 5.0, 0.05, None)
    assert np.abs(np.hypot(track.position[:, 0], track.position[:, 1] - 20.0) - 20.0).max() < 0.01
    assert track.along[-1] == pytest.approx(30.0 * math.pi, rel=1e-3)
    np.testing.assert_allclose(track.turning[200:-200], 1.0 / 20.0, rtol=0.02)


@pytest.mark.parametrize("curve", ["legs", "spline"])
def test_a_vehicle_can_follow_along_a_curve_in_three_dimensions(curve: str) -> None:
    path: dict[str, Any] = {
        "origin_m": (0.0, 0.0, 2.0),
        "waypoints_m": tuple(map(tuple, BEND[1:].tolist())),
        "pace_mps": 0.3,
    }
    _, points, velocities, _, _ = journey(mission(6, curve=curve, turn_radius_m=8.0, **path))
    assert np.linalg.norm(velocities, axis=2).max() <= 0.8 * SPEED
    np.testing.assert_allclose((points[2:] - points[:-2]) / (2 * PERIOD_S), velocities[1:-1], atol=0.01)
    np.testing.assert_allclose(points[-1].mean(axis=0), BEND[-1], atol=1e-6)
