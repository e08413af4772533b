"""How one vehicle's companion sees things after a tick: for recorder, page, report and the status line."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from typing import Any

from companion.events import Event
from companion.link.bus import Counters
from companion.link.diagnosis import Cause
from companion.link.session import LinkState
from companion.scene import Attitude, Phase, Setpoint

Triple = tuple[float, float, float]


@dataclass(slots=True)
class LinkStatus:
    """The line to the firmware: state and why, cause when something is wrong, what was lost."""

    state: LinkState
    reason: str
    cause: Cause
    counters: Counters
    losses: int  # times the link went down
    foreign: int  # messages of others on the line
    undecodable: int
    clock_residual: float  # s, RMS of the firmware's clock about the fitted line


@dataclass(slots=True)
class Status:
    """One vehicle after one tick. Mission frame, SI units, radians; None where a thing is not known."""

    stamp: float
    vehicle: int
    phase: Phase
    point: int | None
    target: Triple | None
    tracking_error: float | None
    setpoint: Setpoint | None
    hold: str  # why the vehicle holds; "" when it follows guidance
    position: Triple | None
    velocity: Triple | None
    neighbours: int
    travelled: float
    attitude: Attitude | None
    depth: float | None
    speed: float | None
    battery_voltage: float | None
    armed: bool
    failsafe: bool
    link: LinkStatus
    failures: dict[str, int]  # exceptions of each part since the start
    events: list[Event]  # of this tick


def to_json(value: Any) -> Any:
    """A status (or any part of it) as JSON can carry it: enums by value, numbers that are none as null."""
    kind = type(value)
    if kind is float:
        return value if math.isfinite(value) else None
    if kind in (int, str, bool, type(None)):
        return value
    if kind in (list, tuple):
        return [to_json(item) for item in value]
    if kind is dict:
        return {str(key): to_json(item) for key, item in value.items()}
    if isinstance(value, Enum):
        return value.value
    return {name: to_json(getattr(value, name)) for name in kind.__dataclass_fields__}


def to_line(status: Status) -> str:
    """A status as one line for people."""
    link = status.link
    parts = [f"{status.stamp:8.1f} s", f"{status.phase.value:8}", "armed" if status.armed else "disarmed"]
    if status.failsafe:
        parts.append("FAILSAFE")
    parts.append("no point" if status.point is None else f"point {status.point}")
    if status.tracking_error is not None:
        parts.append(f"off by {status.tracking_error:.2f} m")
    if status.position is not None:
        parts.append("at {:.1f} {:.1f}".format(*status.position))
    if status.depth is not None:
        parts.append(f"depth {status.depth:.2f} m")
    if status.attitude is not None:
        parts.append(f"heading {math.degrees(status.attitude.yaw) % 360:03.0f} deg")
    if status.battery_voltage is not None:
        parts.append(f"{status.battery_voltage:.1f} V")
    parts.append(f"{status.neighbours} neighbours")
    parts.append(f"link {link.state.value}" + (f": {link.reason}" if link.reason else ""))
    if status.hold:
        parts.append(f"holds: {status.hold}")
    return ", ".join(parts)
