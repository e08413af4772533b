"""Missions that tests of the formation share."""

from __future__ import annotations

from typing import Any

from companion.mission import FormationConfig, LimitsConfig, Mission, PathConfig, ScheduleConfig

SPEED = 0.5  # m/s


def mission(count: int, form: str = "price", exponent: float = 1.2, shape: str = "triangle", **path: Any) -> Mission:
    """A mission of vehicles that cannot hover: it forms at once and, with waypoints, travels after 100 s."""
    return Mission(
        name="swarm",
        seed=7,
        vehicles=count,
        formation=FormationConfig(shape=shape, form=form, exponent=exponent, spacing_m=5.0),
        path=PathConfig(**path),
        schedule=ScheduleConfig(start_s=0.0, forming_s=100.0),
        limits=LimitsConfig(top_speed_mps=SPEED, steerage_speed_mps=0.2, safe_distance_m=1.15),
    )
