"""Which point of the formation is this vehicle's own: the rules, applied once a tick, and what they must remember."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from companion.formation import rules
from companion.formation.reserve import reserve
from companion.formation.rules import Known, Look, Memory, Senses
from companion.formation.som import PAPER, SOM, SomSettings, organise
from companion.formation.tuning import Tuning
from companion.formation.virtual import VirtualFormation, VirtualState
from companion.mission import Mission
from companion.scene import Decision, Phase, Scene

Array = NDArray[np.float64]

LOOK_PERIOD_S = 1.0  # between two looks that are kept to tell the dead by
SCENE_LIMIT_S = 1.0  # an older scene is no scene
SWEEPS = 30  # of Algorithm 1 in a tick: enough where it converges, not too long where it does not
NO_POINT = "no free point"
SPARE = "no free point: travelling in reserve"


@dataclass(slots=True)
class _State:
    """What one vehicle remembers from tick to tick."""

    memory: Memory
    place: int | None = None  # a point, or behind those one of the reserve
    looks: list[Look] = field(default_factory=list)
    known: Known = field(default_factory=Known.nobody)
    switches: float = 0.0
    calm_until: float = -math.inf


class Formation:
    """Decides for one vehicle.

    A pure function of mission and inputs: same scenes at same times, same decisions, whatever the vehicle's number and
    in whatever order its neighbours are listed.
    """

    def __init__(self, mission: Mission, vehicle: int, tuning: Tuning | None = None) -> None:
        self.vehicle = vehicle
        self.virtual = VirtualFormation(mission)
        self._tuning = tuning or Tuning.derive(mission)
        self._form = mission.formation.form
        self._som = _algorithm(mission)
        self._pace: list[float] = mission.pace_factors().tolist()
        self._seed = mission.seed
        self._points = len(mission.points())
        self._spares = max(mission.vehicles - self._points, 0)
        count = self._points + self._spares
        order = np.random.default_rng((mission.seed, 0x50)).permutation(count)
        self._rank = np.argsort(order)
        self._state = _State(Memory.blank(count))
        self._last: tuple[float, VirtualState] | None = None
        self._elapsed = 0.0
        self._settled = -math.inf

    def step(self, now: float, scene: Scene) -> Decision:
        """One tick at `now`, s: the own point and where it is, or a hold with its reason (target None)."""
        virtual = self.virtual.at(now)
        reason = self._clock(now, virtual)
        if reason:
            return self._hold(virtual, reason)
        if virtual.phase is Phase.WAITING:
            self._forget()
            return self._hold(virtual, "waiting for the start")
        if not abs(now - scene.stamp) <= SCENE_LIMIT_S:
            return self._hold(virtual, "scene is stale")
        senses = rules.sense(scene, self._tuning)
        if senses is None:
            return self._hold(virtual, "own position is unknown")
        places, velocities = virtual.points, virtual.velocities
        if self._spares:
            row, drift = reserve(virtual, self._spares, self._tuning.spacing_m)
            places, velocities = np.vstack((places, row)), np.vstack((velocities, drift))
        place = self._choose(now, senses, places)
        self._count_switch(now, place)
        self._state.place = place
        if place is None:
            return self._hold(virtual, NO_POINT)
        target, velocity = places[place], velocities[place]
        if place >= self._points:
            return Decision(virtual.phase, None, virtual.points, target, velocity, None, SPARE)
        error, pace = math.dist(senses.positions[senses.me], target), self._pace[place]
        return Decision(virtual.phase, place, virtual.points, target, velocity, error, "", pace)

    # Rules 2 to 6, for the points and, behind them, the places of the reserve.
    def _choose(self, now: float, senses: Senses, places: Array) -> int | None:
        state, tuning = self._state, self._tuning
        ways = rules.distances(senses.positions, places)
        lost = rules.dead(senses, now, state.looks, ways, tuning)
        self._keep_look(now, senses)
        state.memory = rules.remember(state.memory, now, senses, ways, tuning)
        if lost.any():
            senses, ways = senses.without(lost), ways[~lost]
        lingering = rules.linger(state.known, now, senses, tuning)
        state.known = senses.known(now, lingering)
        if len(lingering.times):
            senses = senses.joined(lingering)
            ways = np.vstack((ways, rules.distances(lingering.positions, places)))
        chosen = rules.candidates(state.memory, now, senses, ways, state.place, tuning)
        if self._form != "price":
            return self._organise(chosen[chosen < self._points], places, senses)
        cost = rules.costs(senses, ways, state.place, now < state.calm_until, chosen, tuning)
        hidden = rules.hidden_costs(senses, ways, chosen, tuning)
        return rules.compete(cost, hidden, senses.me, chosen, self._rank, self._points)

    # Algorithm 1 as it is, for comparison, among those in sight; a point not won this time stays as it was.
    def _organise(self, chosen: NDArray[np.intp], points: Array, senses: Senses) -> int | None:
        urgency = np.array([self._pace[point] - 1.0 for point in chosen])
        outcome = organise(points[chosen], senses.positions, self._som, (self._seed, 0x50), urgency=urgency)
        winner = outcome.winner
        return int(chosen[winner.index(senses.me)]) if senses.me in winner else self._state.place

    # A clock that jumps, either way, makes nonsense of where the points are: hold until it runs on evenly. Points that
    # jump as the mission says are new points, of which nothing is known; their centre goes on evenly.
    def _clock(self, now: float, virtual: VirtualState) -> str:
        if not math.isfinite(now):
            return "clock is not finite"
        last, self._last = self._last, (now, virtual)
        if last is not None:
            self._elapsed = now - last[0]
            moved = np.abs(virtual.points - last[1].points).max()
            if virtual.jumps != last[1].jumps:
                self._forget()
                moved = np.abs(virtual.points.mean(axis=0) - last[1].points.mean(axis=0)).max()
            if self._elapsed < 0.0 or moved > self._tuning.step_m:
                self._forget()
                self._settled = now + self._tuning.settle_s
        jumped = self._settled - self._tuning.settle_s <= now < self._settled
        return "clock jumped" if jumped else ""

    def _count_switch(self, now: float, place: int | None) -> None:
        state, tuning = self._state, self._tuning
        state.switches = max(state.switches - self._elapsed / tuning.switch_leak_s, 0.0)
        if state.place is not None and place != state.place:
            state.switches += 1.0
            if state.switches > tuning.switches_allowed:
                state.switches, state.calm_until = 0.0, now + tuning.calm_s

    def _keep_look(self, now: float, senses: Senses) -> None:
        looks = self._state.looks
        if not looks or now - looks[-1].time >= LOOK_PERIOD_S:
            others = np.delete(senses.positions, senses.me, axis=0)
            looks.append(Look(now, senses.positions[senses.me], others))
            while len(looks) > 1 and now - looks[1].time >= self._tuning.dead_window_s:
                del looks[0]

    def _forget(self) -> None:
        self._state = _State(Memory.blank(len(self._rank)))

    def _hold(self, virtual: VirtualState, reason: str) -> Decision:
        place = self._state.place
        point = place if place is not None and place < self._points else None
        return Decision(virtual.phase, point, virtual.points, None, np.zeros(3), None, reason)


# Algorithm 1 with what the mission says of it: s and f, and S and S_max where it has them.
def _algorithm(mission: Mission) -> SomSettings:
    base = PAPER if mission.formation.form == "paper" else SOM
    formation, limits = mission.formation, mission.limits
    return replace(
        base,
        max_sweeps=SWEEPS,
        slower=formation.slower_factor,
        faster=formation.faster_factor,
        safe_length_m=limits.safe_length_m or base.safe_length_m,
        max_length_m=limits.max_length_m or base.max_length_m,
    )
