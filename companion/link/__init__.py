"""The line to the firmware: a bus of messages, and the conversation held over it."""

from companion.link.bus import Bus, BusReport, BusState, Counters
from companion.link.message import Message
from companion.link.notifier import BufferedReader, Listener, Notifier
from companion.link.pipe import PipeBus
from companion.link.serial_bus import SerialBus
from companion.link.session import LinkCommand, LinkOutput, LinkSession, LinkState
from companion.link.telemetry import Telemetry

__all__ = [
    "BufferedReader",
    "Bus",
    "BusReport",
    "BusState",
    "Counters",
    "LinkCommand",
    "LinkOutput",
    "LinkSession",
    "LinkState",
    "Listener",
    "Message",
    "Notifier",
    "PipeBus",
    "SerialBus",
    "Telemetry",
]
