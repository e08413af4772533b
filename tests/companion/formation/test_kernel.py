"""The compiled auction against the interpreted one, to the bit, and both against the optimum."""

from __future__ import annotations

import random
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linear_sum_assignment

from companion.formation import kernel
from companion.formation.auction import auction, backend, interpreted, ways

pytestmark = pytest.mark.skipif(backend() == "interpreted", reason="no compiler has been here")


@st.composite
def markets(draw: st.DrawFn) -> tuple[list[list[float]], list[int], list[int]]:
    points, columns = draw(st.integers(0, 9)), draw(st.integers(0, 9))
    price = st.one_of(st.floats(0.0, 1e4), st.sampled_from([0.0, 1.0, 2.0, 5.0]))
    costs = [[draw(price) for _ in range(columns)] for _ in range(points)]
    seats = [draw(st.integers(1, 3)) for _ in range(columns)]
    order = list(range(points))
    random.Random(draw(st.integers(0, 9))).shuffle(order)
    return costs, seats, order


@settings(max_examples=300, deadline=None)
@given(markets())
def test_compiled_and_interpreted_say_the_same_to_the_bit(
    market: tuple[list[list[float]], list[int], list[int]],
) -> None:
    costs, seats, order = market
    assert auction(costs, seats, order) == interpreted(costs, seats, order)
    assert auction(costs) == interpreted(costs)


@pytest.mark.parametrize(("points", "columns", "cases"), [(6, 6, 50), (15, 15, 40), (40, 60, 5), (60, 40, 5)])
def test_they_agree_at_sea_and_prove_how_good_they_are(points: int, columns: int, cases: int) -> None:
    for seed in range(cases):
        draw = np.random.default_rng((seed, points, columns))
        costs = ways(draw.uniform(-20, 20, (points, 3)), draw.uniform(-20, 20, (columns, 3)))
        result = auction(costs)
        assert result == interpreted(costs)
        rows, best = linear_sum_assignment(costs)
        optimum = float(costs[rows, best].sum())
        assert optimum - 1e-9 <= result.total <= optimum * 1.0001
        assert result.bound <= optimum + 1e-9, "the certificate is a lower bound"
        assert result.gap <= 1e-4 * optimum


def test_a_thousand_vehicles_find_the_optimum() -> None:
    draw = np.random.default_rng(1)
    costs = ways(draw.uniform(-100, 100, (1000, 3)), draw.uniform(-100, 100, (1000, 3)))
    result = auction(costs)
    rows, best = linear_sum_assignment(costs)
    assert result.total <= 1.0001 * costs[rows, best].sum()
    assert sorted(result.winner) == list(range(1000))


def test_ways_are_the_same_to_the_bit_compiled_or_not(monkeypatch: pytest.MonkeyPatch) -> None:
    draw = np.random.default_rng(2)
    points, vehicles = draw.uniform(-20, 20, (9, 3)), draw.uniform(-20, 20, (7, 3))
    compiled = ways(points, vehicles)
    monkeypatch.setattr("companion.formation.auction._COMPILED", None)
    assert ways(points, vehicles).tobytes() == compiled.tobytes()
    assert backend() == "interpreted"


def test_a_column_without_a_seat_is_refused() -> None:
    with pytest.raises(ValueError, match=r"seats = \[1, 0\]: must be at least 1 each"):
        auction([[1.0, 2.0]], [1, 0])


def test_a_library_of_another_machine_is_no_library(tmp_path: Path) -> None:
    other = tmp_path / "libkernel.so"
    other.write_bytes(b"\x7fELF of another machine")
    with pytest.raises(OSError, match="libkernel"):
        kernel.Kernel(other)
