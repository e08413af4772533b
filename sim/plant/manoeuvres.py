"""Trials of a hull as at sea (speed, turning, stopping, diving), and the page that tells them: docs/hull.md.

`python -m sim.plant.manoeuvres` writes docs/hull.md and docs/hull.svg; it needs `make plant`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sim.plant.fleet import Plant
from sim.plant.library import ROOT

DEEP_M = 50.0  # far from the surface
US_PER_DEG = 500.0 / 60.0
NOMINAL_CHARGE = 0.25  # where the battery rests at 11.1 V
CRUISE = 0.6

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Order:
    """What a trial orders: throttle -1 to 1, rudder and planes in degrees."""

    throttle: float
    rudder_deg: float = 0.0
    planes_deg: float = 0.0


@dataclass(frozen=True, slots=True)
class Steady:
    """How a vehicle moves once it has settled: speed and sinking m/s, yaw rate rad/s, drift and pitch rad, load A."""

    speed: float
    sinking: float
    yaw_rate: float
    drift: float
    pitch: float
    battery_a: float

    @property
    def radius(self) -> float:
        """Of the circle, m; infinite on a straight course."""
        return abs(self.speed / self.yaw_rate) if self.yaw_rate else math.inf


def fleet(orders: Sequence[Order], hull: str = "neptune", charge: float = NOMINAL_CHARGE) -> Plant:
    """One vehicle an order, deep, at rest, heading north, without firmware."""
    return Plant("null", starts=[[0.0, 10.0 * i, DEEP_M, 0.0] for i in range(len(orders))], hull=hull, charge=charge)


def give(plant: Plant, orders: Sequence[Order]) -> None:
    """Sets the pulses of each vehicle by its order."""
    for i, order in enumerate(orders):
        plant.set_pulses(
            i,
            round(1500 + US_PER_DEG * order.planes_deg),
            round(1500 + US_PER_DEG * order.rudder_deg),
            round(1500 + 400 * order.throttle),
        )


def steady(orders: Sequence[Order], hull: str = "neptune", charge: float = NOMINAL_CHARGE) -> list[Steady]:
    """Runs straight for 40 s at each order's throttle, then 40 s with its fins, and tells the motion at the end."""
    plant = fleet(orders, hull, charge)
    give(plant, [Order(order.throttle) for order in orders])
    plant.run_until(40.0)
    give(plant, orders)
    plant.run_until(80.0)
    states = plant.states
    speed = np.linalg.norm(states.velocity, axis=1)
    drift = np.arctan2(states.body_velocity[:, 1], states.body_velocity[:, 0])
    return [
        Steady(
            float(speed[i]),
            float(states.velocity[i, 2]),
            float(states.rates[i, 2]),
            float(drift[i]),
            float(states.euler[i, 1]),
            float(states.battery_a[i]),
        )
        for i in range(plant.vehicles)
    ]


def tracks(orders: Sequence[Order], before_s: float, after_s: float, step_s: float = 0.1) -> tuple[Array, Array]:
    """Positions (T, N, 3) m and speeds (T, N) m/s from the moment when each order follows a straight run at cruise."""
    plant = fleet(orders)
    give(plant, [Order(max(order.throttle, CRUISE)) for order in orders])
    plant.run_until(before_s)
    give(plant, orders)
    positions, speeds = [], []
    for k in range(round(after_s / step_s) + 1):
        plant.run_until(before_s + k * step_s)
        positions.append(plant.states.position.copy())
        speeds.append(np.linalg.norm(plant.states.velocity, axis=1))
    return np.array(positions) - np.array(positions[0]), np.array(speeds)


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [head, ["---:"] * len(head), *rows]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in lines) + "\n"


def _speed_section() -> str:
    throttles = [0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, -1.0]
    orders = [Order(throttle) for throttle in throttles]
    nominal, full = steady(orders), steady(orders, charge=1.0)
    rows = [
        [f"{100 * throttle:.0f} %", f"{low.speed:.2f}", f"{high.speed:.2f}", f"{low.battery_a:.2f}"]
        for throttle, low, high in zip(throttles, nominal, full, strict=True)
    ]
    return _table(["throttle", "m/s at 11.1 V", "m/s, battery full", "A at 11.1 V, hotel load included"], rows)


def _turn_section() -> str:
    rudders, throttles = [5.0, 10.0, 20.0, 30.0], [0.3, 0.6, 1.0]
    orders = [Order(throttle, rudder) for throttle in throttles for rudder in rudders]
    rows = [
        [
            f"{100 * order.throttle:.0f} %",
            f"{order.rudder_deg:.0f}",
            f"{turn.speed:.2f}",
            f"{math.degrees(turn.yaw_rate):.1f}",
            f"{turn.radius:.2f}",
            f"{math.degrees(turn.drift):.1f}",
        ]
        for order, turn in zip(orders, steady(orders), strict=True)
    ]
    return _table(["throttle", "rudder, deg", "speed, m/s", "yaw rate, deg/s", "radius, m", "drift, deg"], rows)


def _dive_section() -> str:
    throttles, planes = [0.25, 0.4, 0.6, 1.0], [-20.0, -10.0, 0.0, 10.0, 20.0]
    orders = [Order(throttle, 0.0, plane) for throttle in throttles for plane in planes]
    results = steady(orders)
    rows = []
    for i, throttle in enumerate(throttles):
        part = results[i * len(planes) : (i + 1) * len(planes)]
        cells = [f"{100 * result.sinking:.1f} ({math.degrees(result.pitch):.0f})" for result in part]
        rows.append([f"{100 * throttle:.0f} %", f"{part[2].speed:.2f}", *cells])
    return _table(["throttle", "speed, m/s", *(f"{plane:+.0f} deg" for plane in planes)], rows)


def yaw_decay_s(throttle: float = CRUISE) -> float:
    """Time in which the yaw rate of a gentle turn falls to 1 / e once the rudder is amidships again, s."""
    plant = fleet([Order(throttle)])
    give(plant, [Order(throttle, 2.0)])
    plant.run_until(40.0)
    give(plant, [Order(throttle)])
    start = float(plant.states.rates[0, 2])
    now = plant.now
    while plant.states.rates[0, 2] > start / math.e and plant.now < now + 60.0:
        plant.run_until(plant.now + 0.02)
    return plant.now - now


def _stop_lines() -> str:
    orders = [Order(0.0), Order(-1.0)]
    positions, speeds = tracks(orders, 30.0, 30.0)
    stopped = int(np.argmax(positions[:, 1, 0]))  # the farthest point ahead
    slow = int(np.argmax(speeds[:, 0] < 0.1))
    rise = steady([Order(0.0)])[0]
    return (
        f"- Motor off at cruise ({speeds[0, 0]:.2f} m/s): under 0.1 m/s after {0.1 * slow:.1f} s and "
        f"{positions[slow, 0, 0]:.1f} m.\n"
        f"- Full astern at cruise: at rest after {0.1 * stopped:.1f} s and {positions[stopped, 1, 0]:.1f} m.\n"
        f"- Motor off, at rest: it rises at {-100 * rise.sinking:.1f} cm/s, being 10 g light.\n"
    )


def _picture(path: Path) -> None:
    import matplotlib

    matplotlib.use("Agg")
    matplotlib.rcParams["svg.hashsalt"] = "shoal"
    from matplotlib import pyplot

    figure, (left, middle, right) = pyplot.subplots(1, 3, figsize=(12.0, 4.0), layout="constrained")
    throttles = [0.1 * k for k in range(1, 11)]
    for charge, label in ((1.0, "battery full"), (NOMINAL_CHARGE, "11.1 V")):
        left.plot(throttles, [s.speed for s in steady([Order(t) for t in throttles], charge=charge)], label=label)
    left.set(xlabel="throttle", ylabel="speed, m/s", title="Speed")
    rudders = [10.0, 20.0, 30.0]
    positions, _ = tracks([Order(CRUISE, rudder) for rudder in rudders], 30.0, 30.0)
    for i, rudder in enumerate(rudders):
        middle.plot(positions[:, i, 1], positions[:, i, 0], label=f"rudder {rudder:.0f} deg")
    middle.set(xlabel="starboard, m", ylabel="ahead, m", title="Turning at cruise throttle, 30 s", aspect="equal")
    planes = [-20.0, -10.0, 10.0, 20.0]
    positions, _ = tracks([Order(CRUISE, 0.0, plane) for plane in planes], 30.0, 20.0)
    for i, plane in enumerate(planes):
        right.plot(positions[:, i, 0], -positions[:, i, 2], label=f"planes {plane:+.0f} deg")
    right.set(xlabel="ahead, m", ylabel="up, m", title="Diving at cruise throttle, 20 s")
    for axes in (left, middle, right):
        axes.grid(alpha=0.3)
        axes.legend(fontsize=8)
    figure.savefig(path, metadata={"Date": None})
    pyplot.close(figure)


def page() -> str:
    """The text of docs/hull.md, every figure measured now."""
    return f"""# How the simulated hull handles

Written by `python -m sim.plant.manoeuvres` from trials of the hull in `sim/plant/hulls/neptune.toml`; a coefficient
changed there changes this page. Nobody has towed this hull: coefficients marked "assumed" are guesses that give its
known speed and turning circle.

![Speed, turning and diving](hull.svg)

## Speed

{_speed_section()}
## Turning

The radius hardly depends on speed: a turn is a geometry, its rate grows with speed. The rudder stands in the
propeller's race, so it answers from rest as soon as the propeller turns ahead; without thrust it answers to speed
alone. The hull is directionally stable: at cruise a yaw rate falls to 1 / e within {yaw_decay_s():.1f} s of the rudder
coming amidships.

{_turn_section()}
## Depth

Sinking in cm/s (pitch in degrees) once settled, by bow planes. Positive planes lift the bow. The righting moment
limits pitch at low speed, and below about 0.2 m/s the planes hardly overcome the 10 g of buoyancy.

{_dive_section()}
## Stopping and floating up

{_stop_lines()}"""


def main() -> None:
    """Writes page and picture."""
    docs = ROOT / "docs"
    docs.mkdir(exist_ok=True)
    _picture(docs / "hull.svg")
    (docs / "hull.md").write_text(page(), encoding="utf-8")
    print(f"wrote {docs / 'hull.md'} and {docs / 'hull.svg'}")


if __name__ == "__main__":
    main()
