"""Both makes run the vehicle's firmware, and what it tells its companion is the same."""

from __future__ import annotations

from collections import Counter
from math import cos, radians, sin
from pathlib import Path
from typing import Any

import pytest

from protocol.frames import Message, decode, encode, header, split_frames
from protocol.generated import dialect
from sim.plant.library import ROOT
from tests.sim.mcu.bench import Bench, G, Library, MakeBench

MakeVehicle = MakeBench
IMAGE = ROOT / "build" / "firmware" / "firmware.elf"
ROLL = radians(10)


@pytest.fixture
def make_vehicle(make_any: MakeBench, request: pytest.FixtureRequest) -> MakeVehicle:
    """Makes microcontrollers of a make with the vehicle's own firmware, lying still and rolled by 10 degrees."""

    def make(name: str, **kwargs: object) -> Bench:
        library: Library = request.getfixturevalue(name)
        if name == "avr" and not Path(IMAGE).exists():
            pytest.skip("no firmware image: run `make firmware`")
        bench = make_any(library, IMAGE, slice_us=2000, **kwargs)
        bench.readings.specific_force_mps2 = [0.0, -G * sin(ROLL), -G * cos(ROLL)]
        return bench

    return make


def heard(bench: Bench, seconds: float) -> list[Message]:
    """The messages of the next seconds; gyroscope, field and pressure carry some noise, as real ones do."""
    data = b""
    for step in range(round(seconds * 50)):
        bench.readings.rate_rps = [0.0005 * (step % 3 - 1), 0.0005 * (step % 5 - 2), 0.0]
        bench.readings.field_ut = [20.0 + 0.2 * (step % 3), 1.0 - 0.2 * (step % 2), 43.0]
        bench.readings.pressure_pa = 121325 + 10 * (step % 2)
        bench.received.clear()
        bench.run(20)
        data += bench.received
    frames, _, _ = split_frames(data)
    return [decode(frame) for frame in frames]


def last(messages: list[Message], kind: str) -> Any:
    """The newest message of a kind, with the fields of its class."""
    return [m for m in messages if m.get_type() == kind][-1]


def test_both_makes_measure_and_report_alike(make_vehicle: MakeVehicle) -> None:
    counts = {}
    for name in ("avr", "native"):
        bench = make_vehicle(name)
        heard(bench, 4)
        messages = heard(bench, 5)
        counts[name] = Counter(m.get_type() for m in messages)
        assert last(messages, "ATTITUDE").roll == pytest.approx(ROLL, abs=0.01), name
        assert last(messages, "SCALED_PRESSURE2").press_abs == pytest.approx(1213.3, abs=0.3), name
        imu = last(messages, "SCALED_IMU2")
        assert (imu.xacc, imu.yacc, imu.zacc) == pytest.approx((0, -174, -985), abs=2), name
        assert (imu.xmag, imu.ymag, imu.zmag) == pytest.approx((202, 9, 430), abs=4), name
        assert last(messages, "SYS_STATUS").voltage_battery == pytest.approx(11100, abs=60), name
        assert {bench.pulse(a) for a in range(3)} == {1500.0}, name
        assert bench.counters.resets == 0
    assert counts["avr"].keys() == counts["native"].keys()
    for kind, count in counts["avr"].items():
        assert counts["native"][kind] == pytest.approx(count, abs=2), kind


FAULTS = ("imu_silent", "imu_frozen", "depth_silent", "i2c_held")


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_reads_the_same_on_both_makes(make_vehicle: MakeVehicle, fault: str) -> None:
    said = {}
    for name in ("avr", "native"):
        bench = make_vehicle(name)
        heard(bench, 4)
        healthy = last(heard(bench, 1), "SYS_STATUS").onboard_control_sensors_health
        setattr(bench.faults, fault, 1)
        broken = last(heard(bench, 3), "SYS_STATUS").onboard_control_sensors_health
        setattr(bench.faults, fault, 0)
        again = last(heard(bench, 4), "SYS_STATUS").onboard_control_sensors_health
        assert broken != healthy, name
        assert again == healthy, name
        said[name] = healthy & ~broken
    assert said["avr"] == said["native"]


@pytest.mark.parametrize("name", ["avr", "native"])
def test_a_parameter_survives_power(make_vehicle: MakeVehicle, name: str) -> None:
    bench = make_vehicle(name)
    heard(bench, 1)
    request = dialect.MAVLink_param_set_message(1, 1, b"SYS_ID", 7.0, dialect.MAV_PARAM_TYPE_REAL32)
    bench.write(encode(request, system=1, component=191, sequence=0))
    assert last(heard(bench, 3), "PARAM_VALUE").param_value == 7
    bench.power_cycle()
    bench.received.clear()
    bench.run(2000)
    frames, _, _ = split_frames(bytes(bench.received))
    assert {header(frame).system for frame in frames} == {7}
    assert bench.counters.resets == 1


@pytest.mark.parametrize("name", ["avr", "native"])
def test_a_cut_line_is_silent_and_comes_back(make_vehicle: MakeVehicle, name: str) -> None:
    bench = make_vehicle(name)
    heard(bench, 1)
    bench.faults.companion_cut = 1
    bench.run(40)
    assert not heard(bench, 1)
    bench.faults.companion_cut = 0
    assert len(heard(bench, 1)) > 20


def night(bench: Bench, slice_us: int) -> tuple[bytes, float, int]:
    """Ten seconds in all weathers: what the vehicle said, its last pulse, and the noise on its line."""
    bench.slice_us = slice_us
    bench.faults.companion_bit_noise = 0.01
    data = b""
    for second in range(10):
        bench.faults.imu_silent = second == 3
        bench.faults.depth_silent = second == 5
        bench.readings.rate_rps = [0.01 * second, 0.0, 0.0]
        request = dialect.MAVLink_param_request_read_message(1, 1, b"SYS_ID", -1)
        bench.write(encode(request, system=1, component=191, sequence=second), at_us=bench.now_us + 123_456)
        bench.received.clear()
        bench.run(1000)
        data += bench.received
    return data, bench.pulse(0), bench.counters.rx_corrupted + bench.counters.tx_corrupted


@pytest.mark.parametrize("name", ["avr", "native"])
def test_same_seed_same_bytes_whatever_the_slices(make_vehicle: MakeVehicle, name: str) -> None:
    whole = night(make_vehicle(name, seed=3), 100_000)
    assert whole[2] > 50
    assert night(make_vehicle(name, seed=3), 1_370) == whole
    assert night(make_vehicle(name, seed=4), 100_000) != whole
