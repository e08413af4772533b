"""The basin: the fleet in its water, the sensors that look at it and the referee who knows the truth."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from companion.formation import VirtualFormation
from companion.scene import Sighting
from sim.history import Event, Snapshot, StatusJson
from sim.plant import Plant, PlantError
from sim.scenario import Scenario
from sim.sighting import SightingSensor
from sim.world import Water, hull_axis, hull_distances, pairs


class Basin:
    """The simulated world of one run. `look` fixes the truth at this moment; everything else refers to that look."""

    def __init__(self, scenario: Scenario, make: str, threads: int, image: Path | None = None) -> None:
        mission, config = scenario.mission, scenario.config
        self.formation = VirtualFormation(mission)
        self.end_s = scenario.end_s()
        self.plant = Plant(
            make,
            starts=scenario.starts,
            seed=mission.seed,
            threads=threads,
            image=image,
            baud=config.line.baud,
        )
        self.failures: dict[int, str] = {}
        self._told: set[int] = set()
        for i in range(mission.vehicles):
            self.plant.faults(i).companion_bit_noise = config.line.byte_noise
        self._water = Water(scenario.current(), mission.seed)
        self._sensors = [SightingSensor(scenario.sighting(), mission.seed, i) for i in range(mission.vehicles)]
        self._separation = np.full(len(pairs(mission.vehicles)[0]), np.inf)
        self.look(0.0)

    def advance(self, until: float) -> None:
        """Runs the fleet; a vehicle whose firmware fails stays where it is, and why goes into `failures`."""
        self.start(until)
        self.finish()

    def start(self, until: float) -> None:
        """Lets the fleet begin to run on threads of its own; until `finish` only the last look may be asked."""
        self.plant.start(until)

    def finish(self) -> None:
        """Waits for the fleet, and helps it."""
        try:
            self.plant.finish()
        except PlantError:
            causes = {i + 1: self.plant.failure(i) for i in range(self.plant.vehicles)}
            self.failures = {vehicle: cause for vehicle, cause in causes.items() if cause}

    def new_failures(self) -> list[tuple[int, str]]:
        """Vehicle and cause of the failures since the last call."""
        new = [failure for failure in self.failures.items() if failure[0] not in self._told]
        self._told.update(vehicle for vehicle, _ in new)
        return new

    def look(self, now: float) -> None:
        """Takes the truth of this moment and sets the current that each hull will feel until the next look."""
        states = self.plant.states
        self.now = now
        self.position, self._axis = states.position.copy(), hull_axis(states.quaternion)
        self.current = self._water.velocity(now, self.position)
        states.current[:] = self.current

    def referee(self) -> None:
        """Notes how near hulls have come."""
        self._separation = np.minimum(self._separation, hull_distances(self.position, self._axis))

    def sight(self, vehicle: int) -> Sighting:
        """What the neighbour sensor of a vehicle (index) reads at this look."""
        return self._sensors[vehicle].read(self.now, self.position)

    def snapshot(self, statuses: Sequence[StatusJson | None], events: Sequence[Event]) -> Snapshot:
        """Everything at this look, before the fleet is advanced, and the least separations since the last snapshot."""
        state, states = self.formation.at(self.now), self.plant.states
        separation, self._separation = self._separation, np.full_like(self._separation, np.inf)
        return Snapshot(
            now=self.now,
            phase=state.phase,
            position=self.position,
            velocity=states.velocity,
            euler=states.euler,
            current=self.current,
            travelled=states.travelled.copy(),
            pulses=states.pulses.copy(),
            separation=separation,
            points=state.points,
            heading=state.heading,
            statuses=tuple(statuses),
            events=tuple(events),
        )
