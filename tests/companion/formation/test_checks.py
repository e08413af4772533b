"""What a mission is told when it is read: what cannot be flown, and what can but is worth a second thought."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from companion.cli import main
from companion.config import ConfigError, load, loads
from companion.formation import VirtualFormation
from companion.mission import Mission

STRAIGHT = "vehicles = 6\n[path]\nwaypoints_m = [[40, 0]]\n"
CORNER = "vehicles = 6\n[path]\nwaypoints_m = [[40, 0], [40, 40]]\n"


def refused(text: str) -> str:
    with pytest.raises(ConfigError) as caught:
        loads(Mission, text, "f.toml")
    [line] = caught.value.lines
    return line


def warned(text: str) -> list[str]:
    return [warning.line("f.toml") for warning in loads(Mission, text, "f.toml").warnings()]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            STRAIGHT + "[limits]\nmax_length_m = 60",
            "f.toml: [limits] max_length_m = 60: must be at least what a vehicle may have to travel, 98 m (40 m with "
            "the formation and 58 m of forming): shorten the path, or lower limits.forming_length_m if they form "
            "in less",
        ),
        (
            STRAIGHT + "[limits]\nsafe_length_m = 300\nmax_length_m = 200",
            "f.toml: [limits] safe_length_m = 300: must be at most max_length_m (200 m)",
        ),
        (
            "vehicles = 6\n[path]\norigin_m = [0, 0, 5]\nwaypoints_m = [[40, 0, 15]]",
            "f.toml: [limits] slope_max = 0.12: must be at least the steepest slope of the path (0.25): "
            "make that more level",
        ),
        (
            'vehicles = 6\n[formation]\nshape = "column"\npitch_deg = 20.0',
            "f.toml: [path] origin_m = [0, 0, 2]: points reach from -2.28 to 6.28 m depth, must be from 0.3 to 30 m "
            "(limits.depth_min_m, depth_max_m)",
        ),
        (
            "vehicles = 6\n[formation]\nslower = [6]",
            "f.toml: [formation] slower = [6]: must hold numbers of points, from 0 to 5",
        ),
        (
            "vehicles = 6\n[formation]\nslower = [1, 2]\nfaster = [2]",
            "f.toml: [formation] faster = [2]: point 2 must not be in slower as well",
        ),
        ("transform = 3\nvehicles = 6", "f.toml: transform = 3: must be tables, each written [[transform]]"),
        ("transform = [3]\nvehicles = 6", "f.toml: transform = [3]: must be tables, each written [[transform]]"),
        (
            'vehicles = 6\n[[transform]]\nshap = "line"\nshape = "line"\nat_s = 9',
            'f.toml: [transform[0]] shap = "line": unknown key, must be one of those of [transform[0]] '
            "(did you mean shape?)",
        ),
        (
            'vehicles = 6\n[path]\nwaypoints_m = "gone.csv"',
            'f.toml: [path] waypoints_m = "gone.csv": must be a list, or the name of a file that can be read: '
            "No such file or directory (from -10000 to 10000 m)",
        ),
    ],
)
def test_what_cannot_be_flown_is_refused_in_one_line_that_says_what_to_change(text: str, said: str) -> None:
    assert refused(text) == said


@pytest.mark.parametrize("text", [STRAIGHT, CORNER, CORNER + "turn_radius_m = 12\n[limits]\nmax_length_m = 150\n"])
def test_a_mission_well_within_its_bounds_is_not_warned_of(text: str) -> None:
    assert warned(text) == []


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            STRAIGHT + "[limits]\nsafe_length_m = 60\nforming_length_m = 30",
            "f.toml: [limits] safe_length_m = 60: vehicles may have to travel 70 m (40 m with the formation and 30 m "
            "of forming), further than is safe (S)",
        ),
        (
            CORNER + "turn_radius_m = 4",
            "f.toml: [path] pace_mps = 0.35: a point slows down to 0.11 m/s at 206 s, 37 m along the path",
        ),
        (
            STRAIGHT + "[limits]\ncurrent_mps = 0.2",
            "f.toml: [path] pace_mps = 0.35: a point slows down to 0.15 m/s through water in limits.current_mps = 0.2",
        ),
        (
            STRAIGHT + "pace_mps = 0.6\n[limits]\ncurrent_mps = 0.1",
            "f.toml: [limits] top_speed_mps = 0.65: a point goes up to 0.70 m/s through water in limits.current_mps",
        ),
        (
            'vehicles = 6\n[[transform]]\nshape = "line"\nat_s = 10',
            "f.toml: [transform[0]] at_s = 10: the formation stands while it transforms",
        ),
    ],
)
def test_what_can_hardly_be_meant_is_warned_of(text: str, said: str) -> None:
    [line] = warned(text)
    assert line.startswith(said)


def test_a_turn_is_refused_only_where_no_speed_makes_it_possible() -> None:
    sharp = VirtualFormation(loads(Mission, CORNER + "turn_radius_m = 4", "f.toml"))
    states = [sharp.at(float(now)) for now in np.arange(100.0, 400.0, 0.5)]
    assert max(np.linalg.norm(state.velocities, axis=1).max() for state in states) <= 0.8 * 0.65
    assert "must be at most 0.52 m/s: turn wider" in refused(CORNER + "turn_radius_m = 0.1")


def test_lambda_is_held_against_the_narrowest_shape_and_every_transformation() -> None:
    narrow = '[[transform]]\nshape = "column"\nspacing_m = 1.6\nat_m = 0.0\n'
    line = refused("vehicles = 6\n[path]\nwaypoints_m = [[100, 0]]\nstep_m = 1.0\n" + narrow)
    assert line.startswith("f.toml: [path] step_m = 1: must be under half the distance of the nearest points (0.762 m)")
    mission = loads(Mission, "vehicles = 6\n[path]\nwaypoints_m = [[100, 0]]\nstep_m = 0.7\n" + narrow, "f.toml")
    assert mission.nearest_m() == pytest.approx(1.6)


def test_way_and_shape_may_stand_in_files_of_their_own(tmp_path: Path) -> None:
    (tmp_path / "way.csv").write_text("north, east, down\n# surveyed\n10, 0, 2\n\n20.5,5,2.5\n")
    (tmp_path / "shape.csv").write_text("0,0\n-4,3\n-4,-3\n")
    file = tmp_path / "mission.toml"
    text = (
        'vehicles = 3\n[formation]\nshape = "points"\npoints_m = "shape.csv"\n[path]\ncurve = "spline"\nwaypoints_m = '
    )
    file.write_text(text + '"way.csv"\n')
    mission = load(Mission, file)
    assert mission.path.corners().tolist() == [[0, 0, 2], [10, 0, 2], [20.5, 5, 2.5]]
    assert len(mission.points()) == 3
    (tmp_path / "way.csv").write_text("10,0\nnorth,east\n")
    with pytest.raises(ConfigError, match=r'waypoints_m = "way.csv": must be a file of numbers, line 2 is not'):
        load(Mission, file)
    (tmp_path / "way.csv").write_text("10,0\n20\n")
    with pytest.raises(ConfigError, match=r"waypoints_m\[1\] = \[20\]: must be a list of 2 or 3 values"):
        load(Mission, file)


def test_check_prints_when_shapes_change_and_what_to_think_about(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "mission.toml"
    file.write_text(
        "vehicles = 6\n[path]\nwaypoints_m = [[80, 0]]\n[limits]\ncurrent_mps = 0.15\n"
        '[[transform]]\nshape = "line"\nat_m = 0.0\njump = true\n'
        '[[transform]]\nshape = "column"\nspacing_m = 4.0\nat_m = 10.0\n'
    )
    assert main(["check", str(file)]) == 0
    output = capsys.readouterr()
    assert "path of 80 m at 0.35 m/s, until" in output.out
    assert f"{file}: transformation: jumps to line at 0.0 m of the path\n" in output.out
    assert f"{file}: transformation: column from 10.0 to " in output.out
    assert output.err.startswith(f"shoal: warning: {file}: [path] pace_mps = 0.35: a point slows down to 0.15 m/s")
