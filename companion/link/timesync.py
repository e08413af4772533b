"""The firmware's clock as seen from here: a line through exchanged stamps that forgets slowly and rejects outliers."""

from __future__ import annotations

import math
from collections import deque

_SAMPLES = 40
_FLOOR_S = 0.005  # a sample this near to the line is never an outlier
_SIGMAS = 4.0
_OUTLIERS_TO_RESTART = 6  # so many in a row mean that the other clock jumped or the line got slower
_SLOWEST_S = 1.0  # a longer round trip tells nothing
_SLOW, _SLOW_S = 4.0, 0.02  # nor does one longer than this times the fastest, plus this
_RATE_ERROR = 5e-3  # most that a ceramic resonator is off


class TimeSync:
    """Maps seconds of the firmware's clock to seconds of ours by regression over the last samples.

    A sample is the time sent, the other's time, the time the answer came; the middle of the first and the last is taken
    for the moment of the second, and a slow round trip weighs less. The line goes through the samples' mean.
    """

    def __init__(self) -> None:
        self.rejected = 0
        self.restarts = 0
        self.round_trip = math.nan  # s, least of the samples
        self.residual = math.nan  # s, RMS of the samples about the line
        self._samples: deque[tuple[float, float, float]] = deque(maxlen=_SAMPLES)  # theirs, ours, round trip
        self._line: tuple[float, float, float] | None = None  # mean of theirs, mean of ours, slope
        self._outliers = 0

    @property
    def synchronised(self) -> bool:
        """Whether there are samples enough to trust."""
        return len(self._samples) >= 3

    def add(self, sent: float, theirs: float, came: float) -> bool:
        """Takes one exchange, s; False when it was rejected."""
        trip = came - sent
        if not 0.0 <= trip <= _SLOWEST_S or not math.isfinite(theirs):
            self.rejected += 1
            return False
        ours = (sent + came) / 2
        if self.synchronised:
            slow = trip > _SLOW * self.round_trip + _SLOW_S
            allowed = max(_FLOOR_S, _SIGMAS * self.residual) + trip / 2
            if slow or abs(ours - self.ours(theirs)) > allowed:
                self.rejected += 1
                self._outliers += 1
                if self._outliers < _OUTLIERS_TO_RESTART:
                    return False
                self.restart()
        self._outliers = 0
        self._samples.append((theirs, ours, trip))
        self._fit()
        return True

    def restart(self) -> None:
        """Forgets the other clock, as after its reset."""
        self.restarts += bool(self._samples)
        self._samples.clear()
        self._line = None
        self._outliers = 0

    def ours(self, theirs: float) -> float:
        """The time here, s, when the firmware's clock showed `theirs`, s; only meaningful when synchronised."""
        if self._line is None:
            return math.nan
        mean_theirs, mean_ours, slope = self._line
        return mean_ours + slope * (theirs - mean_theirs)

    def _fit(self) -> None:
        samples = self._samples
        fastest = min(trip for _, _, trip in samples)
        weights = [1.0 / (1e-3 + trip - fastest) ** 2 for _, _, trip in samples]
        total = sum(weights)
        mean_theirs = sum(w * theirs for w, (theirs, _, _) in zip(weights, samples, strict=True)) / total
        mean_ours = sum(w * ours for w, (_, ours, _) in zip(weights, samples, strict=True)) / total
        spread = sum(w * (theirs - mean_theirs) ** 2 for w, (theirs, _, _) in zip(weights, samples, strict=True))
        slope = 1.0
        if spread / total > 1.0:  # two seconds of samples or so
            cross = sum(
                w * (theirs - mean_theirs) * (ours - mean_ours)
                for w, (theirs, ours, _) in zip(weights, samples, strict=True)
            )
            slope = min(max(cross / spread, 1 - _RATE_ERROR), 1 + _RATE_ERROR)
        self._line = (mean_theirs, mean_ours, slope)
        errors = sum(w * (ours - self.ours(theirs)) ** 2 for w, (theirs, ours, _) in zip(weights, samples, strict=True))
        self.residual = math.sqrt(errors / total)
        self.round_trip = fastest
