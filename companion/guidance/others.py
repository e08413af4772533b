"""From the scene to what guidance keeps clear of: where it is, how it will move, and whether it gives way itself."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from companion.guidance.config import GuidanceConfig
from companion.mission import LimitsConfig
from companion.scene import Decision, Neighbour, Scene, Vector

WORLD_M = 1e6  # no place is further off, no speed higher; NaN is not below it either
CLOCKWISE = 0.6  # least cosine between its course and the tangent for a hull to circle


@dataclass(frozen=True, slots=True)
class Hazard:
    """Something to keep clear of: position (3,) m, velocity (3,) m/s over ground, least distance between centres m.

    It is taken to keep its speed and, for `turn_memory_s`, its turn rate, rad/s; if it `circles` a point, for good.
    One that `reacts` gives way as well, so that each of both need make good a share only of what is short.
    """

    position: Vector
    velocity: Vector
    safe: float
    turn_rate: float = 0.0
    reacts: bool = False
    circles: bool = False


def hazards(scene: Scene, decision: Decision, limits: LimitsConfig, config: GuidanceConfig) -> Iterator[Hazard]:
    """Neighbours and obstacles, those out of this world left out.

    A hull without steerage way does not react, nor does one that circles its point, where all stand on.
    """
    assert scene.own is not None
    north, east, _ = scene.own.current.tolist()
    safe = limits.safe_distance_m + config.barrier.margin_m
    centres = _waiting_places(decision, config)
    radius = config.wait.on_circle_radii * max(limits.waiting_radius_m, config.hull.turning_radius_m)
    for other in scene.neighbours:
        if not sane(other.position, other.velocity):
            continue
        sigma = min(other.sigma, 1.0) if math.isfinite(other.sigma) else 0.0
        vn, ve, _ = other.velocity.tolist()
        through = (vn - north, ve - east)
        moves = math.hypot(*through) > 0.5 * limits.steerage_speed_mps
        if moves and _circles(other, through, centres, radius):
            yield Hazard(other.position, other.velocity, safe + sigma, math.tau / config.wait.period_s, circles=True)
        else:
            rate = other.turn_rate if math.isfinite(other.turn_rate) else 0.0
            yield Hazard(other.position, other.velocity, safe + sigma, rate, reacts=moves)
    for thing in scene.obstacles:
        if sane(thing.position, thing.velocity) and abs(thing.radius) < WORLD_M:
            clearance = config.barrier.obstacle_clearance_m
            yield Hazard(thing.position, thing.velocity, clearance + max(thing.radius, 0.0))


def sane(*vectors: Vector) -> bool:
    """Finite, and nothing that a sea could not hold."""
    return all(abs(value) < WORLD_M for vector in vectors for value in vector.tolist())


# Points that vehicles circle: all of them while the formation stands.
def _waiting_places(decision: Decision, config: GuidanceConfig) -> Sequence[Sequence[float]]:
    vn, ve, _ = decision.target_velocity.tolist()
    if math.hypot(vn, ve) >= config.wait.still_mps or not np.isfinite(decision.points).all():
        return ()
    places: list[list[float]] = decision.points.tolist()
    return places


# Whether a vehicle under way swims clockwise round one of the places, within `radius` m of it.
def _circles(other: Neighbour, through: tuple[float, float], places: Sequence[Sequence[float]], radius: float) -> bool:
    north, east, _ = other.position.tolist()
    for place in places:
        dn, de = north - place[0], east - place[1]
        if dn * dn + de * de < radius * radius:
            along = dn * through[1] - de * through[0]
            return bool(along > CLOCKWISE * math.hypot(dn, de) * math.hypot(*through))
    return False
