"""The microcontroller library of both makes, compiled for the tests, and a bench that speaks to the probe program."""

from __future__ import annotations

import re
import shutil
import struct
import subprocess
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from cffi import FFI

ROOT = Path(__file__).resolve().parents[3]
MCU = ROOT / "sim" / "mcu"
HEADERS = ("mcu.h", "chips/ak09916.h", "chips/icm20948.h", "chips/ms5837.h", "line.h")

G = 9.80665
SHARED = {
    "specific_force_mps2": [0.0, 0.0, -G],
    "field_ut": [20.0, 1.0, 43.0],
    "imu_temperature_c": 25.0,
    "pressure_pa": 101325.0,
    "water_temperature_c": 15.0,
    "battery_v": 11.1,
    "battery_a": 2.0,
}


def declarations() -> str:
    """The library's headers as cffi reads them: without preprocessor lines and linkage braces."""
    text = "\n".join((MCU / name).read_text() for name in HEADERS)
    text = re.sub(r"#ifdef __cplusplus.*?#endif", "", text, flags=re.DOTALL)
    return re.sub(r"^#.*$", "", text, flags=re.MULTILINE)


def compile_library(out: Path) -> Path:
    """Compiles chips and the `avr` make; the C compiler's message is the error."""
    sources = sorted([*MCU.glob("*.c"), *MCU.glob("chips/*.c"), *MCU.glob("avr/*.c")])
    flags = ["-std=c11", "-D_DEFAULT_SOURCE", "-O2", "-fPIC", "-shared", "-Wall", "-Wextra", "-Werror"]
    library = out / "libmcu.so"
    libraries = ["-lsimavr", "-lelf", "-lm", "-lpthread"]
    subprocess.run(["cc", *flags, "-o", library, *sources, *libraries], check=True)
    return library


@dataclass
class Library:
    """The library and cffi's view of its declarations."""

    ffi: Any
    c: Any


@pytest.fixture(scope="session")
def library(tmp_path_factory: pytest.TempPathFactory) -> Library:
    """Chips and the `avr` make as one shared library."""
    if not Path("/usr/include/simavr/sim_avr.h").exists():
        pytest.skip("libsimavr-dev is not installed: the `avr` make cannot be built here")
    ffi = FFI()
    ffi.cdef(declarations())
    return Library(ffi, ffi.dlopen(str(compile_library(tmp_path_factory.mktemp("mcu")))))


@pytest.fixture(scope="session")
def probe(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The probe program as an ELF image."""
    if not shutil.which("avr-gcc"):
        pytest.skip("avr-gcc is not installed: no image to run")
    image = tmp_path_factory.mktemp("probe") / "probe.elf"
    flags = ["-mmcu=atmega2560", "-DF_CPU=16000000UL", "-Os", "-std=gnu11", "-Wall", "-Wextra", "-Werror"]
    subprocess.run(["avr-gcc", *flags, str(Path(__file__).with_name("probe.c")), "-o", image], check=True)
    return image


class Crash(Exception):
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
        """Runs in slices; raises `Crash` with the library's text."""
        end = self.now_us + round(milliseconds * 1000)
        while self.now_us < end:
            self.now_us = min(end, self.now_us + self.slice_us)
            if self.library.c.mcu_run_until(self.mcu, self.now_us) != 0:
                raise Crash(self.library.ffi.string(self.library.c.mcu_failure(self.mcu)).decode())
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


MakeBench = Callable[..., Bench]


@pytest.fixture
def make_bench(library: Library, probe: Path) -> Iterator[MakeBench]:
    """Makes microcontrollers with the probe program and destroys them at the end."""
    made = []

    def make(
        seed: int = 1, baud: int = 115200, eeprom: bytes | None = None, image: Path = probe, **kwargs: int
    ) -> Bench:
        ffi, error = library.ffi, library.ffi.new("char[]", 300)
        path, contents = ffi.new("char[]", str(image).encode()), ffi.new("uint8_t[]", eeprom) if eeprom else ffi.NULL
        config = ffi.new("mcu_config *", {"image": path, "seed": seed, "baud": baud, "eeprom": contents})
        mcu = library.c.mcu_create(config, error, 300)
        if mcu == ffi.NULL:
            raise ValueError(ffi.string(error).decode())
        made.append(mcu)
        bench = Bench(library, mcu, **kwargs)
        set_readings(bench.readings, SHARED)
        return bench

    yield make
    for mcu in made:
        library.c.mcu_destroy(mcu)


@pytest.fixture
def bench(make_bench: MakeBench) -> Bench:
    """A microcontroller that has started."""
    made = make_bench()
    made.run(20)
    return made


def set_readings(readings: Any, values: Mapping[str, object]) -> None:
    """Sets fields of `mcu_readings` by name."""
    for name, value in values.items():
        setattr(readings, name, value)


def words(data: bytes) -> list[int]:
    """Big-endian signed words."""
    return [int(w) for w in struct.unpack(f">{len(data) // 2}h", data)]
