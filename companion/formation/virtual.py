"""Algorithm 2's virtual formation: the points of the formation as they move along the mission's path.

It waits and forms at the path's origin, then travels: it translates along the path, turns with its tangent unless the
mission says otherwise, and starts and stops smoothly; at the places and times that the mission names it goes over from
one shape to the next. The whole journey is worked out beforehand in steps shorter than lambda (eqs 9 and 10).
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from companion.formation.journey import Journey
from companion.formation.timetable import offsets, velocities
from companion.formation.transform import Span, bodies
from companion.mission import Mission
from companion.scene import Phase

Array = NDArray[np.float64]

_BLOCK = 1024  # samples worked on at once: bounds memory
_STRIDE = 4  # of the samples by which a long journey is judged: still under half of lambda


class VirtualState(NamedTuple):
    """Points (L, 3) m and their velocities (L, 3) m/s, mission frame; heading rad, positive to starboard; phase.

    `jumps` counts how often the points have jumped to another shape: what is known of them ends where it changes.
    """

    points: Array
    velocities: Array
    heading: float
    phase: Phase
    jumps: int = 0


class Stretch(NamedTuple):
    """Successive samples of a journey: times (K,) s, and points and velocities (K, L, 3) as in VirtualState.

    `done` (K,) counts the transformations, one under way by its share.
    """

    times: Array
    points: Array
    velocities: Array
    done: Array


class VirtualFormation:
    """The mission's virtual formation at any time; the same for all vehicles, since they share mission and clock.

    Raises TransformError where a transformation of the mission cannot be done, ValueError where its path turns back.
    """

    def __init__(self, mission: Mission) -> None:
        journey = Journey(mission)
        self._start = mission.schedule.start_s
        self._travel = self._start + mission.schedule.forming_s
        self._track, self._shapes = journey.track, journey.shapes
        self._table, self._arrival = journey.timetable(), journey.arrival_s
        self._spans = tuple(journey.spans)
        self._clock: list[float] = self._table.times.tolist()
        self._jumps = np.cumsum((0, *(span.last <= span.first for span in self._spans))).tolist()
        self._cubics = _cubics(*self._table)

    @property
    def end_s(self) -> float:
        """When travel and transformations are over, s of the mission's clock."""
        return max(self._travel, self._clock[-1])

    @property
    def travel_end_s(self) -> float:
        """When the formation reaches the end of its path, s of the mission's clock."""
        return self._arrival

    @property
    def length_m(self) -> float:
        """Length of the centre's way."""
        return float(self._track.along[-1])

    @property
    def way(self) -> Array:
        """The centre's way (K, 3) m, densely sampled."""
        return self._track.position

    @property
    def steepest(self) -> float:
        """Greatest slope of the centre's way: metres up or down for each metre ahead."""
        return self._track.steepest()

    @property
    def spans(self) -> tuple[Span, ...]:
        """Where or when each transformation of the mission happens."""
        return self._spans

    @property
    def shapes(self) -> Array:
        """All shapes (S, L, 3) m, body of the formation, point by point as one becomes the next."""
        return self._shapes

    def at(self, now: float) -> VirtualState:
        """The virtual formation at `now`, s; a time that is no number is taken as before the start."""
        now = now if math.isfinite(now) else -math.inf
        if now < self._travel:
            phase = Phase.FORMING if now >= self._start else Phase.WAITING
        else:
            phase = Phase.TRAVEL if now < self.end_s else Phase.DONE
        state, rate = self._between(now)
        north, east, down, heading, done = state.tolist()
        vn, ve, vd, turning, doing = rate.tolist()
        index = min(max(int(done), 0), len(self._shapes) - 1)
        cosine, sine = math.cos(heading), math.sin(heading)
        turn = np.array(((cosine, sine, 0.0), (-sine, cosine, 0.0), (0.0, 0.0, 1.0)))
        body = self._shapes[index]
        moved = np.zeros_like(body)
        if index + 1 < len(self._shapes):
            way = self._shapes[index + 1] - body
            body = body + (done - index) * way
            moved = (doing * way) @ turn
        offset = body @ turn
        moved[:, 0] += vn - turning * offset[:, 1]
        moved[:, 1] += ve + turning * offset[:, 0]
        moved[:, 2] += vd
        return VirtualState(offset + np.array((north, east, down)), moved, heading, phase, self._jumps[index])

    def stretches(self) -> Iterator[Stretch]:
        """The whole journey, sampled finely enough to judge it, in blocks that follow each other."""
        count = len(self._clock)
        sampled = np.unique(np.append(np.arange(0, count, _STRIDE if count > _BLOCK else 1), count - 1))
        for first in range(0, len(sampled), _BLOCK):
            times, states, rates = (part[sampled[first : first + _BLOCK]] for part in self._table)
            done = states[:, 4]
            points = offsets(bodies(self._shapes, done)[0], states[:, 3]) + states[:, None, :3]
            yield Stretch(times, points, velocities(self._shapes, states[:, 3], done, rates), done)

    # State and rate at a time: cubic between two samples, so that one is the derivative of the other.
    def _between(self, now: float) -> tuple[Array, Array]:
        clock, (_, states, rates) = self._clock, self._table
        if now < clock[0]:
            return states[0], np.zeros(5)
        if now >= clock[-1]:
            return states[-1], np.zeros(5)
        index = bisect_right(clock, now) - 1
        since = now - clock[index]
        square, cube = self._cubics[:, index]
        rate = rates[index]
        return (
            states[index] + since * (rate + since * (square + since * cube)),
            rate + since * (2.0 * square + 3.0 * since * cube),
        )


# Coefficients (2, K - 1, 5) of the square and the cube of the time since each sample (Hermite).
def _cubics(times: Array, states: Array, rates: Array) -> Array:
    duration = np.diff(times)[:, None]
    inverse = np.divide(1.0, duration, out=np.zeros_like(duration), where=duration > 0.0)
    mean = np.diff(states, axis=0) * inverse
    first, last = rates[:-1], rates[1:]
    return np.stack(((3.0 * mean - 2.0 * first - last) * inverse, (first + last - 2.0 * mean) * inverse**2))
