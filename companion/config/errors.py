"""What is wrong with a file of settings, said so that its owner can put it right."""

from __future__ import annotations

import datetime
from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Problem:
    """One complaint: `section` is the dotted table name ("": top of the file), `key` is "" for the whole section."""

    section: str
    key: str
    value: object
    text: str

    def line(self, file: str) -> str:
        """The complaint as one line, in the spelling of the file."""
        place = f"{file}:"
        if self.section:
            place += f" [{self.section}]"
        if not self.key:
            return f"{place} {self.text}"
        return f"{place} {self.key}{spell_assignment(self.value)}: {self.text}"


class ConfigError(ValueError):
    """A file of settings cannot be used; `lines` holds one line for every problem found in it."""

    def __init__(self, lines: Sequence[str]) -> None:
        super().__init__("\n".join(lines))
        self.lines = tuple(lines)


class _Missing:
    """Marks a key that the file does not hold."""


MISSING = _Missing()


def spell_assignment(value: object) -> str:
    """The right side of an assignment as TOML writes it, cut to a readable length; "" for a key that is not there."""
    return "" if value is MISSING else f" = {spell(value)}"


def spell(value: object, longest: int = 60) -> str:
    """A value as TOML writes it."""
    if isinstance(value, bool):
        text = "true" if value else "false"
    elif isinstance(value, str):
        text = '"' + value.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n") + '"'
    elif isinstance(value, (list, tuple)):
        text = "[" + ", ".join(spell(item, longest) for item in value) + "]"
    elif isinstance(value, dict):
        text = "{" + ", ".join(f"{key} = {spell(item, longest)}" for key, item in value.items()) + "}"
    elif isinstance(value, datetime.datetime):
        text = value.isoformat()
    elif isinstance(value, float):
        text = f"{value:.6g}"
    else:
        text = str(value)
    return text if len(text) <= longest else text[: longest - 3] + "..."
