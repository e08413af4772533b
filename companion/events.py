"""What the companion has to say: one line each, for log, page and ground station."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Severity(Enum):
    """How much a person should care."""

    INFO = "info"
    WARNING = "warning"
    ERROR = "error"


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened at `stamp` (s, mission clock); `source` is the part that noticed it."""

    stamp: float
    severity: Severity
    source: str
    text: str
