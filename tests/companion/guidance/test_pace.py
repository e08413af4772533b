"""Coming to a point: slower or faster where the mission says so (s and f of eq 8), and up or down with it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from companion.guidance import Guidance
from companion.mission import LimitsConfig
from companion.scene import Attitude, Decision, OwnPose, Phase, Scene

LIMITS = LimitsConfig()
MOVING = np.array([0.3, 0.0, 0.0])


def speed(away: float, factor: float, velocity: np.ndarray[tuple[int], np.dtype[np.float64]] | None = None) -> float:
    target = np.array([away, 0.0, 2.0])
    decision = Decision(Phase.FORMING, 0, target[None], target, np.zeros(3) if velocity is None else velocity, away)
    pose = OwnPose(np.array([0.0, 0.0, 2.0]), np.zeros(3), Attitude(0.0, 0.0, 0.0), 0.0, 7.0)
    return Guidance(LIMITS).step(7.0, Scene(7.0, pose), replace(decision, pace_factor=factor)).speed


def test_it_closes_on_its_point_by_the_factor_of_the_mission_within_its_speeds() -> None:
    usual = speed(15.0, 1.0)
    assert speed(15.0, 0.7) == pytest.approx(0.7 * usual)
    assert speed(15.0, 1.2) == pytest.approx(min(1.2 * usual, LIMITS.top_speed_mps))
    assert speed(15.0, 0.01) == LIMITS.steerage_speed_mps
    assert speed(15.0, 3.0) == LIMITS.top_speed_mps


def test_behind_a_moving_point_the_factor_is_of_the_closing_speed_so_that_it_always_arrives() -> None:
    usual = speed(15.0, 1.0, MOVING)
    assert usual > 0.31
    assert speed(15.0, 0.7, MOVING) == pytest.approx(0.3 + 0.7 * (usual - 0.3))
    assert speed(15.0, 0.001, MOVING) > 0.3


def test_at_its_point_it_is_like_any_other() -> None:
    for factor in (0.7, 1.2, 0.0, float("nan")):
        assert speed(2.0, factor) == speed(2.0, 1.0)
        assert speed(1.0, factor, MOVING) == speed(1.0, 1.0, MOVING)


def depth(down: float, sinking: float) -> float:
    target, velocity = np.array([3.0, 0.0, down]), np.array([0.3, 0.0, sinking])
    pose = OwnPose(np.array([0.0, 0.0, down]), np.zeros(3), Attitude(0.0, 0.0, 0.0), 0.0, 7.0)
    decision = Decision(Phase.TRAVEL, 0, target[None], target, velocity, 3.0)
    return Guidance(LIMITS).step(7.0, Scene(7.0, pose), decision).depth


def test_it_is_told_the_depth_that_its_point_will_have_once_the_firmware_follows() -> None:
    assert depth(5.0, 0.0) == 5.0
    assert depth(5.0, 0.03) == pytest.approx(5.12)
    assert depth(5.0, -0.03) == pytest.approx(4.88)
    assert depth(LIMITS.depth_min_m, -0.03) == LIMITS.depth_min_m
    assert depth(LIMITS.depth_max_m, 0.03) == LIMITS.depth_max_m
