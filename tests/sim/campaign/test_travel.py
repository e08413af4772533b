"""Whole journeys: what is swum in full is what is added up, and nothing is gained by stopping early."""

from __future__ import annotations

import numpy as np
import pytest

from sim.campaign.travel import EVEN, FIXED, PRICE, Journey, swim


@pytest.mark.parametrize("method", [FIXED, PRICE])
def test_the_way_of_a_point_is_what_its_vehicle_swims(method: object) -> None:
    journey = Journey(6, bend_deg=90.0, turn=True)
    swum, added = (swim(journey, method, 5, full) for full in (True, False))  # type: ignore[arg-type]
    assert swum.whole
    assert added.whole
    np.testing.assert_allclose(added.lengths, swum.lengths, atol=0.2)
    assert abs((added.lengths - swum.lengths).mean()) < 0.1


@pytest.mark.parametrize("displaced", [False, True])
@pytest.mark.parametrize("count", [6, 15])
@pytest.mark.parametrize(("bend_deg", "turn"), [(45.0, False), (45.0, True), (90.0, True)])
def test_journeys_are_missions_that_can_be_swum(count: int, displaced: bool, bend_deg: float, turn: bool) -> None:
    journey = Journey(count, displaced, bend_deg, turn)
    assert not list(journey.mission(EVEN).problems())
    assert len(journey.starts(1)) == count
