"""Algorithm 1 of Li and Zhu (2018): the SOM whose output neurons, the vehicles, are drawn to the formation's points.

Two forms by name: `PAPER` does what is printed, which seldom converges, and `SOM` is the same with eight repairs, which
always does. What differs between them is a setting, so that each repair can be tried alone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from companion.mission import FASTER, SLOWER

Array = NDArray[np.float64]

_EARTH_M = 4e7  # once round the Earth


def real(places: Array) -> NDArray[np.bool_]:
    """Marks (N,) the rows of (N, 3) that can be places: finite, and on this planet."""
    with np.errstate(invalid="ignore"):
        fit: NDArray[np.bool_] = (np.abs(places) < _EARTH_M).all(axis=1)
    return fit


def real_lengths(lengths: Array) -> Array:
    """The lengths (N,) m, those that cannot be as 0 or the most there can be."""
    fit: Array = np.clip(np.nan_to_num(lengths), 0.0, _EARTH_M)
    return fit


@dataclass(frozen=True, slots=True)
class SomSettings:
    """Parameters of Algorithm 1; symbols and equation numbers of the paper in the comments.

    Raises ValueError when a gain breaks the condition of stability 0 < alpha f < 2: a move toward a point must end
    nearer to it.
    """

    gain: float = 0.5  # alpha, of eq 6
    slower: float = SLOWER  # s, of eq 8: for points to be reached later
    faster: float = FASTER  # f, of eq 8: for points to be reached sooner
    radius_m: float = 5.0  # gamma, of eq 4
    breadth_m: float = 5.0  # Go, of eq 4
    decay: float = 0.2  # mu, of eq 4: G(t) = (1 - mu)^t Go, with t counting sweeps
    reach_m: float = 0.1  # D_min, of eq 6
    safe_length_m: float = 60.0  # S, of eq 2
    max_length_m: float = 120.0  # S_max, of eq 2
    exponent: float = 1.0  # p of the cost (P + d)^p where workload_weights is off
    neighbours_follow: bool = False  # eq 6 moves the winner's neighbours too
    one_win_a_sweep: bool = True  # a neuron that won rests until the next sweep
    workload_weights: bool = False  # D by eqs 2 and 5, also where it is compared with D_min
    max_sweeps: int = 200

    def __post_init__(self) -> None:
        for name, value in (("gain", self.gain), ("slower", self.slower), ("faster", self.faster)):
            gain = value if name == "gain" else value * self.gain
            if not 0.0 < gain < 2.0:
                raise ValueError(f"{name} makes a gain of {gain:g}, must be above 0 and below 2 (stability of eq 6)")


SOM = SomSettings()
PAPER = SomSettings(
    breadth_m=0.2, decay=5.0, neighbours_follow=True, one_win_a_sweep=False, workload_weights=True
)  # Table I, optimised for 6 vehicles
PAPER_TYPICAL = replace(PAPER, breadth_m=0.5, radius_m=3.0)  # Table I, typical values


@dataclass(frozen=True, slots=True)
class Organisation:
    """What Algorithm 1 came to.

    winner[l] is the vehicle that reached point l, -1 where none did; `neurons` (K, J, 3) m are the positions R after
    each of K - 1 sweeps, the first ones being the vehicles'; `lengths` (J,) m are the ways of the neurons.
    """

    winner: tuple[int, ...]
    neurons: Array
    lengths: Array
    converged: bool

    @property
    def sweeps(self) -> int:
        """How many times all open points were presented."""
        return len(self.neurons) - 1


def organise(
    points: Array,
    vehicles: Array,
    settings: SomSettings = SOM,
    seed: int | tuple[int, ...] = 0,
    travelled: Array | None = None,
    urgency: Array | None = None,
) -> Organisation:
    """Runs Algorithm 1 until every point has a vehicle, every vehicle a point, or the sweeps are used up.

    `points` (L, 3) and `vehicles` (J, 3) m, mission frame; rows that are no places take no part. `travelled` (J,) m is
    P, the lengths so far. `urgency` (L,) is -1, 0 or 1: reach a point slower (s), as usual or faster (f of eq 8).
    """
    random = np.random.default_rng(seed)
    state = _State(points, vehicles, travelled)
    gains = settings.gain * np.ones(len(points))
    if urgency is not None:
        gains *= np.choose(np.sign(urgency).astype(int) + 1, (settings.slower, 1.0, settings.faster))
    history = [state.neurons.copy()]
    for sweep in range(settings.max_sweeps):
        if state.settled:
            break
        rested = ~state.arrived
        for point in random.permutation(len(points)):
            if state.open[point]:
                _present(state, int(point), sweep, float(gains[point]), rested, settings)
        history.append(state.neurons.copy())
    return Organisation(tuple(state.winner.tolist()), np.array(history), state.walked, state.settled)


class _State:
    """The network: one mask of points still open and one of neurons that have arrived (R = infinity in the paper)."""

    def __init__(self, points: Array, vehicles: Array, travelled: Array | None) -> None:
        self.points = np.asarray(points, dtype=float)
        self.neurons: Array = np.array(vehicles, dtype=float)
        self.open = real(self.points)
        self.arrived = ~real(self.neurons)
        self.winner = np.full(len(self.points), -1)
        self.before: Array = np.zeros(len(self.neurons)) if travelled is None else real_lengths(travelled)
        self.walked: Array = np.zeros(len(self.neurons))

    @property
    def settled(self) -> bool:
        return not self.open.any() or bool(self.arrived.all())


# One point is presented: a winner is found, and moves toward it, alone or with its neighbours.
def _present(
    state: _State, point: int, sweep: int, gain: float, rested: NDArray[np.bool_], settings: SomSettings
) -> None:
    toward = state.points[point] - state.neurons
    distance = np.sqrt((toward * toward).sum(axis=1))  # eq 3
    weighted = _weighted(distance, state, settings)
    weighted[state.arrived] = np.inf
    if settings.one_win_a_sweep:
        weighted = np.where(rested, weighted, np.inf)
    winner = int(weighted.argmin())  # eq 1
    if not weighted[winner] < np.inf:
        return
    rested[winner] = False
    near = weighted[winner] if settings.workload_weights else distance[winner]
    if near < settings.reach_m:
        state.walked[winner] += distance[winner]
        state.neurons[winner] = state.points[point]
        state.winner[point] = winner
        state.open[point] = False
        state.arrived[winner] = True
        return
    if settings.neighbours_follow:
        pull = gain * _neighbourhood(state.neurons, winner, sweep, settings)
        pull[state.arrived] = 0.0
        state.walked[~state.arrived] += (pull * distance)[~state.arrived]
        state.neurons[~state.arrived] += (pull[:, None] * toward)[~state.arrived]  # eqs 6 and 7
    else:
        state.walked[winner] += gain * distance[winner]
        state.neurons[winner] += gain * toward[winner]


# D of eq 2 with the workload V of eq 5; or (P + d)^p, in which a longer way so far counts as a longer way to go.
def _weighted(distance: Array, state: _State, settings: SomSettings) -> Array:
    if not settings.workload_weights:
        cost: Array = (state.before + distance) ** settings.exponent
        return cost
    length = state.before + state.walked
    workload = (length - length.mean()) / (settings.safe_length_m + length.mean())
    weighted: Array = np.where(length < settings.safe_length_m, distance, distance * (1.0 + workload))
    weighted[length >= settings.max_length_m] = np.inf
    return weighted


# f of eq 4: 1 for the winner, falling with the distance d_m from it, 0 beyond gamma.
def _neighbourhood(neurons: Array, winner: int, sweep: int, settings: SomSettings) -> Array:
    away = ((neurons - neurons[winner]) ** 2).sum(axis=1)
    rate = abs(1.0 - settings.decay)  # G enters squared: its sign, which alternates as printed, has no effect
    exponent = 2.0 * (sweep * math.log(rate) + math.log(settings.breadth_m)) if rate > 0.0 else -600.0
    squared_breadth = math.exp(min(max(exponent, -600.0), 600.0))
    pull: Array = np.where(away < settings.radius_m**2, np.exp(-np.minimum(away / squared_breadth, 700.0)), 0.0)
    return pull
