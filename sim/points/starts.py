"""Missions and random starts of the experiments in point dynamics."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from companion.mission import FormationConfig, LimitsConfig, Mission, PathConfig, ScheduleConfig

Array = NDArray[np.float64]

SPEED = 0.5  # top speed of a vehicle, m/s: Table I
DEPTH_M = 2.0
_WIDTHS = (3, 6, 15, 50), (15.0, 20.0, 30.0, 50.0)  # vehicles, and the box that they start in, m


def box_width(count: int) -> float:
    """Width of the square, m, in which so many vehicles start: as wide as the group needs."""
    return float(np.interp(count, *_WIDTHS)) if count <= 50 else 50.0 * (count / 50.0) ** 0.5


def random_starts(seed: int, count: int, apart: float = 2.0) -> Array:
    """Places (count, 3) m, uniform in the box about the origin, at one depth, `apart` m or more from each other."""
    random = np.random.default_rng((seed, count))
    half = box_width(count) / 2.0
    places = np.empty((0, 3))
    while len(places) < count:
        place = np.array([*random.uniform(-half, half, 2), DEPTH_M])
        if not len(places) or np.linalg.norm(places - place, axis=1).min() >= apart:
            places = np.vstack((places, place))
    return places


def forming_mission(
    count: int,
    exponent: float = 1.2,
    form: str = "price",
    shape: str = "triangle",
    vehicles: int | None = None,
    forming_s: float = 1000.0,
    **path: Any,
) -> Mission:
    """`count` points 5 m apart about the origin that form at once and, with waypoints, travel after `forming_s`."""
    return Mission(
        name="points",
        seed=7,
        vehicles=count if vehicles is None else vehicles,
        formation=FormationConfig(shape=shape, form=form, exponent=exponent, spacing_m=5.0, point_count=count),
        path=PathConfig(**path),
        schedule=ScheduleConfig(start_s=0.0, forming_s=forming_s),
        limits=LimitsConfig(top_speed_mps=SPEED, steerage_speed_mps=0.2, safe_distance_m=1.15, waiting_radius_m=0.0),
    )
