"""What formation is compared with: assignments by somebody who sees everything, leader-follower, potential field."""

from sim.baselines.assignment import ASSIGNMENTS, assign, distances
from sim.baselines.leader_follower import LeaderFollower, chain
from sim.baselines.potential import PotentialField

__all__ = ["ASSIGNMENTS", "LeaderFollower", "PotentialField", "assign", "chain", "distances"]
