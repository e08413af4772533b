"""From a point to the heading and speed that a hull without neighbours would take: circling it or following it.

Horizontal vectors are (north, east) pairs of floats, m or m/s, in the mission frame.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from companion.guidance.config import HullConfig, TrackConfig, WaitConfig

Pair = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Course:
    """Heading, rad, and speed through water, m/s, to steer, and the rate, rad/s, at which the heading will turn on.

    `in_step` marks a vehicle that circles its point where the clock says: it stands on, and others give way. `patient`
    marks one on its way to a standing point: it rather slows down than goes round.
    """

    heading: float
    speed: float
    turn_rate: float = 0.0
    in_step: bool = False
    patient: bool = False


def wrap(angle: float) -> float:
    """The same angle within -pi..pi."""
    return math.remainder(angle, math.tau)


def crab(course: float, speed: float, current: Pair) -> float:
    """The heading that keeps `course` over ground at `speed` through water; as near as possible in a strong current."""
    across = current[1] * math.cos(course) - current[0] * math.sin(course)
    return course - math.asin(max(-0.95, min(0.95, across / speed)))


def circle(
    now: float,
    position: Pair,
    centre: Pair,
    current: Pair,
    steerage: float,
    top: float,
    radius: float,
    wait: WaitConfig,
    hull: HullConfig,
) -> Course:
    """Heading and speed to come to a standing point and circle it clockwise.

    A vector field (after Beard and McLain, Small Unmanned Aircraft, 10.2): on the circle along the tangent, and soon
    away from it straight to the centre, since a way along the tangent is longer. The course is taken a heading lag
    ahead, as the circle turns it. Speed brings the vehicle there, and keeps its bearing from its point, in step with
    the clock, which all share: so all circles turn as one, the distances between vehicles are those between their
    points, and they leave side by side.
    """
    dn, de = position[0] - centre[0], position[1] - centre[1]
    distance, bearing = math.hypot(dn, de), math.atan2(de, dn)
    rate = math.tau / wait.period_s
    in_step = False
    if distance > wait.near_radii * radius:
        way = math.sqrt(distance**2 - radius**2)
        early = (bearing + math.acos(radius / distance) - rate * now) % math.tau / rate
        early += wait.period_s * math.ceil(max(way / top - early, 0.0) / wait.period_s)
        speed = max(way / early, wait.approach_mps)
    else:
        late = (rate * now - bearing) % math.tau
        if late > wait.late_share * math.tau:
            late -= math.tau
        in_step = abs(late) < wait.in_step_rad
        speed = min(rate * radius / (1.0 - wait.turning_loss) + wait.step_gain * late, wait.catch_up_mps)
    speed = min(max(speed, steerage), top)
    off = (distance - radius) / radius
    inward = math.atan(wait.convergence * off + wait.directness * max(off, 0.0) ** 2)
    course = bearing + math.pi / 2.0 + inward
    along = speed + current[0] * math.cos(course) + current[1] * math.sin(course)
    turning = max(along, 0.0) / max(distance, radius) * math.cos(inward) ** 2
    return Course(
        crab(course + hull.heading_lag_s * turning, speed, current),
        speed,
        turning,
        in_step,
        distance > wait.near_radii * radius,
    )


def follow(
    position: Pair,
    yaw: float,
    target: Pair,
    velocity: Pair,
    acceleration: Pair,
    current: Pair,
    steerage: float,
    top: float,
    track: TrackConfig,
) -> Course:
    """Heading and speed to travel with a moving point.

    Velocity through water is the point's own plus a correction of the error: across its course by a line of sight to
    a place `lookahead_m` ahead of it, along its course by speed. Far away this becomes the collision course at top
    speed. A hull that is ahead of its point slows down to steerage way and lets it come; where that is still too
    fast it weaves from side to side. It does not turn back.
    """
    wn = velocity[0] + track.lead_s * acceleration[0] - current[0]
    we = velocity[1] + track.lead_s * acceleration[1] - current[1]
    pace = math.hypot(wn, we)
    if pace < 1e-6:
        return Course(math.atan2(target[1] - position[1], target[0] - position[0]), steerage)
    tn, te = wn / pace, we / pace
    en, ee = target[0] - position[0], target[1] - position[1]
    along, across = en * tn + ee * te, ee * tn - en * te
    surge = track.along_gain * along
    sway = across * max(pace, steerage) / track.lookahead_m
    surge, sway = _to_top_speed(pace, surge, sway, top)
    course = math.atan2(te, tn)
    ahead = pace + surge
    if ahead < steerage and along < -track.weave_from_m:
        side = across if abs(across) > track.weave_width_m else wrap(yaw - course)
        turn = min(math.acos(max(ahead, 0.0) / steerage), track.weave_limit_rad)
        return Course(course + math.copysign(turn, side), steerage)
    ahead = max(ahead, steerage)
    sway = math.copysign(min(abs(sway), top), sway)
    heading = course + math.atan2(sway, ahead)
    return Course(heading, min(max(math.hypot(ahead, sway), steerage), top))


def _to_top_speed(pace: float, surge: float, sway: float, top: float) -> Pair:
    """Scales the correction so that pace and correction together stay within top speed."""
    if (pace + surge) ** 2 + sway**2 <= top**2:
        return surge, sway
    square = surge**2 + sway**2
    if square < 1e-12:
        return 0.0, 0.0
    half = pace * surge
    room = max(top**2 - pace**2, 0.0)
    scale = (math.sqrt(half**2 + square * room) - half) / square
    return surge * min(scale, 1.0), sway * min(scale, 1.0)
