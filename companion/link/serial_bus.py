"""The serial port to the firmware: absent or vanished is a state with a cause, and it reopens by itself."""

from __future__ import annotations

import contextlib
import os
import select
import termios
import threading
import time
from collections.abc import Callable

import serial

from companion.link.bus import Bus, BusState

_FIRST_RETRY_S = 0.1
_LONGEST_RETRY_S = 2.0
_SEND_BUFFER = 4096  # bytes: a third of a second at 115200 bit/s
_READ_AT_MOST = 4096
_PORT_ERRORS = (serial.SerialException, OSError, termios.error, ValueError)


class SerialBus(Bus):
    """A bus over `port` at `baud`; received messages are stamped by `clock` (s).

    One thread may receive while another sends. Retries to open come after 0.1 s, then twice as late each time, up to
    2 s; they happen inside recv and send.
    """

    def __init__(self, port: str, baud: int, clock: Callable[[], float] = time.monotonic) -> None:
        super().__init__()
        self.port = port
        self.baud = baud
        self._clock = clock
        self._lock = threading.RLock()
        self._serial: serial.Serial | None = None
        self._pending = bytearray()
        self._pause = _FIRST_RETRY_S
        self._retry_at = 0.0  # monotonic
        self._was_open = False
        self.state, self.cause = BusState.DOWN, f"{port}: not opened yet"
        self._open()

    def shutdown(self) -> None:
        """Sends what waits and closes the port for good."""
        with self._lock:
            if self._serial is not None:
                with contextlib.suppress(*_PORT_ERRORS):
                    self._flush()
            self._close()
            self.state, self.cause = BusState.SHUT, ""

    def _open(self) -> None:
        with self._lock:
            if self._serial is not None or self.state is BusState.SHUT or time.monotonic() < self._retry_at:
                return
            try:
                opened = serial.Serial(self.port, self.baud, timeout=0, write_timeout=0, exclusive=True)
            except _PORT_ERRORS as error:
                self._down(f"{self.port}: cannot be opened: {_reason(error)}")
                return
            self._serial = opened
            self._pause = _FIRST_RETRY_S
            self._rest = b""
            self.counters.reopened += self._was_open
            self._was_open = True
            self.state, self.cause = BusState.OPEN, ""

    # Lets go of the port and plans the next attempt.
    def _down(self, cause: str) -> None:
        with self._lock:
            self._close()
            self._retry_at = time.monotonic() + self._pause
            self._pause = min(2 * self._pause, _LONGEST_RETRY_S)
            if self.state is not BusState.SHUT:
                self.state, self.cause = BusState.DOWN, cause

    def _close(self) -> None:
        if self._serial is not None:
            with contextlib.suppress(*_PORT_ERRORS):
                self._serial.close()
            self._serial = None
            self._pending.clear()

    def _read(self, timeout: float) -> tuple[bytes, float]:
        self._open()
        port = self._serial
        if port is None:
            time.sleep(max(0.0, min(timeout, self._retry_at - time.monotonic())))
            return b"", self._clock()
        try:
            with self._lock:
                self._flush()
            readable, _, _ = select.select([port.fileno()], [], [], timeout)
            data = port.read(_READ_AT_MOST) if readable else b""
            if not readable and port.in_waiting < 0:  # asking also tells whether the port still exists
                return b"", self._clock()
            return data, self._clock()
        except (*_PORT_ERRORS, TypeError) as error:  # pyserial raises TypeError when closed by another thread
            if self._serial is port:
                self._down(f"{self.port}: went away: {_reason(error)}")
            return b"", self._clock()

    def _write(self, frame: bytes) -> bool:
        self._open()
        with self._lock:
            if self._serial is None or len(self._pending) + len(frame) > _SEND_BUFFER:
                return False
            self._pending += frame
            try:
                self._flush()
            except _PORT_ERRORS as error:
                self._down(f"{self.port}: went away: {_reason(error)}")
                return False
            return True

    # Gives the port as many of the waiting bytes as it takes.
    def _flush(self) -> None:
        if self._serial is None or not self._pending:
            return
        # pyserial's own write spins for ever on a line that takes nothing; the descriptor is non-blocking.
        with contextlib.suppress(BlockingIOError):
            del self._pending[: os.write(self._serial.fileno(), self._pending)]


# The operating system's words where there are some.
def _reason(error: BaseException) -> str:
    number = getattr(error, "errno", None)
    return os.strerror(number) if number else str(error)
