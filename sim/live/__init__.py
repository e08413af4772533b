"""The page that shows a run while it goes on, and the pace that lets people watch it."""

from sim.live.pace import Pace
from sim.live.server import LivePage

__all__ = ["LivePage", "Pace"]
