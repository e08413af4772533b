"""The plan of a journey: when on the path or by the clock each transformation of a mission happens, one by one."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from companion.formation import transform
from companion.formation.timetable import Timetable, bounds_on, travel, way_of
from companion.formation.transform import Span, TransformError
from companion.mission import Mission, TransformConfig

Array = NDArray[np.float64]

_ROUNDS = 6  # of bringing a span to its time: travel up to it hardly depends on it
_EXACT = 1e-6  # s or m that a setting may miss its bound by, from rounding


class Journey:
    """A mission's shapes (S, L, 3) m, its path, and a span for each of its transformations.

    Raises TransformError for a transformation that cannot be done, ValueError where the path turns straight back.
    """

    def __init__(self, mission: Mission) -> None:
        self._mission = mission
        self._begin = mission.schedule.start_s + mission.schedule.forming_s
        self.shapes = transform.shapes(mission)
        self.track = way_of(mission, self.shapes)
        self.length = float(self.track.along[-1])
        self.spans: list[Span] = []
        self._travels: dict[tuple[Span, ...], Timetable] = {}
        for index, config in enumerate(mission.transform):
            self.spans.append(self._placed(index, config))

    @property
    def arrival_s(self) -> float:
        """When the formation reaches the end of its path, by the mission's clock."""
        return float(self._travel().times[-1])

    def timetable(self) -> Timetable:
        """Everything that moves, from first to last, by the mission's clock."""
        before, on_way, after = self._split()
        first = self._standing(before, 0, self.track.position[0], self.track.heading[0])
        last = self._standing(after, len(before) + len(on_way), self.track.position[-1], self.track.heading[-1])
        parts = [first, self._travel(), last]
        return Timetable(*(np.concatenate(rows) for rows in zip(*parts, strict=True)))

    # Spans before, during and after the travel; each list may be empty.
    def _split(self) -> tuple[list[Span], list[Span], list[Span]]:
        on_way = [span for span in self.spans if not span.stands]
        stands = [span for span in self.spans if span.stands]
        before = [span for span in stands if span.first < self._begin]
        return before, on_way, stands[len(before) :]

    # Worked out once for each list of spans.
    def _travel(self) -> Timetable:
        known = self._travels.get(tuple(self.spans))
        if known is not None:
            return known
        before, on_way, _ = self._split()
        table = travel(self.track, self.shapes, on_way, len(before), self._mission)
        begin = self._begin if self.length or not before else max(self._begin, before[-1].last)
        self._travels = {tuple(self.spans): table._replace(times=table.times + begin)}
        return self._travels[tuple(self.spans)]

    # A share of the way eased like this is the very cubic that lies between two samples at rest.
    def _standing(self, spans: list[Span], done: int, place: Array, heading: float) -> Timetable:
        times = [time for span in spans for time in (span.first, span.last)]
        states = [[*place, heading, done + i + end] for i in range(len(spans)) for end in (0, 1)]
        shape = (len(times), 5)
        return Timetable(np.array(times, dtype=float), np.array(states, dtype=float).reshape(shape), np.zeros(shape))

    def _placed(self, index: int, config: TransformConfig) -> Span:
        table = self._travel()
        key, begin = ("at_m", config.at_m) if config.at_m is not None else ("at_s", config.at_s)
        assert begin is not None
        if config.at_m is not None and config.at_m > self.length:
            text = (
                f"must be on the path, which is {self.length:.5g} m long" if self.length else "needs a path: give at_s"
            )
            raise TransformError(index, key, text)
        if config.at_s is not None and config.at_s < self._mission.schedule.start_s:
            text = f"must be at or after schedule.start_s ({self._mission.schedule.start_s:g} s)"
            raise TransformError(index, key, text)
        if config.at_s is not None and not (self.length and table.times[0] <= config.at_s < table.times[-1]):
            span = self._standing_span(index, config, config.at_s)
        else:
            span = self._span_on_way(index, config)
        self._check_order(index, key, span)
        return span

    def _standing_span(self, index: int, config: TransformConfig, begin: float) -> Span:
        ways = self.shapes[index + 1] - self.shapes[index]
        least = transform.least_duration(ways, bounds_on(self._mission, 0.0))
        duration = 0.0 if config.jump else least if config.duration_s is None else config.duration_s
        if not config.jump and duration < least - _EXACT:
            raise TransformError(index, "duration_s", f"must be at least {math.ceil(10.0 * least) / 10.0:g} s")
        end = begin + duration
        if self.length and begin < self._begin < end:
            text = f"lasts until {end:.1f} s, must end before travel begins at {self._begin:g} s (or form for longer)"
            raise TransformError(index, "at_s", text)
        return Span(begin, end, True)

    def _span_on_way(self, index: int, config: TransformConfig) -> Span:
        mission = self._mission
        first = config.at_m if config.at_m is not None else self._place_at(config.at_s or 0.0)
        if config.jump:
            return Span(first, first, False)
        ways = self.shapes[index + 1] - self.shapes[index]
        bounds = bounds_on(mission, self.track.steepest(first))
        least = transform.least_length(ways, bounds, mission.path.pace_mps, mission.path.turn)
        if not math.isfinite(least):
            text = (
                f"no point may go under {bounds.needed:.3g} m/s (steerage way) or over {bounds.permitted:.3g} m/s (top "
                f"speed), or up or down by over {bounds.slope:.2g} m a metre beside the path, which leaves no room: "
                "lower path.pace_mps or limits.steerage_speed_mps, level the path, or let points jump"
            )
            raise TransformError(index, "shape", text)
        span = Span(first, first + least, False)
        self._check_end(index, span)
        if config.at_s is not None or config.duration_s is not None:
            span = self._timed(index, config, span, least)
            self._check_end(index, span)
        return span

    # Moves and stretches a span until it begins and lasts as the mission says.
    def _timed(self, index: int, config: TransformConfig, span: Span, least: float) -> Span:
        for turn in range(_ROUNDS):
            self.spans.append(span)
            first = span.first if config.at_s is None else self._place_at(config.at_s)
            begin, end = self._time_at(span.first), self._time_at(span.last)
            self.spans.pop()
            length = least
            if config.duration_s is not None:
                if turn == 0 and config.duration_s < end - begin - _EXACT:
                    text = f"must be at least {math.ceil(10.0 * (end - begin)) / 10.0:g} s"
                    raise TransformError(index, "duration_s", text)
                length = max(least, (span.last - span.first) * config.duration_s / (end - begin))
            span = Span(first, min(first + length, max(self.length, first + least)), False)
        return span

    def _check_end(self, index: int, span: Span) -> None:
        if span.last > self.length + _EXACT:
            config = self._mission.transform[index]
            key = "at_m" if config.at_m is not None else "at_s"
            text = (
                f"takes {span.last - span.first:.1f} m of the path from {span.first:.1f} m on, which is "
                f"{self.length:.1f} m long: must begin earlier, or lengthen the path"
            )
            raise TransformError(index, key, text)

    def _check_order(self, index: int, key: str, span: Span) -> None:
        if not index:
            return
        before = self.spans[-1]
        self.spans.append(span)
        begin, end = ((s.first, s.last) if s.stands else tuple(map(self._time_at, s[:2])) for s in (span, before))
        self.spans.pop()
        if begin[0] < end[1] - _EXACT:
            where = "" if before.stands else f"{before.last:.1f} m along the path, "
            text = f"must begin after transform[{index - 1}] has ended ({where}at {end[1]:.1f} s)"
            raise TransformError(index, key, text)

    def _place_at(self, time: float) -> float:
        table = self._travel()
        return float(np.interp(time, table.times, self._along(table)))

    def _time_at(self, place: float) -> float:
        table = self._travel()
        return float(np.interp(place, self._along(table), table.times))

    # Place, m along the path, of each sample of its timetable.
    def _along(self, table: Timetable) -> Array:
        speed = np.linalg.norm(table.rates[:, :3], axis=1)
        way = 0.5 * (speed[:-1] + speed[1:]) * np.diff(table.times)
        return np.concatenate(((0.0,), np.cumsum(way)))
