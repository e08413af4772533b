"""What files of settings get when they are wrong, and what they give when they are right."""

from __future__ import annotations

import datetime
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.cli import main
from companion.config import ConfigError, from_table, load, loads
from companion.config.vehicle import VehicleConfig
from companion.mission import Mission
from companion.shapes import SHAPES

GOOD = """
name = "triangle"
vehicles = 6
[path]
waypoints_m = [[40.0, 0.0], [40.0, 40.0, 3.0]]
"""

VEHICLE = """
vehicle = 2
mission = "mission.toml"
[serial]
port = "/dev/ttyS1"
[sightings]
unix = "sightings.sock"
"""


def complaints(kind: type[object], text: str) -> list[str]:
    with pytest.raises(ConfigError) as caught:
        loads(kind, text, "f.toml")
    return list(caught.value.lines)


def outcome(table: dict[str, Any]) -> tuple[Mission | None, tuple[str, ...]]:
    try:
        return from_table(Mission, table, "f.toml"), ()
    except ConfigError as error:
        return None, error.lines


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "f.toml: vehicles: must be given (Number of vehicles; from 1 to 250)"),
        ("vehicles = 0", "f.toml: vehicles = 0: must be from 1 to 250"),
        ("vehicles = 6.0", "f.toml: vehicles = 6: must be a whole number (from 1 to 250)"),
        ("vehicles = true", "f.toml: vehicles = true: must be a whole number (from 1 to 250)"),
        ("vehicles = [", "f.toml: must be TOML: "),
        ("vehicles = 6\nformation = 3", "f.toml: formation = 3: must be a table, written [formation]"),
        (
            "vehicles = 6\n[formation]\nspacng_m = 5",
            "f.toml: [formation] spacng_m = 5: unknown key, must be one of those of [formation] "
            "(did you mean spacing_m?)",
        ),
        (
            'vehicles = 6\n[formation]\nshape = "triangel"',
            'f.toml: [formation] shape = "triangel": must be one of triangle, line, column, wedge, diamond, polygon, '
            "tetrahedron, points; did you mean triangle?",
        ),
        (
            "vehicles = 6\n[formation]\nspacing_m = nan",
            "f.toml: [formation] spacing_m = nan: must be a finite number (from 1 to 100 m)",
        ),
        (
            "vehicles = 6\n[path]\npace_mps = 0",
            "f.toml: [path] pace_mps = 0: must be above 0 m/s and at most 2 m/s",
        ),
        (
            "vehicles = 6\n[path]\nwaypoints_m = [[1, 2], [3]]",
            "f.toml: [path] waypoints_m[1] = [3]: must be a list of 2 or 3 values (from -10000 to 10000 m)",
        ),
        (
            'vehicles = 6\n[path]\nwaypoints_m = [[1, "2"]]',
            'f.toml: [path] waypoints_m[0][1] = "2": must be a number (from -10000 to 10000 m)',
        ),
        (
            "vehicles = 2\n[formation]\npoint_count = 3",
            "f.toml: vehicles = 2: must be at least the number of points (3)",
        ),
        (
            'vehicles = 2\n[formation]\nshape = "points"\npoints_m = [[0, 0], [0, 1]]\n[path]\nstep_m = 0.1',
            "f.toml: [formation] points_m = [[0, 0], [0, 1]]: points 0 and 1 are 1 m apart, "
            "must be at least limits.safe_distance_m (1.15 m)",
        ),
        (
            "vehicles = 6\n[path]\nstep_m = 3",
            "f.toml: [path] step_m = 3: must be under half the distance of the nearest points (2.5 m), "
            "else vehicles swap points",
        ),
        (
            "vehicles = 6\n[path]\nwaypoints_m = [[40, 0]]\npace_mps = 0.8",
            "f.toml: [path] pace_mps = 0.8: must be at most limits.top_speed_mps (0.65 m/s)",
        ),
        (
            "vehicles = 6\n[path]\nwaypoints_m = [[40, 0], [40, 40]]\nturn_radius_m = 0.1",
            "f.toml: [path] turn_radius_m = 0.1: the outer point goes 1.03 m/s in a turn, 40 m along the path, "
            "however slow the centre, must be at most 0.52 m/s: turn wider or bring points nearer",
        ),
        (
            "vehicles = 6\n[path]\nwaypoints_m = [[40, 0], [40, 8], [0, 8]]",
            "f.toml: [path] waypoints_m[1] = [40, 8]: leg of 8 m is too short for its arcs, must be at least 24 m "
            '(or turn tighter, or curve = "spline")',
        ),
        (
            "vehicles = 6\n[path]\norigin_m = [0, 0, 40]",
            "f.toml: [path] origin_m = [0, 0, 40]: points reach from 40 to 40 m depth, must be from 0.3 to 30 m "
            "(limits.depth_min_m, depth_max_m)",
        ),
    ],
)
def test_a_wrong_mission_gets_one_line_with_file_key_value_and_range(text: str, said: str) -> None:
    [line] = complaints(Mission, text)
    assert line == said or (said.endswith(": ") and line.startswith(said))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("vehicle = 2", ""), "f.toml: vehicle: must be given (Number of this vehicle; from 1 to 250)"),
        (('[serial]\nport = "/dev/ttyS1"', ""), "f.toml: [serial] this section is missing (Line to the firmware)"),
        (('unix = "sightings.sock"', ""), "f.toml: [sightings] unix: exactly one of unix and tcp must be given"),
        (('unix = "sightings.sock"', 'tcp = "host:99999"'), "f.toml: [sightings] tcp"),
        (("[serial]", "[firmware.parameters]\nSYS_ID = 3\n[serial]"), "f.toml: [firmware.parameters] SYS_ID = 3: must"),
        (
            ("[serial]", '[firmware.parameters]\nHDG_P = "1"\n[serial]'),
            'f.toml: [firmware.parameters] HDG_P = "1": must',
        ),
        (("[serial]", "[firmware.parameters]\nhdg = 1\n[serial]"), "f.toml: [firmware.parameters] hdg = 1: its name"),
        (("[serial]", "[clock]\nstart = 2026-06-01T10:00:00\n[serial]"), "f.toml: [clock] start = 2026-06-01T10:00:00"),
        (('port = "/dev/ttyS1"', 'port = "x"\nbaud = 115201'), "f.toml: [serial] baud = 115201: must be one of 9600, "),
    ],
)
def test_a_wrong_vehicle_file_gets_one_line(change: tuple[str, str], said: str) -> None:
    [line] = complaints(VehicleConfig, VEHICLE.replace(*change))
    assert line.startswith(said)


def test_all_that_is_wrong_is_told_at_once() -> None:
    lines = complaints(Mission, 'nme = "x"\nseed = -1\n[formation]\nexponent = 9\n[limits]\ntop_speed_mps = "fast"')
    assert [line.split(":")[1].strip().split(" = ")[0] for line in lines] == [
        "nme",
        "seed",
        "vehicles",
        "[formation] exponent",
        "[limits] top_speed_mps",
    ]


def test_a_good_mission_is_what_its_file_says() -> None:
    mission = loads(Mission, GOOD, "f.toml")
    assert (mission.name, mission.vehicles, mission.formation.form) == ("triangle", 6, "price")
    assert mission.path.corners().tolist() == [[0, 0, 2], [40, 0, 2], [40, 40, 3]]
    points = mission.points()
    assert points.shape == (6, 3)
    np.testing.assert_allclose(points.mean(axis=0), 0.0, atol=1e-12)
    assert points[0, 0] == points[:, 0].max(), "the tip of the triangle is ahead"
    draws = [mission.generator(vehicle, "rules").random() for vehicle in (1, 2, 1)]
    assert draws[0] == draws[2] != draws[1]
    assert draws[0] != mission.generator(1, "guidance").random()


@given(shape=st.sampled_from(sorted(SHAPES)), count=st.integers(1, 40), spacing=st.floats(1.0, 50.0))
def test_every_shape_keeps_its_spacing(shape: str, count: int, spacing: float) -> None:
    points = SHAPES[shape](count, spacing)
    assert points.shape == (count, 3)
    distances = np.linalg.norm(points[:, None] - points[None], axis=2)
    distances[np.diag_indices(count)] = np.inf
    assert count == 1 or distances.min() == pytest.approx(spacing)


toml_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5) | st.datetimes(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=5,
)
keys = st.sampled_from(["name", "seed", "vehicles", "formation", "path", "transform", "schedule", "limits", "x"])
inner_keys = st.sampled_from(
    ["shape", "spacing_m", "points_m", "point_count", "waypoints_m", "origin_m", "pace_mps", "turn_radius_m", "step_m"]
)


@settings(max_examples=60)
@given(table=st.dictionaries(keys, st.dictionaries(inner_keys, toml_values, max_size=4) | toml_values, max_size=6))
def test_any_table_is_either_a_mission_or_an_error_that_names_the_file(table: dict[str, object]) -> None:
    mission, lines = outcome(table)
    assert all(line.startswith("f.toml: ") and "\n" not in line for line in lines)
    if mission is None:
        assert lines
    else:
        assert np.isfinite(mission.points()).all()
        assert mission.vehicles >= len(mission.points())


@given(value=st.floats(allow_nan=True, allow_infinity=True) | st.integers())
def test_a_number_is_taken_exactly_when_it_is_in_range(value: float) -> None:
    table = {"vehicles": 1, "schedule": {"forming_s": value}}
    inside = math.isfinite(value) and 0 <= value <= 86400
    mission, lines = outcome(table)
    if inside:
        assert mission is not None
        assert mission.schedule.forming_s == value
    else:
        [line] = lines
        assert line.startswith("f.toml: [schedule] forming_s = ")


def test_a_file_that_cannot_be_read_says_why(tmp_path: Path) -> None:
    for path, why in ((tmp_path / "none.toml", "No such file"), (tmp_path, "Is a directory")):
        with pytest.raises(ConfigError, match=why):
            load(Mission, path)
    (tmp_path / "latin.toml").write_bytes(b'name = "\xe9"')
    with pytest.raises(ConfigError, match="must be UTF-8 text: byte 8 is not"):
        load(Mission, tmp_path / "latin.toml")


def test_check_validates_a_vehicle_file_with_its_mission(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "mission.toml").write_text(GOOD)
    file = tmp_path / "vehicle.toml"
    file.write_text(VEHICLE + "[clock]\nstart = 2026-06-01T10:00:00Z\n[firmware.parameters]\nHDG_P = 1\n")
    vehicle = load(VehicleConfig, file)
    assert vehicle.sightings.unix == tmp_path / "sightings.sock"
    assert vehicle.clock.start == datetime.datetime(2026, 6, 1, 10, tzinfo=datetime.UTC)
    assert vehicle.firmware.parameters == {"HDG_P": 1.0}
    assert main(["check", str(file)]) == 0
    assert "vehicle 2 on /dev/ttyS1 at 115200 bit/s, good" in capsys.readouterr().out

    file.write_text(VEHICLE.replace("vehicle = 2", "vehicle = 7"))
    (tmp_path / "bad.toml").write_text("vehicles = 999")
    assert main(["check", str(file), str(tmp_path / "bad.toml")]) == 2
    said = capsys.readouterr().err
    assert "vehicle = 7: must be from 1 to the mission's number of vehicles (6 in " in said
    assert "bad.toml: vehicles = 999: must be from 1 to 250" in said
    assert main(["run", "--config", str(file)]) == 2
