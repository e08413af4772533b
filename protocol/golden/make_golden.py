"""Writes frames.json: frames of the standard messages as reference pymavlink packs them from its full dialect.

Run by hand when a message joins the allow-list; frames that are on file stay as they are. Private messages, which no
reference knows, are packed by struct from the layout that private.xml states.
"""

from __future__ import annotations

import json
import random
import struct
import sys
from pathlib import Path
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as reference
from pymavlink.generator.mavcrc import x25crc

from protocol import dialect

FILE = Path(__file__).with_name("frames.json")
RANGES = {"uint8_t": "B", "int8_t": "b", "uint16_t": "H", "int16_t": "h", "uint32_t": "I", "int32_t": "i"} | {
    "uint64_t": "Q",
    "int64_t": "q",
}


def draw(kind: str, draws: random.Random) -> float | int:
    """Draw one value of a wire type; floats are exact in 32 bits."""
    if kind == "float":
        return struct.unpack("<f", struct.pack("<f", draws.uniform(-1000, 1000)))[0]  # type: ignore[no-any-return]
    return int(struct.unpack("<" + RANGES[kind], draws.randbytes(struct.calcsize(RANGES[kind])))[0])


def field_values(message: Any, draws: random.Random) -> dict[str, Any]:
    """Draw every field of a message; strings are shorter than their field."""
    values: dict[str, Any] = {}
    for name, kind, length in zip(message.fieldnames, message.fieldtypes, lengths_by_field(message), strict=True):
        if kind == "char":
            values[name] = "".join(draws.choices("abcdefghijklmnopqrstuvwxyz_", k=max(1, length - 2)))
        elif length:
            values[name] = [draw(kind, draws) for _ in range(length)]
        else:
            values[name] = draw(kind, draws)
    return values


def lengths_by_field(message: Any) -> list[int]:
    """Array lengths (0 for a scalar) in the order of `fieldnames`."""
    by_name = dict(zip(message.ordered_fieldnames, message.array_lengths, strict=True))
    return [by_name[name] for name in message.fieldnames]


def pack_reference(name: str, values: dict[str, Any], source: tuple[int, int, int]) -> bytes:
    """Let reference pymavlink pack a standard message."""
    sender = reference.MAVLink(None, source[0], source[1])
    sender.seq = source[2]
    arguments = {key: value.encode() if isinstance(value, str) else value for key, value in values.items()}
    if name == "HEARTBEAT":
        arguments["mavlink_version"] = 3
    return bytes(getattr(reference, f"MAVLink_{name.lower()}_message")(**arguments).pack(sender))


def pack_private(message: Any, values: dict[str, Any], source: tuple[int, int, int]) -> bytes:
    """Pack a private message of scalars: 4-byte fields first, then bytes, each group in the order of definition."""
    codes = {"float": "f", **RANGES}
    kinds = dict(zip(message.fieldnames, message.fieldtypes, strict=True))
    ordered = sorted(values, key=lambda name: -struct.calcsize("<" + codes[kinds[name]]))
    payload = b"".join(struct.pack("<" + codes[kinds[name]], values[name]) for name in ordered).rstrip(b"\0")
    system, component, sequence = source
    body = bytes([len(payload), 0, 0, sequence, system, component]) + int(message.id).to_bytes(3, "little") + payload
    seed = x25crc()
    seed.accumulate_str(message.msgname + " ")
    for name in ordered:
        seed.accumulate_str(f"{kinds[name]} ")
        seed.accumulate_str(f"{name} ")
    crc = x25crc()
    crc.accumulate(body + bytes([(seed.crc & 0xFF) ^ (seed.crc >> 8)]))
    return b"\xfd" + body + int(crc.crc).to_bytes(2, "little")


def main() -> int:
    """Add two frames for each message that has none: one full, one whose payload ends in zeros."""
    frames = json.loads(FILE.read_text()) if FILE.exists() else []
    known = {frame["message"] for frame in frames}
    for kind in dialect.mavlink_map.values():
        if kind.msgname in known:
            continue
        draws = random.Random(kind.msgname)
        full = field_values(kind, draws)
        if kind.msgname == "HEARTBEAT":
            full["mavlink_version"] = 3
        tail = kind.ordered_fieldnames[1:]
        short = {
            key: zeroed(value) if key in tail and key != "mavlink_version" else value for key, value in full.items()
        }
        for values in (full, short):
            source = (draws.randrange(1, 256), draws.randrange(1, 256), draws.randrange(256))
            private = kind.id in range(61000, 61020)
            frame = pack_private(kind, values, source) if private else pack_reference(kind.msgname, values, source)
            frames.append(
                {"message": kind.msgname, "fields": values, "source": list(source), "frame": frame.hex()},
            )
    FILE.write_text("[\n" + ",\n".join(json.dumps(frame) for frame in frames) + "\n]\n")
    return 0


def zeroed(value: Any) -> Any:
    """Return the zero of a field's type."""
    if isinstance(value, list):
        return [zeroed(item) for item in value]
    return "" if isinstance(value, str) else type(value)(0)


if __name__ == "__main__":
    sys.exit(main())
