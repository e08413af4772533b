"""Scenario files: those that come with the simulator are good, and a bad one is refused before anything starts."""

from pathlib import Path

import numpy as np
import pytest

from sim.cli import main
from sim.scenario import SCENARIOS, load_scenario, names

SCENARIO = """title = "x"
mission = "mission.toml"
duration_s = 60.0
"""
MISSION = """vehicles = 3
[formation]
shape = "triangle"
"""


@pytest.mark.parametrize("name", names())
def test_the_scenarios_that_come_along_are_good(name: str) -> None:
    scenario = load_scenario(name)
    distance = np.linalg.norm(scenario.starts[:, None, :2] - scenario.starts[None, :, :2], axis=2)
    distance[np.diag_indices(len(distance))] = np.inf
    assert distance.min() >= scenario.config.starts.least_distance_m
    assert scenario.config.criteria.tracking_rms_m is not None
    assert scenario.end_s() > scenario.mission.schedule.start_s + scenario.mission.schedule.forming_s + 10.0


def test_starts_come_from_the_seed() -> None:
    assert load_scenario("demo").starts.tobytes() == load_scenario("demo", seed=1).starts.tobytes()
    assert load_scenario("demo", seed=2).starts.tobytes() != load_scenario("demo", seed=1).starts.tobytes()


@pytest.mark.parametrize(
    ("scenario", "mission", "complaint"),
    [
        (SCENARIO + "wind_mps = 3.0\n", MISSION, "wind_mps = 3: unknown key"),
        (SCENARIO + "[water]\nnorth_mps = 'fast'\n", MISSION, '[water] north_mps = "fast": must be a number'),
        (SCENARIO + "[water]\nnorth_mps = 7.0\n", MISSION, "north_mps = 7: must be from -1 to 1 m/s"),
        (SCENARIO + "[line]\nbyte_noise = 2.0\n", MISSION, "byte_noise = 2: must be from 0 to 0.5"),
        (SCENARIO + "[criteria]\nhold_s = 60.0\n", MISSION, "hold_s = 60: must be under duration_s"),
        (SCENARIO + "[criteria]\npoints_filled = 4\n", MISSION, "points_filled = 4: must be at most the number"),
        (SCENARIO + "[starts]\nbox_m = [3.0, 3.0]\n", MISSION, "box_m = [3.0, 3.0]: must hold 3 starts"),
        (
            SCENARIO,
            "vehicles = 2\n[formation]\nshape = 'triangle'\npoint_count = 3\n",
            "vehicles = 2: must be at least",
        ),
        (SCENARIO, MISSION + "spacing_m = 'wide'\n", 'spacing_m = "wide": must be a number'),
        (SCENARIO, MISSION + "spacing = 5.0\n", "spacing = 5: unknown key"),
        (SCENARIO, "vehicles = 0\n", "vehicles = 0: must be from 1 to 250"),
        ("title = ", MISSION, "must be TOML"),
        (SCENARIO.replace("mission.toml", "gone.toml"), MISSION, "gone.toml: cannot be read"),
    ],
)
def test_bad_files_are_refused_and_nothing_starts(
    scenario: str,
    mission: str,
    complaint: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr("sim.cli.run", lambda *_, **__: pytest.fail("a run was started"))
    monkeypatch.setattr("sim.cli.LivePage", lambda *_: pytest.fail("a page was served"))
    (tmp_path / "mission.toml").write_text(mission)
    (tmp_path / "bad.toml").write_text(scenario)
    out = tmp_path / "out"
    assert main(["run", str(tmp_path / "bad.toml"), "--out", str(out)]) == 2
    error = capsys.readouterr().err
    assert complaint in error
    assert error.startswith(f"shoal-sim: {tmp_path}")
    assert not out.exists()


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["run", "nowhere"], "nowhere: no such scenario, must be a file or one of calm, demo"),
        (["run", "demo", "--seed", "-1"], "--seed -1: must be from 0"),
        (["run", "demo", "--threads", "0"], "--threads 0: must be from 1 to 64"),
        (["run", "demo", "--port", "70000"], "--port 70000: must be from 0 to 65535"),
    ],
)
def test_bad_arguments_are_refused(arguments: list[str], complaint: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(arguments) == 2
    assert complaint in capsys.readouterr().err


def test_list_names_every_scenario(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["list"]) == 0
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines()] == names()
    assert len(names()) == len(list(SCENARIOS.glob("*.toml")))
