"""Coefficient files: every number with its unit and its source, read and checked in one place."""

from __future__ import annotations

import fnmatch
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from sim.plant.library import PlantError

Value = float | str | list[float]
ENTRY_KEYS = {"value", "unit", "source"}


@dataclass(frozen=True, slots=True)
class Coefficient:
    """One declared number, vector or word."""

    value: Value
    unit: str
    source: str


class Coefficients:
    """The entries of one file by dotted name, such as `fin.rudder.area`."""

    def __init__(self, origin: str, entries: Mapping[str, Coefficient]) -> None:
        self.origin = origin
        self.entries = dict(entries)
        self._used: set[str] = set()

    def number(self, name: str) -> float:
        """One scalar. Raises PlantError naming file and entry."""
        value = self._value(name)
        if isinstance(value, float):
            return value
        raise PlantError(f"{self.origin}: {name} = {value!r}: must be a number")

    def vector(self, name: str, size: int) -> list[float]:
        """A list of `size` scalars."""
        value = self._value(name)
        if isinstance(value, list) and len(value) == size:
            return value
        raise PlantError(f"{self.origin}: {name} = {value!r}: must be a list of {size} numbers")

    def word(self, name: str, allowed: tuple[str, ...]) -> str:
        """One of the allowed words."""
        value = self._value(name)
        if isinstance(value, str) and value in allowed:
            return value
        raise PlantError(f"{self.origin}: {name} = {value!r}: must be one of {', '.join(allowed)}")

    def groups(self, prefix: str) -> list[str]:
        """Names of the groups under a prefix, in the order of the file."""
        return list(dict.fromkeys(name.split(".")[1] for name in self.entries if name.startswith(prefix + ".")))

    def scaled(self, factors: Mapping[str, float]) -> Coefficients:
        """A copy with every number whose name matches a pattern (`fin.*.slope`) multiplied by its factor."""
        entries = dict(self.entries)
        for pattern, factor in factors.items():
            matches = fnmatch.filter(entries, pattern)
            if not matches:
                raise PlantError(f"{self.origin}: no coefficient is called {pattern!r}")
            for name in matches:
                old = entries[name]
                if isinstance(old.value, str):
                    raise PlantError(f"{self.origin}: {name} = {old.value!r} is a word and cannot be scaled")
                value = [x * factor for x in old.value] if isinstance(old.value, list) else old.value * factor
                entries[name] = Coefficient(value, old.unit, f"{old.source}, x {factor:g}")
        return Coefficients(self.origin, entries)

    def finish(self) -> None:
        """Raises PlantError for entries that nobody asked for."""
        unknown = sorted(set(self.entries) - self._used)
        if unknown:
            raise PlantError(f"{self.origin}: unknown coefficient {unknown[0]!r}: remove it or correct its name")

    def _value(self, name: str) -> Value:
        self._used.add(name)
        if name not in self.entries:
            raise PlantError(f"{self.origin}: coefficient {name!r} is missing")
        return self.entries[name].value


def _entry(origin: str, name: str, table: Mapping[str, object]) -> Coefficient:
    value, unit, source = table.get("value"), table.get("unit"), table.get("source")
    if set(table) != ENTRY_KEYS or not isinstance(unit, str) or not isinstance(source, str) or not source:
        raise PlantError(f'{origin}: {name}: must have exactly value, unit and a source (or "assumed")')
    if isinstance(value, str):
        return Coefficient(value, unit, source)
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return Coefficient(float(value), unit, source)
    if isinstance(value, list) and all(isinstance(x, (int, float)) and not isinstance(x, bool) for x in value):
        return Coefficient([float(x) for x in value], unit, source)
    raise PlantError(f"{origin}: {name} = {value!r}: must be a number, a list of numbers or a word")


def read(path: Path) -> Coefficients:
    """Reads a TOML file of entries `name = { value, unit, source }` in nested groups. Raises PlantError."""
    try:
        with path.open("rb") as file:
            document = tomllib.load(file)
    except FileNotFoundError:
        known = ", ".join(sorted(other.stem for other in path.parent.glob("*.toml")))
        raise PlantError(f"{path.name} is missing in {path.parent.name}/: known are {known}") from None
    except tomllib.TOMLDecodeError as error:
        raise PlantError(f"{path.name}: {error}") from error
    entries: dict[str, Coefficient] = {}

    def walk(prefix: str, table: Mapping[str, object]) -> None:
        for key, item in table.items():
            name = f"{prefix}{key}"
            if not isinstance(item, Mapping):
                if name != "name":
                    raise PlantError(f"{path.name}: {name}: must be {{ value, unit, source }}")
            elif "value" in item:
                entries[name] = _entry(path.name, name, item)
            else:
                walk(f"{name}.", item)

    walk("", document)
    return Coefficients(path.name, entries)
