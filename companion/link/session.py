"""The conversation with the firmware as a function of time and messages: connect, configure, arm, stream setpoints."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import Enum

import protocol
from companion.events import Event, Severity
from companion.link.arming import Arming
from companion.link.bus import BusReport, BusState, Counters
from companion.link.configuring import Configurator, param_set
from companion.link.diagnosis import Cause, Diagnosis, Diagnostician
from companion.link.message import Message
from companion.link.telemetry import Telemetry
from companion.link.timesync import TimeSync
from companion.scene import Setpoint
from protocol import COMPANION_COMPONENT, DIALECT_HASH, FIRMWARE_COMPONENT, dialect

SILENCE_S = 1.5  # of the firmware, after which the link is down: its attitude comes 25 times a second
HEARTBEAT_S = 1.0
SETPOINT_S = 0.1
TIMESYNC_S = 0.5
_RETRY_S = 0.5
_RECONFIGURE_S = 5.0  # after a refusal
_REPEAT_S = 10.0  # before the same cause or text is told again
_MOST_TEXTS = 64
_ABSURD = 1e6  # in any unit of a setpoint
_EARLY_S = 0.005  # a tick that comes so early is still in time
_TYPE_MASK = 0x09E3  # z, vx, vy and yaw hold; everything else is to be ignored
_OPEN_BUS = BusReport(BusState.OPEN, "", Counters())


class LinkState(Enum):
    """How far the conversation has come."""

    DOWN = "down"
    CONNECTING = "connecting"
    REFUSED = "refused"  # another dialect, or a parameter that the firmware does not take
    READY = "ready"


@dataclass(frozen=True, slots=True)
class LinkCommand:
    """What the node wants: a setpoint to stream (None: none), and whether the vehicle shall be armed (None: as is)."""

    setpoint: Setpoint | None = None
    arm: bool | None = None


_NO_COMMAND = LinkCommand()


@dataclass(slots=True)
class LinkOutput:
    """What a step sends and says."""

    messages: list[Message] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)


class LinkSession:
    """Talks to the firmware of vehicle `vehicle`; `state` and `reason` tell how it goes, `telemetry` what was told.

    A pure function of its inputs: `step(now, messages, command, bus)` with `now` in s on any steady clock, on which
    received messages are stamped too. Bad input is dropped and counted.
    """

    def __init__(self, vehicle: int, parameters: Mapping[str, float], *, rearm: bool = False) -> None:
        self.vehicle = vehicle
        self.state = LinkState.DOWN
        self.reason = "no heartbeat yet"
        self.diagnosis = Diagnosis(Cause.NONE)
        self.telemetry = Telemetry()
        self.timesync = TimeSync()
        self.foreign = 0  # messages of others on the line
        self.undecodable = 0
        self.losses = 0  # times the link went down
        self._arming = Arming(rearm)
        self._configurator = Configurator({"SYS_ID": float(vehicle), **parameters})
        self._diagnostician = Diagnostician()
        self._heard = -math.inf
        self._peer = 0  # system id of the firmware, 0 before its first heartbeat
        self._compatible: bool | None = None  # None: its dialect hash is not known yet
        self._boot_ms = 0
        self._sent: dict[str, float] = {}
        self._told: dict[Cause, float] = {}
        self._texts: dict[str, float] = {}  # of the firmware, and when each was told last
        self._told_losses = 0
        self._refused_at = -math.inf
        self._out = LinkOutput()
        self._now = -math.inf

    @property
    def armed(self) -> bool:
        """Whether the vehicle is armed, as far as is known."""
        return self.state is not LinkState.DOWN and self.telemetry.armed

    @property
    def disarmed_for_certain(self) -> bool:
        """Whether the firmware acknowledged the order to disarm and does not tell otherwise."""
        return self._arming.disarmed_for_certain and not self.telemetry.armed

    def step(
        self,
        now: float,
        messages: Iterable[Message],
        command: LinkCommand = _NO_COMMAND,
        bus: BusReport = _OPEN_BUS,
    ) -> LinkOutput:
        """One tick: received messages in, messages to send and events out."""
        self.listen(now, messages)
        self._judge(bus)
        if bus.state is BusState.OPEN:
            self._talk(command)
        out, self._out = self._out, LinkOutput()
        return out

    def listen(self, now: float, messages: Iterable[Message]) -> None:
        """The first half of `step` alone, for who needs this tick's telemetry before the command is known."""
        if now < self._now:
            self._clock_was_set_back(now)
        self._now = now
        for message in messages:
            try:
                self._receive(message)
            except (protocol.FrameError, UnicodeError, AttributeError, ValueError, TypeError):
                self.undecodable += 1

    # Nothing that was planned by the old clock holds.
    def _clock_was_set_back(self, now: float) -> None:
        for planned in (self._sent, self._told, self._texts):
            planned.clear()
        self._refused_at = -math.inf
        self._heard = min(self._heard, now)
        self.timesync.restart()
        self._configurator.restart()
        self._arming.clock_was_set_back(now)

    # ------------------------------------------------------------------------------------------------ receiving

    def _receive(self, message: Message) -> None:
        if message.component != FIRMWARE_COMPONENT:
            self.foreign += 1
            return
        if message.system != self._peer and not self._adopt(message):
            self.foreign += 1
            return
        self._heard = self._now
        if message.id == dialect.MAVLINK_MSG_ID_ATTITUDE:
            self._watch_boot(message)
        elif message.id == dialect.MAVLINK_MSG_ID_PARAM_VALUE:
            self._configurator.take(message)
        elif message.id == dialect.MAVLINK_MSG_ID_AUTOPILOT_VERSION:
            self._compare(message)
        elif message.id == dialect.MAVLINK_MSG_ID_TIMESYNC:
            self._sync(message)
        elif message.id == dialect.MAVLINK_MSG_ID_STATUSTEXT:
            self._relay(message)
        elif message.id == dialect.MAVLINK_MSG_ID_COMMAND_ACK:
            self._arming.acknowledged(self._now, message.fields)
        self.telemetry.update(message)

    # The line is point to point: before SYS_ID is verified any id is the firmware's, afterwards only the vehicle's own.
    def _adopt(self, message: Message) -> bool:
        if message.system == self.vehicle or not self._configurator.finished or self.state is LinkState.DOWN:
            self._peer = message.system
            return True
        return False

    # A firmware clock that runs backwards is a firmware that restarted, maybe with another image.
    def _watch_boot(self, message: Message) -> None:
        boot_ms = message.fields.time_boot_ms
        if boot_ms < self._boot_ms - 1000:
            self._say(Severity.WARNING, "firmware restarted")
            self._compatible = None
            self._configurator.restart()
            self.timesync.restart()
            self.state, self.reason = LinkState.CONNECTING, "firmware restarted"
            self._sent.clear()
        self._boot_ms = boot_ms

    def _compare(self, message: Message) -> None:
        theirs = bytes(message.fields.middleware_custom_version)
        compatible = theirs == DIALECT_HASH
        if compatible != self._compatible and not compatible:
            self._say(Severity.ERROR, dialect_refusal(theirs))
        self._compatible = compatible
        if not compatible:
            self.state, self.reason = LinkState.REFUSED, dialect_refusal(theirs)
        elif self.state is LinkState.REFUSED and not self._configurator.failures:
            self.state, self.reason = LinkState.CONNECTING, ""

    def _sync(self, message: Message) -> None:
        fields = message.fields
        if fields.tc1 == 0:
            answer = dialect.MAVLink_timesync_message(max(1, int(message.stamp * 1e9)), fields.ts1)
            self._send(answer)
        else:
            self.timesync.add(fields.ts1 / 1e9, fields.tc1 / 1e9, message.stamp)

    def _relay(self, message: Message) -> None:
        fields = message.fields
        self._arming.heard(self._now, fields.text)
        if self._now - self._texts.get(fields.text, -math.inf) < _REPEAT_S:
            return
        if len(self._texts) > _MOST_TEXTS:
            self._texts.clear()
        self._texts[fields.text] = self._now
        severity = Severity.INFO
        if fields.severity <= dialect.MAV_SEVERITY_WARNING:
            severity = Severity.WARNING if fields.severity == dialect.MAV_SEVERITY_WARNING else Severity.ERROR
        self._out.events.append(Event(self._now, severity, "firmware", fields.text))

    # ---------------------------------------------------------------------------------------------------- state

    # Whether the line is up, and what is wrong when it is not.
    def _judge(self, bus: BusReport) -> None:
        now = self._now
        self._diagnostician.step(now, bus)
        up = now - self._heard <= SILENCE_S and bus.state is BusState.OPEN
        if up and self.state is LinkState.DOWN:
            self.state, self.reason = LinkState.CONNECTING, ""
            self._sent.clear()
            self._say(Severity.INFO, f"firmware heard as system {self._peer}")
            if not self.telemetry.armed:
                self._configurator.restart()
        elif not up and self.state is not LinkState.DOWN:
            self.state, self.reason = LinkState.DOWN, ""
            self.losses += 1
        self.diagnosis = diagnosis = self._diagnostician.judge(now, bus)
        if self.state is LinkState.DOWN:
            self.reason = diagnosis.text or self.reason or f"no message for {SILENCE_S:g} s"
        if diagnosis.cause is not Cause.NONE and now - self._told.get(diagnosis.cause, -math.inf) >= _REPEAT_S:
            self._told[diagnosis.cause] = now
            self._say(Severity.WARNING, diagnosis.text)
        elif self._told_losses != self.losses:
            self._say(Severity.WARNING, f"link down: {self.reason}")
        self._told_losses = self.losses
        if self.state is LinkState.CONNECTING:
            self._advance()

    # From connecting to ready or refused.
    def _advance(self) -> None:
        failures = self._configurator.failures
        if self._compatible is None:
            self.reason = "waiting for the firmware's dialect hash"
        elif self._compatible is False:
            self.state = LinkState.REFUSED
        elif failures:
            self.state, self.reason = LinkState.REFUSED, "; ".join(failures)
            self._refused_at = self._now
            self._say(Severity.ERROR, self.reason)
        elif self._configurator.finished or self.telemetry.armed:
            self.state, self.reason = LinkState.READY, ""
            how = "set and verified" if self._configurator.finished else "left alone, for the vehicle is armed"
            self._say(Severity.INFO, f"connected, parameters {how}")
        else:
            self.reason = "setting parameters"

    # -------------------------------------------------------------------------------------------------- sending

    def _talk(self, command: LinkCommand) -> None:
        if self._due("heartbeat", HEARTBEAT_S):
            self._send(
                dialect.MAVLink_heartbeat_message(
                    dialect.MAV_TYPE_ONBOARD_CONTROLLER,
                    dialect.MAV_AUTOPILOT_INVALID,
                    0,
                    0,
                    dialect.MAV_STATE_ACTIVE,
                    3,
                )
            )
        if self.state is LinkState.DOWN:
            return
        # Repeated while disarmed: a firmware that restarted unnoticed arms only for a companion whose hash it knows.
        period = _RETRY_S if self._compatible is None else _RECONFIGURE_S
        if not (self.telemetry.armed and self._compatible) and self._due("version", period):
            self._introduce()
        if self._compatible is not True:
            return
        if self._due("timesync", TIMESYNC_S):
            self._send(dialect.MAVLink_timesync_message(0, int(self._now * 1e9)))
        if not self.telemetry.armed:
            self._configure()
        if command.setpoint is not None and self._due("setpoint", SETPOINT_S):
            self._send_setpoint(command.setpoint)
        ready = self.state is LinkState.READY
        messages, events = self._arming.step(self._now, command.arm, ready, self.telemetry, self._peer)
        for fields in messages:
            self._send(fields)
        self._out.events += events

    # Tells the firmware our dialect and asks for its own.
    def _introduce(self) -> None:
        zeros = bytes(8)
        version = dialect.MAVLink_autopilot_version_message(
            dialect.MAV_PROTOCOL_CAPABILITY_MAVLINK2, 0, 0, 0, 0, zeros, DIALECT_HASH, zeros, 0, 0, 0
        )
        self._send(version)
        request = dialect.MAV_CMD_REQUEST_MESSAGE, 0, float(dialect.MAVLINK_MSG_ID_AUTOPILOT_VERSION)
        self._send(dialect.MAVLink_command_long_message(self._peer, FIRMWARE_COMPONENT, *request, 0, 0, 0, 0, 0, 0))

    def _configure(self) -> None:
        if self.state is LinkState.REFUSED:
            if self._now - self._refused_at < _RECONFIGURE_S:
                return
            self._configurator.restart()
            self.state = LinkState.CONNECTING
        for name, value in self._configurator.step(self._now):
            self._send(param_set(self._peer, FIRMWARE_COMPONENT, name, value))

    def _send_setpoint(self, setpoint: Setpoint) -> None:
        if not all(abs(value) < _ABSURD for value in (setpoint.heading, setpoint.depth, setpoint.speed)):
            return  # not finite, or not to be written as a single
        heading = math.remainder(setpoint.heading, 2 * math.pi)
        depth, speed = max(setpoint.depth, 0.0), setpoint.speed
        self._send(
            dialect.MAVLink_set_position_target_local_ned_message(
                int(max(self._now, 0.0) * 1000) & 0xFFFFFFFF,
                self._peer,
                FIRMWARE_COMPONENT,
                dialect.MAV_FRAME_LOCAL_NED,
                _TYPE_MASK,
                *(0.0, 0.0, depth),
                *(speed * math.cos(heading), speed * math.sin(heading), 0.0),
                *(0.0, 0.0, 0.0),
                heading,
                0.0,
            )
        )

    def _send(self, fields: protocol.Message) -> None:
        self._out.messages.append(Message(fields, system=self.vehicle, component=COMPANION_COMPONENT))

    # Whether something periodic is due, and if so notes that it is done.
    def _due(self, what: str, period: float) -> bool:
        last = self._sent.get(what, -math.inf)
        if self._now - last < period - _EARLY_S:
            return False
        self._sent[what] = self._now
        return True

    def _say(self, severity: Severity, text: str) -> None:
        self._out.events.append(Event(self._now, severity, "link", text))


def dialect_refusal(theirs: bytes) -> str:
    """Why companion and firmware do not fit, with both hashes and what to do."""
    return (
        f"firmware speaks dialect {theirs.hex()}, this companion {DIALECT_HASH.hex()}: "
        "flash the image that belongs to this companion"
    )
