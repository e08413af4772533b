"""What a program on the simulated ATmega2560 sees of its hardware: the probe does, the test reads the answers."""

from __future__ import annotations

import struct
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from tests.sim.mcu.bench import START_MS, Bench, CrashError, G, MakeBench, words

DEPTH_W, DEPTH_R = 0x76 << 1, 0x76 << 1 | 1


def wake_imu(bench: Bench) -> None:
    bench.imu_write(0, 0x06, 0x01)
    bench.run(60)


def test_imu_answers_over_spi_at_the_programmed_clock(bench: Bench) -> None:
    assert bench.imu_read(0, 0x00) == b"\xea"
    assert bench.counters.spi_hz == 250_000
    bench.faults.imu_silent = 1
    assert bench.imu_read(0, 0x00, 4) == b"\xff" * 4


def test_imu_measures_level_flight_and_freezes_on_demand(bench: Bench) -> None:
    wake_imu(bench)
    assert words(bench.imu_read(0, 0x2D, 6)) == [0, 0, 16384]  # +1 g on the chip's Z, range 2 g
    bench.faults.imu_frozen = 1
    bench.readings.specific_force_mps2 = [G, 0, 0]
    bench.run(20)
    assert words(bench.imu_read(0, 0x2D, 6)) == [0, 0, 16384]
    bench.faults.imu_frozen = 0
    bench.run(20)
    assert words(bench.imu_read(0, 0x2D, 6)) == [16384, 0, 0] or words(bench.imu_read(0, 0x2D, 2))[0] > 16300


def test_depth_sensor_converses_over_i2c(bench: Bench) -> None:
    assert bench.ask("i", bytes([DEPTH_W, 0xA2]))[0] == 0x28
    status, high, low = bench.ask("i", bytes([DEPTH_R, 0, 0]))
    assert (status, high << 8 | low) == (0x58, 34982)
    assert bench.counters.i2c_hz == 200_000
    assert bench.ask("i", bytes([0x42, 0]))[0] == 0x20, "nobody at 0x21: no acknowledge"
    bench.faults.depth_silent = 1
    assert bench.ask("i", bytes([DEPTH_W, 0xA2]))[0] == 0x20


def test_conversion_takes_its_time_and_an_early_read_gives_zero(bench: Bench) -> None:
    bench.ask("i", bytes([DEPTH_W, 0x48]))
    bench.ask("i", bytes([DEPTH_W, 0x00]))
    assert bench.ask("i", bytes([DEPTH_R, 0, 0, 0]))[1:] == b"\0\0\0"
    bench.run(20)
    bench.ask("i", bytes([DEPTH_W, 0x48]))
    bench.run(10)
    bench.ask("i", bytes([DEPTH_W, 0x00]))
    d1 = int.from_bytes(bench.ask("i", bytes([DEPTH_R, 0, 0, 0]))[1:], "big")
    assert 2_000_000 < d1 < 6_000_000


@pytest.mark.parametrize("held", [1, 2])
def test_held_bus_stops_transfers_until_it_is_released(bench: Bench, held: int) -> None:
    bench.faults.i2c_held = held
    assert bench.ask("i", bytes([DEPTH_W, 0xA2]))[0] == 0xFF, "no start condition comes through"
    before, after = bench.ask("c", bytes(2))
    assert before == 0
    assert after == (held == 2), "nine clocks free a device that lost count, not a short circuit"
    bench.faults.i2c_held = 0
    assert bench.ask("i", bytes([DEPTH_W, 0xA2]))[0] == 0x28


def test_pulses_have_the_programmed_width_from_the_next_period_on(bench: Bench) -> None:
    assert bench.pulse(0) == 0
    bench.ask("P")
    widths = {0: 1500.0, 1: 1100.5, 2: 1900.0}
    for actuator, width in widths.items():
        bench.ask("p", struct.pack("<HB", round(2 * width) - 1, actuator))
    bench.run(45)
    assert {a: bench.pulse(a) for a in widths} == widths
    seen = set()
    for width in (1900, 1100, 1000, 2000, 1500, 1100) * 4:
        bench.write(b"p\x03" + struct.pack("<HB", 2 * width - 1, 0))
        for _ in range(23):
            bench.run(1)
            seen.add(bench.pulse(0))
    assert seen == {1500.0, 1900.0, 1100.0, 1000.0, 2000.0}, "a lowered compare register never stretches a pulse"
    bench.write(b"W\0")
    bench.run(200)
    assert bench.pulse(0) == 0, "pulses end with a reset"


def test_a_pin_taken_from_its_timer_cuts_the_pulse(bench: Bench) -> None:
    bench.ask("P")
    bench.ask("p", struct.pack("<HB", 2 * 1500 - 1, 0))
    bench.run(45)
    bench.ask("q", b"\x07")
    assert bench.pulse(0) == pytest.approx(700, abs=5)
    bench.run(60)
    assert bench.pulse(0) == 0


def test_line_has_the_true_baud_in_both_directions(make_bench: MakeBench) -> None:
    bench = make_bench(slice_us=10)
    bench.run(START_MS)
    start = bench.now_us
    bench.write(b"s\x28" + bytes(40))
    while len(bench.received) < 42:
        bench.run(0.01)
    # 42 bytes in at 115200, 40 through SPI at 250 kbit/s, 42 out at 117647
    expected = 42 * 10 / 0.1152 + 40 * 32 + 42 * 10 / 0.117647
    assert bench.now_us - start == pytest.approx(expected, rel=0.02)


def test_unread_bytes_overrun_the_receiver_after_three(bench: Bench) -> None:
    bench.ask("o", b"\x05")
    bench.write(b"\0\0" * 20)
    bench.run(10)
    lost = bench.counters.rx_overruns
    assert 37 - 2 <= lost <= 40 - 3
    if lost % 2:
        bench.write(b"\0")
    bench.run(2)
    overrun_seen, _ = bench.ask("O", bytes(2))
    assert overrun_seen == 1


def test_wrong_baud_lets_no_request_through(make_bench: MakeBench) -> None:
    bench = make_bench(baud=57600)
    bench.run(START_MS)
    bench.write(b"l\0" * 10)
    bench.run(50)
    assert b"l\1\1" not in bench.received


def test_noise_flips_the_asked_share_of_bytes(bench: Bench) -> None:
    bench.faults.companion_bit_noise = 0.1
    for _ in range(40):
        bench.write(bytes(100))
        bench.run(9)
    assert 300 < bench.counters.rx_corrupted < 500
    bench.faults.companion_bit_noise = 0
    bench.faults.companion_cut = 1
    bench.run(20)
    bench.received.clear()
    bench.write(bytes(10))
    bench.run(20)
    assert not bench.received


def test_eeprom_write_takes_its_time_and_survives_power(make_bench: MakeBench) -> None:
    bench = make_bench(eeprom=bytes(range(256)) * 16)
    bench.run(START_MS)
    assert bench.ask("E", struct.pack("<H", 777)) == bytes([777 % 256])
    tenths = bench.ask("e", struct.pack("<HB", 777, 0x5A))[0]
    assert 33 <= tenths <= 35
    bench.power_cycle()
    bench.run(START_MS)
    assert bench.ask("E", struct.pack("<H", 777)) == b"\x5a"
    assert bench.eeprom() == bytes(range(256)) * 3 + bytes([*range(9), 0x5A, *range(10, 256)]) + bytes(range(256)) * 12


def test_power_cut_in_a_write_harms_that_byte_alone(make_bench: MakeBench) -> None:
    outcomes = set()
    for seed in range(12):
        bench = make_bench(seed=seed, eeprom=bytes(4096))
        bench.run(START_MS)
        bench.write(b"e\x03" + struct.pack("<HB", 9, 0x5A))
        bench.run(0.3 + 0.35 * seed)
        bench.power_cycle()
        contents = bench.eeprom()
        assert contents[:9] + contents[10:] == bytes(4095)
        outcomes.add(contents[9])
    assert {0x00, 0x5A} < outcomes
    assert len(outcomes) > 4


def test_watchdog_restarts_the_program_and_keeps_its_memory(bench: Bench) -> None:
    _, flags, _ = bench.ask("m", bytes([0x77, 0, 0]))
    assert flags & 0x01, "power-on"
    bench.write(b"W\x00")
    bench.run(125)
    assert bench.counters.resets == 0
    bench.run(25)
    assert bench.counters.resets == 1
    bench.run(START_MS)
    _, flags, survivor = bench.ask("m", bytes(3))
    assert flags & 0x08, "watchdog"
    assert survivor == 0x77
    bench.power_cycle()
    bench.run(START_MS)
    _, flags, survivor = bench.ask("m", bytes(3))
    assert flags & 0x01
    assert survivor != 0, "power loss leaves noise in memory"


@pytest.mark.parametrize(
    ("letter", "text"),
    [
        ("X", "ran out of program or into an invalid opcode"),
        ("Z", "firmware slept with interrupts off at main"),
        ("D", "firmware slept deeper than idle, which stops the timers at main"),
    ],
)
def test_crash_names_cause_and_place(bench: Bench, letter: str, text: str) -> None:
    bench.write(letter.encode() + b"\0")
    with pytest.raises(CrashError, match=text):
        bench.run(100)
    bench.power_cycle()
    bench.run(START_MS)
    assert bench.ask("l") == b"\x01"


def test_battery_and_leak_reach_the_pins(bench: Bench) -> None:
    (volts,) = struct.unpack("<H", bench.ask("A", b"\0"))
    (amperes,) = struct.unpack("<H", bench.ask("A", b"\1"))
    assert volts * 5 / 1023 * 3 == pytest.approx(11.1, abs=0.02)
    assert amperes * 5 / 1023 * 10 == pytest.approx(2.0, abs=0.05)
    assert bench.ask("l") == b"\x01"
    bench.readings.leak = 1
    assert bench.ask("l") == b"\x00"


def test_sleep_is_counted(bench: Bench) -> None:
    asleep, cycles = bench.counters.cycles_asleep, bench.counters.cycles
    bench.run(10)
    assert bench.counters.cycles == cycles + 160_000
    assert bench.counters.cycles_asleep - asleep > 159_900
    bench.write(b"b\x01\x08")
    bench.run(10)
    assert 28_000 < bench.counters.cycles_asleep - asleep - 160_000 < 32_000


def script(bench: Bench, slice_us: int) -> tuple[bytes, int, int, bytes]:
    """A lively minute on the bench, cut into slices of some length: everything it left behind."""
    bench.slice_us = slice_us
    bench.faults.companion_bit_noise = 0.003
    requests = [
        b"P\0",
        b"s\x03\x80\0\0",
        b"p\x03\x37\x0b\x00",
        b"i\x02\xec\xa2",
        b"e\x03\x05\0\x42",
        b"A\x01\0",
        b"b\x01\x03",
    ]
    log = b""
    for turn in range(12):
        for n, request in enumerate(requests):
            bench.write(request, at_us=turn * 100_000 + n * 7_001 + 70_000)
    for _ in range(120):
        bench.readings.battery_v = 10 + bench.now_us % 7
        bench.run(10)
        log += bench.received + struct.pack("<3d", *(bench.pulse(a) for a in range(3)))
        bench.received.clear()
    counters = bench.counters
    return log, counters.cycles, counters.cycles_asleep, bench.eeprom()


def test_same_seed_same_bytes_whatever_the_slices_and_threads(make_bench: MakeBench) -> None:
    whole = script(make_bench(seed=5), 10_000)
    assert script(make_bench(seed=5), 10_000) == whole
    assert script(make_bench(seed=5), 137) == whole
    assert script(make_bench(seed=6), 10_000) != whole
    with ThreadPoolExecutor(2) as pool:
        assert list(pool.map(lambda b: script(b, 2_000), [make_bench(seed=5) for _ in range(4)])) == [whole] * 4


@pytest.mark.parametrize(
    ("content", "text"),
    [(None, "No such file"), (b"nothing", "not an ELF image"), (b"\x7fELF" + bytes(100), "not an ELF image for AVR")],
)
def test_bad_image_is_refused_with_its_name(
    make_bench: MakeBench, tmp_path: Path, content: bytes | None, text: str
) -> None:
    image = tmp_path / "image.elf"
    if content is not None:
        image.write_bytes(content)
    with pytest.raises(ValueError, match=f"image.elf.*{text}"):
        make_bench(image=image)


def test_truncated_image_is_refused(make_bench: MakeBench, probe: Path, tmp_path: Path) -> None:
    image = tmp_path / "cut.elf"
    image.write_bytes(probe.read_bytes()[:700])
    with pytest.raises(ValueError, match=r"cut.elf: (truncated|damaged|not an ELF)"):
        make_bench(image=image)
