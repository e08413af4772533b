"""What happened in a run: snapshots ten times a second, and the arrays that grading and pictures read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from companion.events import Severity
from companion.scene import Phase

Array = NDArray[np.float64]
StatusJson = dict[str, Any]
SAMPLE_PERIOD_S = 0.1


@dataclass(frozen=True, slots=True)
class Event:
    """Something worth a line in the log: time s, vehicle number (0 for the whole fleet), text, how bad it is."""

    stamp: float
    vehicle: int
    text: str
    severity: Severity = Severity.INFO


def events_of(status: StatusJson) -> list[Event]:
    """What a companion had to say in the tick of this status."""
    vehicle = int(status["vehicle"])
    return [Event(e["stamp"], vehicle, e["text"], Severity(e["severity"])) for e in status["events"]]


@dataclass(frozen=True, slots=True)
class Snapshot:
    """The truth at one moment, and what each companion last said; N vehicles, L points, P = N (N - 1) / 2 pairs.

    Mission frame, m, m/s, rad: position, velocity over ground, Euler angles and current (N, 3), points (L, 3);
    travelled (N,) m over ground; pulses (N, 3) us of bow, stern and motor; separation (P,) least distance m between
    hulls since the last snapshot, pairs as in sim.world.pairs; statuses (N) of the companions as
    companion.status.to_json gives them, None before the first tick.
    """

    now: float
    phase: Phase
    position: Array
    velocity: Array
    euler: Array
    current: Array
    travelled: Array
    pulses: Array
    separation: Array
    points: Array
    heading: float
    statuses: tuple[StatusJson | None, ...]
    events: tuple[Event, ...] = ()

    @property
    def decided(self) -> NDArray[np.int64]:
        """Index (N,) of the point that each vehicle holds, -1 for none."""
        points = [None if status is None else status["point"] for status in self.statuses]
        return np.array([-1 if point is None else point for point in points], dtype=np.int64)


@dataclass(frozen=True, slots=True)
class History:
    """All snapshots of a run, stacked over T times; shapes and units as in Snapshot with T in front."""

    time: Array
    phase: tuple[Phase, ...]
    position: Array
    velocity: Array
    euler: Array
    travelled: Array
    separation: Array
    points: Array
    decided: NDArray[np.int64]
    events: tuple[Event, ...] = ()

    def during(self, *phases: Phase) -> NDArray[np.bool_]:
        """Mask (T,) of the samples in these phases."""
        return np.array([phase in phases for phase in self.phase], dtype=bool)

    def tracking_error(self) -> Array:
        """Distance (T, N) m of each vehicle to the point it holds; NaN where it holds none."""
        held = np.take_along_axis(self.points, np.maximum(self.decided, 0)[:, :, None], axis=1)
        error = np.linalg.norm(self.position - held, axis=2)
        return np.where(self.decided >= 0, error, np.nan)


def stack(snapshots: Sequence[Snapshot]) -> History:
    """The history of at least one snapshot."""

    def all_of(name: str) -> NDArray[Any]:
        return np.stack([getattr(snapshot, name) for snapshot in snapshots])

    return History(
        time=np.array([snapshot.now for snapshot in snapshots]),
        phase=tuple(snapshot.phase for snapshot in snapshots),
        position=all_of("position"),
        velocity=all_of("velocity"),
        euler=all_of("euler"),
        travelled=all_of("travelled"),
        separation=all_of("separation"),
        points=all_of("points"),
        decided=all_of("decided"),
        events=tuple(event for snapshot in snapshots for event in snapshot.events),
    )
