"""What the live page is told: one introduction of the run, then a frame for every moment that it shows."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from companion.formation import VirtualFormation
from companion.mission import Mission
from sim.grade import Grade
from sim.history import Array, Snapshot
from sim.record import nearest_hulls
from sim.scenario import Scenario
from sim.world import HULL_DIAMETER_M, HULL_LENGTH_M

_WAY_PLACES = 300  # of the path


def introduction(scenario: Scenario, mcu: str, *, paced: bool) -> dict[str, Any]:
    """Everything about a run that does not change; `paced` when viewers may pause it and choose its speed."""
    mission, config = scenario.mission, scenario.config
    return {
        "type": "run",
        "scenario": scenario.name,
        "title": config.title,
        "seed": mission.seed,
        "mcu": mcu,
        "paced": paced,
        "vehicles": mission.vehicles,
        "duration_s": config.duration_s,
        "shape": ", then ".join((mission.formation.shape, *(change.shape for change in mission.transform))),
        "range_m": config.sensor.range_m,
        "hull_m": [HULL_LENGTH_M, HULL_DIAMETER_M],
        "path": np.round(_way(mission), 2).tolist(),
        "tracking_limit_m": config.criteria.tracking_rms_m,
        "separation_limit_m": config.criteria.separation_m,
    }


# The centre's way (K, 3), m, as finely as a page shows it.
def _way(mission: Mission) -> Array:
    way = VirtualFormation(mission).way
    return np.asarray(way[np.unique(np.linspace(0, len(way) - 1, min(len(way), _WAY_PLACES)).round().astype(int))])


def frame(snapshot: Snapshot) -> dict[str, Any]:
    """One moment, rounded to what can be seen."""
    nearest = nearest_hulls(snapshot.separation, len(snapshot.position))
    return {
        "type": "frame",
        "t": round(snapshot.now, 2),
        "phase": snapshot.phase.value,
        "points": np.round(snapshot.points, 2).tolist(),
        "current": np.round(snapshot.current.mean(axis=0)[:2], 3).tolist(),
        "vehicles": [_vehicle(snapshot, i, point, float(nearest[i])) for i, point in enumerate(snapshot.decided)],
        "events": [{"t": round(e.stamp, 2), "vehicle": e.vehicle, "text": e.text} for e in snapshot.events],
    }


def result(grade: Grade) -> dict[str, Any]:
    """How the run ended."""
    return {"type": "result", "success": grade.success, "verdicts": [asdict(verdict) for verdict in grade.verdicts]}


def _vehicle(snapshot: Snapshot, i: int, decided: int, nearest: float) -> dict[str, Any]:
    point, status = int(decided), snapshot.statuses[i]
    error = float(np.linalg.norm(snapshot.position[i] - snapshot.points[point])) if point >= 0 else None
    return {
        "at": np.round(snapshot.position[i], 3).tolist(),
        "yaw": round(float(snapshot.euler[i, 2]), 3),
        "speed": round(float(np.linalg.norm(snapshot.velocity[i])), 3),
        "length": round(float(snapshot.travelled[i]), 1),
        "nearest": round(nearest, 2) if np.isfinite(nearest) else None,
        "point": point if point >= 0 else None,
        "error": None if error is None else round(error, 3),
        "battery": None if status is None else status["battery_voltage"],
        "link": "" if status is None else status["link"]["state"],
        "armed": status is not None and status["armed"],
        "hold": "" if status is None else status["hold"],
    }
