"""What the chips are exposed to, against the hull's truth and the declared errors."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from sim.plant import load_hull, load_sensors
from sim.plant.library import ffi, load
from tests.sim.plant.trial import Hull

DT = 0.002
VECTORS = {"accelerometer": "specific_force_mps2", "gyro": "rate_rps", "magnetometer": "field_ut"}
PERFECT = {f"*.{kind}": 0.0 for kind in ("noise_density", "noise_rms", "bias_sigma", "bias_walk")}


@cache
def _hull() -> Any:
    return load_hull()


class Sensors:
    """The sensors of one vehicle beside a hull that a test moves."""

    def __init__(self, parameters: Any, seed: int = 1, vehicle: int = 0) -> None:
        self.lib = load("null")
        self.parameters = parameters
        self.hull = Hull(_hull(), depth=2.0)
        self.faults, self.readings = ffi.new("sensor_faults *"), ffi.new("mcu_readings *")
        self.state = ffi.new("sensor_state *")
        self.lib.sensors_start(parameters, seed, vehicle, self.state)

    def step(self, dt: float = DT) -> Any:
        hull = self.hull
        self.lib.sensors_step(self.parameters, hull.parameters, self.faults, hull.state, dt, self.state, self.readings)
        return self.readings

    def sample(self, field: str, count: int, dt: float = DT) -> NDArray[np.float64]:
        values = [list(v) if isinstance(v := getattr(self.step(dt), field), ffi.CData) else v for _ in range(count)]
        return np.array(values)


@pytest.mark.parametrize("channel", ["accelerometer", "gyro", "magnetometer", "pressure"])
@pytest.mark.parametrize("dt", [0.001, 0.004])
def test_noise_has_the_declared_density_and_is_white(channel: str, dt: float) -> None:
    sensors = Sensors(load_sensors({"*.bias_walk": 0.0}))
    error = getattr(sensors.parameters, channel)
    noise = sensors.sample(VECTORS.get(channel, "pressure_pa"), 20_000, dt)
    expected = math.hypot(error.noise_density * math.sqrt(0.5 / dt), error.noise_rms)
    assert expected > 0.0
    np.testing.assert_allclose(noise.std(axis=0), expected, rtol=0.03)
    blocks = noise[: 200 * 100].reshape(200, 100, -1).mean(axis=1)
    np.testing.assert_allclose(blocks.std(axis=0), expected / 10.0, rtol=0.25)


@pytest.mark.parametrize("channel", ["accelerometer", "gyro", "magnetometer", "pressure"])
def test_biases_differ_between_vehicles_as_declared(channel: str) -> None:
    parameters = load_sensors()
    fleet = ffi.new("sensor_state[400]")
    for i in range(len(fleet)):
        load("null").sensors_start(parameters, 1, i, fleet + i)
    biases = np.array([list(b) if isinstance(b := getattr(s, f"{channel}_bias"), ffi.CData) else [b] for s in fleet])
    sigma = getattr(parameters, channel).bias_sigma
    assert biases.std() == pytest.approx(sigma, rel=0.12)
    assert abs(biases.mean()) < 3.0 * sigma / math.sqrt(biases.size)


def test_biases_walk_as_declared() -> None:
    parameters = load_sensors({"*.bias_sigma": 0.0})
    ends = []
    for vehicle in range(100):
        sensors = Sensors(parameters, vehicle=vehicle)
        for _ in range(100):
            sensors.step(1.0)
        ends.append([*sensors.state.gyro_bias, *sensors.state.accelerometer_bias])
    gyro, accelerometer = np.split(np.array(ends), 2, axis=1)
    assert gyro.std() == pytest.approx(10.0 * parameters.gyro.bias_walk, rel=0.12)
    assert accelerometer.std() == pytest.approx(10.0 * parameters.accelerometer.bias_walk, rel=0.12)


def test_at_rest_perfect_sensors_tell_gravity_field_and_depth() -> None:
    sensors = Sensors(load_sensors(PERFECT))
    half = math.radians(90.0) / 2.0
    sensors.hull.state.quaternion = [math.cos(half), 0.0, 0.0, math.sin(half)]  # heading east
    readings, parameters = sensors.step(), sensors.parameters
    np.testing.assert_allclose(list(readings.specific_force_mps2), [0.0, 0.0, -9.81], atol=1e-12)
    north, east, down = parameters.field_ned_ut
    np.testing.assert_allclose(list(readings.field_ut), [east, -north, down], atol=1e-12)
    assert readings.pressure_pa == pytest.approx(parameters.atmosphere_pa + 1025.0 * 9.81 * 2.0)
    assert readings.battery_v == sensors.hull.state.battery_v


def test_in_a_turn_the_accelerometer_feels_how_its_own_place_moves() -> None:
    sensors = Sensors(load_sensors(PERFECT))
    hull, place = sensors.hull, np.array(list(sensors.parameters.imu_position_m))
    hull.order(throttle=1.0, rudder=30.0, planes=-10.0)
    hull.run(5.0)

    def velocity() -> NDArray[np.float64]:
        return hull.to_mission(hull.nu[:3] + np.cross(hull.nu[3:], place))

    before, quaternion = velocity(), list(hull.state.quaternion)
    hull.run(DT)
    force = list(sensors.step().specific_force_mps2)
    acceleration = (velocity() - before) / DT - [0.0, 0.0, 9.81]
    body = ffi.new("double[3]")
    hull.lib.hull_to_body(quaternion, list(acceleration), body)
    assert np.linalg.norm(acceleration[:2]) > 0.1, "it is pulled into the turn"
    np.testing.assert_allclose(force, list(body), atol=2e-3)


@pytest.mark.parametrize(
    ("fault", "value", "reading", "change"),
    [
        ("compass_disturbance_ut", [5.0, -3.0, 0.0], "field_ut", [5.0, -3.0, 0.0]),
        ("gyro_bias_rps", [0.0, 0.0, 0.1], "rate_rps", [0.0, 0.0, 0.1]),
        ("accelerometer_bias_mps2", [0.5, 0.0, 0.0], "specific_force_mps2", [0.5, 0.0, 0.0]),
        ("pressure_offset_pa", 5000.0, "pressure_pa", 5000.0),
        ("battery_drop_v", 3.0, "battery_v", -3.0),
        ("leak", 1, "leak", 1),
    ],
)
def test_each_fault_shows_in_its_reading_and_goes_again(fault: str, value: Any, reading: str, change: Any) -> None:
    sensors = Sensors(load_sensors(PERFECT))
    healthy = sensors.sample(reading, 1)
    setattr(sensors.faults, fault, value)
    np.testing.assert_allclose(sensors.sample(reading, 1) - healthy, [change], atol=1e-9)
    setattr(sensors.faults, fault, [0.0] * 3 if isinstance(value, list) else 0)
    np.testing.assert_array_equal(sensors.sample(reading, 1), healthy)
