"""The neighbour sensor sees who is in range, as noisily and as often as stated, and never says who it is."""

import numpy as np
import pytest

from sim.sighting import SightingModel, SightingSensor

FLEET = np.array([(0, 0, 2), (5, 0, 2), (0, 7, 2), (30, 0, 2)], dtype=float)


def test_range_noise_and_missed_detections_are_as_stated() -> None:
    sensor = SightingSensor(SightingModel(20.0, 0.03, 0.08, missed=0.25), seed=4, vehicle=0)
    readings = [sensor.read(0.1 * k, FLEET) for k in range(4000)]
    assert max(len(r.relative) for r in readings) == 2  # the fourth vehicle is out of range
    assert np.mean([len(r.relative) for r in readings]) == pytest.approx(1.5, abs=0.05)
    seen = np.concatenate([r.relative for r in readings])
    first = seen[np.linalg.norm(seen - FLEET[1] + FLEET[0], axis=1) < 1.0]
    assert np.mean(first, axis=0) == pytest.approx([5, 0, 0], abs=0.01)
    assert np.std(first, axis=0) == pytest.approx([0.08] * 3, rel=0.05)
    fixes = np.stack([r.position for r in readings if r.position is not None])
    assert np.std(fixes, axis=0) == pytest.approx([0.03] * 3, rel=0.05)


def test_order_tells_nothing() -> None:
    sensor = SightingSensor(SightingModel(relative_sigma_m=0.0), seed=4, vehicle=0)
    first_is_north = [sensor.read(0.1 * k, FLEET).relative[0, 0] == 5.0 for k in range(2000)]
    assert np.mean(first_is_north) == pytest.approx(0.5, abs=0.05)


def test_same_seed_same_readings_whoever_else_draws() -> None:
    model = SightingModel(missed=0.1)
    alone = SightingSensor(model, seed=9, vehicle=1)
    alone_read = [alone.read(0.1 * k, FLEET) for k in range(50)]
    among = [SightingSensor(model, seed=9, vehicle=i) for i in range(4)]
    for k in range(50):
        readings = [sensor.read(0.1 * k, FLEET) for sensor in reversed(among)]
        assert readings[2].relative.tobytes() == alone_read[k].relative.tobytes()
    other = SightingSensor(model, seed=10, vehicle=1).read(0.0, FLEET)
    assert other.relative.tobytes() != alone_read[0].relative.tobytes()
