"""A progress bar on a terminal's standard error, and a line every tenth of the way elsewhere."""

from __future__ import annotations

import sys
import time
from typing import TextIO

from sim.history import Snapshot

_WIDTH = 28
_REDRAW_S = 0.1


class Progress:
    """An observer that shows how far a run has come and how fast it goes."""

    def __init__(self, end_s: float, out: TextIO = sys.stderr) -> None:
        self._end = end_s
        self._out = out
        self._terminal = out.isatty()
        self._begun = time.monotonic()
        self._drawn = -1.0
        self._tenth = 0

    def observe(self, snapshot: Snapshot) -> None:
        """Shows one moment."""
        share = min(1.0, snapshot.now / self._end) if self._end > 0.0 else 1.0
        wall = time.monotonic() - self._begun
        text = f"{snapshot.phase.value:8} {snapshot.now:5.0f} of {self._end:.0f} s"
        if snapshot.now > 0.0 and wall > 0.0:
            text += f", {snapshot.now / wall:.1f} x real time"
        if self._terminal:
            if wall - self._drawn >= _REDRAW_S or share >= 1.0:
                self._drawn = wall
                bar = "#" * round(share * _WIDTH)
                self._out.write(f"\r[{bar:.<{_WIDTH}}] {text}\x1b[K")
                self._out.flush()
        elif share * 10 >= self._tenth:
            self._tenth = int(share * 10) + 1
            print(text, file=self._out, flush=True)

    def close(self) -> None:
        """Ends the line."""
        if self._terminal and self._drawn >= 0.0:
            self._out.write("\n")
            self._out.flush()
