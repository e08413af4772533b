"""Hulls that change shape: three vehicles pass a narrow place one behind the other."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from companion.scene import Phase
from sim.cli import main
from sim.run import run
from sim.scenario import load_scenario

MISSION = """vehicles = 3
[formation]
spacing_m = 4.0
[path]
waypoints_m = [[50.0, 0.0]]
pace_mps = 0.4
[[transform]]
shape = "column"
at_m = 2.0
[schedule]
start_s = 2.0
forming_s = 40.0
"""
SCENARIO = (
    'title = "x"\nmission = "mission.toml"\nduration_s = 170.0\n[criteria]\ntracking_rms_m = 0.3\nsettling_s = 20.0\n'
)


def test_hulls_become_a_column_as_they_travel(tmp_path: Path) -> None:
    (tmp_path / "mission.toml").write_text(MISSION)
    (tmp_path / "narrow.toml").write_text(SCENARIO)
    scenario = load_scenario(str(tmp_path / "narrow.toml"))
    outcome = run(scenario, "native")
    grade, history = outcome.grade(scenario), outcome.history
    assert grade.success, grade.verdicts
    travel = np.flatnonzero(history.during(Phase.TRAVEL))
    width = np.ptp(history.position[:, :, 1], axis=1)
    assert width[travel[100]] > 2.0, "abreast at first"
    assert width[travel[-1]] < 0.5, "one behind the other at the end"
    held = history.decided[travel[200:]]
    assert (held == held[0]).all(), "each keeps the point that it has, and the points change places"


def test_a_run_says_what_to_think_about_before_it_starts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sim.cli._swim", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
    (tmp_path / "mission.toml").write_text(MISSION + "[limits]\nsafe_length_m = 60.0\n")
    (tmp_path / "far.toml").write_text(SCENARIO)
    assert main(["run", str(tmp_path / "far.toml"), "--headless", "--out", str(tmp_path / "out")]) == 130
    warning = (
        f"shoal-sim: warning: {tmp_path}/mission.toml: [limits] safe_length_m = 60: vehicles may have to travel 78 m"
    )
    assert capsys.readouterr().err.startswith(warning)
