"""Frames on file, made by reference pymavlink from its full dialect, byte for byte in both languages."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import pytest

import protocol
from protocol import dialect

ROOT = Path(__file__).resolve().parents[2]
GOLDEN: list[dict[str, Any]] = json.loads((ROOT / "protocol/golden/frames.json").read_text())


def message_of(golden: dict[str, Any]) -> protocol.Message:
    """Build the message of the generated module from the fields on file."""
    fields = {key: value.encode() if isinstance(value, str) else value for key, value in golden["fields"].items()}
    message: protocol.Message = getattr(dialect, f"MAVLink_{golden['message'].lower()}_message")(**fields)
    return message


def test_every_message_of_the_dialect_is_on_file() -> None:
    on_file = {golden["message"] for golden in GOLDEN}
    assert on_file == {kind.msgname for kind in dialect.mavlink_map.values()}


@pytest.mark.parametrize("golden", GOLDEN, ids=lambda golden: f"{golden['message']}-{golden['source'][2]}")
def test_python_packs_and_reads_the_frame_on_file(golden: dict[str, Any]) -> None:
    system, component, sequence = golden["source"]
    frame = bytes.fromhex(golden["frame"])
    assert protocol.encode(message_of(golden), system=system, component=component, sequence=sequence) == frame

    assert protocol.split_frames(frame) == ([frame], b"", 0)
    head = protocol.header(frame)
    message = protocol.decode(frame)
    assert (head.system, head.component, head.sequence) == (system, component, sequence)
    assert message.get_type() == golden["message"]
    assert {name: getattr(message, name) for name in golden["fields"]} == golden["fields"]


def c_literal(value: Any) -> str:
    """Write a field's value in C, floats exactly."""
    if isinstance(value, str):
        return json.dumps(value)
    if isinstance(value, list):
        return "{" + ", ".join(c_literal(item) for item in value) + "}"
    return f"{value.hex()}f" if isinstance(value, float) else f"{value}{'ULL' if value > 2**31 else ''}"


def c_assignments(golden: dict[str, Any]) -> str:
    """Write the C statements that fill the struct `sent` with the fields on file."""
    lines = []
    for field, value in golden["fields"].items():
        if isinstance(value, str):
            lines.append(f"memcpy(sent.{field}, {c_literal(value)}, {len(value)});")
        elif isinstance(value, list):
            lines += [f"sent.{field}[{i}] = {c_literal(item)};" for i, item in enumerate(value)]
        else:
            lines.append(f"sent.{field} = {c_literal(value)};")
    return " ".join(lines)


def c_bytes(octets: bytes) -> str:
    """Write bytes as a C initializer."""
    return "{" + ", ".join(map(str, octets)) + "}"


def c_check(index: int, golden: dict[str, Any]) -> str:
    """Write a C++ function that packs one frame, compares it, parses it and compares the message."""
    name = golden["message"].lower()
    system, component, sequence = golden["source"]
    return f"""
static bool frame_{index}() {{
  static const uint8_t golden[] = {c_bytes(bytes.fromhex(golden["frame"]))};
  mavlink_{name}_t sent, received;
  memset(&sent, 0, sizeof(sent));
  memset(&received, 0, sizeof(received));
  {c_assignments(golden)}
  mavlink_status_t status;
  memset(&status, 0, sizeof(status));
  status.current_tx_seq = {sequence};
  mavlink_message_t packed;
  mavlink_msg_{name}_encode_status({system}, {component}, &status, &packed, &sent);
  uint8_t bytes[MAVLINK_MAX_PACKET_LEN];
  const uint16_t count = mavlink_msg_to_send_buffer(bytes, &packed);
  if (count != sizeof(golden) || memcmp(bytes, golden, count) != 0) return false;

  mavlink_message_t parsing, message;
  memset(&status, 0, sizeof(status));
  uint8_t result = MAVLINK_FRAMING_INCOMPLETE;
  for (uint16_t i = 0; i < count; ++i) result = mavlink_frame_char_buffer(&parsing, &status, bytes[i], &message, NULL);
  if (result != MAVLINK_FRAMING_OK || message.msgid != MAVLINK_MSG_ID_{golden["message"]}) return false;
  mavlink_msg_{name}_decode(&message, &received);
  return memcmp(&sent, &received, sizeof(sent)) == 0;
}}
"""


def firmware_check(index: int, golden: dict[str, Any]) -> str:
    """Write a C++ function that lets the firmware's own reader and writer do the same; it sends as component 1."""
    name = golden["message"].lower()
    system, component, sequence = golden["source"]
    own = protocol.encode(message_of(golden), system=system, component=protocol.FIRMWARE_COMPONENT, sequence=0)
    return f"""
static bool frame_{index}() {{
  static const uint8_t golden[] = {c_bytes(bytes.fromhex(golden["frame"]))};
  static const uint8_t own[] = {c_bytes(own)};
  mavlink_{name}_t sent;
  memset(&sent, 0, sizeof(sent));
  {c_assignments(golden)}
  shoal::LineBoard board;
  shoal::FrameWriter writer(board, shoal::Port::companion);
  writer.send({system}, MAVLINK_MSG_ID_{golden["message"]}, &sent, MAVLINK_MSG_ID_{golden["message"]}_LEN,
              MAVLINK_MSG_ID_{golden["message"]}_CRC);
  if (board.count != sizeof(own) || memcmp(board.sent, own, sizeof(own)) != 0) return false;

  shoal::FrameReader reader;
  shoal::Frame frame = {{}};
  for (size_t i = 0; i + 1 < sizeof(golden); ++i) {{
    reader.push(golden[i]);
    if (reader.next(frame)) return false;
  }}
  reader.push(golden[sizeof(golden) - 1]);
  if (!reader.next(frame)) return false;
  if (frame.system != {system} || frame.component != {component} || frame.sequence != {sequence}) return false;
  if (frame.id != MAVLINK_MSG_ID_{golden["message"]}) return false;
  const mavlink_{name}_t received = frame.as<mavlink_{name}_t>();
  return memcmp(&sent, &received, MAVLINK_MSG_ID_{golden["message"]}_LEN) == 0;
}}
"""


def wrong_frames(directory: Path, head: list[str], checks: list[str], names: list[str], more: list[Path]) -> str:
    """Compile the checks with sanitizers, run them and return what they print: the frames that are wrong."""
    calls = [f'  if (!frame_{index}()) puts("{name} {index}");' for index, name in enumerate(names)]
    source, program = directory / "golden.cpp", directory / "golden"
    source.write_text("\n".join([*head, "#include <stdio.h>", *checks, "int main() {", *calls, "  return 0;", "}"]))
    flags = ["-std=gnu++14", "-O0", "-Wall", "-Wextra", "-Werror", "-fsanitize=address,undefined"]
    places = [f"-I{ROOT / 'firmware/src'}", f"-I{ROOT / 'firmware/src/link'}", f"-I{ROOT / 'tests/protocol'}"]
    command: list[str | Path] = ["c++", *flags, "-fno-sanitize-recover=all", *places, source, *more, "-o", program]
    subprocess.run(command, check=True)
    run = subprocess.run([program], capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    return run.stdout


def test_c_packs_and_reads_the_frames_on_file(tmp_path: Path) -> None:
    head = ["#define MAVLINK_MAX_PAYLOAD_LEN 255", '#include "mavlink.h"']
    checks = [c_check(index, golden) for index, golden in enumerate(GOLDEN)]
    assert wrong_frames(tmp_path, head, checks, [golden["message"] for golden in GOLDEN], []) == ""


def test_the_firmware_writes_and_reads_the_frames_on_file(tmp_path: Path) -> None:
    kinds = {kind.msgname: kind for kind in dialect.mavlink_map.values()}
    short = [item for item in GOLDEN if kinds[item["message"]].unpacker.size <= protocol.FIRMWARE_PAYLOAD_MAX]
    head = ['#include "line_board.h"', '#include "frame.h"', '#include "mavlink.h"']
    checks = [firmware_check(index, golden) for index, golden in enumerate(short)]
    sources = [ROOT / "firmware/src/link/frame.cpp"]
    assert wrong_frames(tmp_path, head, checks, [golden["message"] for golden in short], sources) == ""
