"""Holds a run back to a speed that people can watch, and stops it on request; results never depend on it."""

from __future__ import annotations

import threading
import time

SPEEDS = (1.0, 4.0, 8.0)
_LONGEST_WAIT_S = 0.1
_LAG_FORGIVEN_S = 0.25


class Pace:
    """Simulated seconds a second of wall time: `speed` None is as fast as it goes. Safe to use from two threads."""

    def __init__(self, speed: float | None) -> None:
        self._lock = threading.Condition()
        self._speed = speed
        self._paused = False
        self._closed = False
        self._from = (0.0, time.monotonic())  # simulated and wall time since which the speed has been constant

    @property
    def speed(self) -> float | None:
        """The wanted speed."""
        return self._speed

    @property
    def paused(self) -> bool:
        """Whether the run stands still."""
        return self._paused

    def set(self, *, speed: float | bool | None = False, paused: bool | None = None) -> None:
        """Changes what is given; `speed` False leaves it as it is."""
        with self._lock:
            if speed is not False:
                self._speed = None if speed is None else float(speed)
            if paused is not None:
                self._paused = paused
            self._from = (-1.0, 0.0)
            self._lock.notify_all()

    def close(self) -> None:
        """Lets the run go at once, for good."""
        with self._lock:
            self._closed = True
            self._lock.notify_all()

    def wait(self, now: float) -> None:
        """Returns when simulated time `now` is due."""
        with self._lock:
            while not self._closed:
                wall = time.monotonic()
                if self._from[0] < 0.0:
                    self._from = (now, wall)
                if self._paused:
                    self._lock.wait(_LONGEST_WAIT_S)
                    self._from = (now, time.monotonic())
                    continue
                if self._speed is None:
                    return
                due = self._from[1] + (now - self._from[0]) / self._speed
                if due <= wall:
                    if wall - due > _LAG_FORGIVEN_S:
                        self._from = (now, wall)
                    return
                self._lock.wait(min(due - wall, _LONGEST_WAIT_S))
