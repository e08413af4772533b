"""The water is a smooth field of the stated strength; hulls are as far apart as geometry says."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from sim.world import HULL_DIAMETER_M, HULL_LENGTH_M, Current, Water, hull_axis, hull_distances


# Quaternions of hulls with the given roll, pitch and yaw, by products of rotations about one axis each.
def quaternions(*eulers: tuple[float, ...]) -> NDArray[np.float64]:
    def times(p: NDArray[np.float64], q: NDArray[np.float64]) -> NDArray[np.float64]:
        vector = p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:])
        return np.array([p[0] * q[0] - p[1:] @ q[1:], *vector])

    def about(axis: int, angle: float) -> NDArray[np.float64]:
        return np.array([np.cos(angle / 2), *(np.sin(angle / 2) * np.eye(3)[axis])])

    return np.stack([times(times(about(2, yaw), about(1, pitch)), about(0, roll)) for roll, pitch, yaw in eulers])


ANGLE = st.floats(-3.1, 3.1)
PLACE = st.floats(-2.0, 2.0)


@pytest.mark.parametrize(
    ("euler", "offset", "expected"),
    [
        ((0, 0, 0), (0, 1, 0), 1 - HULL_DIAMETER_M),  # abeam
        ((0, 0, 0), (1, 0, 0), 1 - HULL_LENGTH_M),  # in line, nose to tail
        ((0, 0, np.pi / 2), (0, 1, 0), 1 - HULL_LENGTH_M / 2 - HULL_DIAMETER_M / 2),  # a T
        ((0, np.pi / 2, 0), (0, 0, 1), 1 - HULL_LENGTH_M / 2 - HULL_DIAMETER_M / 2),  # standing below
        ((0, 0, np.pi / 2), (0, 0, 0.5), 0.5 - HULL_DIAMETER_M),  # crossing over
        ((0, 0, 0), (0, 0.1, 0), 0.1 - HULL_DIAMETER_M),  # overlapping
    ],
)
def test_distance_of_two_hulls_by_hand(euler: tuple[float, ...], offset: tuple[float, ...], expected: float) -> None:
    position = np.array([(0, 0, 0), offset], dtype=float)
    axis = hull_axis(quaternions((0, 0, 0), euler))
    assert hull_distances(position, axis) == pytest.approx([expected], abs=1e-9)
    assert hull_distances(position[::-1], axis[::-1]) == pytest.approx([expected], abs=1e-9)


@given(st.tuples(PLACE, PLACE, PLACE), st.tuples(ANGLE, ANGLE, ANGLE), st.tuples(ANGLE, ANGLE, ANGLE))
def test_distance_equals_that_of_densely_sampled_axes(
    offset: tuple[float, ...], first: tuple[float, ...], second: tuple[float, ...]
) -> None:
    position = np.array([(0, 0, 0), offset], dtype=float)
    axis = hull_axis(quaternions(first, second))
    assert np.linalg.norm(axis, axis=1) == pytest.approx([1.0, 1.0])
    along = np.linspace(-1, 1, 201)[:, None] * (HULL_LENGTH_M - HULL_DIAMETER_M) / 2
    a, b = along * axis[0], position[1] + along * axis[1]
    sampled = np.min(np.linalg.norm(a[:, None] - b[None], axis=2)) - HULL_DIAMETER_M
    exact = hull_distances(position, axis)[0]
    assert exact <= sampled + 1e-9
    assert sampled - exact < 0.005


def test_one_vehicle_has_no_distance() -> None:
    assert hull_distances(np.zeros((1, 3)), np.array([[1.0, 0.0, 0.0]])).shape == (0,)


def test_current_is_uniform_sheared_and_turbulent_as_stated() -> None:
    place = np.random.default_rng(1).uniform(-200, 200, (20000, 3))
    place[:, 2] = 2.0
    uniform = Water(Current((0.1, -0.05)), 1).velocity(9.0, place)
    assert np.all(uniform == [0.1, -0.05, 0.0])
    sheared = Water(Current((0.1, 0.0), shear_per_m=0.1), 1).velocity(0.0, place)
    assert sheared[0] == pytest.approx([0.08, 0.0, 0.0])
    rough = Water(Current((0.1, 0.0), turbulence_mps=0.03), 1)
    velocity = rough.velocity(50.0, place)
    assert np.mean(velocity, axis=0) == pytest.approx([0.1, 0.0, 0.0], abs=0.002)
    speed = np.sqrt(np.mean(np.sum((velocity - np.array([0.1, 0, 0])) ** 2, axis=1)) / 2)
    assert speed == pytest.approx(0.03, rel=0.05)
    near = rough.velocity(50.0, place + np.array([0.05, 0.0, 0.0]))
    assert np.max(np.abs(near - velocity)) < 0.02
    assert np.any(Water(Current((0.1, 0.0), turbulence_mps=0.03), 2).velocity(50.0, place) != velocity)
