"""One message on the line to the firmware, decoded only when somebody looks inside."""

from __future__ import annotations

import struct
from collections import namedtuple
from typing import Any, NamedTuple

import protocol
from protocol.frames import HEADER_LENGTH


class _Plain(NamedTuple):
    unpacker: struct.Struct
    kind: type[Any]


# Messages without arrays and texts, which make up nearly all of the line: unpacked without the generated module's
# detour, which would check the CRC again.
_PLAIN = {
    key: _Plain(kind.unpacker, namedtuple(kind.msgname, kind.ordered_fieldnames))
    for key, kind in protocol.dialect.mavlink_map.items()
    if not any(kind.array_lengths)
}


class Message:
    """A message with its sender and its time; `fields` gives the decoded fields as attributes.

    `stamp` is the time of reception on the receiver's clock, s (0 for one made to be sent). Messages are not changed
    after construction, except that a sent one learns its `frame`.
    """

    __slots__ = ("_fields", "component", "frame", "id", "sequence", "stamp", "system")

    def __init__(self, fields: protocol.Message, *, system: int, component: int, stamp: float = 0.0) -> None:
        self.stamp = stamp
        self.system = system
        self.component = component
        self.id: int = fields.id
        self.sequence = 0
        self.frame = b""
        self._fields: Any = fields

    @classmethod
    def received(cls, frame: bytes, stamp: float) -> Message:
        """A message from a frame whose CRC was found right by `protocol.split_frames`."""
        message = cls.__new__(cls)
        message.stamp = stamp
        message.sequence, message.system, message.component, message.id = protocol.header(frame)
        message.frame = frame
        message._fields = None
        return message

    @property
    def fields(self) -> Any:
        """The decoded fields, units as on the wire."""
        if self._fields is None:
            plain = _PLAIN.get(self.id)
            if plain is None:
                self._fields = protocol.decode(self.frame)
            else:
                payload = self.frame[HEADER_LENGTH:-2].ljust(plain.unpacker.size, b"\0")
                self._fields = plain.kind._make(plain.unpacker.unpack(payload))
        return self._fields

    @property
    def name(self) -> str:
        """Name of the message in the dialect, such as ATTITUDE."""
        return str(protocol.dialect.mavlink_map[self.id].msgname)

    def __repr__(self) -> str:
        return f"Message({self.name} from {self.system}/{self.component} at {self.stamp:.3f} s)"
