"""Why the line does not work, named as a cause that somebody can remove."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from enum import Enum

from companion.link.bus import BusReport, BusState, Counters

_WINDOW_S = 4.0
_JUDGE_AFTER_S = 1.5
_FEWEST_BYTES = 40  # from which a judgement on content is made
_NOISY = 0.01  # part of the messages damaged from which noise is reported
_STALL_S = 0.5


class Cause(Enum):
    """What is wrong with the line."""

    NONE = "none"
    PORT = "port"
    NOTHING_THERE = "nothing there"
    WRONG_BAUD = "wrong baud"
    WRONG_DIALECT = "wrong dialect"
    NOISE = "noise"
    HOST_STALL = "host stall"


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """A cause, and a sentence on what was seen and what to check."""

    cause: Cause
    text: str = ""


class Diagnostician:
    """Watches the counters of a line over the last seconds."""

    def __init__(self) -> None:
        self._history: deque[tuple[float, Counters]] = deque()
        self._last_step: float | None = None
        self._stalled: tuple[float, float] | None = None  # when, for how long

    def step(self, now: float, report: BusReport) -> None:
        """Takes the line's report at `now`, s; call it every tick."""
        if self._last_step is not None and now - self._last_step > _STALL_S:
            self._stalled = (now, now - self._last_step)
        self._last_step = now
        history = self._history
        if history and now < history[-1][0]:
            history.clear()
        if not history or now - history[-1][0] >= 0.5:
            history.append((now, report.counters))
        while len(history) > 1 and now - history[1][0] >= _WINDOW_S:
            history.popleft()

    def judge(self, now: float, report: BusReport) -> Diagnosis:
        """The most likely cause at this moment; `Cause.NONE` when the line works, or it is too early to tell."""
        if report.state is not BusState.OPEN:
            return Diagnosis(Cause.PORT, report.cause or "serial port is shut")
        if self._stalled is not None and now - self._stalled[0] < 2.0:
            text = f"host stall: this companion did not run for {self._stalled[1]:.1f} s (CPU load, SD card, suspend?)"
            return Diagnosis(Cause.HOST_STALL, text)
        if not self._history or now - self._history[0][0] < _JUDGE_AFTER_S:
            return Diagnosis(Cause.NONE)
        since, before = self._history[0]
        counters, seconds = report.counters, now - since
        received = counters.bytes_received - before.bytes_received
        lost = counters.bytes_lost - before.bytes_lost
        good = counters.messages_received - before.messages_received
        bad = counters.bad_frames - before.bad_frames
        if received == 0:
            text = (
                f"nothing there: no byte for {seconds:.1f} s (firmware unpowered, wrong port, cable or RX/TX swapped?)"
            )
            return Diagnosis(Cause.NOTHING_THERE, text)
        if good == 0 and received >= _FEWEST_BYTES:
            # A frame of this link has 80 bytes at most, so frames of another dialect begin at least that often.
            if bad * 100 >= received:
                text = (
                    f"wrong dialect: {bad} frames of unknown content in {seconds:.1f} s (firmware of another version?)"
                )
                return Diagnosis(Cause.WRONG_DIALECT, text)
            text = f"wrong baud: {received} bytes in {seconds:.1f} s but no frame among them (check serial.baud)"
            return Diagnosis(Cause.WRONG_BAUD, text)
        damaged = max(bad, lost > 0)
        if good and damaged >= 3 and damaged > _NOISY * (good + damaged):
            text = f"noise: {damaged} of {good + damaged} frames damaged in {seconds:.1f} s (cable, ground, shielding?)"
            return Diagnosis(Cause.NOISE, text)
        return Diagnosis(Cause.NONE)
