"""Baselines: is each assignment the best of its kind, and does a chain of leaders hold and break as it must?"""

from __future__ import annotations

import itertools
from functools import partial
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from companion.scene import Phase
from companion.shapes import SHAPES
from sim.baselines import ASSIGNMENTS, LeaderFollower, PotentialField, chain
from sim.baselines.assignment import Array
from sim.points import Swarm, forming_mission, random_starts

TRAVEL = forming_mission(6, forming_s=70.0, waypoints_m=((30.0, 0.0), (30.0, 30.0)), pace_mps=0.25, turn_radius_m=12.0)


def underway(swarm: Swarm, travel_s: float) -> None:
    swarm.run(TRAVEL.schedule.forming_s + travel_s - swarm.now, lambda: False)


@settings(max_examples=60, deadline=None)
@given(
    st.integers(1, 5).flatmap(
        lambda n: arrays(float, (n, n), elements=st.floats(0.0, 100.0).map(lambda x: round(x, 3)))
    )
)
def test_no_assignment_is_better_by_its_own_measure(ways: Array) -> None:
    rows = np.arange(len(ways))
    chosen = {name: ways[rows, find(ways)] for name, find in ASSIGNMENTS.items()}
    for columns in itertools.permutations(rows):
        other = ways[rows, list(columns)]
        assert chosen["hungarian"].sum() <= other.sum() + 1e-9
        assert (chosen["least squares"] ** 2).sum() <= (other**2).sum() + 1e-6
        assert chosen["bottleneck"].max() <= other.max()
        if other.max() <= chosen["bottleneck"].max():
            assert chosen["bottleneck"].sum() <= other.sum() + 1e-9, "the least sum among the shortest longest ways"
    assert chosen["greedy"].min() == ways.min()
    for name, find in ASSIGNMENTS.items():
        assert sorted(find(ways)) == list(rows), f"{name}: every vehicle once"


def test_every_vehicle_of_a_triangle_follows_one_of_the_row_ahead() -> None:
    assert chain(SHAPES["triangle"](6, 5.0)) == (None, 0, 0, 1, 1, 2), "vehicle 1 leads two, as in Fig. 6"
    assert chain(SHAPES["triangle"](15, 5.0))[10:] == (6, 6, 7, 8, 9)
    assert chain(SHAPES["column"](4, 5.0)) == (None, 0, 1, 2)
    assert chain(SHAPES["wedge"](5, 5.0)) == (None, 0, 0, 1, 2)


@given(st.sampled_from(sorted(SHAPES)), st.integers(1, 20))
def test_every_chain_leads_to_the_tip(shape: str, count: int) -> None:
    leaders = chain(SHAPES[shape](count, 5.0))
    assert leaders.count(None) == 1
    for role in range(count):
        seen: list[int] = []
        leader = leaders[role]
        while leader is not None:
            assert leader not in seen
            seen.append(leader)
            leader = leaders[leader]


def test_leader_follower_forms_and_follows_round_a_corner() -> None:
    swarm = LeaderFollower(TRAVEL, random_starts(3, 6), 3)
    assert swarm.run(70.0)
    assert [decision.point for decision in swarm.decisions if decision] == list(range(6))
    underway(swarm, 10.0)
    worst = 0.0
    while swarm.minds[0].virtual.at(swarm.now).phase is Phase.TRAVEL:
        swarm.step()
        worst = max(worst, float(np.linalg.norm(swarm.positions - swarm.points, axis=1).max()))
    assert worst < 0.3
    assert swarm.run(5.0)
    assert swarm.separation > 1.0


@pytest.mark.parametrize(("broken", "stopped"), [(1, {3, 4}), (0, {1, 2, 3, 4, 5}), (5, set())])
def test_a_broken_leader_stops_all_who_follow_it_and_nobody_else(broken: int, stopped: set[int]) -> None:
    swarm = LeaderFollower(TRAVEL, random_starts(1, 6), 1)
    underway(swarm, 25.0)
    swarm.dead.add(broken)
    assert swarm.followers(broken) == stopped
    underway(swarm, 60.0)
    speed = np.linalg.norm(swarm.velocities, axis=1)
    assert {vehicle for vehicle in range(6) if speed[vehicle] < 0.02} == stopped | {broken}


def test_roles_leave_the_spare_without_work_where_shoal_takes_it_in() -> None:
    mission = forming_mission(6, vehicles=7)
    places = np.vstack((random_starts(2, 6), [[13.0, 13.0, 2.0]]))
    filled = {}
    for kind in (LeaderFollower, Swarm):
        swarm = kind(mission, places, 2)
        swarm.dead.add(1)
        filled[kind] = swarm.run(120.0)
    assert filled == {LeaderFollower: False, Swarm: True}


def test_the_potential_field_holds_a_vehicle_off_at_the_safe_distance_but_is_stuck_there() -> None:
    mission = forming_mission(2, shape="line")
    north = np.array([[0.0, 2.5, 2.0], [0.0, -2.5, 2.0]])
    arguments: dict[str, Any] = {"mission": mission, "starts": north, "seed": 1}
    swarm = LeaderFollower(**arguments, mover=PotentialField)
    assert not swarm.run(60.0)
    assert swarm.separation == pytest.approx(1.15, abs=0.1)
    assert LeaderFollower(**arguments).run(60.0), "half-planes let them pass"


def test_same_seed_same_chain() -> None:
    make = partial(LeaderFollower, TRAVEL, random_starts(4, 6), 4)
    first, second = make(), make()
    underway(first, 5.0)
    underway(second, 5.0)
    assert first.positions.tobytes() == second.positions.tobytes()
