"""What perception makes of a noisy sensor: own pose, current and neighbours; and of bad input."""

from __future__ import annotations

import math
from dataclasses import fields

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from companion.perception import Motion, Perception
from companion.scene import Attitude, Scene, Sighting

Array = NDArray[np.float64]
SIGMA = 0.1
CURRENT = np.array((0.08, -0.06, 0.0))


class Dive:
    """A vehicle on a circle of 5 m at 0.4 m/s through a current, with neighbours on a raft that drifts at 0.3 m/s."""

    def __init__(self, seed: int = 1, neighbours: int = 5) -> None:
        self.random = np.random.default_rng(seed)
        self.perception = Perception()
        self.raft = np.array([(-8.0 + 3.0 * (i % 3), -4.0 + 3.0 * (i // 3), 0.3 * i) for i in range(neighbours)])
        self.drift = np.array((0.3, 0.0, 0.0))
        self.position = np.array((0.0, 0.0, 2.0))
        self.heading = 0.0
        self.now = 0.0
        self.neighbours = self.raft

    def motion(self) -> Motion:
        return Motion(self.now, Attitude(0.0, 0.0, self.heading), float(self.position[2]), 0.4)

    def sighting(self, relative: Array | None = None) -> Sighting:
        seen = self.neighbours - self.position if relative is None else relative
        noise = self.random.normal(0.0, SIGMA, seen.shape)
        return Sighting(self.now, self.position + self.random.normal(0.0, SIGMA, 3), SIGMA, seen + noise, 20.0)

    def swim(self) -> None:
        """A tenth of a second of true motion."""
        self.heading += 0.08 * 0.1
        through = 0.4 * np.array((math.cos(self.heading), math.sin(self.heading), 0.0))
        self.position = self.position + (through + CURRENT) * 0.1
        self.now = round(self.now + 0.1, 6)
        self.neighbours = self.raft + self.drift * self.now

    def run(self, seconds: float) -> Scene:
        """Swims on with good input and gives the last scene."""
        scene = Scene(self.now, None)
        for _ in range(round(seconds * 10)):
            self.swim()
            scene = self.perception.step(self.now, self.sighting(), self.motion())
        return scene


def test_after_half_a_minute_it_knows_where_it_is_and_how_the_water_runs() -> None:
    dive = Dive()
    dive.run(30.0)
    errors, currents, speeds = [], [], []
    for _ in range(300):
        scene = dive.run(0.1)
        assert scene.own is not None
        errors.append(scene.own.position[:2] - dive.position[:2])
        currents.append(scene.own.current - CURRENT)
        through = 0.4 * np.array((math.cos(dive.heading), math.sin(dive.heading), 0.0))
        speeds.append(scene.own.velocity - through - CURRENT)
    assert np.sqrt(np.mean(np.square(errors))) < 0.4 * SIGMA
    assert np.sqrt(np.mean(np.square(currents))) < 0.02
    assert np.sqrt(np.mean(np.square(speeds))) < 0.02
    assert scene.own is not None
    assert scene.own.sigma == pytest.approx(np.sqrt(np.mean(np.square(errors))), rel=0.5)


def test_it_tracks_five_neighbours_without_a_false_one() -> None:
    dive = Dive()
    dive.run(10.0)
    position_errors, velocity_errors = [], []
    for _ in range(400):
        scene = dive.run(0.1)
        assert len(scene.neighbours) == 5
        for truth in dive.neighbours:
            nearest = min(scene.neighbours, key=lambda other: float(np.linalg.norm(other.position - truth)))
            position_errors.append(nearest.position - truth)
            velocity_errors.append(nearest.velocity - dive.drift)
    assert np.sqrt(np.mean(np.square(position_errors))) < 0.07
    assert np.sqrt(np.mean(np.square(velocity_errors))) < 0.08
    assert [other.travelled for other in scene.neighbours] == pytest.approx([0.3 * 50.0] * 5, abs=1.2)


def test_a_resting_neighbour_travels_no_way() -> None:
    dive = Dive()
    dive.drift = np.zeros(3)
    scene = dive.run(120.0)
    assert max(other.travelled for other in scene.neighbours) < 1.1


def test_a_circling_neighbour_is_seen_to_turn() -> None:
    dive = Dive(neighbours=1)
    rates = []
    for tick in range(600):
        dive.swim()
        angle = 0.17 * dive.now
        dive.neighbours = np.array(((8.0 + 1.5 * math.cos(angle), 1.5 * math.sin(angle), 2.0),))
        scene = dive.perception.step(dive.now, dive.sighting(), dive.motion())
        if tick > 200:
            rates.append(scene.neighbours[0].turn_rate)
    assert 0.10 < np.mean(rates) < 0.20
    assert np.std(rates) < 0.08


def test_a_neighbour_seen_nine_times_in_ten_is_never_lost_and_a_flash_never_becomes_one() -> None:
    dive = Dive()
    dive.run(5.0)
    for tick in range(600):
        dive.swim()
        seen = dive.neighbours[dive.random.random(5) > 0.1] - dive.position
        if tick % 20 == 0:
            seen = np.concatenate((seen, dive.random.uniform(-15.0, 15.0, (1, 3))))
        scene = dive.perception.step(dive.now, dive.sighting(seen), dive.motion())
        assert len(scene.neighbours) == 5


def test_a_neighbour_out_of_sight_is_forgotten_after_two_seconds() -> None:
    dive = Dive()
    assert len(dive.run(5.0).neighbours) == 5
    ages = []
    for _ in range(25):
        dive.swim()
        scene = dive.perception.step(dive.now, dive.sighting(np.zeros((0, 3))), dive.motion())
        ages += [other.age for other in scene.neighbours]
    assert not scene.neighbours
    assert 1.8 < max(ages) <= 2.0


def test_without_fixes_it_reckons_on_for_two_seconds_and_then_says_so() -> None:
    dive = Dive()
    dive.run(20.0)
    errors = []
    for _ in range(30):
        dive.swim()
        scene = dive.perception.step(dive.now, None, dive.motion())
        if scene.own is not None:
            errors.append(float(np.linalg.norm(scene.own.position - dive.position)))
    assert len(errors) == 20
    assert max(errors) < 0.25
    assert scene.own is None
    assert scene.neighbours == ()
    assert dive.run(1.0).own is not None


def test_without_telemetry_there_is_no_pose() -> None:
    dive = Dive()
    dive.run(5.0)
    for _ in range(15):
        dive.swim()
        scene = dive.perception.step(dive.now, dive.sighting(), None)
    assert scene.own is None
    assert dive.run(0.1).own is not None


def test_a_wild_fix_is_refused_and_a_true_jump_is_accepted_within_a_second() -> None:
    dive = Dive()
    before = dive.run(10.0)
    dive.swim()
    wild = Sighting(dive.now, dive.position + 30.0, SIGMA, dive.neighbours - dive.position)
    scene = dive.perception.step(dive.now, wild, dive.motion())
    assert before.own is not None
    assert scene.own is not None
    assert np.linalg.norm(scene.own.position - before.own.position) < 0.3
    assert dive.perception.counters.outlier_fixes == 1
    dive.position = dive.position + np.array((10.0, 0.0, 0.0))
    after = dive.run(1.0)
    assert after.own is not None
    assert np.linalg.norm(after.own.position - dive.position) < 0.5


def test_bad_detections_are_dropped_and_counted_by_cause() -> None:
    dive = Dive()
    dive.run(5.0)
    dive.swim()
    good = dive.neighbours - dive.position
    bad = np.array(((np.nan, 0.0, 0.0), (np.inf, 1.0, 1.0), (0.0, 0.0, 0.0)))
    sighting = Sighting(dive.now, dive.position, SIGMA, np.concatenate((good, good[:2], bad)), 20.0)
    scene = dive.perception.step(dive.now, sighting, dive.motion())
    assert len(scene.neighbours) == 5
    counters = dive.perception.counters
    assert (counters.bad_detections, counters.duplicate_detections) == (2, 3)
    dive.perception.step(dive.now, sighting, dive.motion())
    assert counters.late_sightings == 1


def test_a_clock_that_jumps_back_starts_everything_anew() -> None:
    dive = Dive()
    dive.run(5.0)
    dive.now = 1.0
    scene = dive.perception.step(dive.now, None, dive.motion())
    assert scene.own is None
    assert dive.perception.counters.clock_jumps == 1
    assert len(dive.run(5.0).neighbours) == 5


def test_same_inputs_same_scenes() -> None:
    first, second = Dive().run(20.0), Dive().run(20.0)
    assert first.own is not None
    assert second.own is not None
    assert first.own.position.tobytes() == second.own.position.tobytes()
    for one, other in zip(first.neighbours, second.neighbours, strict=True):
        assert all(np.array_equal(getattr(one, f.name), getattr(other, f.name)) for f in fields(one))


any_float = st.floats(allow_nan=True, allow_infinity=True, width=32)
vectors = st.tuples(any_float, any_float, any_float)


@given(
    st.lists(st.tuples(any_float, st.none() | vectors, st.lists(vectors, max_size=8), any_float, any_float), max_size=8)
)
def test_no_input_makes_it_fail_or_tell_a_number_that_is_none(
    rows: list[tuple[float, tuple[float, ...] | None, list[tuple[float, ...]], float, float]],
) -> None:
    dive = Dive()
    dive.run(1.0)
    for stamp, position, relative, sigma, speed in rows:
        dive.swim()
        where = None if position is None else np.array(position)
        sighting = Sighting(stamp, where, sigma, np.array(relative).reshape(-1, 3), sigma)
        motion = Motion(dive.now, Attitude(0.0, 0.0, dive.heading), sigma, speed)
        scene = dive.perception.step(dive.now, sighting, motion)
        values = [scene.own.position, scene.own.velocity, scene.own.current] if scene.own else []
        values += [value for other in scene.neighbours for value in (other.position, other.velocity)]
        assert all(np.isfinite(value).all() for value in values)
