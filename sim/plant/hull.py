"""From a hull's coefficients to the parameters of its equations of motion: added mass, damping, slices, fins."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim.plant.coefficients import Coefficients, read
from sim.plant.library import PlantError, ffi

HULLS = Path(__file__).with_name("hulls")
SERVOS = {"bow": 0, "stern": 1, "fixed": -1}
MAX_STRIPS, MAX_FINS, CHARGE_POINTS = 24, 8, 11

Matrix = NDArray[np.float64]  # shape (6, 6)


def lamb_factors(length: float, diameter: float) -> tuple[float, float, float]:
    """Added mass of a prolate spheroid over its own: k1 along, k2 across, k' of the moment of inertia across.

    Lamb 1932, sec. 114 and 115, as in Fossen 2021, eq. 8.21 to 8.25.
    """
    e = math.sqrt(1.0 - (diameter / length) ** 2)
    logarithm = math.log((1.0 + e) / (1.0 - e))
    alpha = 2.0 * (1.0 - e**2) / e**3 * (0.5 * logarithm - e)
    beta = 1.0 / e**2 - (1.0 - e**2) / (2.0 * e**3) * logarithm
    k_turning = e**4 * (beta - alpha) / ((2.0 - e**2) * (2.0 * e**2 - (2.0 - e**2) * (beta - alpha)))
    return alpha / (2.0 - alpha), beta / (2.0 - beta), k_turning


def rigid_body_mass(mass: float, inertia: NDArray[np.float64], centre: NDArray[np.float64]) -> Matrix:
    """M_RB (6, 6) about the origin from mass, inertia (3, 3) about the centre of gravity and that centre (3,) m.

    Fossen 2021, eq. 3.41: H^T M_CG H.
    """
    x, y, z = centre
    transform = np.eye(6)
    transform[:3, 3:] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    at_centre = np.zeros((6, 6))
    at_centre[:3, :3] = mass * np.eye(3)
    at_centre[3:, 3:] = inertia
    return np.asarray(transform.T @ at_centre @ transform)


def _fill_mass(c: Coefficients, out: Any) -> tuple[Matrix, float, float]:
    length, diameter, mass = c.number("body.length"), c.number("body.diameter"), c.number("body.mass")
    gravity = c.number("water.gravity")
    centre = np.array(c.vector("body.centre_of_gravity", 3))
    buoyancy_centre = np.array(c.vector("body.centre_of_buoyancy", 3))
    roll_inertia = 0.4 * mass * (0.5 * diameter) ** 2  # of a homogeneous spheroid
    turn_inertia = 0.2 * mass * ((0.5 * length) ** 2 + (0.5 * diameter) ** 2)
    k1, k2, k_turning = lamb_factors(length, diameter)
    rigid = rigid_body_mass(mass, np.diag([roll_inertia, turn_inertia, turn_inertia]), centre)
    added_roll = c.number("body.added_roll_inertia") * roll_inertia
    added_turn = k_turning * turn_inertia
    added = np.diag([k1 * mass, k2 * mass, k2 * mass, added_roll, added_turn, added_turn])
    out.density_kgm3, out.gravity_mps2 = c.number("water.density"), gravity
    out.weight_n = mass * gravity
    out.buoyancy_n = (mass + c.number("body.lightness")) * gravity
    out.centre_of_gravity_m, out.centre_of_buoyancy_m = list(centre), list(buoyancy_centre)
    out.rigid_body, out.added_mass = rigid.tolist(), added.tolist()
    out.mass_inverse = np.linalg.inv(rigid + added).tolist()
    out.munk = c.number("body.munk")
    stiffness = out.weight_n * centre[2] - out.buoyancy_n * buoyancy_centre[2]
    if stiffness <= 0.0:
        raise PlantError(f"{c.origin}: body.centre_of_gravity: must lie below the centre of buoyancy")
    return rigid + added, stiffness, diameter


def _fill_damping(c: Coefficients, out: Any, mass: Matrix, stiffness: float, diameter: float) -> None:
    """Fossen 2021, sec. 8.4.2: time constants in surge, sway, heave and yaw, damping ratios in roll and pitch."""
    out.linear_damping = [
        mass[0, 0] / c.number("damping.surge_time"),
        mass[1, 1] / c.number("damping.sway_time"),
        mass[2, 2] / c.number("damping.heave_time"),
        2.0 * c.number("damping.roll_ratio") * math.sqrt(stiffness * mass[3, 3]),
        2.0 * c.number("damping.pitch_ratio") * math.sqrt(stiffness * mass[4, 4]),
        mass[5, 5] / c.number("damping.yaw_time"),
    ]
    out.damping_decay = c.vector("damping.decay", 6)
    frontal = 0.25 * math.pi * diameter**2
    out.quadratic_damping[0] = 0.5 * out.density_kgm3 * frontal * c.number("drag.axial")
    out.quadratic_damping[3] = c.number("drag.roll")
    out.crossflow_drag = [c.number("drag.lateral"), c.number("drag.vertical")]
    area = c.number("lift.area")
    out.lift_area_m2 = [c.number("lift.lateral") * area, c.number("lift.vertical") * area]
    out.lift_x_m = c.number("lift.x")
    out.induced_drag = 1.0 / (math.pi * c.number("lift.efficiency") * c.number("lift.aspect_ratio") * area)


def _fill_strips(c: Coefficients, out: Any) -> None:
    count = int(c.number("strips.stations"))
    if not 1 <= count <= MAX_STRIPS:
        raise PlantError(f"{c.origin}: strips.stations = {count}: must be 1 to {MAX_STRIPS}")
    length, diameter = c.number("strips.length"), c.number("body.diameter")
    edges = np.linspace(-0.5, 0.5, count + 1)
    x = 0.5 * (edges[:-1] + edges[1:])
    if c.word("strips.profile", ("spheroid", "cylinder")) == "spheroid":
        square = 1.0 - 4.0 * (edges[1:] ** 2 + edges[1:] * edges[:-1] + edges[:-1] ** 2) / 3.0  # mean of 1 - 4 x^2
        width = np.sqrt(1.0 - 4.0 * x**2)
    else:
        square, width = np.ones(count), np.ones(count)
    share = square / square.sum()
    out.strip_count = count
    for i in range(count):
        strip = out.strips[i]
        strip.x_m, strip.length_m, strip.diameter_m = x[i] * length, length / count, diameter * width[i]
        strip.buoyancy_share = share[i]
        strip.buoyancy_x_m = out.centre_of_buoyancy_m[0] + x[i] * length


def _fill_fins(c: Coefficients, out: Any) -> None:
    names = c.groups("fin")
    if len(names) > MAX_FINS:
        raise PlantError(f"{c.origin}: {len(names)} fins: must be at most {MAX_FINS}")
    out.fin_count = len(names)
    for fin, name in zip(out.fins, names, strict=False):
        key = f"fin.{name}"
        fin.position_m, fin.normal = c.vector(f"{key}.position", 3), c.vector(f"{key}.normal", 3)
        fin.area_m2, fin.span_m = c.number(f"{key}.area"), c.number(f"{key}.span")
        fin.slope_per_rad, fin.broadside = c.number(f"{key}.slope"), c.number(f"{key}.broadside")
        fin.stall_start, fin.stall_end = (math.sin(math.radians(a)) for a in c.vector(f"{key}.stall", 2))
        fin.profile_drag = c.number(f"{key}.profile_drag")
        fin.flow_straightening = c.number(f"{key}.flow_straightening")
        fin.wash_share, fin.gain = c.number(f"{key}.wash_share"), c.number(f"{key}.gain")
        fin.servo = SERVOS[c.word(f"{key}.servo", tuple(SERVOS))]


def _fill_drive(c: Coefficients, out: Any) -> None:
    out.propeller.position_m = c.vector("propeller.position", 3)
    out.propeller.diameter_m = c.number("propeller.diameter")
    for name in ("kt0", "kt1", "kq0", "kq1", "astern", "wake_fraction", "thrust_deduction", "torque_share"):
        setattr(out.propeller, name, c.number(f"propeller.{name}"))
    motor, battery, servo = out.motor, out.battery, out.servo
    motor.constant_vs, motor.resistance_ohm = c.number("motor.constant"), c.number("motor.resistance")
    motor.inertia_kgm2, motor.friction_nm = c.number("motor.inertia"), c.number("motor.friction")
    motor.current_limit_a = c.number("motor.current_limit")
    motor.neutral_us, motor.span_us, motor.dead_us = (c.number(f"motor.{k}") for k in ("neutral", "span", "dead"))
    battery.capacity_as = 3600.0 * c.number("battery.capacity")
    battery.resistance_ohm, battery.hotel_w = c.number("battery.resistance"), c.number("battery.hotel")
    battery.open_circuit_v = c.vector("battery.open_circuit", CHARGE_POINTS)
    servo.time_constant_s, servo.rate_rps = c.number("servo.time_constant"), math.radians(c.number("servo.rate"))
    servo.limit_rad, servo.neutral_us = math.radians(c.number("servo.limit")), c.number("servo.neutral")
    servo.rad_per_us = math.radians(c.number("servo.travel"))


def coefficients(name: str) -> Coefficients:
    """The declared coefficients of a hull, by the name of its file in `hulls/`."""
    return read(HULLS / f"{name}.toml")


def load_hull(name: str = "neptune", factors: Mapping[str, float] | None = None) -> Any:
    """`hull_parameters` of a hull; `factors` multiply coefficients by pattern, as `{"drag.*": 1.3}`.

    Raises PlantError naming file and coefficient.
    """
    c = coefficients(name).scaled(factors or {})
    out = ffi.new("hull_parameters *")
    mass, stiffness, diameter = _fill_mass(c, out)
    _fill_damping(c, out, mass, stiffness, diameter)
    _fill_strips(c, out)
    _fill_fins(c, out)
    _fill_drive(c, out)
    c.finish()
    return out
