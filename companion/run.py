"""The companion on the vehicle: the thin shell that gives the node its clock, its serial port and its sightings."""

from __future__ import annotations

import json
import signal
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from types import FrameType
from typing import TextIO

from companion.clock import MissionClock
from companion.config.vehicle import VehicleConfig
from companion.events import Event
from companion.link.bus import Bus
from companion.link.notifier import BufferedReader, Notifier
from companion.link.serial_bus import SerialBus
from companion.mission import DECISION_PERIOD_S, Mission
from companion.node import Inputs, Node, Outputs
from companion.sightings import SightingSource
from companion.status import Status, to_json, to_line

_FAREWELL_S = 3.0  # at most, to bring the vehicle to neutral and disarmed
_STATUS_S = 1.0
_LATE_S = 0.05


@dataclass(slots=True)
class LoopCounters:
    """How well the loop keeps its time."""

    ticks: int = 0
    late: int = 0  # ticks that began more than half a period late
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
            loop.run(stopping.is_set, lambda outputs: report(outputs.status, out))
            loop.say_farewell(lambda outputs: report(outputs.status, out))
        except BrokenPipeError:
            loop.say_farewell(lambda outputs: None)
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

    def run(self, stopping: Callable[[], bool], report: Callable[[Outputs], None]) -> None:
        """Ticks until told to stop."""
        due = time.monotonic()
        while not stopping():
            self._pace(due)
            report(self._tick(stop=False))
            due = self._next(due)

    # Neutral and disarmed, or as much of it as the line carries in the time there is.
    def say_farewell(self, report: Callable[[Outputs], None]) -> None:
        """Ticks with the order to stop until the firmware says that it is disarmed."""
        due = time.monotonic()
        end = due + _FAREWELL_S
        while time.monotonic() < end:
            outputs = self._tick(stop=True)
            report(outputs)
            if self._node.link.disarmed_for_certain:
                return
            due = self._next(due)
            self._pace(due)

    def _tick(self, *, stop: bool) -> Outputs:
        begun = time.monotonic()
        sighting = self._source.take()
        inputs = Inputs(self._reader.take(), sighting, self._bus.report(), stop)
        outputs = self._node.step(self._clock(), inputs)
        for message in outputs.messages:
            self._bus.send(message)
        self.counters.ticks += 1
        self.counters.worst_s = max(self.counters.worst_s, time.monotonic() - begun)
        return outputs

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
