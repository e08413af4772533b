"""What a vehicle knows of its surroundings, and what it decides: the values that pass between the rooms.

Mission frame: north, east, down (x, y, z; depth is +z), metres. Body frame: forward, right, down. Radians, seconds
since the mission's common start. All arrays are float64 and are not changed after construction.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]  # shape (3,)


@dataclass(frozen=True, slots=True)
class Attitude:
    """Orientation of the body in the mission frame, radians (Z-Y-X Euler angles)."""

    roll: float
    pitch: float
    yaw: float


@dataclass(frozen=True, slots=True)
class OwnPose:
    """Where this vehicle is: position (3,) m, velocity over ground (3,) m/s, one-sigma position error m.

    `current` (3,) m/s is the estimated velocity of the water, so `velocity - current` is the velocity through it.
    """

    position: Vector
    velocity: Vector
    attitude: Attitude
    sigma: float
    stamp: float
    current: Vector = field(default_factory=lambda: np.zeros(3))


@dataclass(frozen=True, slots=True)
class Neighbour:
    """Another vehicle as seen from here, without identity.

    Position and velocity (3,) in the mission frame, m and m/s; sigma is the one-sigma position error, m; age is the
    time since it was last seen, s; travelled is its path length as far as it was watched, m (the workload P);
    turn_rate is that of its course, rad/s, positive to starboard, 0 where it cannot be told.
    """

    position: Vector
    velocity: Vector
    sigma: float
    age: float
    travelled: float
    turn_rate: float = 0.0


@dataclass(frozen=True, slots=True)
class Obstacle:
    """Something to keep clear of that is no neighbour: centre (3,) m, velocity (3,) m/s, radius m."""

    position: Vector
    velocity: Vector
    radius: float


@dataclass(frozen=True, slots=True)
class Scene:
    """Everything perception says at one moment; `own` is None while the vehicle does not know where it is."""

    stamp: float
    own: OwnPose | None
    neighbours: tuple[Neighbour, ...] = ()
    obstacles: tuple[Obstacle, ...] = ()
    sensing_range: float = float("inf")


class Phase(Enum):
    """What the formation is doing, by the mission's clock."""

    WAITING = "waiting"
    FORMING = "forming"
    TRAVEL = "travel"
    DONE = "done"


@dataclass(frozen=True, slots=True)
class Decision:
    """Which point of the formation is this vehicle's own, and where that point is now.

    `point` is its index in the mission's shape, None while the vehicle holds none; `points` (L, 3) m are all points of
    the virtual formation now; `target` and `target_velocity` (3,) belong to the own point; `reason` names why a
    decision is a hold.
    """

    phase: Phase
    point: int | None
    points: NDArray[np.float64]
    target: Vector | None
    target_velocity: Vector
    tracking_error: float | None
    reason: str = ""
    pace_factor: float = 1.0


@dataclass(frozen=True, slots=True)
class Setpoint:
    """What guidance asks of the firmware: heading rad, depth m (down positive), speed through water m/s."""

    heading: float
    depth: float
    speed: float


@dataclass(frozen=True, slots=True)
class Sighting:
    """One reading of the neighbour sensor, the seam behind which a laser will stand.

    `position` (3,) is the own position in the mission frame or None when it is unknown; `relative` (N, 3) are the
    neighbours' positions minus the own one, mission axes, m, in no particular order.
    """

    stamp: float
    position: Vector | None
    sigma: float
    relative: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 3)))
    sensing_range: float = float("inf")
