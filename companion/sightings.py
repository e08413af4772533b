"""Sightings from a stream socket, one JSON document a line: the seam behind which the laser's own process stands.

A line is {"stamp": s, "position": [n, e, d] or null, "sigma": m, "relative": [[n, e, d], ...], "range": m}, times on
the mission's clock, mission axes; "range" may be left out when there is no limit.
"""

from __future__ import annotations

import contextlib
import json
import math
import socket
import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from companion.config.vehicle import SightingsConfig
from companion.scene import Sighting

_RETRY_S = 0.5
_LONGEST_LINE = 65536
_MOST_NEIGHBOURS = 1000


class SightingError(ValueError):
    """A line that is no sighting; the message says why."""


def to_line(sighting: Sighting) -> bytes:
    """A sighting as one line of the stream."""
    document: dict[str, Any] = {
        "stamp": sighting.stamp,
        "position": None if sighting.position is None else sighting.position.tolist(),
        "sigma": sighting.sigma,
        "relative": sighting.relative.tolist(),
    }
    if math.isfinite(sighting.sensing_range):
        document["range"] = sighting.sensing_range
    return json.dumps(document, separators=(",", ":")).encode() + b"\n"


def from_line(line: bytes) -> Sighting:
    """The sighting that a line holds; raises SightingError."""
    try:
        document = json.loads(line)
    except (ValueError, RecursionError) as error:
        raise SightingError(f"not JSON: {error}") from error
    if not isinstance(document, dict):
        raise SightingError("must be an object")
    position = document.get("position")
    relative = document.get("relative", [])
    if not isinstance(relative, list) or len(relative) > _MOST_NEIGHBOURS:
        raise SightingError(f"relative must be a list of at most {_MOST_NEIGHBOURS} vectors")
    sensing_range = _number(document, "range") if "range" in document else math.inf
    rows = [_vector(row, "relative") for row in relative]
    return Sighting(
        stamp=_number(document, "stamp"),
        position=None if position is None else _vector(position, "position"),
        sigma=_number(document, "sigma"),
        relative=np.array(rows) if rows else np.zeros((0, 3)),
        sensing_range=sensing_range,
    )


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def _number(document: dict[str, Any], key: str) -> float:
    value = document.get(key)
    if not _is_number(value):
        raise SightingError(f"{key} must be a finite number")
    return float(value)  # type: ignore[arg-type]


def _vector(value: Any, key: str) -> NDArray[np.float64]:
    if not (isinstance(value, list) and len(value) == 3 and all(map(_is_number, value))):
        raise SightingError(f"{key} must be three finite numbers")
    return np.array(value, dtype=np.float64)


class SightingSource:
    """Reads the newest sighting without waiting; a source that is absent or gone is a `cause`, and is tried again."""

    def __init__(self, config: SightingsConfig) -> None:
        self.cause = "not connected yet"
        self.refused = 0  # lines that were no sighting
        self.last_refusal = ""
        self._config = config
        self._socket: socket.socket | None = None
        self._rest = b""
        self._retry_at = 0.0

    def take(self) -> Sighting | None:
        """The newest sighting since the last call."""
        self._connect()
        lines = self._lines()
        for line in reversed(lines):
            try:
                return from_line(line)
            except SightingError as error:
                self.refused += 1
                self.last_refusal = str(error)
        return None

    def close(self) -> None:
        """Lets go of the connection."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None
        self._rest = b""

    @property
    def where(self) -> str:
        """The address, for people."""
        return str(self._config.unix) if self._config.unix is not None else str(self._config.tcp)

    def _connect(self) -> None:
        if self._socket is not None or time.monotonic() < self._retry_at:
            return
        self._retry_at = time.monotonic() + _RETRY_S
        family = socket.AF_UNIX if self._config.unix is not None else socket.AF_INET
        connecting = socket.socket(family, socket.SOCK_STREAM)
        connecting.settimeout(0.05)  # on this computer or its own wire: half a tick is plenty
        try:
            if self._config.unix is not None:
                connecting.connect(str(self._config.unix))
            else:
                host, port = str(self._config.tcp).rsplit(":", 1)
                connecting.connect((host, int(port)))
        except OSError as error:
            connecting.close()
            self.cause = f"{self.where}: {error.strerror or error}"
            return
        connecting.setblocking(False)
        self._socket, self.cause = connecting, ""

    # All complete lines that have arrived.
    def _lines(self) -> list[bytes]:
        data = self._rest
        while self._socket is not None:
            try:
                chunk = self._socket.recv(_LONGEST_LINE)
            except (BlockingIOError, InterruptedError):
                break
            except OSError as error:
                chunk = b""
                self.cause = f"{self.where}: {error.strerror or error}"
            if not chunk:
                self.cause = self.cause or f"{self.where}: closed by the other side"
                with contextlib.suppress(OSError):
                    self._socket.close()
                self._socket = None
                break
            data += chunk
            if len(data) > 16 * _LONGEST_LINE:
                break
        *lines, self._rest = data.split(b"\n")
        if len(self._rest) > _LONGEST_LINE:
            self._rest = b""
            self.refused += 1
            self.last_refusal = "line too long"
        return lines
