"""A line that carries messages, in the manner of python-can: send, recv, shutdown; a line that is down is a state."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import Enum
from types import TracebackType
from typing import Self

import protocol
from companion.link.message import Message

_FRAME_START = re.compile(rb"\xfd[^\x00]\x00\x00", re.DOTALL)  # marker, length, no incompatible and no other flags


class BusState(Enum):
    """Whether the line can carry bytes at all."""

    OPEN = "open"
    DOWN = "down"  # reopens by itself
    SHUT = "shut"  # by shutdown(), for good


@dataclass(slots=True)
class Counters:
    """What a line carried and lost since it was made."""

    bytes_received: int = 0
    bytes_sent: int = 0
    bytes_lost: int = 0  # received bytes that belonged to no good frame
    messages_received: int = 0
    messages_sent: int = 0
    messages_unsent: int = 0  # the line was down or its buffer full
    bad_frames: int = 0  # a frame began and did not fulfil its CRC, or is of another dialect
    sequence_gaps: int = 0  # messages missing by their senders' numbering
    reopened: int = 0


@dataclass(frozen=True, slots=True)
class BusReport:
    """A line's condition at one moment, as a value that can be passed on and recorded."""

    state: BusState
    cause: str
    counters: Counters


class Bus(ABC):
    """One end of a line. No method but the constructor raises because of what happens on the line."""

    def __init__(self) -> None:
        self.state = BusState.OPEN
        self.cause = ""  # why the line is down
        self.counters = Counters()
        self._rest = b""
        self._ready: deque[Message] = deque()
        self._sequence = 0
        self._expected: dict[tuple[int, int], int] = {}

    @abstractmethod
    def _read(self, timeout: float) -> tuple[bytes, float]:
        """Bytes received, waiting at most `timeout` s for the first of them, and the time of their reception."""

    @abstractmethod
    def _write(self, frame: bytes) -> bool:
        """Takes a whole frame to send, or refuses it."""

    @abstractmethod
    def shutdown(self) -> None:
        """Closes the line for good; may be called twice."""

    def send(self, message: Message) -> bool:
        """Queues a message; False when the line did not take it."""
        frame = protocol.encode(
            message.fields, system=message.system, component=message.component, sequence=self._sequence
        )
        if self.state is BusState.SHUT or not self._write(frame):
            self.counters.messages_unsent += 1
            return False
        message.frame, message.sequence = frame, self._sequence
        self._sequence = (self._sequence + 1) & 0xFF
        self.counters.messages_sent += 1
        self.counters.bytes_sent += len(frame)
        return True

    def recv(self, timeout: float = 0.0) -> Message | None:
        """The next message, waiting at most `timeout` s for it; None when there is none."""
        if not self._ready and self.state is not BusState.SHUT:
            self._take(*self._read(timeout))
        return self._ready.popleft() if self._ready else None

    def recv_all(self) -> list[Message]:
        """All messages that have arrived, without waiting."""
        messages = []
        while (message := self.recv()) is not None:
            messages.append(message)
        return messages

    def report(self) -> BusReport:
        """The line's condition now."""
        return BusReport(self.state, self.cause, replace(self.counters))

    # Cuts received bytes into messages and counts what does not fit.
    def _take(self, data: bytes, stamp: float) -> None:
        if not data:
            return
        counters = self.counters
        counters.bytes_received += len(data)
        data = self._rest + data
        frames, self._rest, lost = protocol.split_frames(data)
        if lost:
            counters.bytes_lost += lost
            stray = data[: len(data) - len(self._rest)]
            for frame in frames:
                stray = stray.replace(frame, b"", 1)
            counters.bad_frames += len(_FRAME_START.findall(stray))
        for frame in frames:
            message = Message.received(frame, stamp)
            sender = (message.system, message.component)
            expected = self._expected.get(sender, message.sequence)
            counters.sequence_gaps += (message.sequence - expected) & 0xFF
            self._expected[sender] = (message.sequence + 1) & 0xFF
            self._ready.append(message)
        counters.messages_received += len(frames)

    def __iter__(self) -> Iterator[Message]:
        """Messages as they come, until shutdown."""
        while self.state is not BusState.SHUT:
            if (message := self.recv(1.0)) is not None:
                yield message

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.shutdown()
