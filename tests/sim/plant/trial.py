"""One hull stepped alone, for tests."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sim.plant.library import ffi, load

Array = NDArray[np.float64]


class Hull:
    """One hull without microcontroller, stepped as often as a test likes; angles in degrees."""

    def __init__(self, parameters: Any, depth: float = 50.0) -> None:
        self.lib = load("null")
        self.parameters = parameters
        self.state = ffi.new("hull_state *", self.lib.hull_at_rest(parameters, [0.0, 0.0, depth], 0.0))
        self.input = ffi.new("hull_input *")

    def order(self, throttle: float = 0.0, rudder: float = 0.0, planes: float = 0.0) -> None:
        self.input.throttle = throttle
        self.input.servo_rad = [math.radians(planes), math.radians(rudder)]

    def run(self, seconds: float, dt: float = 0.002, watch: Callable[[], None] | None = None) -> None:
        for _ in range(round(seconds / dt)):
            self.state[0] = self.lib.hull_step(self.parameters, self.state, self.input, dt)
            if watch:
                watch()

    def move(self, velocity: ArrayLike, rates: ArrayLike) -> None:
        self.state.velocity_mps, self.state.rate_rps = np.asarray(velocity).tolist(), np.asarray(rates).tolist()

    @property
    def position(self) -> Array:
        return np.array(list(self.state.position_m))

    @property
    def nu(self) -> Array:
        """Velocity over ground and rates (6,), body frame."""
        return np.array([*self.state.velocity_mps, *self.state.rate_rps])

    def to_mission(self, body: Array) -> Array:
        out = ffi.new("double[3]")
        self.lib.hull_to_mission(self.state.quaternion, list(body), out)
        return np.array(list(out))

    @property
    def mass(self) -> Array:
        """M_RB + M_A (6, 6)."""
        rows = [self.parameters.rigid_body, self.parameters.added_mass]
        return np.asarray(sum(np.array([list(row) for row in matrix]) for matrix in rows))

    @property
    def energy(self) -> float:
        """Kinetic energy of hull and water, and potential energy of weight and buoyancy, J; deep under water."""
        p = self.parameters
        heavy = self.position + self.to_mission(np.array(list(p.centre_of_gravity_m)))
        light = self.position + self.to_mission(np.array(list(p.centre_of_buoyancy_m)))
        return float(0.5 * self.nu @ self.mass @ self.nu - p.weight_n * heavy[2] + p.buoyancy_n * light[2])
