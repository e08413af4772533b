"""The firmware's unit tests in C++, built for the host with address and undefined-behaviour sanitizers."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def test_drivers_control_safety_and_link_on_a_fake_board() -> None:
    if not Path("/usr/include/doctest/doctest.h").exists():
        pytest.skip("doctest is not installed (Debian: doctest-dev)")
    subprocess.run(["make", "-s", "-j2", "-f", "tests/firmware/units.mk"], cwd=ROOT, check=True)
    done = subprocess.run([ROOT / "build/tests/firmware/units"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
