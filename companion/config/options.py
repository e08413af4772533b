"""How a setting is declared: meaning, unit, range and default stand beside its name and type, and nowhere else.

    @dataclass(frozen=True, slots=True, kw_only=True)
    class LimitsConfig:
        depth_max_m: float = option("Greatest depth allowed", default=30.0, low=0.5, high=100.0, unit="m")

Types that a file can hold: bool, int, float, str, Path (relative to the file), datetime (with offset), tuple[T, ...],
fixed tuples such as tuple[float, float], dict[str, T], another such dataclass (a table), tuple[dataclass, ...] (a list
of tables, each written [[key]]), and `T | None` (None when the key is absent). A method `problems(self) ->
Iterable[Problem]` of a dataclass holds the checks between its settings; sections are named relative to it.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

NO_DEFAULT: Any = dataclasses.MISSING
_KEY = "shoal.option"


@dataclass(frozen=True, slots=True)
class Option:
    """The declaration of one setting; `low` and `high` bound every number inside the value, inclusively."""

    meaning: str
    unit: str = ""
    low: float | None = None
    high: float | None = None
    above: float | None = None
    choices: tuple[Any, ...] = ()
    pattern: str = ""
    least: int = 0
    lengths: tuple[int, ...] = ()
    csv: bool = False

    def expectation(self) -> str:
        """What a value must be, for errors and documentation: "from 0.5 to 100 m"."""
        unit = f" {self.unit}" if self.unit else ""
        if self.choices:
            return "one of " + ", ".join(str(choice) for choice in self.choices) + unit
        parts = []
        if self.above is not None:
            parts.append(f"above {self.above:g}{unit}")
        if self.low is not None and self.high is not None:
            parts.append(f"from {self.low:g} to {self.high:g}{unit}")
        elif self.low is not None:
            parts.append(f"at least {self.low:g}{unit}")
        elif self.high is not None:
            parts.append(f"at most {self.high:g}{unit}")
        return " and ".join(parts) or (f"in {self.unit}" if self.unit else "")


def option(
    meaning: str,
    *,
    default: Any = NO_DEFAULT,
    unit: str = "",
    low: float | None = None,
    high: float | None = None,
    above: float | None = None,
    choices: Sequence[Any] = (),
    pattern: str = "",
    least: int = 0,
    lengths: Sequence[int] = (),
    csv: bool = False,
) -> Any:
    """Declares a setting.

    `above` is an exclusive lower bound, `pattern` a regular expression that a string matches whole, `least` the least
    number of entries of a list, `lengths` the lengths allowed for the lists inside a list. A list of lists of numbers
    with `csv` may stand in a file of its own, one list a line, that the value names.
    """
    declared = Option(meaning, unit, low, high, above, tuple(choices), pattern, least, tuple(lengths), csv)
    if isinstance(default, dict):
        return dataclasses.field(default_factory=lambda: dict(default), metadata={_KEY: declared})
    return dataclasses.field(default=default, metadata={_KEY: declared})


def section(meaning: str, kind: type[Any], *, required: bool = False) -> Any:
    """Declares a table of settings; without `required` an absent table takes all of its defaults."""
    if required:
        return dataclasses.field(metadata={_KEY: Option(meaning)})
    return dataclasses.field(default_factory=kind, metadata={_KEY: Option(meaning)})


def declaration(field: dataclasses.Field[Any]) -> Option:
    """The declaration of a field; a field declared without one may hold anything of its type."""
    return field.metadata.get(_KEY, Option(""))  # type: ignore[no-any-return]
