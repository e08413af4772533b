"""The shapes of a formation as lists of points: triangle, line, column, wedge, diamond, polygon, tetrahedron.

Every function returns (count, 3) metres, body of the formation (forward, right, down), not yet centred, points at least
`spacing` apart. All but the tetrahedron lie in one plane (down = 0), which `tilted` brings out of the horizontal. The
formation moves forward along its first axis.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float64]


def triangle(count: int, spacing: float) -> Points:
    """Rows of 1, 2, 3, ... points on an equilateral grid, tip ahead; an incomplete last row fills from its middle."""
    points: list[tuple[float, float, float]] = []
    row = 0
    while len(points) < count:
        rights = sorted(((i - row / 2) * spacing for i in range(row + 1)), key=lambda right: (abs(right), right))
        points += [(-row * spacing * math.sqrt(3) / 2, right, 0.0) for right in rights[: count - len(points)]]
        row += 1
    return np.array(points)


def line(count: int, spacing: float) -> Points:
    """Side by side."""
    return np.array([(0.0, i * spacing, 0.0) for i in range(count)])


def column(count: int, spacing: float) -> Points:
    """One behind the other."""
    return np.array([(-i * spacing, 0.0, 0.0) for i in range(count)])


def wedge(count: int, spacing: float) -> Points:
    """A V with its tip ahead and a right angle between its arms, filled from the tip, left and right in turn."""
    step = spacing / math.sqrt(2)
    return np.array([(-((i + 1) // 2) * step, ((i + 1) // 2) * step * (-1) ** i, 0.0) for i in range(count)])


def diamond(count: int, spacing: float) -> Points:
    """A square grid standing on its corner, filled from the tip ahead."""
    side = math.ceil(math.sqrt(count))
    step = spacing / math.sqrt(2)
    cells = sorted(((i, j) for i in range(side) for j in range(side)), key=lambda c: (c[0] + c[1], abs(c[0] - c[1]), c))
    return np.array([(-(i + j) * step, (i - j) * step, 0.0) for i, j in cells[:count]])


def polygon(count: int, spacing: float) -> Points:
    """The corners of a regular polygon with sides of `spacing`, the first one ahead."""
    radius = spacing / (2 * math.sin(math.pi / count)) if count > 1 else 0.0
    angles = [2 * math.pi * i / count for i in range(count)]
    return np.array([(radius * math.cos(angle), radius * math.sin(angle), 0.0) for angle in angles])


def tetrahedron(count: int, spacing: float) -> Points:
    """Layers of 1, 3, 6, ... points across the way, packed like spheres, tip ahead; the last fills from its middle."""
    points: list[tuple[float, float, float]] = []
    layer = 0
    while len(points) < count:
        corners = [
            ((j - i / 2) * spacing, (i - layer * 2 / 3) * spacing * math.sqrt(3) / 2)
            for i in range(layer + 1)
            for j in range(i + 1)
        ]
        corners.sort(key=lambda corner: (round(math.hypot(*corner), 9), corner))
        ahead = -layer * spacing * math.sqrt(2 / 3)
        points += [(ahead, right, down) for right, down in corners[: count - len(points)]]
        layer += 1
    return np.array(points)


SHAPES: dict[str, Callable[[int, float], Points]] = {
    "triangle": triangle,
    "line": line,
    "column": column,
    "wedge": wedge,
    "diamond": diamond,
    "polygon": polygon,
    "tetrahedron": tetrahedron,
}


def centred(points: Points) -> Points:
    """The same points about their mean."""
    return np.asarray(points - points.mean(axis=0))


def tilted(points: Points, pitch: float, roll: float) -> Points:
    """The same points after a roll (starboard side down) and then a pitch (what is ahead up), both rad."""
    forward, right, down = points.T
    right, down = right * math.cos(roll) - down * math.sin(roll), right * math.sin(roll) + down * math.cos(roll)
    forward, down = (
        forward * math.cos(pitch) + down * math.sin(pitch),
        down * math.cos(pitch) - forward * math.sin(pitch),
    )
    return np.stack((forward, right, down), axis=1)
