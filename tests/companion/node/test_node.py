"""A logbook of the companion's tick: what it does when all is well, and by rule when a part of it fails."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.config import loads
from companion.config.vehicle import VehicleConfig
from companion.guidance import Guidance
from companion.link import LinkState, PipeBus
from companion.mission import Mission
from companion.node import Inputs, Node
from companion.perception import Motion
from companion.scene import Decision, Phase, Scene, Setpoint, Sighting
from companion.status import Status, to_json, to_line
from tests.companion.link.firmware_fake import FirmwareFake

MISSION = loads(Mission, "vehicles = 6\n[path]\nwaypoints_m = [[40, 0], [40, 40]]\n[schedule]\nstart_s = 5", "mission")
VEHICLE = 'vehicle = 1\nmission = "m"\n[serial]\nport = "x"\n[sightings]\nunix = "s"\n'


class Swim:
    """A node, a fake firmware and an unmoving vehicle at `position`, on simulated time."""

    def __init__(self, vehicle: str = VEHICLE, **parts: object) -> None:
        self.now = 0.0
        self.bus = PipeBus()
        self.firmware = FirmwareFake()
        self.node = Node(loads(VehicleConfig, vehicle, "vehicle"), MISSION, **parts)  # type: ignore[arg-type]
        self.position: Sequence[float] | None = (8.0, 3.0, 2.0)
        self.neighbours = [[-6.0, 2.0, 0.0], [1.0, -7.0, 0.0]]
        self.stop = False
        self.log: list[str] = []

    def tick(self) -> Status:
        self.bus.feed(self.firmware.exchange(self.now, self.bus.take()), self.now)
        position = None if self.position is None else np.array(self.position)
        sighting = Sighting(self.now, position, 0.05, np.array(self.neighbours).reshape(-1, 3), 20.0)
        outputs = self.node.step(self.now, Inputs(self.bus.recv_all(), sighting, self.bus.report(), self.stop))
        for message in outputs.messages:
            assert self.bus.send(message)
        self.log += [f"{event.source}: {event.text}" for event in outputs.status.events]
        self.now = round(self.now + 0.1, 6)
        return outputs.status

    def swim(self, seconds: float) -> Status:
        for _ in range(round(seconds * 10)):
            status = self.tick()
        return status


class Broken:
    """A part that works until it is broken."""

    def __init__(self, part: object) -> None:
        self.part = part
        self.broken = False

    def step(self, *inputs: object) -> object:
        if self.broken:
            raise ZeroDivisionError("of all things")
        return self.part.step(*inputs)  # type: ignore[attr-defined]


def test_a_vehicle_arms_waits_forms_and_stops_on_request() -> None:
    swim = Swim()
    status = swim.swim(4.0)
    assert status.link.state is LinkState.READY
    assert status.armed
    assert status.phase is Phase.WAITING
    assert status.hold
    assert status.setpoint == Setpoint(pytest.approx(0.3), pytest.approx(2.0), 0.0)  # type: ignore[arg-type]
    assert swim.firmware.parameters["DEPTH_MAX"] == MISSION.limits.depth_max_m
    status = swim.swim(6.0)
    assert status.phase is Phase.FORMING
    assert status.hold == ""
    assert status.point is not None
    assert status.neighbours == 2
    assert status.setpoint is not None
    assert status.setpoint.speed >= MISSION.limits.steerage_speed_mps
    assert swim.firmware.setpoints[-1][2] == pytest.approx(status.setpoint.speed, abs=0.1)
    assert f"point {status.point}" in to_line(status)
    assert to_json(status)["link"]["state"] == "ready"
    swim.stop = True
    status = swim.swim(3.0)
    assert status.hold == "stopping"
    assert status.setpoint is not None
    assert status.setpoint.speed == 0.0
    assert not status.armed
    assert not swim.firmware.armed


@pytest.mark.parametrize("part", ["perception", "formation", "guidance"])
def test_a_part_that_fails_means_hold_with_a_name_and_a_count_and_all_comes_back(part: str) -> None:
    swim = Swim()
    broken = Broken(getattr(swim.node, part))
    setattr(swim.node, part, broken)
    assert swim.swim(9.0).hold == ""
    broken.broken = True
    before = len(swim.firmware.setpoints)
    status = swim.swim(3.0)
    assert status.failures == {part: 30}
    assert swim.log.count(f"node: {part} failed: ZeroDivisionError: of all things") == 1
    assert status.setpoint is not None
    assert status.setpoint.speed == 0.0, "no thrust"
    assert status.setpoint.heading == pytest.approx(swim.firmware.heading)
    assert status.setpoint.depth == pytest.approx(swim.firmware.depth)
    assert status.armed
    assert len(swim.firmware.setpoints) - before == 30, "the firmware hears a fresh setpoint all the time"
    broken.broken = False
    status = swim.swim(3.0)
    assert status.setpoint is not None
    assert status.setpoint.speed > 0.0
    assert status.failures == {part: 30}


def test_a_broken_link_room_does_not_stop_the_rest() -> None:
    swim = Swim()
    swim.swim(9.0)
    swim.node.link._receive = None  # type: ignore[assignment, method-assign]
    status = swim.swim(1.0)
    assert status.phase is Phase.FORMING
    assert status.setpoint is not None


def test_own_pose_lost_and_found() -> None:
    swim = Swim()
    swim.swim(9.0)
    swim.position = None
    status = swim.swim(5.0)
    assert status.position is None
    assert status.setpoint is not None
    assert status.setpoint.speed == 0.0
    assert status.armed
    swim.position = (8.0, 3.0, 2.0)
    status = swim.swim(3.0)
    assert status.hold == ""
    assert status.setpoint is not None
    assert status.setpoint.speed > 0.0


def test_a_vehicle_that_may_not_arm_stays_disarmed_and_travelled_length_counts_no_noise() -> None:
    swim = Swim('arm = "never"\n' + VEHICLE)
    generator = np.random.default_rng(1)
    for _ in range(100):
        swim.position = (8.0 + 0.05 * generator.standard_normal(), 3.0 + 0.05 * generator.standard_normal(), 2.0)
        status = swim.tick()
    assert not swim.firmware.armed
    assert status.travelled == 0.0


class Odd:
    """Gives what it was told to give."""

    def __init__(self, setpoint: Setpoint | None) -> None:
        self.setpoint = setpoint

    def step(self, now: float, scene: Scene, decision: Decision) -> Setpoint | None:
        return self.setpoint


anything = st.floats(allow_nan=True, allow_infinity=True)


@settings(max_examples=25)
@given(values=st.tuples(anything, anything, anything), nothing=st.booleans())
def test_no_setpoint_of_guidance_leads_to_a_bad_one_on_the_line(
    values: tuple[float, float, float], nothing: bool
) -> None:
    swim = Swim(guidance=Odd(None if nothing else Setpoint(*values)))
    swim.swim(8.0)
    for setpoint in swim.firmware.setpoints:
        assert all(map(math.isfinite, setpoint))
        assert abs(setpoint[0]) <= math.pi + 1e-6
        assert setpoint[1] >= 0.0


def test_the_same_inputs_give_the_same_bytes() -> None:
    def journey() -> bytes:
        swim, sent = Swim(), b""
        for _ in range(150):
            swim.tick()
            sent += bytes(swim.bus._departing)
        return sent

    assert journey() == journey()


def test_telemetry_reaches_perception_in_the_tick_in_which_it_arrives() -> None:
    seen: list[Motion | None] = []

    class Watcher:
        def step(self, now: float, sighting: Sighting | None, motion: Motion | None) -> Scene:
            seen.append(motion)
            return Scene(now, None)

    swim = Swim(perception=Watcher(), guidance=Guidance(MISSION.limits))
    swim.swim(0.2)
    assert seen[0] is not None
    assert seen[0].attitude.yaw == pytest.approx(0.3)
    swim.firmware.heading = 1.0
    swim.tick()
    assert seen[-1] is not None
    assert seen[-1].attitude.yaw == pytest.approx(1.0)
