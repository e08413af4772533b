"""Writes settings as TOML, so that what this process decided can be handed to another by the ordinary files."""

from __future__ import annotations

import dataclasses
import datetime
import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any


def write_settings(settings: Any) -> str:
    """A declared dataclass or a mapping as TOML; what is None is left out, as an absent key means None."""
    return "\n".join(_table(_plain(settings), "")) + "\n"


# Dataclasses become mappings, all the way down.
def _plain(value: Any) -> Any:
    if dataclasses.is_dataclass(value):
        value = {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items() if item is not None}
    return value


# The lines of one table: its own keys first, since a table's header ends them.
def _table(table: Mapping[str, Any], name: str) -> list[str]:
    lines = [f"{key} = {_value(item)}" for key, item in table.items() if not isinstance(item, dict)]
    for key, item in table.items():
        if isinstance(item, dict):
            inner = f"{name}.{key}" if name else key
            lines += ["", f"[{inner}]", *_table(item, inner)]
    return lines


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_value(item) for item in value) + "]"
    if isinstance(value, datetime.datetime):
        return value.isoformat()
    if isinstance(value, (str, Path)):
        return json.dumps(str(value))
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return repr(value)
