"""Perception: own pose, neighbours and obstacles out of what the sensors say."""

from companion.perception.config import PerceptionConfig, PoseConfig, TrackConfig
from companion.perception.perception import Counters, Motion, Perception

__all__ = ["Counters", "Motion", "Perception", "PerceptionConfig", "PoseConfig", "TrackConfig"]
