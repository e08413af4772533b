"""The serial port as the companion meets it: there, gone, back; a pseudo-terminal plays the firmware's end."""

from __future__ import annotations

import contextlib
import os
import pty
import time
import tty
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

import protocol
from companion.link import BufferedReader, Bus, BusState, Listener, Message, Notifier, PipeBus, SerialBus
from protocol import dialect


class Terminal:
    """A pseudo-terminal behind a name that can vanish and return."""

    def __init__(self, link: Path) -> None:
        self.link = link
        self.plug()

    def plug(self) -> None:
        self.master, self.slave = pty.openpty()
        tty.setraw(self.slave)
        self.link.symlink_to(os.ttyname(self.slave))

    def unplug(self) -> None:
        self.link.unlink()
        os.close(self.slave)
        os.close(self.master)


def attitude(sequence: int) -> bytes:
    fields = dialect.MAVLink_attitude_message(1000, 0.0, 0.0, 0.25, 0.0, 0.0, 0.0)
    return protocol.encode(fields, system=1, component=1, sequence=sequence)


def heartbeat() -> Message:
    return Message(dialect.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3), system=1, component=191)


def eventually(what: Callable[[], object]) -> bool:
    """Whether it comes true within a time that no working machine needs."""
    end = time.monotonic() + 10.0
    while time.monotonic() < end:
        if what():
            return True
    return False


@pytest.fixture
def terminal(tmp_path: Path) -> Iterator[Terminal]:
    terminal = Terminal(tmp_path / "ttyFIRMWARE")
    yield terminal
    with contextlib.suppress(OSError):
        os.close(terminal.master)


def test_a_port_that_vanishes_is_a_state_with_a_cause_and_reopens_by_itself(terminal: Terminal) -> None:
    with SerialBus(str(terminal.link), 115200) as bus:
        os.write(terminal.master, b"noise" + attitude(4) + attitude(6))
        first = bus.recv(5.0)
        assert first is not None
        assert first.name == "ATTITUDE"
        assert first.fields.yaw == pytest.approx(0.25)
        assert bus.recv(5.0) is not None
        assert (bus.counters.bytes_lost, bus.counters.sequence_gaps) == (5, 1)
        assert bus.send(heartbeat())
        assert os.read(terminal.master, 100)[:1] == b"\xfd"

        terminal.unplug()
        assert eventually(lambda: (bus.recv(0.01), bus.state is BusState.DOWN)[1])
        assert str(terminal.link) in bus.cause
        assert not bus.send(heartbeat())
        assert bus.counters.messages_unsent == 1
        assert eventually(lambda: (bus.recv(0.01), "cannot be opened: No such file" in bus.cause)[1])

        terminal.plug()
        assert eventually(lambda: (bus.recv(0.01), bus.state is BusState.OPEN)[1])
        assert bus.counters.reopened == 1
        os.write(terminal.master, attitude(7))
        assert bus.recv(5.0) is not None
    assert bus.state is BusState.SHUT
    assert bus.recv() is None
    assert not bus.send(heartbeat())


def test_a_port_that_is_not_there_at_start_is_waited_for(tmp_path: Path) -> None:
    with SerialBus(str(tmp_path / "nowhere"), 115200) as bus:
        assert bus.state is BusState.DOWN
        assert bus.cause == f"{tmp_path / 'nowhere'}: cannot be opened: No such file or directory"
        assert bus.recv(0.01) is None
        late = Terminal(tmp_path / "nowhere")
        assert eventually(lambda: (bus.recv(0.01), bus.state is BusState.OPEN)[1])
        os.close(late.master)


def test_a_line_that_takes_nothing_loses_whole_messages_and_never_blocks(terminal: Terminal) -> None:
    with SerialBus(str(terminal.link), 115200) as bus:
        while bus.send(heartbeat()):
            assert bus.counters.messages_sent < 10_000, "the buffers are bounded"
        assert bus.counters.messages_unsent == 1
        received = b""
        while len(received) < bus.counters.bytes_sent:
            bus.recv(0.0)  # gives the port what waits
            received += os.read(terminal.master, 65536)
        frames, rest, lost = protocol.split_frames(received)
        assert (len(frames), rest, lost) == (bus.counters.messages_sent, b"", 0)


class FailingBus(PipeBus):
    """Raises on every second call, as no bus should."""

    calls = 0

    def recv(self, timeout: float = 0.0) -> Message | None:
        self.calls += 1
        if self.calls % 2:
            raise OSError("the bus is broken")
        return super().recv(timeout)


class Grumbler(Listener):
    heard = 0

    def on_message(self, message: Message) -> None:
        self.heard += 1
        raise RuntimeError("the listener is broken")


def test_the_notifier_survives_a_broken_bus_and_a_broken_listener() -> None:
    bus: Bus = FailingBus()
    assert isinstance(bus, FailingBus)
    bus.feed(b"".join(attitude(n) for n in range(4)), 0.0)
    reader, grumbler = BufferedReader(), Grumbler()
    notifier = Notifier(bus, [grumbler, reader])
    messages: list[Message] = []

    def all_heard() -> bool:
        messages.extend(reader.take())
        return len(messages) == 4

    assert eventually(all_heard)
    assert grumbler.heard == 4
    assert notifier.is_alive()
    assert any("the bus is broken" in text for text in reader.errors)
    notifier.stop()
    assert not notifier.is_alive()
