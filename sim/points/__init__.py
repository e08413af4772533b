"""Point dynamics: vehicles that stop and turn on the spot, as in the paper, each with a Formation of its own."""

from sim.points.motion import Motion, Mover
from sim.points.starts import SPEED, box_width, forming_mission, random_starts
from sim.points.swarm import Conditions, Swarm

__all__ = ["SPEED", "Conditions", "Motion", "Mover", "Swarm", "box_width", "forming_mission", "random_starts"]
