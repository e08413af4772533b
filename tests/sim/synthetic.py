"""Histories made by hand, on which the answers are known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from companion.scene import Phase
from sim.history import SAMPLE_PERIOD_S, Snapshot, StatusJson
from sim.world import hull_distances

FORMING_S, TRAVEL_S, PACE = 30.0, 60.0, 0.35
START_S = 5.0
POINTS = np.array([(2.0, 0.0, 2.0), (-2.0, 3.0, 2.0), (-2.0, -3.0, 2.0)])


# What a companion would say, as far as anybody asks.
def status(vehicle: int, point: int | None) -> StatusJson:
    link = {"state": "ready"}
    return {
        "vehicle": vehicle,
        "point": point,
        "battery_voltage": 7.9,
        "link": link,
        "armed": True,
        "hold": "",
        "events": [],
    }


# The same moment with other decisions.
def deciding(snapshot: Snapshot, points: Sequence[int | None]) -> Snapshot:
    return replace(snapshot, statuses=tuple(status(i + 1, point) for i, point in enumerate(points)))


# A fleet of point-like vehicles: they lie `away` to the south, swim straight to their points by the end of forming,
# then follow them with the given constant offset; vehicle k holds point order[k].
def fleet_swims(
    offset: NDArray[np.float64] | None = None, away: float = 10.0, order: Sequence[int] = (0, 1, 2)
) -> list[Snapshot]:
    offset = np.zeros((3, 3)) if offset is None else offset
    start = POINTS[list(order)] - [away, 0.0, 0.0]
    travelled = np.zeros(3)
    before = start
    snapshots = []
    for k in range(int((START_S + FORMING_S + TRAVEL_S) / SAMPLE_PERIOD_S) + 1):
        now = k * SAMPLE_PERIOD_S
        share = np.clip((now - START_S) / (FORMING_S - 10.0), 0.0, 1.0)
        travel = max(0.0, now - START_S - FORMING_S)
        points = POINTS + np.array([travel * PACE, 0.0, 0.0])
        position = points[list(order)] - (1.0 - share) * np.array([away, 0.0, 0.0]) + (offset if travel else 0.0)
        travelled = travelled + np.linalg.norm(position - before, axis=1)
        phase = Phase.WAITING if now < START_S else Phase.TRAVEL if travel else Phase.FORMING
        snapshots.append(
            Snapshot(
                now=now,
                phase=phase,
                position=position,
                velocity=(position - before) / SAMPLE_PERIOD_S,
                euler=np.zeros((3, 3)),
                current=np.zeros((3, 3)),
                travelled=travelled,
                pulses=np.full((3, 3), 1500.0),
                separation=hull_distances(position, np.tile([1.0, 0.0, 0.0], (3, 1))),
                points=points,
                heading=0.0,
                statuses=tuple(status(i + 1, order[i] if now >= START_S else None) for i in range(3)),
            )
        )
        before = position
    return snapshots
