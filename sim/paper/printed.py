"""What Li and Zhu (2018) print: their tables, and one published case of the same author."""

from __future__ import annotations

import math
from dataclasses import dataclass

WORKSPACE_M = 50.0
VEHICLES = 6
STEPS_M = (2.5, 1.0)  # |dT| of Fig. 5, typical and optimised
STEPS_TO_FAULT = 10  # of Fig. 6


@dataclass(frozen=True, slots=True)
class Parameter:
    """A row of Table I."""

    symbol: str
    meaning: str
    typical: str
    optimised: str


TABLE_I = (
    Parameter("S", "safety travelling length of a vehicle", "60 m", "60 m"),
    Parameter("S_max", "maximal travelling length of a vehicle", "120 m", "120 m"),
    Parameter("gamma", "radius of the neighbourhood", "3 m", "5 m"),
    Parameter("D_min", "acceptable distance between vehicle and virtual point", "0.1 m", "0.1 m"),
    Parameter("lambda", "maximal step length of the virtual formation", "3 m", "3 m"),
    Parameter("G_o", "neighbourhood function coefficient", "0.5", "0.2"),
    Parameter("mu", "neighbourhood function coefficient", "5", "5"),
    Parameter("\\|dT\\|", "virtual formation's step length", "2.5 m", "1.0 m"),
    Parameter("alpha", "normal velocity of a vehicle", "0.5 m/s", "0.5 m/s"),
    Parameter("s", "deceleration factor", "(0.0, 1.0)", "0.7"),
    Parameter("f", "acceleration factor", "(1.0, 2.0)", "1.2"),
)


@dataclass(frozen=True, slots=True)
class Lengths:
    """A row of Table II: mean and standard deviation of a team's lengths, m."""

    mean: float
    sd: float


TABLE_II = {
    6: {"proposed": Lengths(63.87, 3.7127), "traditional": Lengths(64.32, 4.1949)},
    15: {"proposed": Lengths(77.02, 8.8700), "traditional": Lengths(77.24, 13.2503)},
}

# The published case: six points, six vehicles (x, y), m, and twenty moves of the virtual formation.
CASE_POINTS = ((15.0, 18.0), (10.0, 14.2), (5.0, 10.0), (11.0, 6.9), (17.0, 4.0), (16.0, 11.0))
CASE_VEHICLES = ((15.0, 15.0), (11.0, 16.0), (6.0, 9.0), (12.0, 7.0), (19.0, 3.0), (14.0, 10.0))
CASE_MOVES = tuple((1.5, n**0.5) for n in range(1, 11)) + tuple((1.5, n**-0.5) for n in range(1, 11))
CASE_GAIN, CASE_SWEEPS, CASE_RADIUS_M, CASE_BREADTH_M, CASE_DECAY = 0.1, 30, 2.0, 5.0, 0.1
CASE_STEP_M = max(math.hypot(*move) for move in CASE_MOVES)
