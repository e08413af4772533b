"""The fleet: the same bytes however it is cut and threaded, and errors that say what to do."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sim.plant import Plant, PlantError, load_hull
from sim.plant.library import MAKES, ffi, load

STARTS = [[4.0 * i, -3.0 * i, 2.0, 0.7 * i] for i in range(5)]
ORDERS = [(1500 + 40 * i, 1300 + 80 * i, 1600 + 50 * i) for i in range(len(STARTS))]


def voyage(threads: int = 1, slice_s: float = 0.02, **options: Any) -> tuple[Plant, bytes]:
    """Five vehicles for two seconds in a current; all that is true and all that is sensed in the end, as bytes."""
    plant = Plant("null", starts=STARTS, threads=threads, **options)
    plant.states.current[:] = [0.1, 0.05, 0.0]
    for i, order in enumerate(ORDERS):
        plant.set_pulses(i, *order)
    for k in range(1, round(2.0 / slice_s) + 1):
        plant.run_until(k * slice_s)
    truth = [getattr(plant.states, name).tobytes() for name in ("position", "quaternion", "body_velocity", "travelled")]
    sensed = [bytes(ffi.buffer(ffi.addressof(plant.readings(i)[0]))) for i in range(plant.vehicles)]
    return plant, b"".join(truth + sensed)


def test_threads_slices_and_repetition_change_no_byte() -> None:
    _, reference = voyage(seed=7)
    for options in ({"threads": 2}, {"threads": 3}, {"slice_s": 0.1}, {"slice_s": 0.002}, {}):
        assert voyage(seed=7, **options)[1] == reference, options
    assert voyage(seed=8)[1] != reference


def test_a_vehicle_is_the_same_alone_as_in_a_fleet() -> None:
    fleet, _ = voyage(seed=7)
    alone = Plant("null", starts=STARTS[:1], seed=7)
    alone.states.current[:] = [0.1, 0.05, 0.0]
    alone.set_pulses(0, *ORDERS[0])
    alone.run_until(2.0)
    np.testing.assert_array_equal(alone.states.position[0], fleet.states.position[0])
    assert bytes(ffi.buffer(alone.readings(0))) == bytes(ffi.buffer(fleet.readings(0)))


def test_states_are_views_in_the_mission_frame() -> None:
    plant = Plant("null", starts=[[1.0, 2.0, 30.0, math.pi / 2.0], [0.0, 0.0, 30.0, 0.0]])
    states = plant.states
    np.testing.assert_array_equal(states.position, [[1.0, 2.0, 30.0], [0.0, 0.0, 30.0]])
    np.testing.assert_allclose(states.euler[:, 2], [math.pi / 2.0, 0.0])
    for i in range(2):
        plant.set_pulses(i, 1500, 1500, 1900)
    plant.run_until(20.0)
    assert plant.now == pytest.approx(20.0)
    assert states.velocity[0, 1] > 0.7, "the first goes east"
    assert states.velocity[1, 0] > 0.7, "the second goes north"
    moved = np.linalg.norm(states.position - [[1.0, 2.0, 30.0], [0.0, 0.0, 30.0]], axis=1)
    assert np.all(states.travelled >= moved)
    np.testing.assert_allclose(states.travelled, moved, rtol=0.01)
    with pytest.raises(ValueError, match="read-only"):
        states.position[0, 0] = 5.0
    position = states.position
    del plant, states
    assert np.all(np.isfinite(position)), "an array outlives its fleet"


def test_a_servo_without_pulses_keeps_its_place_and_the_motor_stops() -> None:
    plant = Plant("null", starts=STARTS[:1])
    plant.set_pulses(0, 1600, 1400, 1700)
    plant.run_until(2.0)
    held = plant.states.servos.copy()
    np.testing.assert_allclose(np.degrees(held[0]), [12.0, -12.0], atol=0.01)
    assert plant.states.propeller[0] > 10.0
    plant.set_pulses(0, 0, 0, 0)
    plant.run_until(12.0)
    np.testing.assert_allclose(plant.states.servos, held, atol=1e-6)
    assert plant.states.propeller[0] < 10.0


def test_a_failed_vehicle_is_named_with_its_cause_and_the_others_run_on() -> None:
    factors = [{}, {"drag.axial": 1e9}, {}]
    plant = Plant("null", starts=STARTS[:3], factors=factors)
    for i in range(3):
        plant.set_pulses(i, 1500, 1500, 1900)
    with pytest.raises(PlantError, match=r"vehicle 2: \d.* no longer finite"):
        plant.run_until(5.0)
    assert [bool(plant.failure(i)) for i in range(3)] == [False, True, False]
    assert np.all(plant.states.travelled[[0, 2]] > 0.5)


def test_hulls_of_a_fleet_may_differ() -> None:
    plant = Plant("null", starts=[[0.0, 0.0, 30.0, 0.0]] * 2, factors=[{"drag.*": 0.7}, {"drag.*": 1.3}])
    for i in range(2):
        plant.set_pulses(i, 1500, 1500, 1800)
    plant.run_until(30.0)
    assert plant.states.velocity[0, 0] > 1.1 * plant.states.velocity[1, 0]


@pytest.mark.parametrize(
    ("make", "options", "message"),
    [
        ("arm", {}, "must be one of avr, native, null"),
        ("null", {"starts": [[0.0, 0.0, 2.0]]}, r"shape \(1, 3\): must be \(N, 4\)"),
        ("null", {"starts": [[0.0, math.nan, 2.0, 0.0]]}, "finite"),
        ("null", {"step_s": 0.5}, "step_s = 0.5: must be"),
        ("null", {"threads": 0}, "threads 0"),
        ("null", {"charge": 1.5}, "charge = 1.5: must be 0 to 1"),
        ("null", {"hull": "titanic"}, "titanic.toml is missing .* known are neptune, remus100"),
        ("null", {"factors": {"drag.axail": 2.0}}, "neptune.toml: no coefficient is called 'drag.axail'"),
        ("null", {"factors": {"body.centre_of_gravity": -1.0}}, "must lie below the centre of buoyancy"),
        ("null", {"sensor_factors": {"sonar.*": 2.0}}, "sensors.toml: no coefficient is called"),
    ],
)
def test_what_cannot_be_made_says_why(make: str, options: dict[str, Any], message: str) -> None:
    with pytest.raises(PlantError, match=message):
        Plant(make, **({"starts": STARTS} | options))


def test_what_is_not_built_says_what_to_run(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("sim.plant.library.ROOT", tmp_path)
    load.cache_clear()
    for make in MAKES:
        with pytest.raises(PlantError, match="missing: run `make plant`"):
            load(make)
    load.cache_clear()


def test_every_coefficient_says_where_it_comes_from() -> None:
    from sim.plant import hull, sensors

    for file in (hull.coefficients("neptune"), hull.coefficients("remus100"), sensors.coefficients()):
        for name, entry in file.entries.items():
            assert entry.source.strip(), f"{file.origin}: {name}"
    assert load_hull().strip_count == 10
