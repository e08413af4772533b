"""The messages between vehicle, companion and ground: the public door of the generated dialect.

`dialect` holds the message classes (`dialect.MAVLink_attitude_message`) and enum values (`dialect.MAV_CMD_...`).
Needs the standard library only.
"""

from __future__ import annotations

try:
    from protocol.generated import DIALECT_HASH, FIRMWARE_PAYLOAD_MAX, dialect
except ModuleNotFoundError as error:
    raise ImportError("protocol/generated is missing: run 'make protocol' in the checkout") from error

from protocol.crc import crc16
from protocol.frames import FrameError, FrameHeader, Message, decode, encode, header, split_frames

FIRMWARE_COMPONENT = dialect.MAV_COMP_ID_AUTOPILOT1
COMPANION_COMPONENT = dialect.MAV_COMP_ID_ONBOARD_COMPUTER
GROUND_SYSTEM = 255

__all__ = [
    "COMPANION_COMPONENT",
    "DIALECT_HASH",
    "FIRMWARE_COMPONENT",
    "FIRMWARE_PAYLOAD_MAX",
    "GROUND_SYSTEM",
    "FrameError",
    "FrameHeader",
    "Message",
    "crc16",
    "decode",
    "dialect",
    "encode",
    "header",
    "split_frames",
]
