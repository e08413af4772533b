"""The numbers guidance steers by: how the hull answers, how it keeps a point and how it keeps clear."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class HullConfig:
    """How the hull answers a setpoint."""

    turning_radius_m: float = 1.45  # at full rudder, at any speed
    heading_lag_s: float = 1.5
    speed_lag_s: float = 1.7


@dataclass(frozen=True, slots=True)
class WaitConfig:
    """Circling a point that stands still, in step with everyone else by the mission's clock."""

    period_s: float = 35.0  # of one circle: fast enough for a current to matter little, speed left to correct with
    convergence: float = 2.0  # how sharply the course bends toward the circle
    directness: float = 8.0  # how soon, away from the circle, it leads straight to the point
    on_circle_radii: float = 1.4  # a vehicle that swims round within so many radii of a point circles it
    approach_mps: float = 0.45  # at least, on the way to the circle: rather out of step than late
    near_radii: float = 1.7  # from here on the speed is that of the circle
    turning_loss: float = 0.18  # share of its speed that a hull loses on the circle, asked for on top
    step_gain: float = 0.12  # speed per radian out of step, m/s
    catch_up_mps: float = 0.6  # at most, to come into step
    late_share: float = 0.5  # of a turn: out of step by more counts as early
    in_step_rad: float = 0.8  # out of step by less is in step
    still_mps: float = 0.05  # a point slower than this stands still


@dataclass(frozen=True, slots=True)
class TrackConfig:
    """Following a point that moves."""

    along_gain: float = 0.22  # speed per metre of along-track error, 1/s
    lookahead_m: float = 1.8  # line of sight: cross-track error is closed as if aiming this far ahead
    weave_from_m: float = 0.3  # ahead of the point by more, and slow enough no more, a hull weaves ...
    weave_width_m: float = 0.3  # ... this far to either side ...
    weave_limit_rad: float = 1.0  # ... this far off its course at most
    lead_s: float = 1.0  # the point's velocity is taken this far ahead, for the lag of heading and speed
    depth_lead_s: float = 4.0  # the same of its depth: 1 / DEP_P of the firmware, which follows a slope so much late
    acceleration_lag_s: float = 0.5  # of the estimate of the point's acceleration


@dataclass(frozen=True, slots=True)
class BarrierConfig:
    """Keeping clear of hulls and obstacles."""

    time_constant_s: float = 2.0  # distance may shrink toward the safe one no faster than exponentially with this
    horizon_s: float = 9.0
    doubt: float = 0.25  # others may turn: the distance kept grows by this share of their way ahead ...
    doubt_max_m: float = 0.4  # ... up to this
    turn_memory_s: float = 5.0  # others are taken to keep on turning for so long
    margin_m: float = 0.35  # kept beyond the mission's safe distance
    stand_on_m: float = 0.25  # so much less is asked of a vehicle that circles in step
    obstacle_clearance_m: float = 0.9  # from own centre to an obstacle's surface
    responsibility: float = 0.5  # share of what is short that this hull makes good where the other one reacts too
    speed_cost: float = 0.5  # of a change of speed by top speed, as 1 - cos of a turn
    patient_speed_cost: float = 0.2  # the same on the way to a standing point: a slow way is no longer than a quick one
    left_penalty: float = 0.2  # of any turn to port: both of a pair give way to starboard
    swing_penalty: float = 0.15  # and so does leaving the side chosen before
    vertical_from_m: float = 0.25  # a distance short by more than this calls for depth as well
    vertical_offset_m: float = 0.8


@dataclass(frozen=True, slots=True)
class EscapeConfig:
    """When avoidance holds a vehicle up: a random heading for a while."""

    patience_s: float = 12.0
    progress_m: float = 0.5
    duration_s: float = 4.0


@dataclass(frozen=True, slots=True)
class GuidanceConfig:
    """Everything guidance is told before the dive, apart from the mission's limits."""

    hull: HullConfig = HullConfig()
    wait: WaitConfig = WaitConfig()
    track: TrackConfig = TrackConfig()
    barrier: BarrierConfig = BarrierConfig()
    escape: EscapeConfig = EscapeConfig()
    scene_limit_s: float = 0.5  # an older scene is no scene
