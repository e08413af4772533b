"""The chips alone, at their registers: scale factors, filters, compensation, and the line."""

from __future__ import annotations

import math
import struct
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.sim.mcu.bench import SHARED, G, Library, set_readings, words

DEG = math.pi / 180
WHO_AM_I, USER_CTRL, PWR_MGMT_1, MST_STATUS, ACCEL, GYRO, TEMP, EXT = 0x00, 0x03, 0x06, 0x17, 0x2D, 0x33, 0x39, 0x3B
SLV0, SLV4 = 0x03, 0x13
COMPASS = 0x0C


class Imu:
    """The ICM-20948 with its select line in the test's hand."""

    def __init__(self, library: Library) -> None:
        self.c, self.now_ms = library.c, 0.0
        self.chip, self.readings = library.ffi.new("icm20948 *"), library.ffi.new("mcu_readings *")
        set_readings(self.readings, SHARED)
        self.c.icm20948_power_on(self.chip, 0)

    def run(self, milliseconds: float) -> None:
        self.now_ms += milliseconds
        self.c.icm20948_run_until(self.chip, self.readings, self.now_ns)

    @property
    def now_ns(self) -> int:
        return round(self.now_ms * 1e6)

    def transfer(self, out: bytes) -> bytes:
        self.c.icm20948_select(self.chip, True)
        back = bytes(self.c.icm20948_exchange(self.chip, byte, self.now_ns) for byte in out)
        self.c.icm20948_select(self.chip, False)
        return back[1:]

    def write(self, bank: int, register: int, *values: int) -> None:
        self.transfer(bytes([0x7F, bank << 4]))
        self.transfer(bytes([register, *values]))

    def read(self, bank: int, register: int, count: int = 1) -> bytes:
        self.transfer(bytes([0x7F, bank << 4]))
        return self.transfer(bytes([0x80 | register]) + bytes(count))

    def wake(self) -> None:
        self.run(20)
        self.write(0, PWR_MGMT_1, 0x01)
        self.run(100)


@pytest.fixture
def imu(native: Library) -> Imu:
    return Imu(native)


def test_imu_wakes_as_the_datasheet_says(imu: Imu) -> None:
    assert imu.read(0, WHO_AM_I) == b"\0", "registers do not answer yet"
    imu.run(12)
    assert imu.read(0, WHO_AM_I) == b"\xea"
    assert imu.read(0, PWR_MGMT_1) == b"\x41", "asleep"
    imu.run(100)
    assert imu.read(0, ACCEL, 14) == bytes(14)
    imu.write(0, PWR_MGMT_1, 0x01)
    imu.run(25)
    assert words(imu.read(0, ACCEL, 6))[2] != 0, "accelerometer up after 20 ms"
    assert words(imu.read(0, TEMP, 2)) == [round((25 - 21) * 333.87)]
    imu.write(2, 0x01, 0x3F)
    imu.write(0, PWR_MGMT_1, 0x80)
    imu.run(12)
    assert imu.read(2, 0x01) == b"\x01", "reset restores defaults"
    assert imu.read(0, PWR_MGMT_1) == b"\x41"


@pytest.mark.parametrize("fs", range(4))
def test_imu_scales_and_saturates_by_range(imu: Imu, fs: int) -> None:
    imu.wake()
    imu.write(2, 0x14, fs << 1 | 1)
    imu.write(2, 0x01, fs << 1 | 1)
    imu.readings.specific_force_mps2 = [0.5 * G, -1.5 * G, 100 * G]
    imu.readings.rate_rps = [100 * DEG, -200 * DEG, 5000 * DEG]
    imu.run(100)
    per_g, per_dps = 16384 >> fs, (131, 65.5, 32.8, 16.4)[fs]
    assert words(imu.read(0, ACCEL, 6)) == pytest.approx([0.5 * per_g, 1.5 * per_g, -32768], abs=1), "x, -y, -z"
    assert words(imu.read(0, GYRO, 6)) == pytest.approx([100 * per_dps, 200 * per_dps, -32768], abs=1)


def test_imu_samples_at_the_programmed_rate(imu: Imu) -> None:
    imu.wake()
    imu.write(2, 0x00, 10)  # 1125 / 11 = 102.3 Hz
    imu.write(2, 0x01, 0x00)  # no filter
    changes, last = 0, b""
    for step in range(1000):
        imu.readings.rate_rps = [step * 0.001, 0, 0]
        imu.run(1)
        now = imu.read(0, GYRO, 2)
        changes, last = changes + (now != last), now
    assert changes == pytest.approx(102.3, abs=2)


@pytest.mark.parametrize(("config", "bandwidth"), [(3, 51.2), (5, 11.6)])
def test_filter_delays_a_step_by_its_bandwidth(imu: Imu, config: int, bandwidth: float) -> None:
    imu.wake()
    imu.write(2, 0x01, config << 3 | 1)
    imu.run(200)
    imu.readings.rate_rps = [1.0, 0, 0]
    waited = 0.0
    while words(imu.read(0, GYRO, 2))[0] < (1 - math.exp(-1)) / DEG * 131:
        imu.run(0.5)
        waited += 0.5
    assert waited == pytest.approx(1000 / (2 * math.pi * bandwidth), abs=1.5)


def read_compass(imu: Imu) -> tuple[int, tuple[int, ...], int]:
    """ST1, the three axes, ST2 as slave 0 put them into the external sensor data."""
    data = imu.read(0, EXT, 9)
    return data[0], struct.unpack("<3h", data[1:7]), data[8]


def test_compass_behind_the_i2c_master(imu: Imu) -> None:
    imu.wake()
    imu.write(0, USER_CTRL, 0x20)
    imu.write(3, SLV4, 0x80 | COMPASS, 0x01, 0x80)
    imu.run(2)
    assert imu.read(0, MST_STATUS)[0] & 0x40, "slave 4 done"
    assert imu.read(3, SLV4 + 4) == b"\x09", "WIA2"
    imu.write(3, SLV0, COMPASS, 0x31, 0x81, 0x08)  # continuous at 100 Hz
    imu.run(3)
    imu.write(3, SLV0, 0x80 | COMPASS, 0x10, 0x80 | 9)
    imu.run(30)
    _, field, end = read_compass(imu)
    assert field == (round(20 / 0.15), round(1 / 0.15), round(43 / 0.15))
    assert end == 0
    imu.readings.field_ut = [4000, 1000, 0]
    imu.run(30)
    _, field, end = read_compass(imu)
    assert end == 0x08, "overflow"
    imu.readings.field_ut = [6000, -6000, 0]
    imu.run(30)
    assert read_compass(imu)[1] == (32752, -32752, 0)
    imu.write(3, SLV4, 0x21, 0x00, 0x80)
    imu.run(2)
    assert imu.read(0, MST_STATUS)[0] == 0x50, "slave 4 done, not acknowledged"


def test_compass_stands_still_until_its_last_register_is_read(imu: Imu) -> None:
    imu.wake()
    imu.write(0, USER_CTRL, 0x20)
    imu.write(3, SLV0, COMPASS, 0x31, 0x81, 0x08)
    imu.run(12)
    imu.write(3, SLV0, 0x80 | COMPASS, 0x11, 0x80 | 6)
    imu.run(30)
    imu.readings.field_ut = [-20, 0, 0]
    imu.run(30)
    assert struct.unpack("<h", imu.read(0, EXT, 2)) == (round(20 / 0.15),)
    imu.write(3, SLV0, 0x80 | COMPASS, 0x11, 0x80 | 8)
    imu.run(30)
    assert struct.unpack("<h", imu.read(0, EXT, 2)) == (round(-20 / 0.15),)


def compensate(prom: Any, d1: int, d2: int) -> tuple[int, int]:
    """Pressure in 10 Pa and temperature in 0.01 degrees by the datasheet's integer flow chart, second order."""
    dt = d2 - prom[5] * 256
    temp = 2000 + dt * prom[6] // 2**23
    off = prom[2] * 2**16 + prom[4] * dt // 2**7
    sens = prom[1] * 2**15 + prom[3] * dt // 2**8
    if temp < 2000:
        ti, off_i, sens_i = 3 * dt**2 // 2**33, 3 * (temp - 2000) ** 2 // 2, 5 * (temp - 2000) ** 2 // 2**3
        if temp < -1500:
            off_i, sens_i = off_i + 7 * (temp + 1500) ** 2, sens_i + 4 * (temp + 1500) ** 2
    else:
        ti, off_i, sens_i = 2 * dt**2 // 2**37, (temp - 2000) ** 2 // 2**4, 0
    return (d1 * (sens - sens_i) // 2**21 - (off - off_i)) // 2**13, temp - ti


@pytest.fixture(scope="module")
def depth(native: Library) -> Any:
    chip = native.ffi.new("ms5837 *")
    native.c.ms5837_power_on(chip, 0)
    return chip


def test_depth_sensor_prom_passes_its_own_check(native: Library, depth: Any) -> None:
    assert native.c.ms5837_crc4(depth.prom) == depth.prom[0] >> 12
    assert (depth.prom[0] >> 5) & 0x7F == 0x1A, "MS5837-30BA26"
    example = native.ffi.new("uint16_t[7]", [0x0000, 34982, 36352, 20328, 22354, 26646, 26146])
    checks = set()
    for bit in range(16):
        example[3] ^= 1 << bit
        checks.add(native.c.ms5837_crc4(example))
        example[3] ^= 1 << bit
    assert native.c.ms5837_crc4(example) not in checks, "every single-bit error shows"


def test_depth_sensor_example_of_the_datasheet(depth: Any) -> None:
    assert compensate([0, 34982, 36352, 20328, 22354, 26646, 26146], 4958179, 6815414)[0] // 10 == 3999
    assert depth.prom[1] == 34982


@given(pressure=st.floats(50e3, 3e6), temperature=st.floats(-19, 84))
@settings(max_examples=200, deadline=None)
def test_depth_sensor_gives_back_the_pressure(native: Library, depth: Any, pressure: float, temperature: float) -> None:
    d1, d2 = native.ffi.new("uint32_t *"), native.ffi.new("uint32_t *")
    native.c.ms5837_raw(depth, pressure, temperature, d1, d2)
    back, centidegrees = compensate(depth.prom, d1[0], d2[0])
    assert back * 10 == pytest.approx(pressure, abs=25), "resolution: 10 Pa, and rounding of the integer steps"
    assert centidegrees == pytest.approx(temperature * 100, abs=1.5)


@pytest.mark.parametrize(("code", "longest_ms"), [(0x40, 0.60), (0x48, 9.04), (0x4A, 18.08)])
def test_conversion_ends_after_its_longest_time(native: Library, code: int, longest_ms: float) -> None:
    c, chip, readings = native.c, native.ffi.new("ms5837 *"), native.ffi.new("mcu_readings *")
    set_readings(readings, SHARED)
    c.ms5837_power_on(chip, 0)
    assert not c.ms5837_start(chip, 2_000_000), "still reloading its PROM"
    start = 10_000_000
    assert c.ms5837_start(chip, start)

    def convert_and_read(after_ms: float, from_ns: int) -> int:
        now = from_ns + round(after_ms * 1e6)
        c.ms5837_write(chip, code, from_ns)
        c.ms5837_run_until(chip, readings, now)
        c.ms5837_write(chip, 0x00, now)
        return int.from_bytes(bytes(c.ms5837_read(chip) for _ in range(3)), "big")

    assert convert_and_read(longest_ms - 0.01, start) == 0
    c.ms5837_run_until(chip, readings, start + 10**9)
    right = convert_and_read(longest_ms + 0.01, start + 2 * 10**9)
    assert right > 0
    c.ms5837_write(chip, 0x00, start + 3 * 10**9)
    assert c.ms5837_read(chip) == 0, "a second read gives nothing"


@given(value=st.integers(0, 255), off=st.floats(-0.045, 0.045))
@settings(max_examples=100, deadline=None)
def test_receiver_tolerates_a_small_difference_of_baud(native: Library, value: int, off: float) -> None:
    error = native.ffi.new("bool *")
    assert native.c.line_sample(value, 8680.0, 8680.0 * (1 + off), error) == value
    assert not error[0]


def test_receiver_far_off_reads_garbage(native: Library) -> None:
    error = native.ffi.new("bool *")
    assert native.c.line_sample(0x55, 8680.0, 8680.0 * 1.12, error) != 0x55
    native.c.line_sample(0x00, 17361.0, 8680.0, error)
    assert error[0], "no stop bit where it looks for one"
