"""The latest that the firmware told, each with its time, decoded when asked for."""

from __future__ import annotations

import math

from companion.link.message import Message
from companion.scene import Attitude
from protocol import dialect

_NEVER = -math.inf


class Telemetry:
    """Newest message of each kind; a property is None until its message arrived. SI units, body FRD, mission NED."""

    def __init__(self) -> None:
        self._latest: dict[int, Message] = {}
        self._values: dict[str, float] = {}

    def update(self, message: Message) -> None:
        """Takes one message from the firmware."""
        if message.id == dialect.MAVLINK_MSG_ID_NAMED_VALUE_FLOAT:
            self._values[str(message.fields.name).rstrip("\0")] = float(message.fields.value)
        self._latest[message.id] = message

    def latest(self, message_id: int) -> Message | None:
        """The newest message of a kind."""
        return self._latest.get(message_id)

    def stamp(self, message_id: int) -> float:
        """Time of reception of the newest message of a kind, s; minus infinity when there was none."""
        message = self._latest.get(message_id)
        return message.stamp if message is not None else _NEVER

    @property
    def values(self) -> dict[str, float]:
        """The named values, such as worst loop time."""
        return self._values

    @property
    def attitude(self) -> Attitude | None:
        """Orientation, rad."""
        message = self._latest.get(dialect.MAVLINK_MSG_ID_ATTITUDE)
        if message is None:
            return None
        fields = message.fields
        return Attitude(fields.roll, fields.pitch, fields.yaw)

    @property
    def attitude_stamp(self) -> float:
        """Time of reception of the newest attitude, s; minus infinity when there was none."""
        return self.stamp(dialect.MAVLINK_MSG_ID_ATTITUDE)

    @property
    def boot_time(self) -> float | None:
        """The firmware's clock at the newest attitude, s since its reset."""
        message = self._latest.get(dialect.MAVLINK_MSG_ID_ATTITUDE)
        return message.fields.time_boot_ms / 1000.0 if message is not None else None

    @property
    def depth(self) -> float | None:
        """Estimated depth, m, down positive."""
        message = self._latest.get(dialect.MAVLINK_MSG_ID_VFR_HUD)
        return -message.fields.alt if message is not None else None

    @property
    def speed(self) -> float | None:
        """Estimated speed through the water along the hull, m/s."""
        message = self._latest.get(dialect.MAVLINK_MSG_ID_VFR_HUD)
        return message.fields.airspeed if message is not None else None

    @property
    def battery_voltage(self) -> float | None:
        """Battery voltage, V."""
        message = self._latest.get(dialect.MAVLINK_MSG_ID_SYS_STATUS)
        return message.fields.voltage_battery / 1000.0 if message is not None else None

    @property
    def battery_current(self) -> float | None:
        """Battery current, A."""
        message = self._latest.get(dialect.MAVLINK_MSG_ID_SYS_STATUS)
        return message.fields.current_battery / 100.0 if message is not None else None

    @property
    def pulses_us(self) -> tuple[float, float, float] | None:
        """Pulses of bow servo, stern servo and motor, us."""
        message = self._latest.get(dialect.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW)
        if message is None:
            return None
        fields = message.fields
        return (fields.servo1_raw, fields.servo2_raw, fields.servo3_raw)

    @property
    def armed(self) -> bool:
        """Whether the newest heartbeat says so."""
        message = self._latest.get(dialect.MAVLINK_MSG_ID_HEARTBEAT)
        return message is not None and bool(message.fields.base_mode & dialect.MAV_MODE_FLAG_SAFETY_ARMED)

    @property
    def failsafe(self) -> bool:
        """Whether the newest heartbeat tells of a failsafe that only arming again ends."""
        message = self._latest.get(dialect.MAVLINK_MSG_ID_HEARTBEAT)
        return message is not None and message.fields.system_status >= dialect.MAV_STATE_CRITICAL
