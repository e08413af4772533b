"""A logbook of the line with the firmware itself at its other end, compiled for this machine, in simulated water."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from typing import Any

import pytest

import protocol
from companion.link import LinkCommand, LinkSession, LinkState, Message, PipeBus
from companion.scene import Setpoint
from protocol import COMPANION_COMPONENT, DIALECT_HASH, FIRMWARE_COMPONENT, dialect
from sim.plant import Plant

TICK_S, SYNC_S = 0.1, 0.02
CRUISE = Setpoint(1.0, 2.0, 0.4)


class Dive:
    """One vehicle and its session in lockstep; `garble` may change bytes on the line."""

    def __init__(self, session: LinkSession) -> None:
        self.plant = Plant("native", starts=[[0.0, 0.0, 0.5, 0.3]], seed=1)
        self.session = session
        self.bus = PipeBus()
        self.ticks = 0
        self.setpoint: Setpoint | None = CRUISE
        self.arm: bool | None = True
        self.connected = True
        self.garble: Callable[[bytes], bytes] = lambda data: data
        self.echoes: list[Any] = []
        self.log: list[str] = []

    def dive(self, seconds: float) -> None:
        for _ in range(round(seconds / TICK_S)):
            for sync in range(1, 6):
                at = self.ticks * TICK_S + sync * SYNC_S
                self.plant.run_until(at)
                received = self.garble(self.plant.uart_read(0))
                if self.connected:
                    self.bus.feed(received, at)
            self.ticks += 1
            messages = self.bus.recv_all()
            self.echoes += [m.fields for m in messages if m.name == "POSITION_TARGET_LOCAL_NED"]
            command = LinkCommand(self.setpoint, self.arm)
            out = self.session.step(self.ticks * TICK_S, messages, command, self.bus.report())
            for message in out.messages:
                self.bus.send(message)
            sent = self.bus.take()
            if self.connected:
                self.plant.uart_write(0, self.garble(sent), self.ticks * TICK_S)
            self.log += [event.text for event in out.events]

    def mode(self) -> int:
        """0 disarmed, 1 armed, 2 failsafe, by the newest heartbeat."""
        heartbeat = self.session.telemetry.latest(dialect.MAVLINK_MSG_ID_HEARTBEAT)
        assert heartbeat is not None
        return int(heartbeat.fields.custom_mode)


def test_the_firmware_becomes_vehicle_3_dives_and_obeys_its_two_timeouts() -> None:
    dive = Dive(LinkSession(3, {"DEPTH_MAX": 20.0}))
    dive.dive(30.0)
    session, states = dive.session, dive.plant.states
    assert session.state is LinkState.READY
    assert session.armed
    assert "connected, parameters set and verified" in dive.log
    assert "armed" in dive.log
    assert session.telemetry.depth == pytest.approx(states.position[0, 2], abs=0.1)
    assert session.telemetry.attitude is not None
    assert states.position[0, 2] == pytest.approx(CRUISE.depth, abs=0.5)
    assert dive.echoes[-1].z == pytest.approx(CRUISE.depth)
    assert dive.echoes[-1].yaw == pytest.approx(CRUISE.heading)
    assert math.hypot(dive.echoes[-1].vx, dive.echoes[-1].vy) == pytest.approx(CRUISE.speed)
    assert dive.bus.counters.bytes_lost == dive.bus.counters.sequence_gaps == 0
    assert session.timesync.synchronised
    assert session.telemetry.boot_time is not None
    measured = session.timesync.ours(session.telemetry.boot_time)
    assert session.telemetry.attitude_stamp - 0.05 < measured < session.telemetry.attitude_stamp

    dive.setpoint = None  # 1 s without: hold at zero thrust, and back
    dive.dive(1.0)
    assert states.pulses[0, 2] == pytest.approx(1500, abs=2)
    dive.setpoint = CRUISE
    dive.dive(3.0)
    assert dive.mode() == 1
    assert states.pulses[0, 2] > 1550

    dive.connected = False  # 4 s: failsafe, which only arming again ends
    dive.dive(4.0)
    dive.connected = True
    dive.dive(4.0)
    assert dive.mode() == 2
    assert any(text.startswith("the firmware ended the run") for text in dive.log)
    dive.arm = False
    dive.dive(2.0)
    dive.arm = True
    dive.dive(4.0)
    assert dive.mode() == 1


def test_with_one_byte_in_a_thousand_flipped_the_firmware_accepts_no_setpoint_that_was_not_sent() -> None:
    noise = random.Random(5)

    def flip(data: bytes) -> bytes:
        return bytes(octet ^ (1 << noise.randrange(8)) if noise.random() < 1e-3 else octet for octet in data)

    dive = Dive(LinkSession(1, {}))
    dive.garble = flip
    sent = []
    for step in range(60):
        dive.setpoint = Setpoint(0.1 * (step % 30), 2.0 + 0.01 * step, 0.3 + 0.002 * step)
        sent.append((dive.setpoint.heading, dive.setpoint.depth))
        dive.dive(0.5)
    assert dive.mode() == 1
    assert dive.session.losses == 0
    accepted = [(echo.yaw, echo.z) for echo in dive.echoes if echo.z > 0.0]
    assert len(accepted) > 100
    for yaw, depth in accepted:
        assert any(abs(yaw - heading) < 1e-5 and abs(depth - z) < 1e-5 for heading, z in sent)
    assert dive.bus.counters.bad_frames > 0
    values = dive.session.telemetry.values
    assert values["rx_bad"] > 0
    assert values["sp_refused"] == 0


def test_the_firmware_itself_refuses_a_companion_of_another_dialect_and_names_both_hashes() -> None:
    plant, bus = Plant("native", starts=[[0.0, 0.0, 0.5, 0.0]], seed=1), PipeBus()
    other, zeros = bytes(range(8)), bytes(8)
    plant.run_until(4.0)
    for fields in (
        dialect.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3),
        dialect.MAVLink_autopilot_version_message(0, 0, 0, 0, 0, zeros, other, zeros, 0, 0, 0),
    ):
        bus.send(Message(fields, system=1, component=COMPANION_COMPONENT))
    plant.uart_write(0, bus.take(), plant.now)
    plant.uart_read(0)
    plant.run_until(4.5)
    bus.feed(plant.uart_read(0), plant.now)
    arm = dialect.MAVLink_command_long_message(1, FIRMWARE_COMPONENT, 400, 0, 1.0, 0, 0, 0, 0, 0, 0)
    bus.send(Message(arm, system=1, component=COMPANION_COMPONENT))
    plant.uart_write(0, bus.take(), plant.now)
    plant.run_until(5.0)
    bus.feed(plant.uart_read(0), plant.now)
    messages = bus.recv_all()
    [ack] = [m.fields for m in messages if m.name == "COMMAND_ACK"]
    assert ack.result == dialect.MAV_RESULT_TEMPORARILY_REJECTED
    texts = [protocol.decode(m.frame).text for m in messages if m.name == "STATUSTEXT"]  # type: ignore[attr-defined]
    assert f"dialect {DIALECT_HASH.hex()}, not {other.hex()}" in texts
