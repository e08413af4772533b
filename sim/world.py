"""The water and the hulls in it: current at any place and time, and the true distance between hulls."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

HULL_LENGTH_M = 0.77
HULL_DIAMETER_M = 0.13
_EDDIES = 24


@dataclass(frozen=True, slots=True)
class Current:
    """The water's motion over ground: mean (2,) m/s north and east, its gain a metre of depth, and turbulence.

    `shear_per_m` scales the mean by 1 - shear_per_m * depth; `turbulence_mps` is the RMS of each horizontal component
    of the eddies, whose sizes lie between `eddy_min_m` and `eddy_max_m`.
    """

    mean_mps: tuple[float, float] = (0.0, 0.0)
    shear_per_m: float = 0.0
    turbulence_mps: float = 0.0
    eddy_min_m: float = 2.0
    eddy_max_m: float = 20.0


class Water:
    """A velocity field that is a function of place and time alone, so neighbours feel the same eddy.

    The eddies are plane waves across their own wave vector (hence free of divergence), carried along by the mean
    current, with amplitudes that grow with size as in a Kolmogorov cascade (speed ~ size^(1/3)).
    """

    def __init__(self, current: Current, seed: int) -> None:
        self.current = current
        random = np.random.default_rng([seed, 0x3A7E5])
        size = np.geomspace(current.eddy_min_m, current.eddy_max_m, _EDDIES)
        course = random.uniform(0.0, 2.0 * np.pi, _EDDIES)
        weight = np.cbrt(size)
        amplitude = weight * current.turbulence_mps * 2.0 / np.sqrt(np.sum(weight**2))
        number = 2.0 * np.pi / size
        self._wave = number[:, None] * np.stack([np.cos(course), np.sin(course)], axis=1)
        self._velocity = amplitude[:, None] * np.stack([-np.sin(course), np.cos(course)], axis=1)
        self._frequency = number * amplitude
        self._phase = random.uniform(0.0, 2.0 * np.pi, _EDDIES)

    def velocity(self, now: float, position: Array) -> Array:
        """Velocity (N, 3) m/s of the water at positions (N, 3) m, mission frame."""
        mean = np.asarray(self.current.mean_mps)
        out = np.zeros_like(position)
        out[:, :2] = mean * (1.0 - self.current.shear_per_m * position[:, 2:3])
        if self.current.turbulence_mps > 0.0:
            carried = position[:, :2] - mean * now
            out[:, :2] += np.cos(carried @ self._wave.T + self._frequency * now + self._phase) @ self._velocity
        return out


def hull_axis(quaternion: Array) -> Array:
    """Unit vectors (N, 3) along the hulls, from quaternions (N, 4) body to mission, scalar first."""
    w, x, y, z = quaternion.T
    return np.stack([1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)], axis=1)


@cache
def pairs(count: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Indices (P,) of both vehicles of every pair, in the order of numpy.triu_indices(count, 1)."""
    first, second = np.triu_indices(count, 1)
    return first, second


def hull_distances(position: Array, axis: Array) -> Array:
    """Distance (P,) m between the surfaces of the hulls of every pair, as capsules in their true attitude.

    Negative where hulls overlap. Position (N, 3) m is the middle of the hull, axis (N, 3) the unit vector along it.
    """
    first, second = pairs(len(position))
    if not len(first):
        return np.zeros(0)
    half = (HULL_LENGTH_M - HULL_DIAMETER_M) / 2.0 * axis
    return _segment_distance(position[first], half[first], position[second], half[second]) - HULL_DIAMETER_M


def _segment_distance(centre_a: Array, half_a: Array, centre_b: Array, half_b: Array) -> Array:
    """Least distances (P,) of segments centre +- half (P, 3): the interior solution where it exists, else an end's."""
    apart = centre_b - centre_a
    aa, bb, ab = _dot(half_a, half_a), _dot(half_b, half_b), _dot(half_a, half_b)
    da, db = _dot(half_a, apart), _dot(half_b, apart)
    determinant = aa * bb - ab * ab
    crossing = determinant > 1e-12
    divisor = np.where(crossing, determinant, 1.0)
    s = (da * bb - db * ab) / divisor
    t = (da * ab - db * aa) / divisor
    inside = crossing & (np.abs(s) <= 1.0) & (np.abs(t) <= 1.0)
    between = apart + t[:, None] * half_b - s[:, None] * half_a
    least = np.where(inside, _dot(between, between), np.inf)
    for end in (-1.0, 1.0):
        t = np.minimum(np.maximum((end * ab - db) / bb, -1.0), 1.0)
        between = apart + t[:, None] * half_b - end * half_a
        least = np.minimum(least, _dot(between, between))
        s = np.minimum(np.maximum((end * ab + da) / aa, -1.0), 1.0)
        between = apart + end * half_b - s[:, None] * half_a
        least = np.minimum(least, _dot(between, between))
    return np.asarray(np.sqrt(least))


def _dot(u: Array, v: Array) -> Array:
    return np.asarray(np.einsum("ij,ij->i", u, v))
