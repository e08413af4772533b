"""The report on the paper: does it write what it promises, and do its experiments show what its page says?"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from companion.formation import VirtualFormation
from sim.cli import main
from sim.paper import experiments, printed
from sim.paper.trace import by_steps
from sim.points import Swarm


def test_the_quick_report_writes_what_it_promises(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "paper"
    status = main(
        ["report", "paper", "--seeds", "2", "--quick", "--jobs", "1", "--out", str(out), "--log", str(tmp_path / "log")]
    )
    assert status == 0
    page = (out / "README.md").read_text()
    for heading in ("Fig. 4", "Fig. 5", "Fig. 6", "Fig. 8", "Table I:", "Table II:", "Forms", "potential", "published"):
        assert re.search(f"^## .*{heading}", page, re.MULTILINE), heading
    assert "shoal-sim report paper --seeds 2 --quick" in page
    assert "**printed** | 1 | 64.32 | 4.19 | 63.87 | 3.71" in page
    assert "nan" not in page
    pictures = re.findall(r"!\[[^\]]+\]\((\w+\.svg)\)", page)
    assert len(pictures) == 5
    for name in pictures:
        data = (out / name).read_bytes()
        assert b"</svg>" in data
        assert len(data) < 150_000, name
    assert "done after" in capsys.readouterr().err, "progress is shown"


def test_a_report_without_seeds_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["report", "paper", "--seeds", "0"]) == 2
    assert "--seeds 0: must be at least 1" in capsys.readouterr().err


def test_its_missions_are_good() -> None:
    for mission in (
        experiments.transformation_mission(),
        experiments.case_mission(),
        experiments.basin_mission((30.0, 25.0)),
    ):
        assert not list(mission.problems())


def test_a_triangle_goes_through_the_gap_in_two_files() -> None:
    trace = experiments.transformation()
    assert experiments.clearance(trace) > 1.0
    virtual = VirtualFormation(experiments.transformation_mission())
    across = virtual.at(experiments.FORMING_S).points @ np.array((-1.0, 1.0, 0.0)) / np.sqrt(2.0)
    gap = np.hypot(*(np.subtract(*np.array(experiments.OBSTACLES_M)[:, :2]))) - 14.0
    assert np.ptp(across) > gap, "as a triangle it does not fit"
    assert np.nanmax(trace.errors()[trace.at(experiments.FORMING_S) :]) < 0.1


def test_the_virtual_formation_moves_in_steps_once_all_are_there() -> None:
    mission = experiments.basin_mission((30.0, 25.0), pace=0.4)
    swarm = Swarm(mission, experiments.basin_starts(1), 1)
    smooth = swarm.minds[0].virtual
    stepped = by_steps(swarm, 2.5)
    assert stepped.steps == np.ceil(smooth.length_m / 2.5)
    before = swarm.points
    stepped.jump()
    moves = np.linalg.norm(swarm.points - before, axis=1)
    np.testing.assert_allclose(moves, 2.5, atol=0.01)
    for _ in range(stepped.steps + 3):
        stepped.jump()
    np.testing.assert_allclose(swarm.points, smooth.at(smooth.end_s).points, atol=1e-6)


def test_after_a_fault_shoal_takes_the_spare_in_and_a_chain_of_leaders_stops() -> None:
    shoal, team = experiments.fault(fixed=False), experiments.fault(fixed=True)
    assert team.broken == 1
    assert (shoal.trace.errors()[-1] < 0.1).sum() == printed.VEHICLES
    left = team.trace.errors()[-1]
    assert [i for i in range(6) if not left[i] < 0.1] == [1, 3, 4], "the broken one and its two followers"
    assert team.trace.held[-1, 6] == -1, "the spare has no role"


def test_the_published_case_forms_with_the_least_way() -> None:
    case = experiments.published_case()
    assert case.forming == pytest.approx(case.optimum, rel=1e-3)
    assert case.lengths.mean() < case.fixed.mean()
