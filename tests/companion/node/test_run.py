"""The production command line on a pseudo-terminal in real time: arms, swims and, on SIGTERM, leaves in good order."""

from __future__ import annotations

import contextlib
import json
import os
import pty
import select
import signal
import socket
import subprocess
import sys
import time
import tty
from pathlib import Path

import numpy as np
import pytest

from companion.scene import Sighting
from companion.sightings import SightingError, from_line, to_line
from tests.companion.link.firmware_fake import FirmwareFake

MISSION = "vehicles = 2\n[formation]\nshape = 'line'\n[schedule]\nstart_s = 0\n"
PATIENCE_S = 30.0  # that no working machine needs


def test_shoal_run_swims_until_sigterm_and_leaves_the_vehicle_disarmed(tmp_path: Path) -> None:
    master, slave = pty.openpty()
    tty.setraw(slave)
    address = str(tmp_path / "s")
    server = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    server.bind(address)
    server.listen(1)
    (tmp_path / "mission.toml").write_text(MISSION)
    config = tmp_path / "vehicle.toml"
    config.write_text(
        f'vehicle = 2\nmission = "mission.toml"\n[serial]\nport = "{os.ttyname(slave)}"\n[sightings]\nunix = "s"\n'
    )
    command = [sys.executable, "-m", "companion.cli", "run", "--config", str(config), "--status-json"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, cwd=Path(__file__).parents[3])
    assert process.stdout is not None
    firmware, begun, now, eyes, stopping = FirmwareFake(), time.monotonic(), 0.0, None, False
    with process, contextlib.closing(server):
        lines, rest = [], b""
        while process.poll() is None and (now := time.monotonic() - begun) < PATIENCE_S:
            readable = select.select([master, server.fileno(), process.stdout.fileno()], [], [], 0.02)[0]
            received = os.read(master, 4096) if master in readable else b""
            os.write(master, firmware.exchange(now, received))
            if server.fileno() in readable:
                eyes = server.accept()[0]
            if process.stdout.fileno() in readable:
                *more, rest = (rest + os.read(process.stdout.fileno(), 65536)).split(b"\n")
                lines += [json.loads(line) for line in more]
                for line in more:
                    stamp = json.loads(line)["stamp"]
                    if eyes is not None and not stopping:
                        sight = Sighting(stamp, np.array((2.0, 3.0, 2.0)), 0.05, np.array([[0.0, 6.0, 0.0]]), 20.0)
                        eyes.sendall(to_line(sight))
            if not stopping and sum(speed > 0.0 for _, _, speed in firmware.setpoints) > 15:
                process.send_signal(signal.SIGTERM)
                stopping = True
        process.kill()
    while select.select([master], [], [], 0.0)[0]:
        firmware.exchange(now, os.read(master, 4096))
    os.close(master)
    os.close(slave)
    assert process.returncode == 0
    assert stopping, "it never swam"
    assert firmware.system == 2
    assert not firmware.armed
    assert firmware.setpoints[-1][2] == 0.0
    assert any(status["phase"] == "forming" and status["armed"] and status["neighbours"] == 1 for status in lines)
    assert lines[-1]["hold"] == "stopping"
    assert lines[-1]["failures"] == {}


@pytest.mark.parametrize(
    ("line", "why"),
    [
        (b"{", "not JSON"),
        (b"[]", "must be an object"),
        (b'{"stamp": "now"}', "stamp must be a finite number"),
        (b'{"stamp": 1, "sigma": 0.1, "position": [1, 2]}', "position must be three finite numbers"),
        (b'{"stamp": 1, "sigma": 0.1, "position": null, "relative": [[1, 2, NaN]]}', "relative must be three"),
        (b'{"stamp": 1, "sigma": 0.1, "position": null, "relative": 5}', "relative must be a list"),
        (b'{"stamp": 1, "sigma": Infinity, "position": null}', "sigma must be a finite number"),
    ],
)
def test_a_line_that_is_no_sighting_says_why(line: bytes, why: str) -> None:
    with pytest.raises(SightingError, match=why):
        from_line(line)


def test_a_sighting_survives_the_wire() -> None:
    sighting = Sighting(1.5, np.array((1.0, 2.0, 3.0)), 0.1, np.array([[1.0, 0.0, -1.0]]), 20.0)
    again = from_line(to_line(sighting))
    assert (again.stamp, again.sigma, again.sensing_range) == (1.5, 0.1, 20.0)
    assert again.position is not None
    np.testing.assert_array_equal(again.position, (1.0, 2.0, 3.0))
    np.testing.assert_array_equal(again.relative, sighting.relative)
    nothing = from_line(to_line(Sighting(2.0, None, 0.1)))
    assert nothing.position is None
    assert nothing.relative.shape == (0, 3)
    assert nothing.sensing_range == float("inf")
