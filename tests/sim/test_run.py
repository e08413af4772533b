"""Whole runs: firmware, companions and water together, in lockstep and as processes."""

from __future__ import annotations

import io
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader

import sim.run as lockstep
from companion.link import Telemetry
from companion.scene import Sighting
from protocol import decode, dialect, split_frames
from sim.cli import main
from sim.processes import run_processes
from sim.record import Recorder
from sim.run import Companion, run
from sim.scenario import Scenario, load_scenario

KEYS = {
    "scenario", "seed", "mcu", "vehicles", "success", "points_filled", "collisions", "min_separation_m",
    "mean_length_m", "sd_length_m", "forming_time_s", "tracking_rms_m", "realtime_factor", "firmware_flash_bytes",
    "firmware_ram_bytes",
}  # fmt: skip


def swim(out: Path, *arguments: str) -> dict[str, Any]:
    assert main(["run", *arguments, "--headless", "--out", str(out)]) == 0
    summary: dict[str, Any] = json.loads((out / "summary.json").read_text())
    assert summary.keys() >= KEYS
    assert summary["success"] is True
    return summary


def cut(scenario: Scenario, seconds: float) -> Scenario:
    return replace(scenario, config=replace(scenario.config, duration_s=seconds))


def test_the_demo_meets_its_criteria_and_leaves_everything_behind(tmp_path: Path) -> None:
    summary = swim(tmp_path, "demo", "--mcu", "native")
    assert summary["points_filled"] == summary["vehicles"] == 6
    assert summary["collisions"] == 0
    assert summary["min_separation_m"] >= 0.3
    assert summary["tracking_rms_m"] <= 0.5
    assert summary["mean_length_m"] > 40.0
    report = (tmp_path / "report.html").read_text()
    assert report.count("data:image/png;base64,") == 4
    assert "The run meets its criteria" in report
    assert len(report) < 1_000_000
    with (tmp_path / "run.mcap").open("rb") as stream:
        statistics = make_reader(stream).get_summary()
        assert statistics is not None
        topics = {channel.topic for channel in statistics.channels.values()}
        assert statistics.statistics is not None
        assert statistics.statistics.message_end_time == round(summary["duration_s"] * 1e9)
    assert topics >= {"/events", "/formation", "/scene", "/tf", *(f"/vehicle_{n}/pose" for n in range(1, 7))}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["calm", "noisy_line", "transform", "dive"])
def test_the_other_scenarios_meet_their_criteria(name: str, tmp_path: Path) -> None:
    swim(tmp_path, name, "--mcu", "native")


@pytest.mark.slow
@pytest.mark.avr
def test_the_demo_on_the_flashed_image(tmp_path: Path) -> None:
    summary = swim(tmp_path, "demo", "--mcu", "avr")
    assert 0 < summary["firmware_flash_bytes"] <= 48 * 1024
    assert 0 < summary["firmware_ram_bytes"] <= 4 * 1024


@pytest.mark.parametrize("make", ["native", pytest.param("avr", marks=pytest.mark.avr())])
def test_same_seed_same_bytes_for_any_number_of_threads(make: str, tmp_path: Path) -> None:
    recordings = {}
    for seed, threads in ((1, 1), (1, 2), (2, 2)):
        recording = tmp_path / f"{seed} {threads}.mcap"
        with recording.open("wb") as stream, Recorder(stream, "two", seed, make, 2) as recorder:
            run(cut(load_scenario("two", seed), 12.0), make, threads=threads, observers=[recorder])
        recordings[seed, threads] = recording.read_bytes()
    assert recordings[1, 1] == recordings[1, 2]
    assert recordings[1, 1] != recordings[2, 2]


def test_same_command_same_recording(tmp_path: Path) -> None:
    for folder in ("first", "second"):
        swim(tmp_path / folder, "two", "--mcu", "native")
    assert (tmp_path / "first/run.mcap").read_bytes() == (tmp_path / "second/run.mcap").read_bytes()


def test_criteria_that_do_not_hold_are_an_exit_status(tmp_path: Path) -> None:
    (tmp_path / "hard.toml").write_text(
        f'title = "x"\nmission = "{load_scenario("two").config.mission}"\nduration_s = 6.0\n[criteria]\nhold_s = 1.0\n'
    )
    out = tmp_path / "out"
    assert main(["run", str(tmp_path / "hard.toml"), "--mcu", "native", "--headless", "--out", str(out)]) == 1
    assert json.loads((out / "summary.json").read_text())["success"] is False
    assert "does not meet" in (out / "report.html").read_text()


class Overheard(Companion):
    """A companion whose setpoints, and the firmware's echoes of those that it took, are noted down."""

    fleet: list[Overheard]

    def __init__(self, scenario: Scenario, vehicle: int) -> None:
        super().__init__(scenario, vehicle)
        self.sent: list[tuple[float, ...]] = []
        self.echoes: list[tuple[float, ...]] = []
        self.fleet.append(self)

    def tick(self, now: float, received: bytes, sighting: Sighting) -> bytes:
        data = super().tick(now, received, sighting)
        for frame in split_frames(data)[0]:
            message: Any = decode(frame)
            if message.id == dialect.MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED:
                self.sent.append((message.z, message.vx, message.vy, message.yaw))
        telemetry: Telemetry = self.node.link.telemetry
        echo = telemetry.latest(dialect.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED)
        if echo is not None and echo.stamp == now:
            self.echoes.append((echo.fields.z, echo.fields.vx, echo.fields.vy, echo.fields.yaw))
        return data


@pytest.mark.parametrize(("byte_noise", "least_bad"), [(0.001, 20), (0.01, 400)])
def test_noise_on_the_line_costs_messages_and_never_brings_a_wrong_setpoint(
    byte_noise: float, least_bad: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    Overheard.fleet = []
    monkeypatch.setattr(lockstep, "Companion", Overheard)
    scenario = load_scenario("two")
    noisy = replace(scenario.config, line=replace(scenario.config.line, byte_noise=byte_noise))
    grade = run(replace(scenario, config=noisy), "native").grade(scenario)
    assert grade.points_filled == 2
    assert grade.collisions == 0
    assert grade.success or byte_noise > 0.001
    for companion in Overheard.fleet:
        sent = np.array(companion.sent)
        taken = np.array([echo for echo in companion.echoes if any(echo)])  # all zero until the first is taken
        assert len(taken) > 1.5 * scenario.end_s()  # of 5 a second, most frames lost at the worst
        nearest = np.abs(taken[:, None] - sent[None]).max(axis=2).min(axis=1)
        assert nearest.max() < 1e-4
        assert companion.bus.counters.bad_frames > least_bad
        assert companion.bus.counters.sequence_gaps > least_bad
        assert companion.node.link.telemetry.values["rx_bad"] > 0


def test_companions_as_processes_on_serial_ports(tmp_path: Path) -> None:
    scenario = cut(load_scenario("two"), 24.0)
    with Recorder(io.BytesIO(), "two", 1, "native", 2) as recorder:
        outcome = run_processes(scenario, "native", tmp_path / "processes", observers=[recorder])
    history = outcome.history
    log = [event.text for event in history.events]
    assert outcome.failures == {}, log
    assert [text for text in log if text == "armed"] == ["armed"] * 2
    assert sorted(history.decided[-1]) == [0, 1]
    assert (history.travelled[-1] > 2.0).all()
    assert np.abs(history.position[-1, :, 2] - 1.0).max() < 0.4
    assert history.position[-1, :, 0].min() > history.position[0, :, 0].max()
    assert (tmp_path / "processes/vehicle_2.log").read_text() == ""
    assert outcome.effort.wall_s > 23.0
