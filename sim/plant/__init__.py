"""The simulated vehicles: hull, sensors and microcontroller of each, in C, behind a thin door."""

from sim.plant.fleet import COMPANION, CONSOLE, Counters, Plant, States
from sim.plant.hull import load_hull
from sim.plant.library import PlantError
from sim.plant.sensors import load_sensors

__all__ = ["COMPANION", "CONSOLE", "Counters", "Plant", "PlantError", "States", "load_hull", "load_sensors"]
