"""The mission's clock: seconds since the common start, steady even when the computer's date is corrected."""

from __future__ import annotations

import datetime
import time


class MissionClock:
    """Callable that tells the mission's time; the date is read once, at construction."""

    def __init__(self, start: datetime.datetime | None = None) -> None:
        begun = 0.0 if start is None else time.time() - start.timestamp()
        self._origin = time.monotonic() - begun

    def __call__(self) -> float:
        """Seconds since the common start; negative before it."""
        return time.monotonic() - self._origin
