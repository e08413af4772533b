"""The numbers perception works with: how good fixes and tracks are, and when they are too old to use."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class PoseConfig:
    """Own-pose filter. Noise is one sigma an axis."""

    fix_limit_s: float = 2.0  # a pose without a fix for longer is no pose
    motion_limit_s: float = 1.0  # nor is one without attitude and speed for longer
    speed_limit_mps: float = 5.0  # no hull is faster, so a faster log is wrong
    speed_noise: float = 0.05  # velocity error of log and heading, m/s per sqrt(Hz)
    current_noise: float = 0.006  # how fast the current may wander, m/s per sqrt(s)
    current_sigma_mps: float = 0.15  # of the current before the first fix
    gate_sigmas: float = 5.0  # a fix further off than this is an outlier ...
    outliers_to_restart: int = 5  # ... unless so many come in a row: then it is the filter that is wrong
    depth_gain: float = 0.5  # alpha of the alpha-beta filter on depth


@dataclass(frozen=True, slots=True)
class TrackConfig:
    """Neighbour tracks. Noise is one sigma an axis."""

    acceleration_noise: float = 0.1  # of a neighbour, m/s^2 per sqrt(Hz)
    start_speed_sigma_mps: float = 0.4  # of a neighbour just seen
    course_memory_s: float = 2.5  # turn rate is told from the course now against that of so long ago
    turn_limit_radps: float = 0.4
    gate_sigmas: float = 4.0
    gate_floor_m: float = 0.5  # half the least distance between two hulls that both swim
    confirm_hits: int = 3  # M ...
    confirm_of: int = 5  # ... of N sightings make a track a neighbour
    age_limit_s: float = 2.0  # a neighbour unseen for longer is forgotten
    duplicate_m: float = 0.25  # two echoes closer than this cannot be two hulls
    stride_m: float = 0.5  # travelled length counts strides, so that noise on a hull at rest adds nothing
    tracks_limit: int = 64


@dataclass(frozen=True, slots=True)
class PerceptionConfig:
    """Everything perception is told before the dive."""

    pose: PoseConfig = PoseConfig()
    tracks: TrackConfig = TrackConfig()
    stamp_tolerance_s: float = 0.5  # a sighting stamped further ahead of the clock is refused
