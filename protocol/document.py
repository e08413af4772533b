"""Writes the reference of the messages that Shoal speaks, as Markdown, from the very XML that both languages come from.

Usage: python -m protocol.document OUT.md
"""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path
from xml.etree import ElementTree

from protocol import DIALECT_HASH

HERE = Path(__file__).parent
ROLES = {
    "firmware_sends": "firmware sends",
    "firmware_receives": "firmware receives",
    "ground": "companion and ground",
}


def one_line(element: ElementTree.Element | None) -> str:
    """Join the text of an element into one line that a table cell can hold."""
    return " ".join((element.text or "" if element is not None else "").split()).replace("|", "\\|")


def message_section(message: ElementTree.Element, roles: list[str]) -> list[str]:
    """Describe one message: who speaks it, and its fields in the order of definition."""
    lines = [f"## {message.attrib['name']} ({message.attrib['id']})", "", f"*{', '.join(roles)}*", ""]
    lines += [one_line(message.find("description")), "", "| field | type | unit | meaning |", "|---|---|---|---|"]
    extension = ""
    for child in message:
        if child.tag == "extensions":
            extension = " (extension)"
        if child.tag == "field":
            kind = child.attrib["type"] + extension
            unit = child.attrib.get("units") or child.attrib.get("enum", "")
            lines.append(f"| `{child.attrib['name']}` | {kind} | {unit} | {one_line(child)} |")
    return [*lines, ""]


def reference() -> str:
    """Compose the whole page."""
    lists = tomllib.loads((HERE / "dialect.toml").read_text())["messages"]
    root = ElementTree.parse(HERE / "generated" / "shoal.xml").getroot()
    lines = ["# Messages", "", f"Dialect hash `{DIALECT_HASH.hex()}`.", ""]
    for message in root.iter("message"):
        lines += message_section(
            message, [ROLES[key] for key, names in lists.items() if message.attrib["name"] in names]
        )
    return "\n".join(lines)


def main(arguments: list[str]) -> int:
    """Write the page to the file named."""
    if len(arguments) != 1:
        print(__doc__, file=sys.stderr)
        return 2
    path = Path(arguments[0])
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(reference(), encoding="utf-8")
    print(f"docs: {path}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
