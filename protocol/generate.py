"""Makes the C headers and the Python module of the dialect from pymavlink's definitions and the allow-list.

Usage: python protocol/generate.py [--root DIR]. Files whose content would not change are left alone, so that make
rebuilds nothing in vain.
"""

from __future__ import annotations

import argparse
import contextlib
import copy
import hashlib
import importlib.util
import io
import sys
import tempfile
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

DIALECT = "shoal"
HERE = Path(__file__).resolve().parent


class DialectError(Exception):
    """The allow-list and the definitions do not fit together; the message says which name is at fault."""


def standard_definitions() -> Path:
    """Find the directory of MAVLink XML that pymavlink ships."""
    spec = importlib.util.find_spec("pymavlink")
    if spec is None or spec.origin is None:
        raise DialectError("pymavlink is not installed for this Python: run 'make setup'")
    return Path(spec.origin).parent / "dialects" / "v20"


def read_definitions(root: Path) -> list[ElementTree.Element]:
    """Parse a definition file and all that it includes, each once, includes after their includer."""
    pending, seen, trees = [root], set[Path](), list[ElementTree.Element]()
    while pending:
        path = pending.pop(0)
        if path in seen:
            continue
        seen.add(path)
        try:
            tree = ElementTree.parse(path).getroot()
        except (OSError, ElementTree.ParseError) as error:
            raise DialectError(f"{path}: cannot be read as MAVLink XML: {error}") from error
        trees.append(tree)
        pending += [path.parent / str(include.text).strip() for include in tree.iter("include")]
    return trees


def merge(trees: list[ElementTree.Element], tag: str) -> dict[str, ElementTree.Element]:
    """Collect elements by name; enums that several files extend become one, entries in order of value."""
    merged: dict[str, ElementTree.Element] = {}
    for element in (copy.deepcopy(found) for tree in trees for found in tree.iter(tag)):
        known = merged.setdefault(element.attrib["name"], element)
        if known is not element:
            if tag == "message":
                raise DialectError(f"message {element.attrib['name']} is defined twice")
            known.extend(element.findall("entry"))
    for enum in merged.values() if tag == "enum" else ():
        entries = sorted(enum.findall("entry"), key=lambda entry: int(entry.attrib["value"], 0))
        for entry in entries:
            enum.remove(entry)
        enum.extend(entries)
    return merged


def pick_messages(known: dict[str, ElementTree.Element], names: set[str]) -> list[ElementTree.Element]:
    """Take the listed messages in order of id; refuses unknown ones and those with a field that AVR cannot hold."""
    picked = []
    for name in sorted(names):
        if name not in known:
            raise DialectError(f"dialect.toml: message {name} is in neither the standard nor the private definitions")
        fields = [field.attrib["type"] for field in known[name].iter("field")]
        if any(kind.startswith("double") for kind in fields):
            raise DialectError(f"dialect.toml: message {name} has a double, which has 4 bytes on AVR: leave it out")
        picked.append(known[name])
    return sorted(picked, key=lambda message: int(message.attrib["id"]))


def pick_enums(
    known: dict[str, ElementTree.Element], messages: list[ElementTree.Element], listed: dict[str, str | list[str]]
) -> list[ElementTree.Element]:
    """Take the enums that fields refer to and those listed, cut to the listed entries."""
    names = {field.attrib["enum"] for message in messages for field in message.iter("field") if "enum" in field.attrib}
    picked = []
    for name in sorted(names | listed.keys()):
        if name not in known:
            raise DialectError(f"dialect.toml: enum {name} is not defined")
        enum, keep = known[name], listed.get(name, "*")
        if keep != "*":
            entries = {entry.attrib["name"]: entry for entry in enum.findall("entry")}
            if missing := set(keep) - entries.keys():
                raise DialectError(f"dialect.toml: enum {name} has no entry {', '.join(sorted(missing))}")
            for entry in (entries[other] for other in entries.keys() - set(keep)):
                enum.remove(entry)
        picked.append(enum)
    return picked


def reduce_dialect(config: dict[str, Any], standard: Path, here: Path) -> ElementTree.ElementTree[ElementTree.Element]:
    """Build the one XML that holds what is allowed and nothing else."""
    trees = [*read_definitions(standard / config["root"]), ElementTree.parse(here / config["private"]).getroot()]
    names = {name for group in config["messages"].values() for name in group}
    messages = pick_messages(merge(trees, "message"), names)
    root = ElementTree.Element("mavlink")
    ElementTree.SubElement(root, "version").text = "3"
    ElementTree.SubElement(root, "enums").extend(pick_enums(merge(trees, "enum"), messages, config["enums"]))
    ElementTree.SubElement(root, "messages").extend(messages)
    ElementTree.indent(root)
    return ElementTree.ElementTree(root)


def wire_description(messages: list[Any]) -> str:
    """State in canonical text all that changes the bytes on the wire; its digest is the dialect hash."""
    lines = []
    for message in sorted(messages, key=lambda m: m.id):
        lines.append(f"{message.id} {message.name} {message.crc_extra}")
        for index, field in enumerate(message.ordered_fields):
            extension = message.extensions_start is not None and index >= message.extensions_start
            lines.append(f"  {field.type} {field.name} {field.array_length}{' extension' if extension else ''}")
    return "\n".join(lines) + "\n"


def dialect_constants(config: dict[str, Any], messages: list[Any]) -> dict[str, str]:
    """Write the constants of both languages: the dialect hash and the firmware's longest payload."""
    digest = hashlib.sha256(wire_description(messages).encode()).digest()[:8]
    firmware = {*config["messages"]["firmware_sends"], *config["messages"]["firmware_receives"]}
    longest = max(message.wire_length for message in messages if message.name in firmware)
    octets = ", ".join(f"0x{octet:02x}" for octet in digest)
    header = (
        "// Constants of the dialect; generated, do not edit.\n#pragma once\n\n"
        "// First 8 bytes of the SHA-256 of everything that changes the wire.\n"
        f"#define SHOAL_DIALECT_HASH {{{octets}}}\n\n"
        f"// The longest payload of the messages that the firmware sends or receives.\n"
        f"#define SHOAL_FIRMWARE_PAYLOAD_MAX {longest}\n"
    )
    module = (
        '"""Constants of the dialect; generated, do not edit."""\n\n'
        f'DIALECT_HASH = bytes.fromhex("{digest.hex()}")\nFIRMWARE_PAYLOAD_MAX = {longest}\n'
    )
    return {"c": header, "python": module}


def run_mavgen(xml: Path, language: str, output: Path) -> None:
    """Let pymavlink's generator write one language; what it prints appears only when it fails."""
    from pymavlink.generator import mavgen

    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        options = mavgen.Opts(str(output), wire_protocol="2.0", language=language, validate=False)
        done = mavgen.mavgen(options, [str(xml)])
    if not done:
        raise DialectError(f"mavgen refused the reduced dialect:\n{said.getvalue()}")


def generated_files(config: dict[str, Any], standard: Path, here: Path) -> Iterator[tuple[str, str]]:
    """Yield every generated file as its path from the project's root and its text."""
    from pymavlink.generator import mavparse

    with tempfile.TemporaryDirectory() as scratch:
        xml, python, c = Path(scratch) / f"{DIALECT}.xml", Path(scratch) / "dialect.py", Path(scratch) / "c"
        reduce_dialect(config, standard, here).write(xml, encoding="utf-8", xml_declaration=True)
        constants = dialect_constants(config, mavparse.MAVXML(str(xml), mavparse.PROTOCOL_2_0).message)
        run_mavgen(xml, "Python3", python)
        run_mavgen(xml, "C", c)

        yield f"protocol/generated/{DIALECT}.xml", xml.read_text(encoding="utf-8")
        yield "protocol/generated/__init__.py", constants["python"]
        yield "protocol/generated/dialect.py", python.read_text(encoding="utf-8")
        yield "firmware/src/link/dialect/constants.h", constants["c"]
        for header in sorted(c.rglob("*.h")):
            if header.name == "testsuite.h":
                continue
            lines = header.read_text(encoding="utf-8").splitlines(keepends=True)
            text = "".join(line for line in lines if "MAVLINK_BUILD_DATE" not in line)
            yield f"firmware/src/link/dialect/{header.relative_to(c)}", text


def write_changed(root: Path, files: dict[str, str]) -> int:
    """Write what differs, remove what is no longer generated; returns the number of files touched."""
    touched = 0
    for directory in ("protocol/generated", "firmware/src/link/dialect"):
        for stale in (root / directory).rglob("*"):
            if stale.is_file() and stale.suffix != ".pyc" and str(stale.relative_to(root)) not in files:
                stale.unlink()
                touched += 1
    for name, text in files.items():
        path = root / name
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
            touched += 1
    return touched


def main() -> int:
    """Generate into a checkout of the project."""
    parser = argparse.ArgumentParser(description="Generate both languages' view of the dialect.")
    parser.add_argument("--root", type=Path, default=HERE.parent, help="the checkout to write into")
    arguments = parser.parse_args()
    try:
        with (HERE / "dialect.toml").open("rb") as file:
            config = tomllib.load(file)
        files = dict(generated_files(config, standard_definitions(), HERE))
    except DialectError as error:
        print(f"protocol: {error}", file=sys.stderr)
        return 1
    touched = write_changed(arguments.root, files)
    print(f"protocol: {len(files)} files, {touched} changed")
    return 0


if __name__ == "__main__":
    sys.exit(main())
