"""Writes the reference pages from the very declarations that the programs use: messages, parameters, settings.

Usage: python scripts/document.py OUT_DIRECTORY
"""

from __future__ import annotations

import dataclasses
import re
import sys
import tomllib
import typing
from pathlib import Path
from xml.etree import ElementTree

from companion.config.options import declaration
from companion.config.vehicle import VehicleConfig
from companion.mission import Mission
from protocol import DIALECT_HASH

ROOT = Path(__file__).resolve().parent.parent
ROLES = {"firmware_sends": "firmware sends", "firmware_receives": "firmware receives", "ground": "companion and ground"}
PARAMETER = re.compile(r'^PARAMETER\((\w+),\s*(.+?)f?,\s*(.+?)f?,\s*(.+?)f?,\s*"(.*)",\s*"(.*)"\)$', re.MULTILINE)


def table(head: list[str], rows: list[list[str]]) -> list[str]:
    """Lay out a Markdown table."""
    cells = [head, ["---"] * len(head), *([cell.replace("|", "\\|") for cell in row] for row in rows)]
    return ["| " + " | ".join(row) + " |" for row in cells] + [""]


def one_line(element: ElementTree.Element | None) -> str:
    """Join the text of an element into one line."""
    return " ".join((element.text or "").split()) if element is not None else ""


def messages() -> list[str]:
    """Describe every message: who speaks it, and its fields in the order of definition."""
    lists = tomllib.loads((ROOT / "protocol/dialect.toml").read_text())["messages"]
    lines = ["# Messages", "", f"Dialect hash `{DIALECT_HASH.hex()}`.", ""]
    for message in ElementTree.parse(ROOT / "protocol/generated/shoal.xml").getroot().iter("message"):
        name = message.attrib["name"]
        roles = ", ".join(ROLES[key] for key, names in lists.items() if name in names)
        lines += [
            f"## {name} ({message.attrib['id']})",
            "",
            f"*{roles}*",
            "",
            one_line(message.find("description")),
            "",
        ]
        rows = []
        for field in message.iter("field"):
            unit = field.attrib.get("units") or field.attrib.get("enum", "")
            rows.append([f"`{field.attrib['name']}`", field.attrib["type"], unit, one_line(field)])
        lines += table(["field", "type", "unit", "meaning"], rows)
    return lines


def parameters() -> list[str]:
    """Describe every parameter of the firmware."""
    rows = [
        [f"`{name}`", initial, f"{low} to {high}", unit, meaning]
        for name, initial, low, high, unit, meaning in PARAMETER.findall(
            (ROOT / "firmware/src/params/table.h").read_text()
        )
    ]
    return ["# Parameters of the firmware", "", *table(["name", "default", "range", "unit", "meaning"], rows)]


def settings(kind: type, place: str = "") -> list[str]:
    """Describe the keys of a settings file, tables behind the keys of the top."""
    hints, rows, tables = typing.get_type_hints(kind), [], []
    for field in dataclasses.fields(kind):
        hint, option = hints[field.name], declaration(field)
        inner = f"{place.strip('[]')}.{field.name}".lstrip(".")
        if dataclasses.is_dataclass(hint):
            tables += settings(typing.cast(type, hint), f"[{inner}]")
            continue
        if any(dataclasses.is_dataclass(part) for part in typing.get_args(hint)):
            tables += settings(typing.get_args(hint)[0], f"[[{inner}]]")
            continue
        default = "required" if required(field) else f"`{default_of(field)}`"
        spelled = hint.__name__ if isinstance(hint, type) and not typing.get_args(hint) else str(hint)
        rows.append([f"`{field.name}`", spelled, default, option.expectation(), option.meaning])
    head = [f"## {place}", ""] if place else []
    says = [" ".join((kind.__doc__ or "").split()), ""]
    return [*head, *says, *table(["key", "type", "default", "must be", "meaning"], rows), *tables]


def required(field: dataclasses.Field[typing.Any]) -> bool:
    """Whether a file must give the key."""
    return field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING


def default_of(field: dataclasses.Field[typing.Any]) -> object:
    """What holds when a file does not give the key."""
    return field.default if field.default_factory is dataclasses.MISSING else field.default_factory()


def main(arguments: list[str]) -> int:
    """Write all pages into the directory named."""
    if len(arguments) != 1:
        print(__doc__, file=sys.stderr)
        return 2
    directory = Path(arguments[0])
    directory.mkdir(parents=True, exist_ok=True)
    pages = {
        "messages": messages(),
        "parameters": parameters(),
        "mission": ["# Mission file", "", *settings(Mission)],
        "vehicle": ["# Vehicle file", "", *settings(VehicleConfig)],
    }
    for name, lines in pages.items():
        (directory / f"{name}.md").write_text("\n".join(lines), encoding="utf-8")
    print(f"docs: {', '.join(f'{name}.md' for name in pages)} in {directory}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
