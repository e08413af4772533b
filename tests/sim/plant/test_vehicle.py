"""Whole vehicles with their firmware, in both makes: they wake up, and every byte is the same however they are run."""

from __future__ import annotations

from typing import Any

import pytest

from sim.plant import Plant, PlantError
from sim.plant.library import ffi

STARTS = [[4.0 * i, 0.0, 1.0, 0.8 * i] for i in range(3)]
MAKES = [pytest.param("avr", marks=pytest.mark.avr), "native"]


def vehicles(make: str, **options: Any) -> Plant:
    try:
        return Plant(make, starts=STARTS, seed=5, **options)
    except PlantError as error:
        if "missing" in str(error):
            pytest.skip(f"make {make}: {error}")
        raise


def voyage(make: str, slice_s: float, threads: int) -> list[bytes]:
    """A second of three vehicles; what each has sent, sensed and done, as bytes."""
    plant = vehicles(make, threads=threads)
    sent = [b""] * plant.vehicles
    for k in range(1, round(1.0 / slice_s) + 1):
        plant.run_until(k * slice_s)
        sent = [before + plant.uart_read(i) for i, before in enumerate(sent)]
    states = plant.states
    return [
        sent[i]
        + states.position[i].tobytes()
        + states.quaternion[i].tobytes()
        + states.pulses[i].tobytes()
        + bytes(ffi.buffer(ffi.addressof(plant.readings(i)[0])))
        for i in range(plant.vehicles)
    ]


@pytest.mark.parametrize("make", MAKES)
def test_it_wakes_up_speaks_and_keeps_its_actuators_neutral(make: str) -> None:
    plant = vehicles(make)
    plant.run_until(1.0)
    for i in range(plant.vehicles):
        assert b"\xfd" in plant.uart_read(i), "MAVLink 2 on the companion's port"
        assert plant.counters(i).resets == 0
    assert abs(plant.states.pulses - 1500.0).max() < 10.0


@pytest.mark.parametrize("make", MAKES)
def test_threads_and_slices_change_no_byte(make: str) -> None:
    reference = voyage(make, 0.02, threads=1)
    assert min(map(len, reference)) > 500, "each has told something"
    assert voyage(make, 0.02, threads=2) == reference
    assert voyage(make, 0.1, threads=2) == reference
