"""A logbook of the line between companion and firmware: connecting, arming, losing each other, and why."""

from __future__ import annotations

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

import protocol
from companion.link import BusReport, BusState, Counters, LinkCommand, LinkSession, LinkState, PipeBus
from companion.link.diagnosis import Cause
from companion.link.timesync import TimeSync
from companion.scene import Setpoint
from protocol import DIALECT_HASH, FIRMWARE_COMPONENT, dialect
from tests.companion.link.firmware_fake import FirmwareFake
from tests.companion.link.voyage import Voyage

PARAMETERS = {"DEPTH_MAX": 5.0, "BOW_TRIM": -1.5}


def voyage(vehicle: int = 3, *, rearm: bool = False, **firmware: object) -> Voyage:
    return Voyage(FirmwareFake(**firmware), LinkSession(vehicle, PARAMETERS, rearm=rearm))  # type: ignore[arg-type]


def test_a_fresh_board_becomes_vehicle_3_with_its_parameters_and_follows_setpoints_at_10_hz() -> None:
    trip = voyage()
    trip.arm = True
    trip.sail(4.0)
    assert trip.state() is LinkState.READY
    assert trip.firmware.system == 3
    assert trip.firmware.parameters == {"SYS_ID": 3, "DEPTH_MAX": 5, "FS_ACTION": 1, "BOW_TRIM": -1.5, "THR_MAX": 1}
    assert trip.firmware.armed
    assert trip.session.armed
    before = len(trip.firmware.setpoints)
    trip.sail(2.0)
    assert len(trip.firmware.setpoints) - before == 20
    assert trip.firmware.setpoints[-1] == pytest.approx((0.5, 2.0, 0.4), abs=1e-6)
    assert trip.log == [
        "info: firmware heard as system 1",
        "info: connected, parameters set and verified",
        "info: armed",
    ]
    assert trip.bus.counters.bytes_lost == trip.bus.counters.sequence_gaps == 0
    trip.arm = False
    trip.sail(2.0)
    assert trip.firmware_mode() == "disarmed"
    assert trip.log[-1] == "info: disarmed"


def test_an_image_of_another_dialect_is_refused_with_both_hashes_until_it_is_replaced() -> None:
    other = bytes(reversed(DIALECT_HASH))
    trip = voyage(dialect_hash=other)
    trip.arm = True
    trip.sail(20.0)
    assert trip.state() is LinkState.REFUSED
    assert DIALECT_HASH.hex() in trip.session.reason
    assert other.hex() in trip.session.reason
    assert trip.log.count(f"error: {trip.session.reason}") == 1
    assert trip.firmware.companion_hash == DIALECT_HASH, "the firmware must be able to refuse, too"
    assert not trip.firmware.setpoints
    assert not trip.firmware.armed
    trip.firmware.dialect_hash = DIALECT_HASH
    trip.sail(10.0)
    assert trip.state() is LinkState.READY
    assert trip.firmware.armed


def test_a_refusal_to_arm_is_told_once_with_the_firmwares_reason_and_tried_again() -> None:
    trip = voyage(refusal="battery low")
    trip.arm = True
    trip.sail(8.0)
    assert trip.log.count("warning: arming refused: battery low") == 2, "once by the firmware, once by the companion"
    trip.firmware.refusal = ""
    trip.sail(4.0)
    assert trip.firmware.armed


@pytest.mark.parametrize(
    ("parameters", "complaint"),
    [
        ({"THR_MAX": 3.0}, "parameter THR_MAX = 3 refused, firmware keeps 1"),
        ({"NO_SUCH": 1.0}, "parameter NO_SUCH: no answer (unknown to this firmware?)"),
    ],
)
def test_a_parameter_that_the_firmware_does_not_take_keeps_the_vehicle_ashore(
    parameters: dict[str, float], complaint: str
) -> None:
    trip = Voyage(FirmwareFake(), LinkSession(1, parameters))
    trip.arm = True
    trip.sail(8.0)
    assert trip.state() is LinkState.REFUSED
    assert trip.session.reason == complaint
    assert not trip.firmware.armed


def test_a_gap_in_the_line_is_a_state_and_setpoints_flow_again_at_once() -> None:
    trip = voyage()
    trip.arm = True
    trip.sail(4.0)
    trip.connected = False
    trip.sail(6.0)
    assert trip.state() is LinkState.DOWN
    assert trip.session.diagnosis.cause is Cause.NOTHING_THERE
    assert trip.session.reason.startswith("nothing there: no byte for")
    assert not trip.session.armed, "what is not heard is not known to be armed"
    trip.bus.take()
    trip.connected = True
    before = len(trip.firmware.setpoints)
    trip.sail(0.5)
    assert len(trip.firmware.setpoints) - before >= 3
    trip.sail(2.0)
    assert trip.state() is LinkState.READY
    assert trip.session.losses == 1
    assert trip.said("connected, parameters left alone, for the vehicle is armed") or trip.said("set and verified")


def test_a_vehicle_that_failed_safe_is_armed_again_only_where_the_vehicle_file_allows_it() -> None:
    for rearm in (False, True):
        trip = voyage(rearm=rearm)
        trip.arm = True
        trip.sail(4.0)
        trip.firmware.failsafe = True
        trip.sail(2.0)
        assert trip.firmware.failsafe
        assert trip.said("the firmware ended the run")
        trip.sail(6.0)
        assert trip.firmware.failsafe is not rearm
    trip = voyage(rearm=False)
    trip.arm = True
    trip.sail(4.0)
    trip.firmware.failsafe = True
    trip.sail(6.0)
    trip.arm = False
    trip.sail(2.0)
    trip.arm = True
    trip.sail(3.0)
    assert trip.firmware.armed
    assert not trip.firmware.failsafe, "disarming and arming on purpose is always allowed"


def test_a_firmware_that_restarts_is_introduced_and_configured_anew() -> None:
    trip = voyage(rearm=True)
    trip.arm = True
    trip.sail(6.0)
    trip.firmware.restart(trip.now)
    trip.firmware.parameters["BOW_TRIM"] = 0.0
    trip.sail(8.0)
    assert trip.said("firmware restarted")
    assert trip.firmware.parameters["BOW_TRIM"] == -1.5
    assert trip.firmware.companion_hash == DIALECT_HASH
    assert trip.firmware.armed


@pytest.mark.parametrize("period", [1000, 200])
def test_with_flipped_bytes_nothing_wrong_is_believed_and_the_counters_tell(period: int) -> None:
    noise = random.Random(7)

    def flip(data: bytes) -> bytes:
        return bytes(octet ^ (1 << noise.randrange(8)) if noise.random() < 1 / period else octet for octet in data)

    trip = voyage()
    trip.garble = flip
    trip.arm = True
    trip.sail(60.0)
    assert trip.firmware.armed
    assert trip.firmware.setpoints
    for heading, depth, speed in trip.firmware.setpoints:
        assert (heading, depth, speed) == pytest.approx((0.5, 2.0, 0.4), abs=1e-6)
    assert trip.session.telemetry.attitude is not None
    assert trip.session.telemetry.attitude.yaw == pytest.approx(0.3)
    assert trip.session.telemetry.depth == pytest.approx(2.0)
    counters = trip.bus.counters
    assert counters.bad_frames > 0
    assert counters.bytes_lost > 0
    assert counters.sequence_gaps > 0
    assert trip.said("noise: ")
    assert trip.session.losses == 0, "noise alone does not take the link down"


def diagnose(reports: list[tuple[float, BusReport]]) -> LinkSession:
    session = LinkSession(1, {})
    for now, report in reports:
        session.step(now, [], LinkCommand(), report)
    return session


def garbage_reports(data: bytes) -> list[tuple[float, BusReport]]:
    bus, reports = PipeBus(), []
    for tick in range(40):
        bus.feed(data[tick * 100 : tick * 100 + 100], 0.0)
        assert bus.recv_all() == []
        reports.append((tick * 0.1, bus.report()))
    return reports


def test_causes_have_names() -> None:
    noise = random.Random(1)
    port = BusReport(BusState.DOWN, "/dev/ttyS1: cannot be opened: No such file or directory", Counters())
    assert diagnose([(0.1 * tick, port) for tick in range(5)]).reason == port.cause

    wrong_baud = diagnose(garbage_reports(noise.randbytes(4000)))
    assert wrong_baud.diagnosis.cause is Cause.WRONG_BAUD
    assert "check serial.baud" in wrong_baud.reason

    # Frames of the right form whose messages have other definitions: their CRC cannot be right here.
    frames = b"".join(
        bytes((0xFD, 28, 0, 0, n & 0xFF, 1, 1, 30, 0, 0)) + bytes(noise.randrange(200) for _ in range(30))
        for n in range(100)
    )
    assert diagnose(garbage_reports(frames)).diagnosis.cause is Cause.WRONG_DIALECT

    quiet = BusReport(BusState.OPEN, "", Counters())
    assert diagnose([(0.1 * tick, quiet) for tick in range(30)]).diagnosis.cause is Cause.NOTHING_THERE
    stalled = diagnose([(0.0, quiet), (0.1, quiet), (3.1, quiet)])
    assert stalled.diagnosis.cause is Cause.HOST_STALL
    assert "did not run for 3.0 s" in stalled.reason


def test_the_firmwares_clock_is_known_to_a_millisecond_in_spite_of_drift_and_late_answers() -> None:
    noise = random.Random(3)
    sync = TimeSync()
    for beat in range(120):
        sent = 0.5 * beat
        out, back = 0.004 + noise.random() * 0.003, 0.004 + noise.random() * 0.003
        if beat % 9 == 5:
            back += 0.3 + noise.random()  # the host was busy
        sync.add(sent, 1000.0 + 1.0004 * (sent + out), sent + out + back)
    assert sync.rejected >= 12
    assert sync.ours(1000.0 + 1.0004 * 60.0) == pytest.approx(60.0, abs=1.5e-3)
    for beat in range(20):  # it restarts: a new line after a few exchanges
        sent = 61.0 + 0.5 * beat
        sync.add(sent, 5.0 + sent - 61.0, sent + 0.008)
    assert sync.restarts == 1
    assert sync.ours(5.0 + 9.0) == pytest.approx(70.0, abs=5e-3)


def frame_of(kind: int, payload: bytes) -> bytes:
    message_type = dialect.mavlink_map[kind]
    payload = payload[: message_type.unpacker.size] or b"\0"
    head = bytes((len(payload), 0, 0, 0, 1, FIRMWARE_COMPONENT)) + kind.to_bytes(3, "little")
    crc = protocol.crc16(head + payload + bytes([message_type.crc_extra]))
    return b"\xfd" + head + payload + crc.to_bytes(2, "little")


anything = st.floats(allow_nan=True, allow_infinity=True)


@given(
    steps=st.lists(
        st.tuples(
            st.floats(-1e6, 1e6),
            st.sampled_from(sorted(dialect.mavlink_map)),
            st.binary(max_size=300),
            st.tuples(anything, anything, anything),
            st.sampled_from([None, True, False]),
        ),
        max_size=12,
    )
)
def test_whatever_arrives_in_whatever_order_the_session_goes_on(
    steps: list[tuple[float, int, bytes, tuple[float, float, float], bool | None]],
) -> None:
    session, bus = LinkSession(1, {"DEPTH_MAX": 5.0}), PipeBus()
    for now, kind, payload, setpoint, arm in steps:
        bus.feed(frame_of(kind, payload), now)
        [message] = bus.recv_all()
        out = session.step(now, [message], LinkCommand(Setpoint(*setpoint), arm), bus.report())
        for sent in out.messages:
            assert bus.send(sent)
