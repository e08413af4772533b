"""Sets the firmware's parameters from the vehicle file and verifies each by the firmware's answer."""

from __future__ import annotations

import struct
from collections.abc import Mapping

from companion.link.message import Message
from protocol import dialect

_RETRY_S = 0.5
_ATTEMPTS = 8
_AT_ONCE = 4  # parameters on their way at the same time, so that the firmware's receive ring holds them


class Configurator:
    """Sends PARAM_SET until each PARAM_VALUE came back equal; the first of `parameters` goes alone."""

    def __init__(self, parameters: Mapping[str, float]) -> None:
        self._wanted = {name: _single(value) for name, value in parameters.items()}
        self.restart()

    def restart(self) -> None:
        """Starts anew, as after a reset of the firmware."""
        self._open = dict.fromkeys(self._wanted, 0)  # name -> attempts made
        self._due = dict.fromkeys(self._wanted, -1e9)
        self.failures: list[str] = []

    @property
    def finished(self) -> bool:
        """Whether every parameter was verified or given up."""
        return not self._open

    def take(self, message: Message) -> None:
        """Hears a PARAM_VALUE."""
        fields = message.fields
        name = str(fields.param_id).rstrip("\0")
        if self._open.get(name, 0) == 0:
            return
        wanted = self._wanted[name]
        if fields.param_value == wanted:
            del self._open[name]
        elif self._open[name] >= 2:  # the first answer may be older than our request
            self.failures.append(f"parameter {name} = {wanted:g} refused, firmware keeps {fields.param_value:g}")
            del self._open[name]

    def step(self, now: float) -> list[tuple[str, float]]:
        """The parameters to send now: (name, value)."""
        due = []
        first = next(iter(self._wanted), "")
        window = [first] if first in self._open else list(self._open)[:_AT_ONCE]
        for name in window:
            if now - self._due[name] < _RETRY_S - 1e-6:
                continue
            if self._open[name] >= _ATTEMPTS:
                self.failures.append(f"parameter {name}: no answer (unknown to this firmware?)")
                del self._open[name]
                continue
            self._open[name] += 1
            self._due[name] = now
            due.append((name, self._wanted[name]))
        return due


# A parameter as the line carries it.
def _single(value: float) -> float:
    return float(struct.unpack("<f", struct.pack("<f", value))[0])


def param_set(system: int, component: int, name: str, value: float) -> dialect.MAVLink_param_set_message:
    """The message that sets one parameter."""
    """PARAM_SET of a REAL32, the only type on this link."""
    return dialect.MAVLink_param_set_message(system, component, name.encode(), value, dialect.MAV_PARAM_TYPE_REAL32)
