"""Conducts a campaign: every seed of every cell, in processes side by side, kept as it goes."""

from __future__ import annotations

import importlib
import json
import math
import multiprocessing
import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TextIO, cast

import numpy as np

from companion.config import ConfigError
from sim.campaign.figures import Array, Estimate, Figure, Limit, Samples

Sample = Mapping[str, float]
REDRAW_S = 0.2
MODULES = ("central", "swarm", "faults", "travel", "fleet")


@dataclass(frozen=True, slots=True)
class Cell:
    """One row of the table: an experiment, how many seeds it gets, and what is asked of its figures, by title.

    `run` takes a seed and returns what it measured; it must be picklable, such as a partial of a module's function.
    """

    name: str
    run: Callable[[int], Sample]
    seeds: int
    asked: Mapping[str, Limit] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Campaign:
    """A table: what it shows, in words, its columns and its rows."""

    name: str
    title: str
    text: str
    figures: Sequence[Figure]
    cells: Sequence[Cell]


@dataclass(frozen=True, slots=True)
class Result:
    """A cell's figures, in the order of the campaign's, and over how many runs."""

    cell: Cell
    runs: int
    estimates: Sequence[Estimate]

    def misses(self, figures: Sequence[Figure]) -> list[str]:
        """The titles of the figures that do not keep their limits; a cell that was not run misses nothing."""
        if not self.runs:
            return []
        pairs = zip(figures, self.estimates, strict=True)
        return [
            figure.title
            for figure, estimate in pairs
            if figure.title in self.cell.asked and not self.cell.asked[figure.title].holds(estimate)
        ]


def names() -> list[str]:
    """The campaigns there are."""
    return [name for name in MODULES if (Path(__file__).parent / f"{name}.py").is_file()]


def open_campaign(name: str) -> Campaign:
    """A campaign by its name; raises ConfigError for an unknown one."""
    if name not in names():
        raise ConfigError([f"{name}: no such campaign, must be one of {', '.join(names())}"])
    return cast(Campaign, importlib.import_module(f"sim.campaign.{name}").CAMPAIGN)


def conduct(
    campaign: Campaign, log: Path, seeds: int | None, jobs: int, out: TextIO, part: str = "", resume: bool = False
) -> list[Result]:
    """Runs the seeds 0, 1, ... of each cell whose name holds `part`; every run is a line of JSON in the file `log`.

    `seeds` replaces the cells' own number; with `resume`, runs that the log holds already are not repeated. Raises
    ConfigError where a run ends in an exception, naming cell and seed.
    """
    done = dict(_logged(log)) if resume else {}
    cells = [(i, cell) for i, cell in enumerate(campaign.cells) if part in cell.name]
    if not cells:
        raise ConfigError([f"--cells {part}: no cell of campaign {campaign.name} has this in its name"])
    todo = [
        (i, seed)
        for i, cell in cells
        for seed in range(cell.seeds if seeds is None else seeds)
        if (cell.name, seed) not in done
    ]
    log.parent.mkdir(parents=True, exist_ok=True)
    counter = _Counter(out, len(todo))
    with log.open("a" if resume else "w", encoding="utf-8") as lines:
        for number, (i, seed, sample) in enumerate(_runs(campaign, todo, jobs)):
            if isinstance(sample, str):
                raise ConfigError([f"campaign {campaign.name}, {campaign.cells[i].name}, seed {seed}: {sample}"])
            done[campaign.cells[i].name, seed] = sample
            lines.write(json.dumps({"cell": campaign.cells[i].name, "seed": seed, **sample}) + "\n")
            lines.flush()
            counter.show(number + 1, campaign.cells[i].name)
    return [_result(campaign, cell, done) for cell in campaign.cells]


def _logged(log: Path) -> Iterator[tuple[tuple[str, int], Sample]]:
    if log.is_file():
        for line in log.read_text(encoding="utf-8").splitlines():
            sample = json.loads(line)
            yield (sample.pop("cell"), sample.pop("seed")), sample


# Everything to be run, in order, by `jobs` processes that give way to whoever sits at the machine.
def _runs(campaign: Campaign, todo: Sequence[tuple[int, int]], jobs: int) -> Iterator[tuple[int, int, Sample | str]]:
    tasks = [(campaign.cells[i].run, seed) for i, seed in todo]
    if jobs == 1:
        results: Iterator[Sample | str] = map(_attempt, tasks)
        yield from ((i, seed, sample) for (i, seed), sample in zip(todo, results, strict=True))
        return
    with multiprocessing.get_context("fork").Pool(jobs, initializer=os.nice, initargs=(10,)) as pool:
        for (i, seed), sample in zip(todo, pool.imap(_attempt, tasks), strict=True):
            yield i, seed, sample


def _attempt(task: tuple[Callable[[int], Sample], int]) -> Sample | str:
    run, seed = task
    try:
        return {key: float(value) for key, value in run(seed).items()}
    except Exception as error:
        return f"{type(error).__name__}: {error}"


def _result(campaign: Campaign, cell: Cell, done: Mapping[tuple[str, int], Sample]) -> Result:
    found = [sample for (name, _), sample in sorted(done.items()) if name == cell.name]
    if not found:
        return Result(cell, 0, [Estimate(math.nan)] * len(campaign.figures))
    keys = dict.fromkeys(key for sample in found for key in sample)
    samples: Samples = _Columns({key: np.array([sample.get(key, np.nan) for sample in found]) for key in keys})
    return Result(cell, len(found), [figure.estimate(samples) for figure in campaign.figures])


class _Columns(dict[str, Array]):
    """Columns of samples; a quantity that a cell does not measure has no values."""

    def __missing__(self, key: str) -> Array:
        return np.array([])


class _Counter:
    """Shows how many runs are done: on a terminal all the time, elsewhere every twentieth of the way."""

    def __init__(self, out: TextIO, count: int) -> None:
        self._out, self._count = out, count
        self._drawn = -math.inf

    def show(self, number: int, name: str) -> None:
        last = number == self._count
        text = f"{number} of {self._count} runs, {name}"
        if self._out.isatty():
            if last or time.monotonic() - self._drawn > REDRAW_S:
                self._drawn = time.monotonic()
                self._out.write(f"\r{text}\x1b[K" + ("\n" if last else ""))
                self._out.flush()
        elif last or number * 20 // self._count != (number - 1) * 20 // self._count:
            print(text, file=self._out, flush=True)
