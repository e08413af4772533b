"""The reserve: places behind the formation where spare vehicles travel along, ready for a point that becomes free."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from companion.formation.virtual import VirtualState

Array = NDArray[np.float64]


def reserve(virtual: VirtualState, count: int, spacing: float) -> tuple[Array, Array]:
    """Places (count, 3) m and their velocities (count, 3) m/s, mission frame.

    They are a row `spacing` m behind the last point, abreast, from its middle outwards, and turns with the formation.
    """
    side = np.array([(index + 1) // 2 * spacing * (-1) ** index for index in range(count)])
    cosine, sine = math.cos(virtual.heading), math.sin(virtual.heading)
    centre, pace = virtual.points.mean(axis=0), virtual.velocities.mean(axis=0)
    arms, swing = virtual.points - centre, virtual.velocities - pace
    behind = float((arms[:, 0] * cosine + arms[:, 1] * sine).min()) - spacing
    offset = np.column_stack((behind * cosine - side * sine, behind * sine + side * cosine, np.zeros(count)))
    inertia = float((arms[:, :2] ** 2).sum())
    rate = float((arms[:, 0] * swing[:, 1] - arms[:, 1] * swing[:, 0]).sum()) / inertia if inertia > 1e-9 else 0.0
    velocity = pace + rate * np.column_stack((-offset[:, 1], offset[:, 0], np.zeros(count)))
    return centre + offset, velocity
