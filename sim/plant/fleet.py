"""The door to the simulated fleet: vehicles in lockstep behind one call, their states as NumPy views."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sim.plant.hull import load_hull
from sim.plant.library import ROOT, PlantError, ffi, load
from sim.plant.sensors import load_sensors

IMAGE = ROOT / "build" / "firmware" / "firmware.elf"
CONSOLE, COMPANION = 0, 1  # ports, as MCU_PORT_ in mcu.h

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Counters:
    """What one microcontroller has counted since creation; cycles and bus clocks are 0 without simavr."""

    cycles: int
    cycles_asleep: int
    resets: int
    rx_overruns: int
    rx_corrupted: int
    tx_corrupted: int
    spi_hz: int
    i2c_hz: int


class _Field:
    """Memory of one field of every vehicle, kept alive as long as an array looks at it."""

    def __init__(self, owner: Any, address: int, shape: tuple[int, ...], stride: int, writable: bool) -> None:
        self.owner = owner
        self.__array_interface__ = {
            "version": 3,
            "typestr": np.dtype(np.float64).str,
            "data": (address, not writable),
            "shape": shape,
            "strides": (stride, *([8] if len(shape) == 2 else [])),
        }


class States:
    """What is true of the fleet now, vehicle by vehicle along the first axis; the arrays are views and move with time.

    Mission frame NED metres, body frame FRD. `position` (N, 3); `quaternion` (N, 4) body to mission, scalar first;
    `body_velocity` (N, 3) m/s over ground; `rates` (N, 3) rad/s; `servos` (N, 2) rad, bow and stern; `propeller` (N,)
    rad/s; `charge` (N,) 0 to 1; `battery_v`, `battery_a` (N,); `acceleration` (N, 3) m/s2 in body axes; `pulses`
    (N, 3) microseconds; `travelled` (N,) m over ground; `current` (N, 3) m/s, the only one to write: the water's
    velocity around each vehicle.
    """

    def __init__(self, owner: Any, vehicles: Sequence[Any]) -> None:
        base = vehicles[0]
        first = int(ffi.cast("uintptr_t", base))
        stride = int(ffi.cast("uintptr_t", vehicles[1])) - first if len(vehicles) > 1 else 8

        def view(path: tuple[str, ...], size: int | None, writable: bool = False) -> Array:
            offset = ffi.offsetof("plant_vehicle", *path)
            shape = (len(vehicles),) if size is None else (len(vehicles), size)
            return np.asarray(_Field(owner, first + offset, shape, stride, writable))

        self.position = view(("hull", "position_m"), 3)
        self.quaternion = view(("hull", "quaternion"), 4)
        self.body_velocity = view(("hull", "velocity_mps"), 3)
        self.rates = view(("hull", "rate_rps"), 3)
        self.servos = view(("hull", "servo_rad"), 2)
        self.propeller = view(("hull", "propeller_rps"), None)
        self.charge = view(("hull", "charge"), None)
        self.battery_v = view(("hull", "battery_v"), None)
        self.battery_a = view(("hull", "battery_a"), None)
        self.acceleration = view(("hull", "acceleration_mps2"), 3)
        self.pulses = view(("pulse_us",), 3)
        self.travelled = view(("travelled_m",), None)
        self.current = view(("current_ned_mps",), 3, writable=True)

    @property
    def euler(self) -> Array:
        """Roll, pitch, yaw (N, 3), radians, Z-Y-X; a copy."""
        w, x, y, z = self.quaternion.T
        roll = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
        pitch = np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0))
        yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        return np.stack([roll, pitch, yaw], axis=1)

    @property
    def velocity(self) -> Array:
        """Velocity over ground (N, 3) in the mission frame, m/s; a copy."""
        w, axis = self.quaternion[:, :1], self.quaternion[:, 1:]
        twice = 2.0 * np.cross(axis, self.body_velocity)
        return np.asarray(self.body_velocity + w * twice + np.cross(axis, twice))


class Plant:
    """N vehicles, each with hull, sensors and microcontroller, stepped by simulated time only.

    `make` is `avr` (the flashed image in simavr), `native` (the firmware compiled for the host) or `null` (no
    firmware: the pulses are those of `set_pulses`). `starts` (N, 4) are north, east, depth (m) and heading (rad); all
    vehicles start at rest, their batteries at `charge` (0 to 1). `hull` names a file of `hulls/`, `factors` multiply
    its coefficients by pattern, for the whole fleet or one mapping a vehicle; `sensor_factors` likewise those of the
    sensors. Every vehicle's random numbers come from `seed` and its index alone, and results are bit-identical for
    any number of threads.

    Raises PlantError naming cause and remedy when the fleet cannot be made.
    """

    def __init__(
        self,
        make: str = "avr",
        *,
        starts: ArrayLike,
        seed: int = 0,
        threads: int = 2,
        image: Path | None = None,
        hull: str = "neptune",
        factors: Mapping[str, float] | Sequence[Mapping[str, float]] | None = None,
        sensor_factors: Mapping[str, float] | None = None,
        step_s: float = 0.002,
        baud: int = 115200,
        charge: float = 1.0,
    ) -> None:
        lib = load(make)
        rows = np.atleast_2d(np.asarray(starts, dtype=np.float64))
        if rows.ndim != 2 or rows.shape[1] != 4 or len(rows) == 0 or not np.all(np.isfinite(rows)):
            raise PlantError(f"starts has shape {rows.shape}: must be (N, 4) finite: north, east, depth m, heading rad")
        step_us = round(step_s * 1e6)
        if not 1 <= step_us <= 20_000:
            raise PlantError(f"step_s = {step_s}: must be 1e-6 to 0.02")
        if not 0.0 <= charge <= 1.0:
            raise PlantError(f"charge = {charge}: must be 0 to 1")
        path = image or IMAGE
        if make == "avr" and not path.exists():
            raise PlantError(f"{path} is missing: run `make firmware`")
        per_vehicle = [factors or {}] * len(rows) if factors is None or isinstance(factors, Mapping) else list(factors)
        if len(per_vehicle) != len(rows):
            raise PlantError(f"factors for {len(per_vehicle)} vehicles: must be {len(rows)}, one a vehicle")
        parameters = [load_hull(hull, each) for each in per_vehicle]
        hulls = ffi.new("hull_parameters[]", [each[0] for each in parameters])
        states = ffi.new(
            "hull_state[]", [lib.hull_at_rest(hulls + i, list(row[:3]), row[3]) for i, row in enumerate(rows)]
        )
        for state in states:
            state.charge = charge
        image_bytes = ffi.new("char[]", str(path).encode())
        config = ffi.new(
            "plant_config *",
            {
                "image": image_bytes,
                "vehicles": len(rows),
                "threads": threads,
                "seed": seed,
                "baud": baud,
                "step_us": step_us,
                "hulls": hulls,
                "sensors": load_sensors(sensor_factors)[0],
            },
        )
        error = ffi.new("char[512]")
        plant = lib.plant_create(config, states, error, len(error))
        if plant == ffi.NULL:
            raise PlantError(ffi.string(error).decode(errors="replace"))
        self._lib = lib
        self._plant = ffi.gc(plant, lib.plant_destroy)
        self.make = make
        self.vehicles = len(rows)
        self.step_s = step_us * 1e-6
        self.states = States(self._plant, [lib.plant_get_vehicle(plant, i) for i in range(len(rows))])

    @property
    def now(self) -> float:
        """Simulated seconds since creation."""
        return float(self._lib.plant_time_us(self._plant)) * 1e-6

    def run_until(self, seconds: float) -> None:
        """Runs every vehicle until the absolute time. Raises PlantError naming the first failed vehicle and its cause.

        A failed vehicle stays where it is, and the others have run on, when the error is raised.
        """
        self.start(seconds)
        self.finish()

    def start(self, seconds: float) -> None:
        """Lets the other threads begin a run; until `finish`, states and lines must be left alone."""
        self._lib.plant_start(self._plant, round(seconds * 1e6))

    def finish(self) -> None:
        """Helps the run that was started to its end. Raises PlantError as `run_until` does."""
        failed = self._lib.plant_finish(self._plant)
        if failed:
            raise PlantError(f"vehicle {failed}: {self.failure(failed - 1)}")

    def failure(self, vehicle: int) -> str:
        """Why a vehicle failed, with its time; empty while it runs."""
        return str(ffi.string(self._lib.plant_failure(self._plant, self._index(vehicle))).decode(errors="replace"))

    def uart_write(self, vehicle: int, data: bytes, at: float = 0.0, port: int = COMPANION) -> int:
        """Puts bytes on the line to the firmware, not before `at` seconds; returns how many the line took."""
        not_before_us = max(0, round(at * 1e6))
        index = self._index(vehicle)
        return int(self._lib.plant_uart_write(self._plant, index, port, data, len(data), not_before_us))

    def uart_read(self, vehicle: int, port: int = COMPANION) -> bytes:
        """Takes what the firmware has sent by now."""
        index = self._index(vehicle)
        buffer = ffi.new("uint8_t[4096]")
        received = bytearray()
        while count := self._lib.plant_uart_read(self._plant, index, port, buffer, len(buffer)):
            received += ffi.buffer(buffer, count)
        return bytes(received)

    def set_pulses(self, vehicle: int, bow_us: int, stern_us: int, motor_us: int) -> None:
        """Holds these pulses from now on; for the `null` make only."""
        if self.make != "null":
            raise PlantError(
                f"set_pulses on make {self.make!r}: must be 'null', elsewhere the firmware gives the pulses"
            )
        frame = b"".join(int(width).to_bytes(2, "little") for width in (bow_us, stern_us, motor_us))
        self.uart_write(vehicle, frame, self.now)

    def faults(self, vehicle: int) -> Any:
        """The `mcu_faults` of a vehicle (see mcu.h), to be read and set."""
        return self._lib.plant_get_faults(self._plant, self._index(vehicle))

    def sensor_faults(self, vehicle: int) -> Any:
        """The `sensor_faults` of a vehicle (see sensors.h), to be read and set."""
        return self._lib.plant_get_sensor_faults(self._plant, self._index(vehicle))

    def readings(self, vehicle: int) -> Any:
        """The `mcu_readings` that a vehicle's chips are exposed to now (see mcu.h), to be read."""
        return self._lib.plant_get_readings(self._plant, self._index(vehicle))

    def counters(self, vehicle: int) -> Counters:
        """What a vehicle's microcontroller has counted up to the last run."""
        seen = self._lib.plant_get_vehicle(self._plant, self._index(vehicle)).counters
        return Counters(*(int(getattr(seen, name)) for name in Counters.__dataclass_fields__))

    def eeprom(self, vehicle: int) -> bytes:
        """What a vehicle's EEPROM holds."""
        content = ffi.new("uint8_t[]", self._lib.MCU_EEPROM_BYTES)
        self._lib.plant_eeprom_read(self._plant, self._index(vehicle), content)
        return bytes(content)

    def power_cycle(self, vehicle: int) -> None:
        """Switches a vehicle's electronics off and on: RAM is lost, EEPROM kept, time goes on."""
        self._lib.plant_power_cycle(self._plant, self._index(vehicle))

    def _index(self, vehicle: int) -> int:
        if not 0 <= vehicle < self.vehicles:
            raise IndexError(f"vehicle {vehicle}: must be 0 to {self.vehicles - 1}")
        return vehicle
