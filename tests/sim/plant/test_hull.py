"""The hull against a published model, the laws of mechanics and the vehicle that it stands for."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim.plant import load_hull
from sim.plant.manoeuvres import NOMINAL_CHARGE, Order, steady
from tests.sim.plant.trial import Hull


def free(parameters: Any) -> Any:
    """The hull with its inertia alone: no weight, no damping, no lift, no fins."""
    parameters.weight_n = parameters.buoyancy_n = 0.0
    parameters.linear_damping = parameters.quadratic_damping = [0.0] * 6
    parameters.crossflow_drag = parameters.lift_area_m2 = [0.0] * 2
    parameters.fin_count = 0
    return parameters


def test_remus_100_turns_as_published() -> None:
    published = {5.0: 2.09, 10.0: 3.49, 15.0: 4.64}  # deg/s at 1.67 m/s, Fossen's model at 1000 rpm
    turns = steady([Order(1000 / 1525, rudder) for rudder in (0.0, *published)], hull="remus100", charge=1.0)
    assert turns[0].speed == pytest.approx(1.67, abs=0.02)
    for turn, rate in zip(turns[1:], published.values(), strict=True):
        assert math.degrees(turn.yaw_rate) == pytest.approx(rate, rel=0.1)


def test_neptune_moves_as_the_vehicle_it_stands_for() -> None:
    full, cruise, turn, port = steady(
        [Order(1.0), Order(0.6), Order(0.6, 30.0), Order(0.6, -30.0)], charge=NOMINAL_CHARGE
    )
    assert full.speed == pytest.approx(0.8, abs=0.05)
    assert cruise.speed == pytest.approx(0.5, abs=0.05)
    assert abs(cruise.yaw_rate) < math.radians(0.5), "it keeps its course"
    assert turn.yaw_rate > 0.0, "positive rudder turns to starboard"
    assert port.yaw_rate < 0.0
    assert 1.2 <= turn.radius <= 1.5


def test_positive_planes_lift_the_bow_and_raise_the_vehicle() -> None:
    down, up = steady([Order(0.6, 0.0, -10.0), Order(0.6, 0.0, 10.0)])
    assert up.pitch > math.radians(1.0)
    assert up.sinking < -0.03
    assert down.pitch < math.radians(-1.0)
    assert down.sinking > 0.03


def test_the_rudder_in_the_race_answers_from_rest() -> None:
    vehicle = Hull(load_hull())
    vehicle.order(throttle=0.6, rudder=30.0)
    vehicle.run(1.0)
    assert vehicle.nu[0] < 0.25
    assert math.degrees(vehicle.nu[5]) > 2.0


def test_half_the_step_gives_the_same_track() -> None:
    def track(dt: float) -> Any:
        vehicle = Hull(load_hull())
        vehicle.order(throttle=0.8)
        vehicle.run(4.0, dt)
        vehicle.order(throttle=1.0, rudder=25.0, planes=-15.0)
        vehicle.run(10.0, dt)
        return vehicle.position

    reference = track(0.00025)
    coarse, used = (float(np.linalg.norm(track(dt) - reference)) for dt in (0.004, 0.002))
    assert used < 2e-4
    assert coarse > 2.0 * used


def test_without_forces_momentum_and_energy_stay() -> None:
    vehicle = Hull(free(load_hull()))
    vehicle.move([0.5, 0.1, -0.05], [0.4, 0.3, -0.5])

    def momentum() -> Any:
        linear, angular = np.split(vehicle.mass @ vehicle.nu, 2)
        linear = vehicle.to_mission(linear)
        return np.concatenate([linear, vehicle.to_mission(angular) + np.cross(vehicle.position, linear)])

    momentum_before, energy_before = momentum(), vehicle.energy
    vehicle.run(20.0)
    assert np.linalg.norm(vehicle.position - [0.0, 0.0, 50.0]) > 1.0
    np.testing.assert_allclose(momentum(), momentum_before, atol=2e-4 * np.abs(momentum_before).max())
    assert vehicle.energy == pytest.approx(energy_before, rel=1e-4)


@settings(max_examples=25)
@given(
    velocity=st.tuples(*[st.floats(-1.0, 1.0)] * 3),
    rates=st.tuples(*[st.floats(-1.0, 1.0)] * 3),
    fins=st.tuples(*[st.floats(-45.0, 45.0)] * 2),
)
def test_water_only_takes_energy(
    velocity: tuple[float, float, float], rates: tuple[float, float, float], fins: tuple[float, float]
) -> None:
    vehicle = Hull(load_hull())
    vehicle.order(rudder=fins[0], planes=fins[1])
    vehicle.state.servo_rad = list(vehicle.input.servo_rad)
    vehicle.move(velocity, rates)
    last = vehicle.energy
    for _ in range(20):
        vehicle.run(0.1)
        assert vehicle.energy <= last + 1e-6
        last = vehicle.energy
    assert np.all(np.isfinite(vehicle.nu))


def test_a_hull_that_drifts_with_the_water_feels_no_force() -> None:
    vehicle = Hull(load_hull(factors={"body.lightness": 0.0}))
    vehicle.input.current_ned_mps = [0.3, -0.2, 0.1]
    vehicle.move([0.3, -0.2, 0.1], [0.0, 0.0, 0.0])
    vehicle.run(10.0)
    np.testing.assert_allclose(vehicle.nu, [0.3, -0.2, 0.1, 0.0, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(vehicle.position, [3.0, -2.0, 51.0], atol=1e-9)


def test_a_current_carries_the_same_manoeuvre_along() -> None:
    current = np.array([0.15, 0.25, -0.02])
    still, carried = Hull(load_hull()), Hull(load_hull())
    carried.input.current_ned_mps = list(current)
    carried.move(current, [0.0] * 3)
    for vehicle in (still, carried):
        vehicle.order(throttle=0.7, rudder=20.0, planes=-10.0)
        vehicle.run(20.0)
    np.testing.assert_allclose(carried.position - still.position, 20.0 * current, atol=1e-9)
    np.testing.assert_allclose(carried.nu[3:], still.nu[3:], atol=1e-12)


def test_light_by_ten_grams_it_floats_up_as_fast_as_its_drag_allows() -> None:
    parameters = load_hull()
    vehicle = Hull(parameters)
    vehicle.run(60.0)
    assert parameters.buoyancy_n - parameters.weight_n == pytest.approx(0.010 * 9.81)
    strips = [parameters.strips[i] for i in range(parameters.strip_count)]
    area = parameters.crossflow_drag[1] * sum(strip.diameter_m * strip.length_m for strip in strips)
    fins = [parameters.fins[i] for i in range(parameters.fin_count)]
    area += sum(fin.area_m2 * fin.broadside * fin.flow_straightening**2 * fin.normal[2] ** 2 for fin in fins)

    def surplus(w: float) -> float:
        linear = parameters.linear_damping[2] * math.exp(-parameters.damping_decay[2] * w) * w
        return float(
            parameters.buoyancy_n - parameters.weight_n - linear - 0.5 * parameters.density_kgm3 * area * w * w
        )

    speeds = np.linspace(0.01, 0.1, 9001)
    expected = speeds[np.argmin(np.abs([surplus(w) for w in speeds]))]
    assert -vehicle.to_mission(vehicle.nu[:3])[2] == pytest.approx(expected, rel=0.03)


def test_at_the_surface_it_floats_and_stays_in_the_water() -> None:
    vehicle = Hull(load_hull(), depth=1.0)
    vehicle.run(90.0)
    assert -0.065 < vehicle.position[2] < 0.065
    assert np.linalg.norm(vehicle.nu) < 5e-3
    vehicle.order(throttle=1.0, planes=30.0)
    vehicle.run(10.0)
    assert vehicle.position[2] > -0.065, "it cannot climb out of the water"


def test_the_battery_sags_under_load_and_empties_by_its_current() -> None:
    vehicle = Hull(load_hull())
    vehicle.run(0.1)
    rest_v, rest_a, charge = vehicle.state.battery_v, vehicle.state.battery_a, vehicle.state.charge
    drawn = []
    vehicle.order(throttle=1.0)
    vehicle.run(20.0, watch=lambda: drawn.append(vehicle.state.battery_a))
    resistance = vehicle.parameters.battery.resistance_ohm
    assert max(drawn) > 2.0 * rest_a, "the motor starts"
    sag = resistance * (vehicle.state.battery_a - rest_a)
    assert rest_v - vehicle.state.battery_v == pytest.approx(sag, abs=0.02)
    assert charge - vehicle.state.charge == pytest.approx(np.sum(drawn) * 0.002 / (5.0 * 3600.0), rel=0.01)
    vehicle.state.charge = 0.0
    vehicle.run(5.0)
    assert vehicle.state.battery_v == 0.0
    assert vehicle.nu[0] < 0.6, "empty, it coasts"
