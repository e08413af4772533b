"""A firmware in a few lines for tests of the link: it answers as the real one does, and can be told to misbehave."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import protocol
from protocol import COMPANION_COMPONENT, DIALECT_HASH, FIRMWARE_COMPONENT, dialect

STREAM_HZ = 25


@dataclass
class FirmwareFake:
    """One firmware; `exchange(now, bytes)` lets it live until `now` and returns what it sent."""

    system: int = 1
    dialect_hash: bytes = DIALECT_HASH
    refusal: str = ""  # refuses arming with this text
    parameters: dict[str, float] = field(
        default_factory=lambda: {"SYS_ID": 1.0, "DEPTH_MAX": 10.0, "FS_ACTION": 1.0, "BOW_TRIM": 0.0, "THR_MAX": 1.0}
    )
    limits: dict[str, float] = field(default_factory=lambda: {"THR_MAX": 1.0})
    booted_at: float = 0.0
    clock_rate: float = 1.0
    heading: float = 0.3
    depth: float = 2.0
    armed: bool = False
    failsafe: bool = False
    companion_hash: bytes = b""
    setpoints: list[tuple[float, float, float]] = field(default_factory=list)  # heading, depth, speed
    heard: list[str] = field(default_factory=list)
    _rest: bytes = b""
    _out: bytearray = field(default_factory=bytearray)
    _sequence: int = 0
    _next_stream: float = 0.0
    _next_beat: float = 0.0

    def exchange(self, now: float, received: bytes = b"") -> bytes:
        """Takes bytes from the companion and returns those sent since the last call."""
        frames, self._rest, _ = protocol.split_frames(self._rest + received)
        for frame in frames:
            self._answer(now, frame)
        while self._next_stream <= now:
            boot_ms = int(self.boot_s(self._next_stream) * 1000)
            self.send(dialect.MAVLink_attitude_message(boot_ms, 0.0, 0.0, self.heading, 0.0, 0.0, 0.0))
            self.send(dialect.MAVLink_vfr_hud_message(0.4, 0.4, 17, 50, -self.depth, 0.0))
            self._next_stream += 1.0 / STREAM_HZ
        while self._next_beat <= now:
            self._beat()
            self._next_beat += 1.0
        sent = bytes(self._out)
        self._out.clear()
        return sent

    def boot_s(self, now: float) -> float:
        """The firmware's own clock."""
        return max(0.0, (now - self.booted_at) * self.clock_rate)

    def restart(self, now: float) -> None:
        """A reset: everything that is not in EEPROM is forgotten."""
        self.booted_at, self.armed, self.failsafe, self.companion_hash, self._sequence = now, False, False, b"", 0

    def send(self, fields: Any) -> None:
        """Queues one message."""
        self._out += protocol.encode(
            fields, system=self.system, component=FIRMWARE_COMPONENT, sequence=self._sequence & 0xFF
        )
        self._sequence += 1

    def _beat(self) -> None:
        mode = dialect.MAV_MODE_FLAG_SAFETY_ARMED if self.armed else 0
        status = dialect.MAV_STATE_CRITICAL if self.failsafe else dialect.MAV_STATE_ACTIVE
        kind = dialect.MAV_TYPE_SUBMARINE, dialect.MAV_AUTOPILOT_GENERIC
        self.send(dialect.MAVLink_heartbeat_message(*kind, mode, 0, status, 3))

    def _answer(self, now: float, frame: bytes) -> None:
        message: Any = protocol.decode(frame)
        assert protocol.header(frame).component == COMPANION_COMPONENT
        self.heard.append(message.msgname)
        if message.msgname == "AUTOPILOT_VERSION":
            self.companion_hash = bytes(message.middleware_custom_version)
        elif message.msgname == "TIMESYNC" and message.tc1 == 0:
            self.send(dialect.MAVLink_timesync_message(int(self.boot_s(now) * 1e9) + 1, message.ts1))
        elif message.msgname == "PARAM_SET":
            self._set(message.param_id, message.param_value)
        elif message.msgname == "SET_POSITION_TARGET_LOCAL_NED":
            speed = message.vx * math.cos(message.yaw) + message.vy * math.sin(message.yaw)
            self.setpoints.append((message.yaw, message.z, speed))
        elif message.msgname == "COMMAND_LONG":
            self._command(message)

    def _set(self, name: str, value: float) -> None:
        if name not in self.parameters:
            return
        if value <= self.limits.get(name, math.inf):
            self.parameters[name] = value
            if name == "SYS_ID":
                self.system = int(value)
        kind, count = dialect.MAV_PARAM_TYPE_REAL32, len(self.parameters)
        self.send(dialect.MAVLink_param_value_message(name.encode(), self.parameters[name], kind, count, 0))

    def _command(self, message: Any) -> None:
        result = dialect.MAV_RESULT_ACCEPTED
        if message.command == dialect.MAV_CMD_REQUEST_MESSAGE:
            zeros = bytes(8)
            self.send(
                dialect.MAVLink_autopilot_version_message(0, 0, 0, 0, 0, zeros, self.dialect_hash, zeros, 0, 0, 0)
            )
        elif message.command == dialect.MAV_CMD_COMPONENT_ARM_DISARM:
            if message.param1 == 1.0 and (self.refusal or self.companion_hash != self.dialect_hash):
                result = dialect.MAV_RESULT_TEMPORARILY_REJECTED
            else:
                self.armed, self.failsafe = message.param1 == 1.0, False
        self.send(dialect.MAVLink_command_ack_message(message.command, result))
        if result != dialect.MAV_RESULT_ACCEPTED:
            text = f"arming refused: {self.refusal or 'dialect'}"
            self.send(dialect.MAVLink_statustext_message(dialect.MAV_SEVERITY_WARNING, text.encode()))
