"""What the line does to frames: cut anywhere, between noise, with flipped bits; no wrong frame ever comes out."""

from __future__ import annotations

import math
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import protocol
from protocol import dialect

ROOT = Path(__file__).resolve().parents[2]


def setpoint(sequence: int) -> bytes:
    """Pack a setpoint such as the companion sends ten times a second."""
    message = dialect.MAVLink_set_position_target_local_ned_message(
        time_boot_ms=1000 + 100 * sequence,
        target_system=1,
        target_component=protocol.FIRMWARE_COMPONENT,
        coordinate_frame=dialect.MAV_FRAME_LOCAL_NED,
        type_mask=0x09E3,
        x=0.0,
        y=0.0,
        z=2.0,
        vx=0.35 * math.cos(0.1 * sequence),
        vy=0.35 * math.sin(0.1 * sequence),
        vz=0.0,
        afx=0.0,
        afy=0.0,
        afz=0.0,
        yaw=0.1 * sequence,
        yaw_rate=0.0,
    )
    return protocol.encode(message, system=1, component=protocol.COMPANION_COMPONENT, sequence=sequence % 256)


FRAMES = [setpoint(sequence) for sequence in range(8)]


def feed(chunks: list[bytes]) -> tuple[list[bytes], bytes, int]:
    """Receive chunk after chunk as a link does."""
    frames: list[bytes] = []
    rest, lost = b"", 0
    for chunk in chunks:
        found, rest, more = protocol.split_frames(rest + chunk)
        frames += found
        lost += more
    return frames, rest, lost


def crc_by_bits(data: bytes) -> int:
    """CRC-16/MCRF4XX by its definition: polynomial 0x1021 reflected, initial value 0xFFFF."""
    crc = 0xFFFF
    for octet in data:
        crc ^= octet
        for _ in range(8):
            crc = crc >> 1 ^ (0x8408 if crc & 1 else 0)
    return crc


def test_the_crc_is_mcrf4xx() -> None:
    assert protocol.crc16(b"123456789") == 0x6F91


@given(st.binary(max_size=300), st.integers(0, 300))
def test_the_crc_may_be_continued_anywhere(data: bytes, cut: int) -> None:
    assert protocol.crc16(data[cut:], protocol.crc16(data[:cut])) == crc_by_bits(data)


@given(st.lists(st.integers(0, sum(map(len, FRAMES))), max_size=40))
def test_frames_arrive_whole_however_the_line_cuts_them(cuts: list[int]) -> None:
    stream = b"".join(FRAMES)
    edges = [0, *sorted(cuts), len(stream)]
    chunks = [stream[begin:end] for begin, end in pairwise(edges)]
    assert feed(chunks) == (FRAMES, b"", 0)


@given(st.binary(max_size=200))
def test_noise_is_counted_to_the_byte(noise: bytes) -> None:
    frames, rest, lost = feed([noise, *FRAMES, bytes(300)])
    assert rest == b""
    assert [frame for frame in frames if frame in FRAMES] == FRAMES
    assert sum(map(len, frames)) + lost == len(noise) + sum(map(len, FRAMES)) + 300


@given(st.integers(0, len(FRAMES) - 1), st.integers(0, 1000), st.integers(0, 7))
def test_a_flipped_bit_costs_its_own_frame_and_no_other(hit: int, place: int, bit: int) -> None:
    broken = bytearray(FRAMES[hit])
    broken[place % len(broken)] ^= 1 << bit
    frames, _, lost = feed([*FRAMES[:hit], bytes(broken), *FRAMES[hit + 1 :], bytes(300)])
    assert frames == FRAMES[:hit] + FRAMES[hit + 1 :]
    assert lost == len(broken) + 300


def test_a_frame_of_another_dialect_is_refused_with_its_id() -> None:
    body = bytes([1, 0, 0, 0, 1, 1]) + (50000).to_bytes(3, "little") + b"\x01"
    with pytest.raises(protocol.FrameError, match="50000"):
        protocol.decode(b"\xfd" + body + protocol.crc16(body).to_bytes(2, "little"))


def test_a_corrupted_frame_is_refused_by_decode() -> None:
    frame = bytearray(FRAMES[0])
    frame[20] ^= 1
    with pytest.raises(protocol.FrameError, match="CRC"):
        protocol.decode(bytes(frame))


def test_the_vehicle_needs_the_standard_library_only() -> None:
    program = f"import sys; sys.path.insert(0, {str(ROOT)!r}); import protocol; print(protocol.DIALECT_HASH.hex())"
    run = subprocess.run([sys.executable, "-I", "-S", "-c", program], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == protocol.DIALECT_HASH.hex()
