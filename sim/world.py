"""The water and the hulls in it: current at any place and time, and the true distance between hulls."""

from __future__ import annotations

from dataclasses import dataclass

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


def heading_axis(euler: Array) -> Array:
    """Unit vectors (N, 3) along the hulls, from Euler angles (N, 3) roll, pitch, yaw in radians."""
    pitch, yaw = euler[:, 1], euler[:, 2]
    return np.stack([np.cos(pitch) * np.cos(yaw), np.cos(pitch) * np.sin(yaw), -np.sin(pitch)], axis=1)


def hull_distances(position: Array, euler: Array) -> Array:
    """Distance (N, N) m between the surfaces of hulls, as capsules in their true attitude; inf on the diagonal.

    Negative where hulls overlap. Position (N, 3) m is the middle of the hull.
    """
    count = len(position)
    out = np.full((count, count), np.inf)
    first, second = np.triu_indices(count, 1)
    if len(first):
        half = (HULL_LENGTH_M - HULL_DIAMETER_M) / 2.0 * heading_axis(euler)
        distance = _segment_distance(position[first], half[first], position[second], half[second]) - HULL_DIAMETER_M
        out[first, second] = out[second, first] = distance
    return out


def _segment_distance(centre_a: Array, half_a: Array, centre_b: Array, half_b: Array) -> Array:
    """Least distances (P,) of segments centre +- half (P, 3): the interior solution where it exists, else an end's."""
    apart = centre_b - centre_a
    aa, bb, ab = (np.sum(u * v, axis=1) for u, v in ((half_a, half_a), (half_b, half_b), (half_a, half_b)))
    da, db = np.sum(half_a * apart, axis=1), np.sum(half_b * apart, axis=1)
    determinant = aa * bb - ab * ab
    crossing = determinant > 1e-12
    divisor = np.where(crossing, determinant, 1.0)
    s = (da * bb - db * ab) / divisor
    t = (da * ab - db * aa) / divisor
    inside = crossing & (np.abs(s) <= 1.0) & (np.abs(t) <= 1.0)
    candidates = [np.where(inside, np.linalg.norm(apart + t[:, None] * half_b - s[:, None] * half_a, axis=1), np.inf)]
    for end in (-1.0, 1.0):
        t = np.clip((end * ab - db) / bb, -1.0, 1.0)
        candidates.append(np.linalg.norm(apart + t[:, None] * half_b - end * half_a, axis=1))
        s = np.clip((end * ab + da) / aa, -1.0, 1.0)
        candidates.append(np.linalg.norm(apart + end * half_b - s[:, None] * half_a, axis=1))
    return np.asarray(np.min(np.stack(candidates), axis=0))
