"""The page that shows a run while it goes on, and the pace that lets people watch it."""

from sim.live.pace import SPEEDS, Pace
from sim.live.server import LivePage

__all__ = ["SPEEDS", "LivePage", "Pace"]
