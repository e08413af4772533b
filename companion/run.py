"""The companion on the vehicle: the thin shell that gives the node its clock, its serial port and its sightings."""

from __future__ import annotations

import json
import math
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from types import FrameType
from typing import TextIO

from companion.clock import MissionClock
from companion.config.vehicle import VehicleConfig
from companion.events import Event, Severity
from companion.link.bus import Bus
from companion.link.notifier import BufferedReader, Notifier
from companion.link.serial_bus import SerialBus
from companion.mission import DECISION_PERIOD_S, Mission
from companion.node import Inputs, Node
from companion.sightings import SightingSource
from companion.status import Status, to_json, to_line

_FAREWELL_S = 3.0  # at most, to bring the vehicle to neutral and disarmed
_STATUS_S = 1.0
_LATE_S = 0.05
_REPEAT_S = 10.0  # before the same thing is told again
_MOST_TOLD = 100


@dataclass(slots=True)
class LoopCounters:
    """How well the loop keeps its time."""

    ticks: int = 0
    late: int = 0  # ticks that began more than half a period late
    failed: int = 0  # ticks that ended in an exception
    worst_s: float = 0.0  # longest tick


def run(vehicle: VehicleConfig, mission: Mission, *, json_lines: bool, out: TextIO = sys.stdout) -> int:
    """Runs until SIGTERM or SIGINT, then brings the vehicle to neutral and disarms it; returns the exit status."""
    stopping = threading.Event()

    def stop(number: int, frame: FrameType | None) -> None:
        stopping.set()

    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, stop)
    clock = MissionClock(vehicle.clock.start)
    reader = BufferedReader()
    source = SightingSource(vehicle.sightings)
    report = _report_json if json_lines else _Reporter().report
    with SerialBus(vehicle.serial.port, vehicle.serial.baud, clock) as bus:
        notifier = Notifier(bus, [reader])
        loop = _Loop(Node(vehicle, mission), bus, reader, source, clock)
        try:
            loop.run(stopping.is_set, lambda status: report(status, out))
            loop.say_farewell(lambda status: report(status, out))
        except BrokenPipeError:  # nobody listens any more, so nobody is in charge
            loop.say_farewell(lambda status: None)
        finally:
            notifier.stop()
            source.close()
    return 0


class _Loop:
    """Ten ticks a second by the monotonic clock; a tick that comes late is counted, and the next keeps its place."""

    def __init__(
        self, node: Node, bus: Bus, reader: BufferedReader, source: SightingSource, clock: Callable[[], float]
    ) -> None:
        self.counters = LoopCounters()
        self._node = node
        self._bus = bus
        self._reader = reader
        self._source = source
        self._clock = clock
        self._told: dict[str, float] = {}

    def run(self, stopping: Callable[[], bool], report: Callable[[Status], None]) -> None:
        """Ticks until told to stop."""
        due = time.monotonic()
        while not stopping():
            self._pace(due)
            self._tick(report, stop=False)
            due = self._next(due)

    def say_farewell(self, report: Callable[[Status], None]) -> None:
        """Neutral and disarmed: ticks with the order to stop until the firmware acknowledged it, or for 3 s."""
        due = time.monotonic()
        end = due + _FAREWELL_S
        while time.monotonic() < end and not self._node.link.disarmed_for_certain:
            self._pace(due)
            self._tick(report, stop=True)
            due = self._next(due)

    # A tick that fails in spite of the node's own rules sends nothing; if it persists the firmware's timeouts act.
    def _tick(self, report: Callable[[Status], None], *, stop: bool) -> None:
        begun, now = time.monotonic(), self._clock()
        self.counters.ticks += 1
        try:
            sighting = self._source.take()
            inputs = Inputs(self._reader.take(), sighting, self._bus.report(), stop)
            outputs = self._node.step(now, inputs)
            for message in outputs.messages:
                self._bus.send(message)
        except Exception:
            self.counters.failed += 1
            if self._news(traceback.format_exc(limit=-1), now):
                traceback.print_exc()
            return
        self.counters.worst_s = max(self.counters.worst_s, time.monotonic() - begun)
        outputs.status.events += self._events(now)
        report(outputs.status)

    # What the shell itself noticed, each thing at most once in ten seconds.
    def _events(self, now: float) -> list[Event]:
        found = [("sightings", self._source.cause)] if self._source.cause else []
        if self._source.refused:
            found.append(("sightings", f"a line was no sighting: {self._source.last_refusal}"))
        if self.counters.late:
            found.append(("loop", f"{self.counters.late} late ticks, the longest took {self.counters.worst_s:.2f} s"))
        self._source.refused = 0
        return [
            Event(now, Severity.WARNING, part, text)
            for part, text in found
            if self._news(part if part == "loop" else text, now)
        ]

    def _news(self, text: str, now: float) -> bool:
        if now - self._told.get(text, -math.inf) < _REPEAT_S:
            return False
        if len(self._told) > _MOST_TOLD:
            self._told.clear()
        self._told[text] = now
        return True

    def _pace(self, due: float) -> None:
        if (wait := due - time.monotonic()) > 0:
            time.sleep(wait)

    def _next(self, due: float) -> float:
        late = time.monotonic() - due - DECISION_PERIOD_S
        if late > _LATE_S:
            self.counters.late += 1
            return due + DECISION_PERIOD_S * (1 + late // DECISION_PERIOD_S)
        return due + DECISION_PERIOD_S


# Every status as one JSON document a line, for a program that listens.
def _report_json(status: Status, out: TextIO) -> None:
    print(json.dumps(to_json(status), separators=(",", ":")), file=out, flush=True)


class _Reporter:
    """For people: every event as it comes, and one status line a second."""

    def __init__(self) -> None:
        self._due = 0.0

    def report(self, status: Status, out: TextIO) -> None:
        for event in status.events:
            print(_event_line(event), file=out, flush=True)
        if time.monotonic() >= self._due:
            self._due = time.monotonic() + _STATUS_S
            print(to_line(status), file=out, flush=True)


def _event_line(event: Event) -> str:
    return f"{event.stamp:8.1f} s, {event.severity.value}: {event.source}: {event.text}"
