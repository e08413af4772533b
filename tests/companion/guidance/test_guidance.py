"""What guidance makes of its inputs alone: setpoints in range, holds with a reason, steering by rule."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from companion.guidance import Guidance, Mode
from companion.mission import LimitsConfig
from companion.scene import Attitude, Decision, Neighbour, Obstacle, OwnPose, Phase, Scene
from tests.companion.guidance.sea import moving, standing

Array = NDArray[np.float64]
LIMITS = LimitsConfig()
AHEAD = np.array((10.0, 0.0, 2.0))


def scene_at(
    now: float = 0.0, yaw: float = 0.0, speed: float = 0.4, **parts: tuple[Neighbour | Obstacle, ...]
) -> Scene:
    """A vehicle at the origin, two metres down, under way north."""
    velocity = speed * np.array((math.cos(yaw), math.sin(yaw), 0.0))
    own = OwnPose(np.array((0.0, 0.0, 2.0)), velocity, Attitude(0.0, 0.0, yaw), 0.05, now)
    return replace(Scene(now, own), **parts)  # type: ignore[arg-type]


def neighbour(north: float, east: float, speed: float = 0.0, down: float = 2.0) -> Neighbour:
    return Neighbour(np.array((north, east, down)), np.array((speed, 0.0, 0.0)), 0.05, 0.0, 0.0)


def test_an_empty_sea_is_crossed_straight() -> None:
    guidance = Guidance(LIMITS)
    setpoint = guidance.step(0.0, scene_at(), moving(AHEAD, np.array((0.35, 0.0, 0.0))))
    assert setpoint.heading == pytest.approx(0.0, abs=1e-9)
    assert (setpoint.depth, setpoint.speed) == (2.0, LIMITS.top_speed_mps)
    assert guidance.status.mode is Mode.FOLLOW


def test_it_gives_way_to_starboard_and_to_what_lies_on_its_way_only() -> None:
    decision = moving(AHEAD, np.array((0.35, 0.0, 0.0)))
    for parts, turns in (
        ({"neighbours": (neighbour(5.0, 0.0, -0.4),)}, True),
        ({"obstacles": (Obstacle(np.array((3.0, 0.0, 2.0)), np.zeros(3), 0.5),)}, True),
        ({"neighbours": (neighbour(5.0, 0.0, -0.4, down=6.0),)}, False),
        ({"neighbours": (neighbour(0.0, 6.0, 0.4), neighbour(0.0, -6.0, 0.4))}, False),
        ({"neighbours": (neighbour(-4.0, 0.0, 0.0),)}, False),
    ):
        guidance = Guidance(LIMITS)
        setpoint = guidance.step(0.0, scene_at(**parts), decision)
        assert (setpoint.heading > 0.1) is turns, parts
        assert guidance.status.giving_way is turns, parts


def test_every_hold_has_its_reason_and_no_thrust() -> None:
    good, target = scene_at(1.0), standing(AHEAD)
    assert good.own is not None
    lost = replace(good.own, position=np.array((math.nan, 0.0, 0.0)))
    cases = {
        "own pose is unknown": (1.0, Scene(1.0, None), target),
        "own pose is out of this world": (1.0, replace(good, own=lost), target),
        "scene is stale": (2.0, good, target),
        "waiting for the start": (
            1.0,
            good,
            Decision(Phase.WAITING, None, np.zeros((0, 3)), None, np.zeros(3), None, "waiting for the start"),
        ),
        "no point to go to": (1.0, good, Decision(Phase.FORMING, None, np.zeros((0, 3)), None, np.zeros(3), None)),
        "point is out of this world": (1.0, good, standing(np.array((math.inf, 0.0, 2.0)))),
    }
    for reason, (now, scene, decision) in cases.items():
        guidance = Guidance(LIMITS)
        setpoint = guidance.step(now, scene, decision)
        assert (setpoint.speed, guidance.status.mode, guidance.status.reason) == (0.0, Mode.HOLD, reason)
        assert guidance.step(1.0, good, target).speed > 0.0


def test_a_neighbour_that_is_no_number_is_left_out() -> None:
    decision = moving(AHEAD, np.array((0.35, 0.0, 0.0)))
    ghost = neighbour(math.nan, 0.0)
    clear = Guidance(LIMITS).step(0.0, scene_at(), decision)
    assert Guidance(LIMITS).step(0.0, scene_at(neighbours=(ghost,)), decision) == clear


def test_same_seed_same_setpoints() -> None:
    def swim(seed: int) -> list[object]:
        guidance = Guidance(LIMITS, seed=seed)
        wall = tuple(neighbour(2.0, east) for east in np.arange(-6.0, 7.0))
        decision = moving(np.array((6.0, 0.0, 2.0)), np.array((0.06, 0.0, 0.0)))
        return [guidance.step(i / 10, scene_at(i / 10, neighbours=wall), decision) for i in range(200)]

    assert swim(1) == swim(1)
    assert swim(1) != swim(2)


any_float = st.floats(allow_nan=True, allow_infinity=True)
sane = st.floats(-20.0, 20.0)
vectors = st.tuples(*[any_float | sane] * 3).map(np.array)
sane_vectors = st.tuples(sane, sane, sane).map(np.array)
attitudes = st.builds(Attitude, sane, sane, any_float | sane)
poses = st.builds(
    OwnPose, vectors | sane_vectors, vectors | sane_vectors, attitudes, any_float, any_float, sane_vectors
)
neighbours = st.builds(Neighbour, vectors, vectors, any_float, any_float, any_float, any_float | sane)
obstacles = st.builds(Obstacle, vectors, vectors, any_float)
scenes = st.builds(
    Scene,
    st.just(0.0) | any_float,
    st.none() | poses,
    st.lists(neighbours, max_size=6).map(tuple),
    st.lists(obstacles, max_size=3).map(tuple),
)


@given(st.lists(st.tuples(scenes, vectors, sane_vectors), min_size=1, max_size=4))
def test_any_scene_gets_a_setpoint_in_range_or_a_hold_with_a_reason(rows: list[tuple[Scene, Array, Array]]) -> None:
    guidance = Guidance(LIMITS)
    for scene, target, velocity in rows:
        setpoint = guidance.step(0.0, scene, moving(target, velocity))
        assert -math.pi <= setpoint.heading <= math.pi
        if guidance.status.mode is Mode.HOLD:
            assert setpoint.speed == 0.0
            assert guidance.status.reason
            assert math.isfinite(setpoint.depth)
        else:
            assert LIMITS.steerage_speed_mps <= setpoint.speed <= LIMITS.top_speed_mps
            assert LIMITS.depth_min_m <= setpoint.depth <= LIMITS.depth_max_m
