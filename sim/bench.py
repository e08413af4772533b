"""Measures how much faster than real time the demo runs on each make of the microcontroller, and what limits it."""

from __future__ import annotations

import os
import sys
from dataclasses import replace
from pathlib import Path

from companion.mission import DECISION_PERIOD_S
from sim.plant import PlantError
from sim.run import Effort, run
from sim.scenario import Scenario, load_scenario
from sim.summary import firmware_size

SCENARIO = "demo"
FIRMWARE_TICK_S = 0.01
NEEDED = {"avr": 2.0, "native": 10.0}  # times real time, six vehicles with their companions


def bench(seconds: float, threads: int, root: Path) -> int:
    """Runs the demo's first seconds on both makes and prints the figures; 1 when a make is missing or too slow."""
    scenario = load_scenario(SCENARIO)
    cut = replace(scenario, config=replace(scenario.config, duration_s=max(seconds, 10.0)))
    fleet = f"{scenario.mission.vehicles} vehicles, {cut.end_s():g} s"
    machine = f"{threads} threads on {os.cpu_count()} cores under a load of {os.getloadavg()[0]:.1f}"
    print(f"{SCENARIO}: {fleet}, {machine}")
    good = True
    for make, needed in NEEDED.items():
        try:
            outcome = run(cut, make, threads=threads)
        except PlantError as error:
            print(f"shoal-sim: {error}", file=sys.stderr)
            good = False
            continue
        effort, ticks = outcome.effort, outcome.ticks
        factor = cut.end_s() / effort.wall_s
        good &= factor >= needed
        print(f"{make:7} {factor:5.1f} x real time (needed {needed:g}); {_limits(cut, effort, threads)}")
        if make == "avr" and ticks is not None:
            share = 100.0 * ticks.worst_s / FIRMWARE_TICK_S
            print(
                f"firmware: longest tick {1e3 * ticks.worst_s:.2f} ms ({share:.0f} % of a tick), {ticks.missed} missed"
            )
    size = firmware_size(root)
    if size:
        print(
            f"firmware: flash {size['flash_bytes']} of {size['flash_budget_bytes']} bytes, "
            f"RAM {size['ram_bytes']} of {size['ram_budget_bytes']} bytes"
        )
    return 0 if good else 1


# Where the time went. The plant works on all threads, companions and world on one of them.
def _limits(scenario: Scenario, effort: Effort, threads: int) -> str:
    end = scenario.end_s()
    ticks = end * scenario.mission.vehicles / DECISION_PERIOD_S
    beside = effort.companions_s + effort.world_s + effort.observers_s
    limit = "plant" if effort.plant_s + beside > threads * beside else "thread of companions and world"
    return (
        f"processor time a simulated second: plant {1e3 * effort.plant_s / end:.0f} ms, companions "
        f"{1e3 * effort.companions_s / end:.0f} ms ({1e6 * effort.companions_s / ticks:.0f} us a tick), world "
        f"{1e3 * (effort.world_s + effort.observers_s) / end:.0f} ms; the {limit} sets the pace"
    )
