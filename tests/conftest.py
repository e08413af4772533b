"""Settings of every test: examples come from a fixed seed; what needs avr-gcc and libsimavr is skipped without them."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest
from hypothesis import settings

ROOT = Path(__file__).resolve().parents[1]

settings.register_profile("shoal", derandomize=True, deadline=None, database=None)
settings.load_profile("shoal")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Skip the tests marked avr on a host that cannot build the image or the library round simavr."""
    marked = [item for item in items if item.get_closest_marker("avr")]
    if marked and subprocess.run([ROOT / "scripts/setup", "mcu"], capture_output=True, check=True).stdout != b"avr\n":
        for item in marked:
            item.add_marker(pytest.mark.skip(reason="no avr-gcc or no libsimavr on this host"))
