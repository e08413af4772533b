"""CRC-16/MCRF4XX of MAVLink at the speed of the standard library's C code.

MCRF4XX is CRC-16/CCITT with every byte and the remainder bit-reversed, and CCITT is what `binascii.crc_hqx` computes.
"""

from __future__ import annotations

from binascii import crc_hqx

_REVERSED = bytes(int(f"{octet:08b}"[::-1], 2) for octet in range(256))


def _reverse16(value: int) -> int:
    return _REVERSED[value & 0xFF] << 8 | _REVERSED[value >> 8]


def crc16(data: bytes | bytearray, crc: int = 0xFFFF) -> int:
    """Continue the CRC `crc` over `data`; the initial value is that of MAVLink."""
    return _reverse16(crc_hqx(data.translate(_REVERSED), _reverse16(crc)))


class X25Crc:
    """The CRC in the form that the generated module calls."""

    def __init__(self, data: bytes | bytearray = b"") -> None:
        self.crc = crc16(data)

    def accumulate(self, data: bytes | bytearray) -> None:
        """Continue over more bytes."""
        self.crc = crc16(data, self.crc)
