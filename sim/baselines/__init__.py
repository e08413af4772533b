"""What formation is compared with: assignments by somebody who sees everything, and fixed roles."""

from sim.baselines.assignment import ASSIGNMENTS, assign, distances

__all__ = ["ASSIGNMENTS", "assign", "distances"]
