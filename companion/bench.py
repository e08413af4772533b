"""How long a tick of the companion takes on this computer, part by part, at the traffic of a swim in formation."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import protocol
from companion.config.vehicle import SerialConfig, SightingsConfig, VehicleConfig
from companion.formation import VirtualFormation
from companion.link import PipeBus
from companion.mission import DECISION_PERIOD_S, Mission, PathConfig, ScheduleConfig
from companion.node import Inputs, Node
from companion.scene import Sighting
from protocol import DIALECT_HASH, FIRMWARE_COMPONENT, dialect

_ZEROS = bytes(8)
_WARM_UP = 100  # ticks, for connecting and forming


class _Traffic:
    """The firmware's telemetry at its rates, as bytes."""

    def __init__(self) -> None:
        self._sequence = 0

    def tick(self, number: int, position: np.ndarray[Any, np.dtype[np.float64]]) -> bytes:
        ms = 100 * number
        every: list[tuple[int, Callable[[], protocol.Message]]] = [
            (10, lambda: dialect.MAVLink_heartbeat_message(12, 0, 128, 1, 4, 3)),
            (5, lambda: dialect.MAVLink_sys_status_message(0, 0, 0, 200, 11800, 150, 90, 0, 0, 0, 0, 0, 0)),
            (2, lambda: dialect.MAVLink_vfr_hud_message(0.4, 0.4, 0, 50, -float(position[2]), 0.0)),
            (2, lambda: dialect.MAVLink_nav_controller_output_message(0.0, 0.0, 0, 0, 0, 0.0, 0.0, 0.0)),
            (2, lambda: dialect.MAVLink_named_value_float_message(ms, b"tick_worst", 4000.0)),
            (5, lambda: dialect.MAVLink_timesync_message(ms * 1_000_000 + 1, ms * 1_000_000)),
            (1, lambda: dialect.MAVLink_servo_output_raw_message(ms * 1000, 0, 1500, 1500, 1700, 0, 0, 0, 0, 0)),
            (1, lambda: dialect.MAVLink_scaled_pressure2_message(ms, 1200.0, 200.0, 1500)),
        ]
        messages = [make() for period, make in every if number % period == 0]
        for part in range(3 if number % 2 else 2):
            messages.append(dialect.MAVLink_attitude_message(ms + 40 * part, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0))
            messages.append(dialect.MAVLink_scaled_imu2_message(ms + 40 * part, 0, 0, 1000, 0, 0, 0, 200, 0, 400))
        if number < _WARM_UP:
            custom = _ZEROS, DIALECT_HASH, _ZEROS
            messages.append(dialect.MAVLink_autopilot_version_message(0, 0, 0, 0, 0, *custom, 0, 0, 0))
            messages.append(dialect.MAVLink_param_value_message(b"SYS_ID", 1.0, 9, 2, 0))
            messages.append(dialect.MAVLink_param_value_message(b"DEPTH_MAX", 30.0, 9, 2, 1))
        sent = b""
        for message in messages:
            sent += protocol.encode(message, system=1, component=FIRMWARE_COMPONENT, sequence=self._sequence)
            self._sequence = (self._sequence + 1) & 0xFF
        return sent


class _Stopwatch:
    """Sums the time spent inside a method of an object."""

    def __init__(self, owner: Any, method: str) -> None:
        self.total = 0.0
        self._inner = getattr(owner, method)
        setattr(owner, method, self)

    def __call__(self, *arguments: Any) -> Any:
        begun = time.thread_time()
        try:
            return self._inner(*arguments)
        finally:
            self.total += time.thread_time() - begun


def measure(ticks: int = 1000, vehicles: int = 6) -> dict[str, float]:
    """Mean microseconds of CPU a tick of each part, and the slowest ticks, of one of `vehicles` in formation."""
    config = VehicleConfig(
        vehicle=1, mission=Path("none"), serial=SerialConfig(port="none"), sightings=SightingsConfig(tcp="none:1")
    )
    mission = Mission(
        vehicles=vehicles,
        path=PathConfig(waypoints_m=((2.0 * ticks, 0.0),)),
        schedule=ScheduleConfig(start_s=0.0, forming_s=0.5 * _WARM_UP * DECISION_PERIOD_S),
    )
    node, bus, traffic = Node(config, mission), PipeBus(), _Traffic()
    parts = {
        "perception": _Stopwatch(node.perception, "step"),
        "formation": _Stopwatch(node.formation, "step"),
        "guidance": _Stopwatch(node.guidance, "step"),
    }
    spent: list[float] = []
    messages = 0
    virtual, random = VirtualFormation(mission), np.random.default_rng(1)
    for number in range(_WARM_UP + ticks):
        now = number * DECISION_PERIOD_S
        if number == _WARM_UP:
            for part in parts.values():
                part.total = 0.0
        positions = virtual.at(now).points + 0.05 * random.standard_normal((vehicles, 3))
        sighting = Sighting(now, positions[0], 0.05, positions[1:] - positions[0], 20.0)
        data = traffic.tick(number, positions[0])
        begun = time.thread_time()
        bus.feed(data, now)
        received = bus.recv_all()
        outputs = node.step(now, Inputs(received, sighting, bus.report()))
        for message in outputs.messages:
            bus.send(message)
        bus.take()
        if number >= _WARM_UP:
            spent.append(time.thread_time() - begun)
            messages += len(received)
    means = {name: 1e6 * part.total / ticks for name, part in parts.items()}
    total = 1e6 * sum(spent) / ticks
    return {
        "messages_in": messages / ticks,
        "link_and_node_us": round(total - sum(means.values()), 1),
        **{f"{name}_us": round(mean, 1) for name, mean in means.items()},
        "tick_us": round(total, 1),
        "tick_p99_us": round(1e6 * float(np.percentile(spent, 99)), 1),
    }
