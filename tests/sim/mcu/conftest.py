"""Benches with the makes of the microcontroller that are built, and the probe program as an image."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.sim.mcu.bench import SHARED, START_MS, Bench, Library, MakeBench, make_mcu, open_library, set_readings


def library_or_skip(make: str) -> Library:
    """The library of a make, or a skip that says what is missing."""
    try:
        return open_library(make)
    except OSError as error:
        pytest.skip(f"the `{make}` make is not built here: {error}")


@pytest.fixture(scope="session")
def avr() -> Library:
    """The make that runs the flashed image."""
    return library_or_skip("avr")


@pytest.fixture(scope="session")
def native() -> Library:
    """The make that runs the firmware's sources, which every host can build."""
    return library_or_skip("native")


@pytest.fixture(scope="session")
def probe(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The probe program as an ELF image."""
    if not shutil.which("avr-gcc"):
        pytest.skip("avr-gcc is not installed: no image to run")
    image = tmp_path_factory.mktemp("probe") / "probe.elf"
    flags = ["-mmcu=atmega2560", "-DF_CPU=16000000UL", "-Os", "-std=gnu11", "-Wall", "-Wextra", "-Werror"]
    subprocess.run(["avr-gcc", *flags, str(Path(__file__).with_name("probe.c")), "-o", image], check=True)
    return image


@pytest.fixture
def make_any() -> Iterator[MakeBench]:
    """Makes microcontrollers of any library and destroys them at the end."""
    made: list[Bench] = []

    def make(
        library: Library,
        image: Path | str,
        seed: int = 1,
        baud: int = 115200,
        eeprom: bytes | None = None,
        slice_us: int = 1000,
    ) -> Bench:
        bench = Bench(library, make_mcu(library, seed, baud, str(image), eeprom), slice_us)
        made.append(bench)
        set_readings(bench.readings, SHARED)
        return bench

    yield make
    for bench in made:
        bench.library.c.mcu_destroy(bench.mcu)


@pytest.fixture
def make_bench(make_any: MakeBench, avr: Library, probe: Path) -> MakeBench:
    """Makes simulated ATmega2560s that run the probe program, or another image."""

    def make(image: Path | str = probe, **kwargs: object) -> Bench:
        return make_any(avr, image, **kwargs)

    return make


@pytest.fixture
def bench(make_bench: MakeBench) -> Bench:
    """A simulated ATmega2560 whose probe program has started."""
    made = make_bench()
    made.run(START_MS)
    return made
