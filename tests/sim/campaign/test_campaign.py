"""A campaign from seeds to table: what it counts and asks, how it goes on after a break, what a bad one gets."""

from __future__ import annotations

import io
import math
from pathlib import Path

import numpy as np
import pytest

from companion.config import ConfigError
from sim.campaign import Campaign, Cell, at_least, at_most, conduct, least, names, open_campaign, ratio, share
from sim.campaign.figures import Estimate
from sim.campaign.table import page


def even(seed: int) -> dict[str, float]:
    return {"even": float(seed % 2 == 0), "way": 2.0 + seed, "best": 1.0 + seed}


def broken(seed: int) -> dict[str, float]:
    if seed == 3:
        raise ValueError("three is no good")
    return even(seed)


def campaign(run: object = even, least_share: float = 0.5) -> Campaign:
    asked = {"even": at_least(least_share), "way": at_most(1.2)}
    cells = [Cell("all", run, 10, asked), Cell("few", even, 4)]  # type: ignore[arg-type]
    figures = [share("even", "even"), ratio("way", "way", "best"), least("least", "way")]
    return Campaign("trial", "A trial", "Counts.", figures, cells)


@pytest.mark.parametrize("jobs", [1, 2])
def test_every_seed_of_every_cell_counts(tmp_path: Path, jobs: int) -> None:
    results = conduct(campaign(), tmp_path / "log", None, jobs, io.StringIO())
    assert [result.runs for result in results] == [10, 4]
    assert results[0].estimates[0].value == 0.5
    assert results[0].estimates[1].value == pytest.approx(65.0 / 55.0)
    assert results[1].estimates[2] == Estimate(2.0)
    low, high = results[0].estimates[0].low, results[0].estimates[0].high
    assert low == pytest.approx(0.2366, abs=1e-4)
    assert high == pytest.approx(0.7634, abs=1e-4), "Wilson's interval of 5 in 10"


def test_the_table_names_what_was_missed(tmp_path: Path) -> None:
    asked = campaign(least_share=0.6)
    text = page(asked, conduct(asked, tmp_path / "log", None, 1, io.StringIO()))
    assert "**50.00% (23.66% to 76.34%)**, asked at least 60.00%" in text
    assert "Missed: all: even." in text
    assert "| few | 0 to 3 |" in text


def test_it_goes_on_from_its_log(tmp_path: Path) -> None:
    log = tmp_path / "log"
    conduct(campaign(), log, 3, 1, io.StringIO(), part="all")
    before = log.read_text()
    results = conduct(campaign(), log, None, 1, io.StringIO(), resume=True)
    assert log.read_text().startswith(before)
    assert len(log.read_text().splitlines()) == 14
    assert results[0].runs == 10


def test_a_cell_that_was_not_run_is_named_and_misses_nothing(tmp_path: Path) -> None:
    text = page(campaign(), conduct(campaign(), tmp_path / "log", None, 1, io.StringIO(), part="few"))
    assert "Not run: all." in text
    assert "Every limit holds." in text


def test_a_run_that_breaks_off_says_which_and_why(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="campaign trial, all, seed 3: ValueError: three is no good"):
        conduct(campaign(broken), tmp_path / "log", None, 2, io.StringIO())
    with pytest.raises(ConfigError, match="--cells none"):
        conduct(campaign(), tmp_path / "log", None, 1, io.StringIO(), part="none")
    with pytest.raises(ConfigError, match="no such campaign"):
        open_campaign("nonsense")


def test_a_figure_without_values_is_none() -> None:
    figure = ratio("way", "way", "best")
    estimate = figure.estimate({"way": np.array([math.nan]), "best": np.array([1.0])})
    assert math.isnan(estimate.value)
    assert figure.spell(estimate) == "none"


def test_the_campaigns_that_there_are_can_be_opened() -> None:
    for name in names():
        assert open_campaign(name).name == name
