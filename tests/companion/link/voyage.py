"""Companion's session and fake firmware on one simulated line, tick by tick, with a log of what was said."""

from __future__ import annotations

from collections.abc import Callable

from companion.link import LinkCommand, LinkSession, LinkState, PipeBus
from companion.scene import Setpoint
from tests.companion.link.firmware_fake import FirmwareFake

TICK_S = 0.1


class Voyage:
    """Simulated time only; `garble` may change the bytes of either direction on their way."""

    def __init__(self, firmware: FirmwareFake, session: LinkSession) -> None:
        self.now = 0.0
        self.firmware = firmware
        self.session = session
        self.bus = PipeBus()
        self.setpoint: Setpoint | None = Setpoint(0.5, 2.0, 0.4)
        self.arm: bool | None = None
        self.connected = True
        self.garble: Callable[[bytes], bytes] = lambda data: data
        self.log: list[str] = []

    def sail(self, seconds: float) -> None:
        """Lets time pass: ten ticks a second, the line carried five times a tick."""
        for _ in range(round(seconds / TICK_S)):
            for step in range(1, 6):
                at = self.now + step * TICK_S / 5
                received = self.garble(self.bus.take())
                sent = self.garble(self.firmware.exchange(at, received if self.connected else b""))
                if self.connected:
                    self.bus.feed(sent, at)
            self.now = round(self.now + TICK_S, 6)
            command = LinkCommand(self.setpoint, self.arm)
            out = self.session.step(self.now, self.bus.recv_all(), command, self.bus.report())
            for message in out.messages:
                self.bus.send(message)
            self.log += [f"{event.severity.value}: {event.text}" for event in out.events]

    def said(self, text: str) -> bool:
        """Whether an event so far contained the text."""
        return any(text in line for line in self.log)

    def state(self) -> LinkState:
        """How far the conversation has come."""
        return self.session.state

    def firmware_mode(self) -> str:
        """What the firmware is in truth."""
        return "failsafe" if self.firmware.failsafe else "armed" if self.firmware.armed else "disarmed"
