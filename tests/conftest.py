"""Settings of every test: generated examples come from a fixed seed, so that a test says the same on every machine."""

from __future__ import annotations

from hypothesis import settings

settings.register_profile("shoal", derandomize=True, deadline=None, database=None)
settings.load_profile("shoal")
