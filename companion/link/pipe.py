"""A line inside the process, for lockstep: somebody else carries the bytes and says when they arrived."""

from __future__ import annotations

from collections import deque

from companion.link.bus import Bus, BusState


class PipeBus(Bus):
    """The companion's end of a line whose other end is the caller: `feed` bytes in, `take` bytes out."""

    def __init__(self) -> None:
        super().__init__()
        self._arrived: deque[tuple[bytes, float]] = deque()
        self._departing = bytearray()

    def feed(self, data: bytes, stamp: float) -> None:
        """Bytes that arrived from the firmware at `stamp`, s on the companion's clock."""
        if data:
            self._arrived.append((data, stamp))

    def take(self) -> bytes:
        """All bytes sent to the firmware since the last call."""
        data = bytes(self._departing)
        self._departing.clear()
        return data

    def unplug(self, cause: str) -> None:
        """Takes the line down, as a port that vanishes does; `plug` brings it back."""
        if self.state is BusState.OPEN:
            self.state, self.cause = BusState.DOWN, cause
            self._arrived.clear()
            self._departing.clear()

    def plug(self) -> None:
        """Brings a line that is down back."""
        if self.state is BusState.DOWN:
            self.state, self.cause = BusState.OPEN, ""
            self.counters.reopened += 1
            self._rest = b""

    def shutdown(self) -> None:
        """Closes this end for good."""
        self.state = BusState.SHUT

    def _read(self, timeout: float) -> tuple[bytes, float]:
        return self._arrived.popleft() if self._arrived and self.state is BusState.OPEN else (b"", 0.0)

    def _write(self, frame: bytes) -> bool:
        if self.state is not BusState.OPEN:
            return False
        self._departing += frame
        return True
