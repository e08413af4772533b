"""Arms and disarms the vehicle by command, repeats what got no answer, and tells why the firmware refused."""

from __future__ import annotations

import math
from typing import Any

import protocol
from companion.events import Event, Severity
from companion.link.telemetry import Telemetry
from protocol import FIRMWARE_COMPONENT, dialect

_RETRY_S = 1.0  # without an answer
_REFUSED_RETRY_S = 2.0
_REASON_AGE_S = 2.0  # a text of the firmware so near to a refusal gives its reason
_SETTLED_S = 3.0  # of good link before arming again after a failsafe
_RESULTS = {
    dialect.MAV_RESULT_TEMPORARILY_REJECTED: "not now",
    dialect.MAV_RESULT_DENIED: "denied",
    dialect.MAV_RESULT_UNSUPPORTED: "unsupported",
    dialect.MAV_RESULT_FAILED: "failed",
}


class Arming:
    """Brings the vehicle to the state wanted.

    After the firmware ended a run by itself (failsafe, or disarmed unasked) it stays so, unless `rearm` allows to arm
    again once the link has been good for 3 s; a command to disarm clears that memory.
    """

    def __init__(self, vehicle: int, rearm: bool) -> None:
        self.refusal = ""  # the firmware's last reason
        self._vehicle = vehicle
        self._rearm = rearm
        self._next = -math.inf  # no command before
        self._attempts = 0
        self._was_armed = False
        self._wanted: bool | None = None
        self._ended_at: float | None = None  # when the firmware ended the run
        self._text = ""
        self._text_at = -math.inf

    def heard(self, now: float, text: str) -> None:
        """Takes a STATUSTEXT, which may hold the reason of a refusal."""
        self._text, self._text_at = text, now

    def acknowledged(self, now: float, fields: Any) -> list[Event]:
        """Takes a COMMAND_ACK."""
        if fields.command != dialect.MAV_CMD_COMPONENT_ARM_DISARM or self._wanted is None:
            return []
        if fields.result in (dialect.MAV_RESULT_ACCEPTED, dialect.MAV_RESULT_IN_PROGRESS):
            return []
        self._next = now + _REFUSED_RETRY_S
        reason = self._text if now - self._text_at <= _REASON_AGE_S else _RESULTS.get(fields.result, "no reason given")
        known, self.refusal = self.refusal, reason
        what = "arming" if self._wanted else "disarming"
        return [] if known == reason else [Event(now, Severity.WARNING, "link", f"{what} refused: {reason}")]

    def step(
        self, now: float, wanted: bool | None, ready: bool, telemetry: Telemetry, peer: int
    ) -> tuple[list[protocol.Message], list[Event]]:
        """Commands to send and events of one tick; `wanted` None leaves the vehicle as it is."""
        armed, driving = telemetry.armed, telemetry.armed and not telemetry.failsafe
        events = self._notice(now, wanted, driving)
        if wanted is not self._wanted:
            self._wanted, self._attempts, self._next, self.refusal = wanted, 0, -math.inf, ""
        if wanted is False:
            self._ended_at = None
        if wanted is None or (wanted is True and driving) or (wanted is False and not armed):
            self._attempts = 0
            return [], events
        if now < self._next or (wanted and not (ready and self._may_arm(now))):
            return [], events
        self._next = now + _RETRY_S
        command = dialect.MAV_CMD_COMPONENT_ARM_DISARM, min(self._attempts, 255), float(wanted)
        self._attempts += 1
        return [dialect.MAVLink_command_long_message(peer, FIRMWARE_COMPONENT, *command, 0, 0, 0, 0, 0, 0)], events

    # Whether the firmware's own end of a run, if there was one, allows another.
    def _may_arm(self, now: float) -> bool:
        return self._ended_at is None or (self._rearm and now - self._ended_at >= _SETTLED_S)

    # Tells of changes, and remembers a run that the firmware ended.
    def _notice(self, now: float, wanted: bool | None, driving: bool) -> list[Event]:
        events = []
        if driving and not self._was_armed:
            self.refusal, self._ended_at = "", None
            events.append(Event(now, Severity.INFO, "link", "armed"))
        elif self._was_armed and not driving:
            if wanted is False:
                events.append(Event(now, Severity.INFO, "link", "disarmed"))
            else:
                self._ended_at = now
                then = "arming again when the link is good" if self._rearm else "arm again by hand"
                events.append(Event(now, Severity.ERROR, "link", f"the firmware ended the run ({then})"))
        self._was_armed = driving
        return events
