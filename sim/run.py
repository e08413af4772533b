"""Runs a scenario in lockstep: plant and companions meet every 20 ms of simulated time, and no clock is asked."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from companion.config.vehicle import FirmwareConfig, SerialConfig, SightingsConfig, VehicleConfig
from companion.events import Severity
from companion.link import PipeBus
from companion.mission import DECISION_PERIOD_S
from companion.node import Inputs, Node
from companion.scene import Sighting
from companion.status import to_json
from sim.basin import Basin
from sim.grade import Grade, Ticks, grade
from sim.history import SAMPLE_PERIOD_S, Event, History, Snapshot, StatusJson, events_of, stack
from sim.scenario import SYNC_S, Scenario

SYNCS_A_TICK = round(DECISION_PERIOD_S / SYNC_S)
SYNCS_A_SAMPLE = round(SAMPLE_PERIOD_S / SYNC_S)


class Observer(Protocol):
    """Somebody who watches a run: a recorder, the live page, a progress bar."""

    def observe(self, snapshot: Snapshot) -> None:
        """Takes one snapshot."""


@dataclass(slots=True)
class Effort:
    """What a run cost: processor seconds of each part, and seconds of wall time without waits for viewers.

    Companions, world and observers share one thread; the plant works beside them, and on that thread too once they are
    done.
    """

    plant_s: float = 0.0
    companions_s: float = 0.0
    world_s: float = 0.0
    observers_s: float = 0.0
    wall_s: float = 0.0

    @contextmanager
    def spent(self, on: str) -> Iterator[None]:
        """Adds the time of a block to one of the fields."""
        begun = time.thread_time()
        yield
        setattr(self, on, getattr(self, on) + time.thread_time() - begun)


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a run leaves behind; `failures` tells by vehicle number why firmware stopped, `ticks` how it kept time."""

    history: History
    failures: dict[int, str]
    effort: Effort
    ticks: Ticks | None = None

    def grade(self, scenario: Scenario) -> Grade:
        """Figures and verdicts of this run by the scenario's own criteria."""
        start_s = scenario.mission.schedule.start_s
        return grade(self.history, scenario.config.criteria, start_s, self.failures, self.ticks)


class Companion:
    """One vehicle's companion in this process, at the end of a pipe instead of a serial line."""

    def __init__(self, scenario: Scenario, vehicle: int) -> None:
        config = VehicleConfig(
            vehicle=vehicle + 1,
            mission=Path(scenario.name),
            serial=SerialConfig(port="pipe", baud=scenario.config.line.baud),
            sightings=SightingsConfig(tcp="simulator:1"),
            firmware=FirmwareConfig(parameters=scenario.config.firmware),
        )
        self.node = Node(config, scenario.mission)
        self.bus = PipeBus()
        self.status: StatusJson | None = None

    def tick(self, now: float, received: bytes, sighting: Sighting) -> bytes:
        """One step of the companion; returns the bytes that it sends."""
        self.bus.feed(received, now)
        outputs = self.node.step(now, Inputs(self.bus.recv_all(), sighting, self.bus.report()))
        for message in outputs.messages:
            self.bus.send(message)
        self.status = to_json(outputs.status)
        return self.bus.take()

    def ticks(self) -> Ticks:
        """How this vehicle's firmware has kept its time, by its own account."""
        values = self.node.link.telemetry.values
        return Ticks(values.get("tick_worst", 0.0) * 1e-6, round(values.get("tick_miss", 0.0)))


def run(
    scenario: Scenario,
    make: str,
    *,
    threads: int = 2,
    image: Path | None = None,
    observers: Iterable[Observer] = (),
    pace: Callable[[float], None] = lambda now: None,
) -> Outcome:
    """Runs a scenario to its end; `pace` is called with the simulated time before each sync and may wait."""
    basin = Basin(scenario, make, threads, image)
    companions = [Companion(scenario, i) for i in range(scenario.mission.vehicles)]
    snapshots: list[Snapshot] = []
    events: list[Event] = []
    watchers = [*observers]
    effort = Effort()
    begun, waited = time.perf_counter(), 0.0
    all_threads, this_thread = time.process_time(), time.thread_time()
    for sync in range(round(basin.end_s / SYNC_S) + 1):
        now = sync * SYNC_S
        before = time.perf_counter()
        pace(now)
        waited += time.perf_counter() - before
        with effort.spent("world_s"):
            basin.look(now)
            due = [i for i in range(len(companions)) if (sync - i) % SYNCS_A_TICK == 0]
            received = {i: basin.plant.uart_read(i) for i in due}
            sightings = {i: basin.sight(i) for i in due}
        if sync % SYNCS_A_SAMPLE == 0:
            snapshots.append(basin.snapshot([c.status for c in companions], events))
            events = []
        # The plant goes on to the next sync while the companions think: their answers leave no earlier than that.
        basin.start(now + SYNC_S)
        with effort.spent("world_s"):
            basin.referee()
        with effort.spent("companions_s"):
            sent = {i: companions[i].tick(now, received[i], sightings[i]) for i in due}
            events += [event for i in due for event in events_of(companions[i].status or {})]
        if sync % SYNCS_A_SAMPLE == 0:
            with effort.spent("observers_s"):
                for watcher in watchers:
                    watcher.observe(snapshots[-1])
        with effort.spent("plant_s"):
            basin.finish()
        events += [Event(now, i, f"firmware failed: {why}", Severity.ERROR) for i, why in basin.new_failures()]
        for i, data in sent.items():
            if data:
                basin.plant.uart_write(i, data, at=now + scenario.config.line.compute_latency_s)
    effort.wall_s = time.perf_counter() - begun - waited
    effort.plant_s += time.process_time() - all_threads - (time.thread_time() - this_thread)
    kept = [companion.ticks() for companion in companions]
    ticks = Ticks(max(each.worst_s for each in kept), sum(each.missed for each in kept))
    return Outcome(stack(snapshots), basin.failures, effort, ticks)
