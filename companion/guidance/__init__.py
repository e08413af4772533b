"""Guidance: from a point of the formation to heading, depth and speed."""

from companion.guidance.config import GuidanceConfig
from companion.guidance.guidance import Guidance, GuidanceStatus, Mode

__all__ = ["Guidance", "GuidanceConfig", "GuidanceStatus", "Mode"]
