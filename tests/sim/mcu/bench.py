"""A bench for one microcontroller: its time, its companion's line, and the probe program's requests."""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from cffi import FFI

from sim.plant.library import HEADERS, ROOT, declarations

CHIPS = ("sim/mcu/chips/ak09916.h", "sim/mcu/chips/icm20948.h", "sim/mcu/chips/ms5837.h", "sim/mcu/line.h")

G = 9.80665
START_MS = 70  # from reset to a program that has set up its ports
SHARED = {
    "specific_force_mps2": [0.0, 0.0, -G],
    "field_ut": [20.0, 1.0, 43.0],
    "imu_temperature_c": 25.0,
    "pressure_pa": 101325.0,
    "water_temperature_c": 15.0,
    "battery_v": 11.1,
    "battery_a": 2.0,
}


@dataclass
class Library:
    """One make of the microcontroller and cffi's view of its declarations."""

    make: str
    ffi: Any
    c: Any


def open_library(make: str) -> Library:
    """Opens the library of a make with the declarations of its chips, too; OSError when it is not built."""
    ffi = FFI()
    for header in (*HEADERS, *CHIPS):
        ffi.cdef(declarations((ROOT / header).read_text(encoding="utf-8")))
    return Library(make, ffi, ffi.dlopen(str(ROOT / "build" / "lib" / f"libshoal_plant_{make}.so")))


class CrashError(Exception):
    """The firmware crashed; the text is the library's."""


@dataclass
class Bench:
    """A microcontroller on the bench, its companion's line, and its time in microseconds."""

    library: Library
    mcu: Any
    slice_us: int = 1000
    now_us: int = 0
    received: bytearray = field(default_factory=bytearray)

    @property
    def readings(self) -> Any:
        return self.library.c.mcu_get_readings(self.mcu)

    @property
    def faults(self) -> Any:
        return self.library.c.mcu_get_faults(self.mcu)

    @property
    def counters(self) -> Any:
        return self.library.c.mcu_get_counters(self.mcu)

    def run(self, milliseconds: float) -> None:
        """Runs in slices; raises CrashError with the library's text."""
        end = self.now_us + round(milliseconds * 1000)
        while self.now_us < end:
            self.now_us = min(end, self.now_us + self.slice_us)
            if self.library.c.mcu_run_until(self.mcu, self.now_us) != 0:
                raise CrashError(self.library.ffi.string(self.library.c.mcu_failure(self.mcu)).decode())
            self.received += self.read()

    def write(self, data: bytes, port: int = 1, at_us: int = 0) -> int:
        return int(self.library.c.mcu_uart_write(self.mcu, port, data, len(data), at_us))

    def read(self, port: int = 1) -> bytes:
        room = self.library.ffi.new("uint8_t[]", 8192)
        return bytes(self.library.ffi.buffer(room, self.library.c.mcu_uart_read(self.mcu, port, room, 8192)))

    def ask(self, letter: str, data: bytes = b"", timeout_ms: int = 300) -> bytes:
        """Sends a request to the probe and returns its answer."""
        self.received.clear()
        self.write(letter.encode() + bytes([len(data)]) + data)
        for _ in range(timeout_ms):
            self.run(1)
            if len(self.received) >= 2 and len(self.received) >= 2 + self.received[1]:
                assert self.received[:1] == letter.encode()
                return bytes(self.received[2:])
        raise TimeoutError(f"the probe did not answer {letter!r} in {timeout_ms} ms")

    def imu_write(self, bank: int, register: int, value: int) -> None:
        self.ask("s", bytes([0x7F, bank << 4]))
        self.ask("s", bytes([register, value]))

    def imu_read(self, bank: int, register: int, count: int = 1) -> bytes:
        self.ask("s", bytes([0x7F, bank << 4]))
        return self.ask("s", bytes([0x80 | register]) + bytes(count))[1:]

    def pulse(self, actuator: int) -> float:
        return float(self.library.c.mcu_pulse_us(self.mcu, actuator))

    def eeprom(self) -> bytes:
        room = self.library.ffi.new("uint8_t[]", 4096)
        self.library.c.mcu_eeprom_read(self.mcu, room)
        return bytes(self.library.ffi.buffer(room))

    def power_cycle(self) -> None:
        self.library.c.mcu_power_cycle(self.mcu)


MakeBench = Callable[..., Bench]


def make_mcu(library: Library, seed: int, baud: int, image: str, eeprom: bytes | None) -> Any:
    """A new microcontroller; ValueError with the library's text when it cannot be made."""
    ffi, error = library.ffi, library.ffi.new("char[]", 300)
    path, contents = ffi.new("char[]", image.encode()), ffi.new("uint8_t[]", eeprom) if eeprom else ffi.NULL
    config = ffi.new("mcu_config *", {"image": path, "seed": seed, "baud": baud, "eeprom": contents})
    mcu = library.c.mcu_create(config, error, 300)
    if mcu == ffi.NULL:
        raise ValueError(ffi.string(error).decode())
    return mcu


def set_readings(readings: Any, values: Mapping[str, object]) -> None:
    """Sets fields of `mcu_readings` by name."""
    for name, value in values.items():
        setattr(readings, name, value)


def words(data: bytes) -> list[int]:
    """Big-endian signed words."""
    return [int(w) for w in struct.unpack(f">{len(data) // 2}h", data)]
