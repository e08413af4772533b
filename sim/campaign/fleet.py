"""Campaign `fleet`: the firmware itself on simulated hulls, forming and travelling in a current, native and AVR."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np

from sim.campaign import Campaign, Cell, at_least, at_most, least, mean, most, ratio, share
from sim.forming import ways
from sim.run import run as simulate
from sim.scenario import load_scenario


def run(scenario_name: str, make: str, seed: int) -> Mapping[str, float]:
    """One scenario from one random start, swum to its end."""
    scenario = load_scenario(scenario_name, seed)
    outcome = simulate(scenario, make, threads=1)
    grade = outcome.grade(scenario)
    criteria = scenario.config.criteria
    formed = ways(outcome.history, criteria.arrival_radius_m, scenario.mission.schedule.start_s, grade.forming_time_s)
    points = outcome.history.points.shape[1]
    sample = {
        "success": float(grade.success),
        "filled": float(grade.points_filled == points),
        "collisions": float(grade.collisions),
        "separation": np.inf if grade.min_separation_m is None else grade.min_separation_m,
        "formed": float(grade.forming_time_s is not None),
        "forming time": np.nan if grade.forming_time_s is None else grade.forming_time_s,
        "tracking": np.nan if grade.tracking_rms_m is None else grade.tracking_rms_m,
    }
    if formed is not None:
        sample |= {"swum": formed.swum_m, "straight": formed.straight_m, "hull": formed.hull_m}
    return sample


FIGURES = (
    share("all points filled", "filled"),
    most("collisions in a run", "collisions", ".0f"),
    least("closest hulls (m)", "separation"),
    mean("tracking error (m RMS)", "tracking", ".3f"),
    most("greatest tracking error of a run (m RMS)", "tracking", ".3f"),
    share("formed", "formed"),
    ratio("forming travel over the optimum", "swum", "straight"),
    ratio("over the hulls' own", "swum", "hull"),
    ratio("the hulls' own over the optimum", "hull", "straight"),
    mean("forming time (s)", "forming time", ".1f"),
    most("longest (s)", "forming time", ".1f"),
    share("every criterion of the scenario", "success"),
)
ASKED = {
    "all points filled": at_least(1.0),
    "collisions in a run": at_most(0.0),
    "greatest tracking error of a run (m RMS)": at_most(0.35),
    "formed": at_least(1.0),
    "forming travel over the optimum": at_most(1.25),
}

CAMPAIGN = Campaign(
    name="fleet",
    title="Formation on full vehicle dynamics",
    text=(
        "Six and fifteen hulls (scenarios `six` and `fifteen`) lie at random places with random headings, form a "
        "triangle and travel round a corner in a current of 0.1 m/s, steered by the firmware: its very image in simavr "
        "(avr) or the same sources compiled for the host (native). Neighbours are seen within 20 m. A point is filled "
        "while a vehicle of its own is within 1 m all through the last 5 s of travel; hulls have collided when their "
        "surfaces come within 0.3 m. The tracking error is the distance to the point that each vehicle decided for, "
        "over all samples from 20 s after the start of travel on. Forming travel is what was swum over ground until "
        "each vehicle held its point and was within 2.5 m of it (waiting hulls circle at 1.9 m), the straight rest "
        "added, all runs summed. The optimum is the least sum of straight ways; the hulls' own is the least sum of "
        "ways for hulls that start with the headings they have and turn in circles of 1.25 m (Dubins, final heading "
        "free, still water): no hull with that turning circle does better but by luck with the current. A run that "
        "never formed counts under \"formed\" and has no forming travel."
    ),
    figures=FIGURES,
    cells=(
        Cell("6 vehicles, avr", partial(run, "six", "avr"), 20, ASKED),
        Cell("6 vehicles, native", partial(run, "six", "native"), 200, ASKED),
        Cell("15 vehicles, native", partial(run, "fifteen", "native"), 200, ASKED),
    ),
)  # fmt: skip
