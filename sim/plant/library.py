"""The C library of the plant: found, opened, and its declarations read from the very headers that it was built from."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from typing import Any

from cffi import FFI

ROOT = Path(__file__).resolve().parents[2]
MAKES = ("avr", "native", "null")
HEADERS = ("sim/mcu/mcu.h", "sim/plant/random.h", "sim/plant/hull.h", "sim/plant/sensors.h", "sim/plant/plant.h")


class PlantError(RuntimeError):
    """The plant cannot be made or a vehicle of it has failed; the message names cause and remedy."""


def declarations(header: str) -> str:
    """Plain C of a header: without comments, preprocessor lines and the parts meant for C++."""
    text = re.sub(r"/\*.*?\*/|//[^\n]*", "", header, flags=re.DOTALL)
    text = re.sub(r"^#ifdef __cplusplus$.*?^#endif$", "", text, flags=re.DOTALL | re.MULTILINE)
    return re.sub(r"^\s*#.*$", "", text, flags=re.MULTILINE)


def _ffi() -> FFI:
    ffi = FFI()
    for header in HEADERS:
        ffi.cdef(declarations((ROOT / header).read_text(encoding="utf-8")))
    return ffi


ffi: Any = _ffi()


def layout() -> int:
    """What `plant_layout` of a library built from these very headers returns."""
    value = 0
    for name in ("plant_vehicle", "plant_config", "mcu_readings", "mcu_faults", "sensor_faults"):
        value = value * 4093 + int(ffi.sizeof(name))
    return value


@cache
def load(make: str) -> Any:
    """The library of one make (`avr`, `native` or `null`). Raises PlantError when it is unknown or not built."""
    if make not in MAKES:
        raise PlantError(f"make = {make!r}: must be one of {', '.join(MAKES)}")
    path = ROOT / "build" / "lib" / f"libshoal_plant_{make}.so"
    if not path.exists():
        raise PlantError(f"{path} is missing: run `make plant`")
    try:
        library = ffi.dlopen(str(path))
        same = library.plant_layout() == layout()
    except (OSError, AttributeError) as error:
        raise PlantError(f"{path} does not load ({error}): run `make plant`") from error
    if not same:
        raise PlantError(f"{path} was built from other headers: run `make plant`")
    return library
