"""The whole firmware on the simulated hull: what it does with setpoints, with silence and with a wrong companion."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest

from protocol import dialect
from tests.firmware.helm import ARM, Helm, Order, fleet

CRUISE = 0.5  # m/s
CYCLES_A_TICK = 160_000
CYCLES_A_MICROSECOND = 16
RAM = 8192


def driving(helm: Helm, vehicle: int = 0) -> bool:
    """Whether the vehicle's last heartbeat says that it is armed."""
    return bool(helm.last(vehicle, "HEARTBEAT").base_mode & dialect.MAV_MODE_FLAG_SAFETY_ARMED)


def under_way(make: str, vehicles: int = 1) -> Helm:
    """A fleet at cruise, heading north at 2 m, its compass and speed settled."""
    helm = fleet(make, vehicles)
    helm.orders = [Order(0.0, 2.0, CRUISE) for _ in range(vehicles)]
    helm.arm()
    helm.run(60.0)
    return helm


def steps(helm: Helm, speeds: Sequence[float]) -> None:
    """Turn by 90 degrees, dive by a metre and rise again, all vehicles at once; check each against what is asked."""
    helm.orders = [Order(0.0, 2.0, speed) for speed in speeds]
    helm.arm()
    cruise = helm.run(60.0)
    helm.orders = [Order(math.pi / 2, 2.0, speed) for speed in speeds]
    turn = helm.run(30.0)
    helm.orders = [Order(math.pi / 2, 3.0, speed) for speed in speeds]
    dive = helm.run(60.0)
    helm.orders = [Order(math.pi / 2, 2.0, speed) for speed in speeds]
    rise = helm.run(60.0)
    last = slice(-200, None)  # ten seconds
    for vehicle, speed in enumerate(speeds):
        story = f"vehicle {vehicle} at {speed} m/s"
        assert driving(helm, vehicle), story
        heading = np.degrees(np.unwrap(turn.euler[:, vehicle, 2]))
        settled = heading[last].mean()  # off by what its compass is off
        assert heading.max() < settled + 9.0, story
        assert abs(settled - 90.0) < 7.0, story
        assert np.ptp(heading[last]) < 2.0, story
        assert dive.position[:, vehicle, 2].max() < 3.15, story
        assert rise.position[:, vehicle, 2].min() > 1.85, story
        for track, depth in ((cruise, 2.0), (turn, 2.0), (dive, 3.0), (rise, 2.0)):
            assert np.abs(track.position[last, vehicle, 2] - depth).max() < 0.05, f"{story}, {depth} m"


def test_it_turns_dives_and_rises_without_overshoot_at_every_speed_it_travels_at() -> None:
    speeds = (0.25, 0.35, 0.5, 0.65)
    steps(fleet("native", len(speeds)), speeds)


def test_it_does_so_with_a_hull_that_is_thirty_percent_off() -> None:
    factors = [
        {"drag.*": 1.3},
        {"drag.*": 0.7},
        {"fin.*.slope": 1.3},
        {"fin.*.slope": 0.7},
        {"body.lightness": 1.3},
        {"drag.*": 1.3, "fin.*.slope": 0.7, "body.lightness": 1.3},
        {"drag.*": 0.7, "fin.*.slope": 1.3, "body.lightness": 0.7},
    ]
    steps(fleet("native", len(factors), factors=factors), [CRUISE] * len(factors))


@pytest.mark.avr
def test_the_image_turns_as_its_sources_do_on_a_host() -> None:
    avr, native = under_way("avr"), under_way("native")
    for helm in (avr, native):
        helm.orders = [Order(math.pi / 2, 3.0, CRUISE)]
    flown, expected = avr.run(20.0), native.run(20.0)
    assert np.degrees(np.abs(flown.euler[:, 0, 2] - expected.euler[:, 0, 2])).max() < 5.0
    assert np.abs(flown.position[:, 0, 2] - expected.position[:, 0, 2]).max() < 0.05


@pytest.mark.avr
def test_a_held_bus_costs_no_tick_and_floats_the_vehicle_up() -> None:
    helm = under_way("avr")
    helm.plant.faults(0).i2c_held = 1
    risen = helm.run(40.0)
    assert "depth sensor silent" in helm.texts(0)
    assert risen.pulses[-1, 0, 2] == 1500.0  # blind: no thrust, the hull is trimmed light
    assert risen.position[-1, 0, 2] < 1.5
    assert helm.counter(0, "tick_miss") == 0.0
    assert helm.plant.counters(0).resets == 0


@pytest.mark.avr
def test_a_setpoint_that_stops_coming_is_held_then_given_up() -> None:
    helm = under_way("avr")
    helm.orders = [None]
    thrust = helm.run(1.5).pulses[:, 0, 2]
    assert thrust[0] > 1550.0
    assert thrust[18:].max() == thrust[18:].min() == 1500.0  # after 0.9 s: held, at zero thrust
    assert driving(helm)
    helm.orders = [Order(0.0, 2.0, CRUISE)]
    assert helm.run(1.0).pulses[-1, 0, 2] > 1550.0  # a new setpoint ends the hold

    helm.orders = [None]
    risen = helm.run(30.0)
    assert any("setpoint lost" in text for text in helm.texts(0))
    assert risen.position[-1, 0, 2] < 0.6  # failsafe: it went up
    helm.orders = [Order(0.0, 2.0, CRUISE)]
    assert helm.run(10.0).position[-1, 0, 2] < 0.6  # and no setpoint brings it down again
    helm.command(0, ARM, 1)
    assert helm.run(30.0).position[-1, 0, 2] > 1.5  # but arming anew does


@pytest.mark.avr
def test_ticks_are_never_missed_under_streams_commands_a_parameter_list_and_noise() -> None:
    helm = under_way("avr")
    helm.plant.faults(0).companion_bit_noise = 0.001
    for second in range(20):
        if second % 5 == 0:
            helm.send(0, dialect.MAVLink_param_request_list_message(1, 1))
        helm.command(0, dialect.MAV_CMD_REQUEST_MESSAGE, dialect.MAVLINK_MSG_ID_AUTOPILOT_VERSION)
        helm.command(0, dialect.MAV_CMD_RUN_PREARM_CHECKS)
        helm.run(1.0)
    assert driving(helm)
    assert helm.counter(0, "rx_bad") > 0.0
    assert helm.counter(0, "sp_refused") == 0.0  # a frame is whole or none
    assert helm.counter(0, "tick_miss") == 0.0
    assert helm.counter(0, "tick_worst") * CYCLES_A_MICROSECOND < 0.5 * CYCLES_A_TICK
    assert RAM - helm.last(0, "MEMINFO").freemem < 4096  # stack at its deepest included


def test_without_the_companions_hash_it_refuses_to_arm_and_says_why() -> None:
    helm = fleet("native", 1)
    helm.run(4.0)
    helm.command(0, ARM, 1)
    helm.run(1.0)
    assert not driving(helm)
    assert helm.last(0, "COMMAND_ACK").result != dialect.MAV_RESULT_ACCEPTED
    assert any("dialect" in text or "companion" in text for text in helm.texts(0))


@pytest.mark.parametrize(
    ("speed", "depth"), [(math.nan, 2.0), (0.5, math.inf), (5.0, 2.0), (0.5, -3.0), (0.5, math.nan), (0.5, 500.0)]
)
def test_setpoints_out_of_this_world_are_counted_and_dropped(speed: float, depth: float) -> None:
    helm = under_way("native")
    helm.orders = [Order(0.0, depth, speed)]
    helm.run(0.8)
    echo = helm.last(0, "POSITION_TARGET_LOCAL_NED")
    assert echo.vx == pytest.approx(CRUISE, abs=0.01)
    assert echo.z == pytest.approx(2.0)
    assert helm.last(0, "SYS_STATUS").errors_count3 >= 2
    assert "setpoint refused: out of range or malformed" in helm.texts(0)
