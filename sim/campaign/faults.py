"""Campaign faults: a vehicle of the travelling formation stops for good, and later a spare comes after it."""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from sim.campaign.campaign import Campaign, Cell
from sim.campaign.figures import Limit, at_least, least, most, quantile, share
from sim.points import SPEED, Conditions, Swarm, forming_mission

STEP_M = 1.0  # of the virtual formation: Table I
FAULT_STEPS = 10  # Fig. 6
SPARE_S = 40.0  # from the fault to the spare
FORMED_S = 5.0
LIMIT_S = 300.0  # from the spare's coming to the whole formation
FILLED_M = 0.5
SPARE_BOX_M = 5.0


def lose_one(seed: int, count: int, share_of_speed: float, conditions: Conditions) -> dict[str, float]:
    """One fault, drawn by the seed: whether the formation is whole again, how long it took, and the least distance."""
    draw = np.random.default_rng((seed, count, 6))
    pace = share_of_speed * SPEED
    way = pace * (SPARE_S + LIMIT_S) + 2.0 * FAULT_STEPS * STEP_M + 20.0
    mission = forming_mission(
        count, 1.2, vehicles=count + 1, forming_s=FORMED_S, waypoints_m=((way, 0.0),), pace_mps=pace, turn=False
    )
    spare = np.array([*draw.uniform(-SPARE_BOX_M, SPARE_BOX_M, 2), 2.0])
    swarm = Swarm(mission, np.vstack((mission.points() + mission.path.origin_m, spare)), seed, conditions)
    swarm.absent.add(count)
    victim = int(draw.integers(count))
    swarm.run(FORMED_S + FAULT_STEPS * STEP_M / pace, lambda: False)
    swarm.dead.add(victim)
    swarm.run(SPARE_S, lambda: False)
    swarm.absent.clear()
    joined = swarm.now
    whole = swarm.run(LIMIT_S, lambda: swarm.filled(FILLED_M))
    stays = whole and _stays(swarm)
    return {
        "success": stays,
        "join_s": swarm.now - joined if stays else math.nan,
        "separation_m": swarm.separation,
    }


# Whether it is still whole a while later.
def _stays(swarm: Swarm) -> bool:
    swarm.run(10.0, lambda: False)
    return swarm.filled(FILLED_M)


def _cells() -> list[Cell]:
    cells = []
    for count in (6, 15):
        for reach in (math.inf, 20.0, 10.0):
            for part in (0.5, 0.8):
                asked: dict[str, Limit] = {"closest (m)": at_least(1.0)}
                if part == 0.5:
                    asked["whole again"] = at_least(1.0)
                run = partial(lose_one, count=count, share_of_speed=part, conditions=Conditions(reach, 0.1))
                cells.append(Cell(f"J = {count}, r = {reach:g} m, {part:g} of top speed", run, 200, asked))
    return cells


CAMPAIGN = Campaign(
    "faults",
    "A vehicle breaks down under way, and a spare replaces it, in point dynamics",
    "A triangle travels at a share of the vehicles' top speed of 0.5 m/s. After ten steps of 1 m one vehicle, drawn at "
    "random, stops for good, in the way of those behind it. 40 s later a spare appears within 5 m of where the centre "
    "of the formation began and sees no further than all others. The formation is whole again when every point has a "
    "vehicle within 0.5 m for 10 s, at the latest 300 s after the spare came. At 0.8 of top speed a spare gains only "
    "0.1 m/s on the formation, so that cases without it in time are expected there. Noise is 0.1 m an axis.",
    [
        share("whole again", "success"),
        quantile("median time to join (s)", "join_s", 0.5, ".0f"),
        most("longest (s)", "join_s", ".0f"),
        least("closest (m)", "separation_m"),
    ],
    _cells(),
)
