"""The vehicle file: what differs from one vehicle of a mission to the next."""

from __future__ import annotations

import datetime
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from companion.config.errors import MISSING, Problem
from companion.config.loader import load
from companion.config.options import option, section

BAUD_RATES = (9600, 19200, 38400, 57600, 115200, 230400, 250000, 500000, 1000000)


@dataclass(frozen=True, slots=True, kw_only=True)
class SerialConfig:
    """The line to the firmware."""

    port: str = option("Serial port of the firmware, such as /dev/ttyS1", pattern=r".+")
    baud: int = option("Line speed", default=115200, choices=BAUD_RATES, unit="bit/s")


@dataclass(frozen=True, slots=True, kw_only=True)
class FirmwareConfig:
    """What the companion sets in the firmware at connect, before arming."""

    parameters: dict[str, float] = option(
        "Parameters to set and verify, by name", default={}, pattern="[A-Z][A-Z0-9_]{0,15}", low=-3.4e38, high=3.4e38
    )

    def problems(self) -> Iterator[Problem]:
        """The checks between settings."""
        if "SYS_ID" in self.parameters:
            yield Problem("parameters", "SYS_ID", self.parameters["SYS_ID"], "must be absent: `vehicle` sets it")


@dataclass(frozen=True, slots=True, kw_only=True)
class SightingsConfig:
    """Where sightings of own position and neighbours come from: one JSON document a line over a stream socket."""

    unix: Path | None = option("Path of a Unix socket to connect to", default=None)
    tcp: str | None = option("HOST:PORT to connect to instead", default=None, pattern=r"[^:\s]+:\d{1,5}")

    def problems(self) -> Iterator[Problem]:
        """The checks between settings."""
        if (self.unix is None) == (self.tcp is None):
            yield Problem("", "unix", MISSING, "exactly one of unix and tcp must be given (where sightings come from)")
        if self.tcp is not None and not 1 <= int(self.tcp.rsplit(":", 1)[1]) <= 65535:
            yield Problem("", "tcp", self.tcp, "must have a port from 1 to 65535")


@dataclass(frozen=True, slots=True, kw_only=True)
class ClockConfig:
    """The common start, from which every vehicle counts its seconds."""

    start: datetime.datetime | None = option(
        "Date and time of second 0; the start of the program when absent", default=None
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class VehicleConfig:
    """One vehicle: number n is MAVLink system n."""

    vehicle: int = option("Number of this vehicle", low=1, high=250)
    mission: Path = option("Mission file, relative to this file")
    arm: str = option(
        "Arm when everything is ready and the mission has begun: never, once, or again after each failsafe (always)",
        default="once",
        choices=("never", "once", "always"),
    )
    serial: SerialConfig = section("Line to the firmware", SerialConfig, required=True)
    firmware: FirmwareConfig = section("Settings of the firmware", FirmwareConfig)
    sightings: SightingsConfig = section("Source of sightings", SightingsConfig, required=True)
    clock: ClockConfig = section("Common start of the mission", ClockConfig)


def load_vehicle(path: Path | str) -> VehicleConfig:
    """Reads a vehicle file; raises ConfigError with every problem found in it."""
    return load(VehicleConfig, path)
