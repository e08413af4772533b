"""From the declared errors of the sensors to the parameters of their models."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sim.plant.coefficients import Coefficients, read
from sim.plant.library import ffi

FILE = Path(__file__).with_name("sensors.toml")
CHANNELS = (
    "accelerometer",
    "gyro",
    "magnetometer",
    "pressure",
    "imu_temperature",
    "water_temperature",
    "voltage",
    "current",
)


def coefficients() -> Coefficients:
    """The declared errors of every channel, and the surroundings."""
    return read(FILE)


def load_sensors(factors: Mapping[str, float] | None = None) -> Any:
    """`sensor_parameters`; `factors` multiply coefficients by pattern, as `{"*.bias_sigma": 0}` for no bias.

    Raises PlantError naming file and coefficient.
    """
    c = coefficients().scaled(factors or {})
    out = ffi.new("sensor_parameters *")
    for channel in CHANNELS:
        error = getattr(out, channel)
        for kind in ("noise_density", "noise_rms", "bias_sigma", "bias_walk"):
            name = f"{channel}.{kind}"
            if name in c.entries:
                setattr(error, kind, c.number(name))
    out.imu_position_m = c.vector("mounting.imu", 3)
    out.pressure_position_m = c.vector("mounting.pressure", 3)
    out.atmosphere_pa = c.number("surroundings.atmosphere")
    field = c.number("surroundings.field")
    inclination, declination = (math.radians(c.number(f"surroundings.{k}")) for k in ("inclination", "declination"))
    level = field * math.cos(inclination)
    out.field_ned_ut = [
        level * math.cos(declination),
        level * math.sin(declination),
        field * math.sin(inclination),
    ]
    out.water_temperature_c = c.number("surroundings.water_temperature")
    out.imu_heating_c = c.number("surroundings.imu_heating")
    c.finish()
    return out
