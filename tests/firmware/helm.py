"""A helmsman for tests: a fleet on the simulated plant, commanded over its lines as companions do it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from protocol import COMPANION_COMPONENT, DIALECT_HASH, Message, decode, dialect, encode, split_frames
from sim.plant import Plant

Array = NDArray[np.float64]
SETPOINT_MASK = 0x09E3
ARM = dialect.MAV_CMD_COMPONENT_ARM_DISARM


@dataclass
class Order:
    """What a vehicle is told: heading (rad), depth (m), speed through water (m/s)."""

    heading: float
    depth: float
    speed: float


@dataclass
class Track:
    """What the fleet did since the track began: times (T,), positions (T, N, 3), euler angles (T, N, 3), pulses."""

    t: Array
    position: Array
    euler: Array
    pulses: Array


@dataclass
class Helm:
    """Steers every vehicle of a fleet by `orders`, ten setpoints and one heartbeat a second; None sends no setpoint."""

    plant: Plant
    vehicles: int
    orders: list[Order | None] = field(default_factory=list)
    beats: bool = True
    now: float = 0.0
    heard: list[list[tuple[float, Any]]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.orders = [None] * self.vehicles
        self.heard = [[] for _ in range(self.vehicles)]
        self._rest = [b""] * self.vehicles
        self._sequence = [0] * self.vehicles
        self._tick = 0
        self._rows: list[tuple[float, Array, Array, Array]] = []

    def send(self, vehicle: int, message: Message) -> None:
        frame = encode(message, system=1, component=COMPANION_COMPONENT, sequence=self._sequence[vehicle])
        self._sequence[vehicle] = (self._sequence[vehicle] + 1) % 256
        self.plant.uart_write(vehicle, frame, self.now)

    def command(self, vehicle: int, number: int, *parameters: float) -> None:
        padded = [*parameters, *[0.0] * (7 - len(parameters))]
        self.send(vehicle, dialect.MAVLink_command_long_message(1, 1, number, 0, *padded))

    def setpoint(self, vehicle: int, order: Order) -> None:
        north, east = order.speed * np.cos(order.heading), order.speed * np.sin(order.heading)
        heading = float(np.arctan2(np.sin(order.heading), np.cos(order.heading)))
        frame = dialect.MAV_FRAME_LOCAL_NED
        fields = (0.0, 0.0, order.depth, north, east, 0.0, 0.0, 0.0, 0.0, heading, 0.0)
        message = dialect.MAVLink_set_position_target_local_ned_message(0, 1, 1, frame, SETPOINT_MASK, *fields)
        self.send(vehicle, message)

    def arm(self, parameters: Mapping[str, float] | None = None) -> None:
        """Boot, set parameters, show the dialect and arm every vehicle."""
        self.run(1.0)
        version = (8192, 0, 0, 0, 0, [0] * 8, list(DIALECT_HASH), [0] * 8, 0, 0, 0)
        for vehicle in range(self.vehicles):
            self.send(vehicle, dialect.MAVLink_autopilot_version_message(*version))
            for name, value in (parameters or {}).items():
                real = dialect.MAV_PARAM_TYPE_REAL32
                self.send(vehicle, dialect.MAVLink_param_set_message(1, 1, name.encode(), value, real))
        self.run(2.5)
        for vehicle in range(self.vehicles):
            self.command(vehicle, ARM, 1)
        self.run(0.2)

    def run(self, seconds: float) -> Track:
        """Steer for a time; returns what the fleet did, twenty rows a second."""
        first = len(self._rows)
        for _ in range(round(seconds * 20)):
            for vehicle in range(self.vehicles):
                order = self.orders[vehicle]
                if self._tick % 2 == 0 and order is not None:
                    self.setpoint(vehicle, order)
                if self._tick % 20 == 0 and self.beats:
                    self.send(vehicle, dialect.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3))
            self._tick += 1
            self.now = self._tick / 20
            self.plant.run_until(self.now)
            self._listen()
            states = self.plant.states
            self._rows.append((self.now, states.position.copy(), states.euler, states.pulses.copy()))
        t, position, euler, pulses = zip(*self._rows[first:], strict=True)
        return Track(np.array(t), np.array(position), np.array(euler), np.array(pulses))

    def _listen(self) -> None:
        for vehicle in range(self.vehicles):
            frames, self._rest[vehicle], _ = split_frames(self._rest[vehicle] + self.plant.uart_read(vehicle))
            self.heard[vehicle] += [(self.now, decode(frame)) for frame in frames]

    def texts(self, vehicle: int) -> dict[str, float]:
        """Every STATUSTEXT that the vehicle said, with the time of its last occurrence."""
        return {m.text: at for at, m in self.heard[vehicle] if m.get_type() == "STATUSTEXT"}

    def last(self, vehicle: int, kind: str) -> Any:
        """The last message of a kind that the vehicle sent."""
        return next(m for _, m in reversed(self.heard[vehicle]) if m.get_type() == kind)

    def counter(self, vehicle: int, name: str) -> float:
        """The last NAMED_VALUE_FLOAT of a name."""
        values = [m.value for _, m in self.heard[vehicle] if m.get_type() == "NAMED_VALUE_FLOAT" and m.name == name]
        return float(values[-1])


def fleet(
    make: str, vehicles: int, depth: float = 2.0, seed: int = 1, factors: Sequence[Mapping[str, float]] | None = None
) -> Helm:
    """Vehicles abreast, ten metres apart, heading north at rest."""
    starts = [[0.0, 10.0 * i, depth, 0.0] for i in range(vehicles)]
    return Helm(Plant(make, starts=starts, seed=seed, factors=factors), vehicles)
