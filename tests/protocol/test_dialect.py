"""The allow-list becomes two languages: both carry one hash, which changes with the wire and with nothing else."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import protocol
from protocol import dialect, generate

ROOT = Path(__file__).resolve().parents[2]
CONFIG: dict[str, Any] = tomllib.loads((ROOT / "protocol/dialect.toml").read_text())
PRIVATE = (ROOT / "protocol/private.xml").read_text()


def generated(tmp_path: Path, config: dict[str, Any] = CONFIG, private: str = PRIVATE) -> dict[str, str]:
    """Generate from a changed definition."""
    (tmp_path / "private.xml").write_text(private)
    return dict(generate.generated_files(config, generate.standard_definitions(), tmp_path))


def hash_of(files: dict[str, str]) -> str:
    """Read the hash from the C header, where the firmware finds it."""
    found = re.search(r"SHOAL_DIALECT_HASH \{(.*)\}", files["firmware/src/link/dialect/constants.h"])
    assert found is not None
    return "".join(octet.strip().removeprefix("0x") for octet in found[1].split(","))


def test_both_languages_carry_the_same_hash(tmp_path: Path) -> None:
    header = (ROOT / "firmware/src/link/dialect/constants.h").read_text()
    assert hash_of({"firmware/src/link/dialect/constants.h": header}) == protocol.DIALECT_HASH.hex()
    assert hash_of(generated(tmp_path)) == protocol.DIALECT_HASH.hex()


@pytest.mark.parametrize(
    "change",
    [
        lambda xml: xml.replace('id="61000"', 'id="61002"'),
        lambda xml: xml.replace('type="uint8_t" name="points"', 'type="uint16_t" name="points"'),
        lambda xml: xml.replace('name="variance"', 'name="sigma"'),
        lambda xml: xml.replace("NEIGHBOUR_STATE", "NEIGHBOR_STATE"),
        lambda xml: xml.replace("</message>", '<extensions/><field type="uint8_t" name="more">More.</field></message>'),
    ],
    ids=["id", "type", "field name", "message name", "extension"],
)
def test_the_hash_changes_with_the_wire(tmp_path: Path, change: Callable[[str], str]) -> None:
    private = change(PRIVATE)
    assert private != PRIVATE
    config = {**CONFIG, "messages": dict(CONFIG["messages"])}
    if "NEIGHBOR_STATE" in private:
        config["messages"]["ground"] = ["NEIGHBOR_STATE", "FORMATION_STATUS", *CONFIG["messages"]["ground"][:-2]]
    assert hash_of(generated(tmp_path, config, private)) != protocol.DIALECT_HASH.hex()


def test_the_hash_keeps_when_only_words_change(tmp_path: Path) -> None:
    assert hash_of(generated(tmp_path, private=PRIVATE.replace("Timestamp", "Time"))) == protocol.DIALECT_HASH.hex()


def test_generating_again_touches_nothing(tmp_path: Path) -> None:
    files = generated(tmp_path)
    assert generate.write_changed(tmp_path, files) == len(files)
    assert generate.write_changed(tmp_path, files) == 0
    del files["firmware/src/link/dialect/constants.h"]
    assert generate.write_changed(tmp_path, files) == 1
    assert not (tmp_path / "firmware/src/link/dialect/constants.h").exists()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"messages": {"ground": ["HEARTBEET"]}}, "HEARTBEET"),
        ({"messages": {"ground": ["WHEEL_DISTANCE"]}}, "WHEEL_DISTANCE has a double"),
        ({"enums": {"MAV_CMD": ["MAV_CMD_SWIM"]}}, "MAV_CMD has no entry MAV_CMD_SWIM"),
        ({"enums": {"MAV_WISH": "*"}}, "MAV_WISH"),
    ],
    ids=["unknown message", "double", "unknown entry", "unknown enum"],
)
def test_a_wrong_allow_list_is_refused_by_name(tmp_path: Path, change: dict[str, Any], said: str) -> None:
    with pytest.raises(generate.DialectError, match=said):
        generated(tmp_path, {**CONFIG, **change})


def test_the_firmware_buffers_hold_its_longest_message() -> None:
    names = {*CONFIG["messages"]["firmware_sends"], *CONFIG["messages"]["firmware_receives"]}
    longest = max(kind.unpacker.size for kind in dialect.mavlink_map.values() if kind.msgname in names)
    assert longest == protocol.FIRMWARE_PAYLOAD_MAX
