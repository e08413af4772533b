"""Between bytes on a line and typed messages: finds frames, checks them, encodes and decodes them."""

from __future__ import annotations

from typing import NamedTuple, cast

from protocol.crc import X25Crc, crc16
from protocol.generated import dialect

MARKER = dialect.PROTOCOL_MARKER_V2
HEADER_LENGTH = dialect.HEADER_LEN_V2
OVERHEAD = HEADER_LENGTH + 2

Message = dialect.MAVLink_message

# The generated module computes every CRC through the first name, and must never ignore one.
vars(dialect).update(x25crc=X25Crc, MAVLINK_IGNORE_CRC=0)


class FrameError(ValueError):
    """A frame that cannot be decoded; the message says why."""


class FrameHeader(NamedTuple):
    """Who sent a frame, and what it is."""

    sequence: int
    system: int
    component: int
    message_id: int


class _Shape(NamedTuple):
    longest: int
    crc_extra: bytes


# What the splitter must know of every message of the dialect, by id.
_SHAPES = {key: _Shape(kind.unpacker.size, bytes([kind.crc_extra])) for key, kind in dialect.mavlink_map.items()}


class _NoSigning:
    sign_outgoing = False


class _Sender:
    """The part of a generated MAVLink object that packing reads."""

    signing = _NoSigning()

    def __init__(self, system: int, component: int, sequence: int) -> None:
        self.srcSystem = system
        self.srcComponent = component
        self.seq = sequence


_decoder = dialect.MAVLink(None)


def encode(message: Message, *, system: int, component: int, sequence: int) -> bytes:
    """Pack a message into a frame sent by `system`, `component` with the sequence number `sequence` (0..255)."""
    return message.pack(cast(dialect.MAVLink, _Sender(system, component, sequence)))


def header(frame: bytes) -> FrameHeader:
    """Read the header of a frame that `split_frames` returned."""
    return FrameHeader(frame[4], frame[5], frame[6], int.from_bytes(frame[7:10], "little"))


def decode(frame: bytes) -> Message:
    """Turn one frame into a message of its class; raises FrameError when length, CRC or id do not fit the dialect."""
    if len(frame) < OVERHEAD or frame[0] != MARKER or frame[2]:
        raise FrameError(f"not an unsigned MAVLink 2 frame: {frame[:12].hex()}")
    try:
        message = _decoder.decode(bytearray(frame))
    except dialect.MAVError as error:
        raise FrameError(str(error)) from error
    if isinstance(message, dialect.MAVLink_unknown):
        raise FrameError(f"message {header(frame).message_id} is not of this dialect")
    return message


def split_frames(buffer: bytes | bytearray) -> tuple[list[bytes], bytes, int]:
    """Cut the frames out of received bytes without decoding them.

    Returns the complete frames of the dialect whose length and CRC are right, the rest to be put before the next bytes,
    and the number of bytes that belonged to no such frame. Signed frames and MAVLink 1 count as lost. After a bad CRC
    the search goes on behind the marker, so a corrupted frame costs no other. The rest never exceeds one frame.
    """
    data = bytes(buffer)
    frames: list[bytes] = []
    position = lost = 0
    while (start := data.find(MARKER, position)) >= 0:
        lost += start - position
        position = start
        length = _frame_length(data, start)
        if length is None or start + length > len(data):
            return frames, data[start:], lost
        if length and _crc_fits(data, start, length):
            frames.append(data[start : start + length])
            position = start + length
        else:
            lost += 1
            position = start + 1
    return frames, b"", lost + len(data) - position


def _frame_length(data: bytes, start: int) -> int | None:
    """Length of the frame that may begin at `start`; 0 when none can, None when more bytes must tell."""
    head = data[start : start + HEADER_LENGTH]
    if len(head) > 2 and head[2]:
        return 0
    if len(head) < HEADER_LENGTH:
        return None
    shape = _SHAPES.get(int.from_bytes(head[7:10], "little"))
    return OVERHEAD + head[1] if shape is not None and 0 < head[1] <= shape.longest else 0


def _crc_fits(data: bytes, start: int, length: int) -> bool:
    """Whether the CRC of the frame is that of its bytes and of its message's definition."""
    end = start + length
    shape = _SHAPES[int.from_bytes(data[start + 7 : start + 10], "little")]
    return crc16(data[start + 1 : end - 2] + shape.crc_extra) == int.from_bytes(data[end - 2 : end], "little")
