"""The whole firmware on the simulated hull: what it does with setpoints, with silence and with a wrong companion."""

from __future__ import annotations

import math

import numpy as np
import pytest

from protocol import dialect
from tests.firmware.helm import ARM, Helm, Order, Track, fleet

CRUISE = 0.5  # m/s
CYCLES_A_TICK = 160_000
CYCLES_A_MICROSECOND = 16


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


def heading(track: Track) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Heading of the first vehicle, unwrapped, degrees."""
    return np.asarray(np.degrees(np.unwrap(track.euler[:, 0, 2])))


@pytest.mark.parametrize("make", ["native", pytest.param("avr", marks=pytest.mark.avr)])
def test_it_turns_by_ninety_degrees_and_hardly_overshoots(make: str) -> None:
    helm = under_way(make)
    begun = heading(helm.run(1.0))[-1]
    helm.orders = [Order(math.radians(begun) + math.pi / 2, 2.0, CRUISE)]
    turned = heading(helm.run(30.0)) - begun
    assert turned.max() < 90.0 + 9.0 + 5.0  # a tenth of the step; the compass may be off by as much again
    assert abs(turned[-100:].mean() - 90.0) < 5.0
    assert np.ptp(turned[-100:]) < 2.0


def test_it_dives_by_a_metre_and_stays_there() -> None:
    helm = under_way("native")
    level = helm.run(10.0).position[:, 0, 2]
    assert np.abs(level - 2.0).max() < 0.05
    helm.orders = [Order(0.0, 3.0, CRUISE)]
    depth = helm.run(40.0).position[:, 0, 2]
    assert depth.max() < 3.25
    assert np.abs(depth[-200:] - 3.0).max() < 0.05


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
def test_ticks_are_never_missed_while_all_streams_flow() -> None:
    helm = under_way("avr")
    helm.run(20.0)
    assert helm.counter(0, "tick_miss") == 0.0
    assert helm.counter(0, "tick_worst") * CYCLES_A_MICROSECOND < 0.5 * CYCLES_A_TICK


def test_without_the_companions_hash_it_refuses_to_arm_and_says_why() -> None:
    helm = fleet("native", 1)
    helm.run(4.0)
    helm.command(0, ARM, 1)
    helm.run(1.0)
    assert not driving(helm)
    assert helm.last(0, "COMMAND_ACK").result != dialect.MAV_RESULT_ACCEPTED
    assert any("dialect" in text or "companion" in text for text in helm.texts(0))


@pytest.mark.parametrize(
    ("north", "depth"), [(math.nan, 2.0), (0.5, math.inf), (5.0, 2.0), (0.5, -3.0), (0.5, math.nan), (0.5, 500.0)]
)
def test_setpoints_out_of_this_world_are_counted_and_dropped(north: float, depth: float) -> None:
    helm = under_way("native")
    helm.orders = [Order(0.0, depth, north)]
    helm.run(0.4)
    echo = helm.last(0, "POSITION_TARGET_LOCAL_NED")
    assert echo.vx == pytest.approx(CRUISE, abs=0.01)
    assert echo.z == pytest.approx(2.0)
