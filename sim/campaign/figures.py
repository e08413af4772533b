"""What a campaign measures: figures of many runs with their 95 % intervals, and the limits that are asked of them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Samples = Mapping[str, Array]  # of each quantity its values (N,), one a run; NaN where a run has none

_Z = 1.959964  # 95 % of a normal distribution lie within so many standard deviations
_RESAMPLES = 400


@dataclass(frozen=True, slots=True)
class Estimate:
    """A figure and, where it is an estimate of something, its 95 % interval."""

    value: float
    low: float | None = None
    high: float | None = None


@dataclass(frozen=True, slots=True)
class Figure:
    """A column of the table: its title, how it follows from the runs, and how it is spelled (a format of floats)."""

    title: str
    estimate: Callable[[Samples], Estimate]
    spelling: str = ".3f"

    def spell(self, estimate: Estimate) -> str:
        """The figure with its interval as text."""
        if math.isnan(estimate.value):
            return "none"
        text = format(estimate.value, self.spelling)
        if estimate.low is None or estimate.high is None:
            return text
        return f"{text} ({format(estimate.low, self.spelling)} to {format(estimate.high, self.spelling)})"


@dataclass(frozen=True, slots=True)
class Limit:
    """What is asked of a figure."""

    bound: float
    above: bool  # whether the figure must be at least the bound, rather than at most

    def holds(self, estimate: Estimate) -> bool:
        """Whether the figure itself, not only some of its interval, keeps the limit."""
        return estimate.value >= self.bound if self.above else estimate.value <= self.bound

    def spell(self, spelling: str) -> str:
        """The limit as text."""
        return f"{'at least' if self.above else 'at most'} {format(self.bound, spelling)}"


def at_least(bound: float) -> Limit:
    """Asks for no less."""
    return Limit(bound, above=True)


def at_most(bound: float) -> Limit:
    """Asks for no more."""
    return Limit(bound, above=False)


def share(title: str, key: str) -> Figure:
    """The share of runs in which `key` is 1, with Wilson's interval."""

    def estimate(samples: Samples) -> Estimate:
        values = samples[key]
        count = len(values)
        if not count:
            return Estimate(math.nan)
        part = float(np.mean(values == 1.0))
        centre = (part + _Z**2 / (2 * count)) / (1 + _Z**2 / count)
        half = _Z / (1 + _Z**2 / count) * math.sqrt(part * (1 - part) / count + _Z**2 / (4 * count**2))
        return Estimate(part, max(centre - half, 0.0), min(centre + half, 1.0))

    return Figure(title, estimate, ".2%")


def mean(title: str, key: str, spelling: str = ".2f") -> Figure:
    """The mean of `key` over the runs that have it."""

    def estimate(samples: Samples) -> Estimate:
        values = known(samples[key])
        if len(values) < 2:
            return Estimate(float(values[0]) if len(values) else math.nan)
        centre, half = float(values.mean()), _Z * float(values.std(ddof=1)) / math.sqrt(len(values))
        return Estimate(centre, centre - half, centre + half)

    return Figure(title, estimate, spelling)


def ratio(title: str, key: str, over: str, spelling: str = ".3f") -> Figure:
    """The sum of `key` over the sum of `over`, with the interval of a bootstrap over runs."""

    def estimate(samples: Samples) -> Estimate:
        both = np.isfinite(samples[key]) & np.isfinite(samples[over])
        above, below = samples[key][both], samples[over][both]
        if not len(above):
            return Estimate(math.nan)
        picked = np.random.default_rng(0).integers(0, len(above), (_RESAMPLES, len(above)))
        spread = above[picked].sum(axis=1) / below[picked].sum(axis=1)
        low, high = np.quantile(spread, (0.025, 0.975))
        return Estimate(float(above.sum() / below.sum()), float(low), float(high))

    return Figure(title, estimate, spelling)


def least(title: str, key: str, spelling: str = ".2f") -> Figure:
    """The least value of `key` in any run."""
    return Figure(title, lambda samples: Estimate(_extreme(samples[key], np.min)), spelling)


def most(title: str, key: str, spelling: str = ".2f") -> Figure:
    """The greatest value of `key` in any run."""
    return Figure(title, lambda samples: Estimate(_extreme(samples[key], np.max)), spelling)


def quantile(title: str, key: str, part: float, spelling: str = ".2f") -> Figure:
    """The value of `key` that a share `part` of the runs does not exceed."""

    def pick(values: Array) -> float:
        return float(np.quantile(values, part))

    return Figure(title, lambda samples: Estimate(_extreme(samples[key], pick)), spelling)


def known(values: Array) -> Array:
    """Those that are numbers."""
    there: Array = values[np.isfinite(values)]
    return there


def _extreme(values: Array, pick: Callable[[Array], float]) -> float:
    there = known(values)
    return float(pick(there)) if len(there) else math.nan
