"""The companion's tick: perception, formation, guidance and link wired together, each allowed to fail by rule."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Protocol, TypeVar

import numpy as np

from companion.config.vehicle import VehicleConfig
from companion.events import Event, Severity
from companion.formation import Formation
from companion.guidance import Guidance
from companion.link.bus import BusReport, BusState, Counters
from companion.link.message import Message
from companion.link.session import LinkCommand, LinkOutput, LinkSession, LinkState
from companion.mission import Mission
from companion.perception import Motion, Perception
from companion.scene import Decision, Phase, Scene, Setpoint, Sighting
from companion.status import LinkStatus, Status

T = TypeVar("T")

_OPEN_BUS = BusReport(BusState.OPEN, "", Counters())
_STILL = np.zeros(3)
_NO_POINTS = np.zeros((0, 3))
_MOTION_S = 1.0  # older telemetry tells no motion
_STRIDE_M = 0.5  # travelled length counts strides, so that noise on a vehicle at rest adds nothing
_REPEAT_S = 10.0  # before the same failure is told again


class PerceptionPart(Protocol):
    """From sighting and telemetry to scene."""

    def step(self, now: float, sighting: Sighting | None, motion: Motion | None) -> Scene:
        """One tick."""


class FormationPart(Protocol):
    """From scene to decision."""

    def step(self, now: float, scene: Scene) -> Decision:
        """One tick."""


class GuidancePart(Protocol):
    """From scene and decision to setpoint."""

    def step(self, now: float, scene: Scene, decision: Decision) -> Setpoint | None:
        """One tick."""


@dataclass(frozen=True, slots=True)
class Inputs:
    """What reached the companion since the last tick; `stop` ends the run: neutral, then disarmed."""

    messages: Sequence[Message] = ()
    sighting: Sighting | None = None
    bus: BusReport = _OPEN_BUS
    stop: bool = False


@dataclass(frozen=True, slots=True)
class Outputs:
    """What the companion sends, and how things stand."""

    messages: list[Message]
    status: Status


@dataclass(slots=True)
class _Failures:
    """Exceptions of the parts: how many of each, and which were told when."""

    counts: dict[str, int] = field(default_factory=dict)
    told: dict[str, float] = field(default_factory=dict)


class Node:
    """One vehicle's companion; `step` is a function of its inputs and never raises because of one part."""

    def __init__(
        self,
        vehicle: VehicleConfig,
        mission: Mission,
        *,
        perception: PerceptionPart | None = None,
        formation: FormationPart | None = None,
        guidance: GuidancePart | None = None,
    ) -> None:
        self.vehicle = vehicle.vehicle
        self.mission = mission
        parameters = {"DEPTH_MAX": mission.limits.depth_max_m, **vehicle.firmware.parameters}
        self.link = LinkSession(vehicle.vehicle, parameters, rearm=vehicle.arm == "always")
        self.perception = perception or Perception()
        self.formation = formation or Formation(mission, vehicle.vehicle - 1)
        self.guidance = guidance or Guidance(mission.limits, seed=mission.seed, vehicle=vehicle.vehicle)
        self._arms = vehicle.arm != "never"
        self._failures = _Failures()
        self._events: list[Event] = []
        self._held: Setpoint | None = None  # while holding
        self._heading = 0.0  # last known
        self._depth: float | None = None
        self._travelled = 0.0
        self._anchor: np.ndarray[tuple[int], np.dtype[np.float64]] | None = None

    def step(self, now: float, inputs: Inputs) -> Outputs:
        """One tick at `now`, s of the mission's clock; received messages are stamped on the same clock."""
        self._events = []
        self._guard(now, "link", lambda: self.link.listen(now, inputs.messages), None)
        motion = self._guard(now, "telemetry", lambda: self._motion(now), None)
        lost = Scene(now, None)
        scene = self._guard(now, "perception", lambda: self.perception.step(now, inputs.sighting, motion), lost)
        waiting = Decision(Phase.WAITING, None, _NO_POINTS, None, _STILL, None, "formation failed")
        decision = self._guard(now, "formation", lambda: self.formation.step(now, scene), waiting)
        wanted = self._guard(now, "guidance", lambda: self.guidance.step(now, scene, decision), None)
        reason = self._reason_to_hold(inputs, scene, decision, wanted)
        setpoint = self._hold() if reason else self._follow(wanted)
        command = LinkCommand(setpoint, self._arm(now, scene, inputs.stop))
        output = self._guard(now, "link", lambda: self.link.step(now, (), command, inputs.bus), LinkOutput())
        self._guard(now, "odometer", lambda: self._travel(scene), None)
        status = self._status(now, scene, decision, setpoint, reason, output, inputs)
        return Outputs(output.messages, status)

    # Runs one part; what it raises becomes a count and an event, and `instead` its result.
    def _guard(self, now: float, part: str, run: Callable[[], T], instead: T) -> T:
        try:
            return run()
        except Exception as error:
            failures = self._failures
            failures.counts[part] = failures.counts.get(part, 0) + 1
            text = f"{part} failed: {type(error).__name__}: {error}"
            if abs(now - failures.told.get(text, -math.inf)) >= _REPEAT_S:
                if len(failures.told) > 100:
                    failures.told.clear()
                failures.told[text] = now
                self._events.append(Event(now, Severity.ERROR, "node", text))
            return instead

    # Telemetry as perception wants it; None while any of it is missing or old.
    def _motion(self, now: float) -> Motion | None:
        telemetry = self.link.telemetry
        attitude, depth, speed = telemetry.attitude, telemetry.depth, telemetry.speed
        if attitude is None or depth is None or speed is None:
            return None
        heard = telemetry.attitude_stamp
        if not 0.0 <= now - heard <= _MOTION_S:
            return None
        if math.isfinite(attitude.yaw):
            self._heading = attitude.yaw
        if math.isfinite(depth):
            self._depth = depth
        measured = self.link.timesync.ours(telemetry.boot_time or 0.0)
        stamp = measured if heard - 0.5 <= measured <= heard else heard
        return Motion(stamp, attitude, depth, speed)

    # Why the vehicle shall not follow guidance now; "" when it shall.
    def _reason_to_hold(self, inputs: Inputs, scene: Scene, decision: Decision, wanted: Setpoint | None) -> str:
        if inputs.stop:
            return "stopping"
        if wanted is None:
            return decision.reason or "guidance gives no setpoint"
        if not (math.isfinite(wanted.heading) and math.isfinite(wanted.depth) and math.isfinite(wanted.speed)):
            return "setpoint is not finite"
        if scene.own is None:
            return "own pose is unknown"
        if wanted.speed == 0.0:
            return decision.reason or "guidance holds"
        if decision.phase is Phase.WAITING:
            return decision.reason or "waiting for the start"
        return ""

    def _follow(self, wanted: Setpoint | None) -> Setpoint | None:
        self._held = None
        return wanted

    # No thrust; heading and depth stay what they were when the hold began.
    def _hold(self) -> Setpoint | None:
        if self._held is None and self._depth is not None:
            limits = self.mission.limits
            depth = min(max(self._depth, 0.0), limits.depth_max_m)
            self._held = Setpoint(self._heading, depth, 0.0)
        return self._held

    # Armed from the mission's second 0 on, once the vehicle knows where it is; without a pose it stays as it is.
    def _arm(self, now: float, scene: Scene, stop: bool) -> bool | None:
        if stop:
            return False
        if not self._arms or now < 0.0:
            return None
        return True if self.link.armed or scene.own is not None else None

    def _travel(self, scene: Scene) -> None:
        if scene.own is None or not np.isfinite(scene.own.position).all():
            return
        if self._anchor is None:
            self._anchor = scene.own.position
            return
        stride = float(np.linalg.norm(scene.own.position - self._anchor))
        if stride >= _STRIDE_M:
            self._travelled += stride
            self._anchor = scene.own.position

    def _status(
        self,
        now: float,
        scene: Scene,
        decision: Decision,
        setpoint: Setpoint | None,
        reason: str,
        output: LinkOutput,
        inputs: Inputs,
    ) -> Status:
        link, telemetry = self.link, self.link.telemetry
        own = scene.own
        return Status(
            stamp=now,
            vehicle=self.vehicle,
            phase=decision.phase,
            point=decision.point,
            target=_triple(decision.target),
            tracking_error=decision.tracking_error,
            setpoint=setpoint,
            hold=reason,
            position=_triple(own.position) if own is not None else None,
            velocity=_triple(own.velocity) if own is not None else None,
            neighbours=len(scene.neighbours),
            travelled=self._travelled,
            attitude=telemetry.attitude,
            depth=telemetry.depth,
            speed=telemetry.speed,
            battery_voltage=telemetry.battery_voltage,
            armed=link.armed,
            failsafe=link.state is not LinkState.DOWN and telemetry.failsafe,
            link=LinkStatus(
                state=link.state,
                reason=link.reason,
                cause=link.diagnosis.cause,
                counters=inputs.bus.counters,
                losses=link.losses,
                foreign=link.foreign,
                undecodable=link.undecodable,
                clock_residual=link.timesync.residual,
            ),
            failures=dict(self._failures.counts),
            events=self._events + output.events,
        )


# A vector as three plain numbers.
def _triple(vector: np.ndarray[tuple[int], np.dtype[np.float64]] | None) -> tuple[float, float, float] | None:
    if vector is None:
        return None
    x, y, z = vector.tolist()
    return (x, y, z)
