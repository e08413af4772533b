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
_REASON_S = 0.3  # after a refusal, for the firmware's texts with the reasons
_SETTLED_S = 3.0  # of good link before arming again after a failsafe
_RESULTS = {
    dialect.MAV_RESULT_TEMPORARILY_REJECTED: "not now",
    dialect.MAV_RESULT_DENIED: "denied",
    dialect.MAV_RESULT_UNSUPPORTED: "unsupported",
    dialect.MAV_RESULT_FAILED: "failed",
}
_PREFIX = "arming refused: "


class Arming:
    """Brings the vehicle to the state wanted.

    After the firmware ended a run by itself (failsafe, or disarmed unasked) it stays so, unless `rearm` allows to arm
    again once the link has been good for 3 s; a command to disarm clears that memory.
    """

    def __init__(self, rearm: bool) -> None:
        self.refusal = ""  # the firmware's last reasons, "" once armed
        self.confirmed = False  # the firmware acknowledged the last command
        self._rearm = rearm
        self._wanted: bool | None = None
        self._next = -math.inf  # no command before
        self._attempts = 0
        self._was_driving = False
        self._ended_at: float | None = None  # when the firmware ended the run
        self._result = 0  # of a refused command whose reasons are still being gathered
        self._refused_at = -math.inf
        self._reasons: list[str] = []

    @property
    def disarmed_for_certain(self) -> bool:
        """Whether the last command was to disarm, and was acknowledged."""
        return self._wanted is False and self.confirmed

    def clock_was_set_back(self, now: float) -> None:
        """Plans anew from `now`."""
        self._next = self._refused_at = -math.inf
        if self._ended_at is not None:
            self._ended_at = now

    def heard(self, now: float, text: str) -> None:
        """Takes a STATUSTEXT, which may hold a reason."""
        if self._result and now - self._refused_at <= _REASON_S:
            self._reasons.append(text.removeprefix(_PREFIX))

    def acknowledged(self, now: float, fields: Any) -> None:
        """Takes a COMMAND_ACK."""
        if fields.command != dialect.MAV_CMD_COMPONENT_ARM_DISARM or self._wanted is None:
            return
        if fields.result == dialect.MAV_RESULT_ACCEPTED:
            self.confirmed = True
        elif fields.result != dialect.MAV_RESULT_IN_PROGRESS:
            self._next = now + _REFUSED_RETRY_S
            self._result, self._refused_at, self._reasons = fields.result, now, []

    def step(
        self, now: float, wanted: bool | None, ready: bool, telemetry: Telemetry, peer: int
    ) -> tuple[list[protocol.Message], list[Event]]:
        """Commands to send and events of one tick; `wanted` None leaves the vehicle as it is."""
        driving = telemetry.armed and not telemetry.failsafe
        events = self._notice(now, wanted, driving) + self._explain(now)
        if wanted is not self._wanted:
            self._wanted, self._attempts, self._next, self.refusal = wanted, 0, -math.inf, ""
            self.confirmed = False
        if wanted is False:
            self._ended_at = None
        # A heartbeat may be older than the last command to arm, so disarming counts only once it is acknowledged.
        if wanted is None or (driving if wanted else self.confirmed and not telemetry.armed):
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

    # Tells of a refusal once its reasons are in, and again only when they change.
    def _explain(self, now: float) -> list[Event]:
        if not self._result or now - self._refused_at < _REASON_S:
            return []
        reason = (
            ", ".join(dict.fromkeys(self._reasons)) or self.refusal or _RESULTS.get(self._result, "no reason given")
        )
        self._result = 0
        if reason == self.refusal:
            return []
        self.refusal = reason
        what = "arming" if self._wanted else "disarming"
        return [Event(now, Severity.WARNING, "link", f"{what} refused: {reason}")]

    # Tells of changes, and remembers a run that the firmware ended.
    def _notice(self, now: float, wanted: bool | None, driving: bool) -> list[Event]:
        was, self._was_driving = self._was_driving, driving
        if driving and not was:
            self.refusal, self._ended_at = "", None
            return [Event(now, Severity.INFO, "link", "armed")]
        if was and not driving:
            if wanted is False:
                return [Event(now, Severity.INFO, "link", "disarmed")]
            self._ended_at = now
            then = "arming again when the link is good" if self._rearm else "arm again by hand"
            return [Event(now, Severity.ERROR, "link", f"the firmware ended the run ({then})")]
        return []
