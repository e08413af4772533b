"""Leader-follower formation with fixed roles: the traditional method that the paper compares itself with.

Vehicle i has point i for good. The tip of the formation follows the virtual formation's tip, everybody else keeps its
offset to a leader of its own, so a broken leader stops all who follow it. It is given the strongest form: the true
position and velocity of the leader at every decision, an offset that turns and changes with the formation, and, while
the formation forms, the straight way to the own point, which is the offset from where the leader is bound.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from companion.mission import Mission
from companion.scene import Decision, Phase, Scene
from sim.points import Swarm

Array = NDArray[np.float64]

_ABREAST_M = 1e-6


def chain(points: Array) -> tuple[int | None, ...]:
    """Of each point (L, 3), body of the formation, m, the one that its vehicle follows; None for the tip.

    It is the nearest of those further ahead, or of those abreast that lie more to the middle where nobody is ahead
    (Fig. 6 of the paper: a vehicle of a triangle follows one of the row before it).
    """
    order = sorted(range(len(points)), key=lambda i: (round(-points[i, 0], 6), abs(points[i, 1]), i))
    leaders: list[int | None] = [None] * len(points)
    for place, point in enumerate(order[1:], 1):

        def rank(other: int, point: int = point) -> tuple[bool, float]:
            ahead = points[other, 0] > points[point, 0] + _ABREAST_M
            return not ahead, round(float(np.linalg.norm(points[other] - points[point])), 6)

        leaders[point] = min(order[:place], key=rank)
    return tuple(leaders)


class LeaderFollower(Swarm):
    """A swarm in the same water with the same motion, in which roles are fixed; vehicles beyond the roles stay away.

    `leaders` says whom each role follows.
    """

    def __init__(self, mission: Mission, *arguments: Any, **options: Any) -> None:
        super().__init__(mission, *arguments, **options)
        self.leaders = chain(mission.points())

    def followers(self, vehicle: int) -> set[int]:
        """All who stop when this vehicle does, itself not among them."""
        found: set[int] = set()
        for role in range(len(self.leaders)):
            leader = self.leaders[role]
            while leader is not None and leader != vehicle:
                leader = self.leaders[leader]
            if leader == vehicle:
                found.add(role)
        return found

    def _decide(self, vehicle: int, scene: Scene) -> Decision:
        virtual = self.minds[vehicle].virtual.at(self.now)
        if vehicle >= len(self.leaders) or virtual.phase is Phase.WAITING or scene.own is None:
            reason = "no role" if vehicle >= len(self.leaders) else "waiting for the start"
            return Decision(virtual.phase, None, virtual.points, None, np.zeros(3), None, reason)
        target, velocity = virtual.points[vehicle], virtual.velocities[vehicle]
        leader = self.leaders[vehicle]
        if leader is not None and virtual.phase is not Phase.FORMING:
            target = target + self.positions[leader] - virtual.points[leader]
            velocity = velocity + self.velocities[leader] - virtual.velocities[leader]
        error = math.dist(virtual.points[vehicle], scene.own.position)
        return Decision(virtual.phase, vehicle, virtual.points, target, velocity, error)
