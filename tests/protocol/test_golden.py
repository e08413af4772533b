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


def c_check(index: int, golden: dict[str, Any]) -> str:
    """Write a C++ function that packs one frame, compares it, parses it and compares the message."""
    name = golden["message"].lower()
    system, component, sequence = golden["source"]
    octets = bytes.fromhex(golden["frame"])
    assign = []
    for field, value in golden["fields"].items():
        if isinstance(value, str):
            assign.append(f"memcpy(sent.{field}, {c_literal(value)}, {len(value)});")
        elif isinstance(value, list):
            assign += [f"sent.{field}[{i}] = {c_literal(item)};" for i, item in enumerate(value)]
        else:
            assign.append(f"sent.{field} = {c_literal(value)};")
    return f"""
static bool frame_{index}() {{
  static const uint8_t golden[] = {{{", ".join(str(octet) for octet in octets)}}};
  mavlink_{name}_t sent, received;
  memset(&sent, 0, sizeof(sent));
  memset(&received, 0, sizeof(received));
  {" ".join(assign)}
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


def test_c_packs_and_reads_the_frames_on_file(tmp_path: Path) -> None:
    lines = ["#define MAVLINK_MAX_PAYLOAD_LEN 255", '#include "mavlink.h"', "#include <stdio.h>"]
    lines += [c_check(index, golden) for index, golden in enumerate(GOLDEN)]
    lines += ["int main() {", "  int wrong = 0;"]
    for index, golden in enumerate(GOLDEN):
        lines.append(f'  if (!frame_{index}()) {{ ++wrong; puts("{golden["message"]} frame {index}"); }}')
    lines += ["  return wrong;", "}"]
    source, program = tmp_path / "golden.cpp", tmp_path / "golden"
    source.write_text("\n".join(lines))
    flags = ["-std=gnu++14", "-O1", "-Wall", "-Wextra", "-Werror", "-fsanitize=address,undefined"]
    subprocess.run(
        ["c++", *flags, "-fno-sanitize-recover=all", f"-I{ROOT / 'firmware/src/link'}", source, "-o", program],
        check=True,
    )
    run = subprocess.run([program], capture_output=True, text=True, check=False)
    assert (run.returncode, run.stdout, run.stderr) == (0, "", "")
