"""Runs a scenario as on the vehicles: every companion a process of its own on a serial port, in real time.

The plant runs in this process at the pace of the wall clock. Each firmware's line is a pseudo-terminal, each
neighbour sensor a Unix socket that speaks JSON lines, and each companion is started by the command line that starts
it on a vehicle.
"""

from __future__ import annotations

import contextlib
import datetime
import json
import os
import pty
import select
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import tty
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import IO, Any

from companion.events import Severity
from companion.sightings import to_line
from sim.basin import Basin
from sim.history import Event, Snapshot, StatusJson, events_of, stack
from sim.run import SYNCS_A_SAMPLE, SYNCS_A_TICK, Effort, Observer, Outcome
from sim.scenario import SYNC_S, Scenario
from sim.settings import write_settings

_LEAD_S = 4.0  # for the processes to come up before the mission's second 0
_FAREWELL_S = 5.0  # for the processes to bring their vehicles to rest


class Boat:
    """One vehicle's companion process with both ends of its lines."""

    def __init__(self, scenario: Scenario, vehicle: int, folder: Path, sockets: Path, start: datetime.datetime) -> None:
        self.number = vehicle + 1
        self.status: StatusJson | None = None
        self._events: list[Event] = []
        self._lock = threading.Lock()
        self._line, port = pty.openpty()
        tty.setraw(port)
        os.set_blocking(self._line, False)
        self._port = port  # kept open, so that the line lives while the process starts or restarts
        sock = sockets / f"{self.number}"
        self._server = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._server.bind(str(sock))
        self._server.listen(1)
        self._server.setblocking(False)
        self._viewer: socket.socket | None = None
        config = folder / f"vehicle_{self.number}.toml"
        settings: dict[str, Any] = {
            "vehicle": self.number,
            "mission": "mission.toml",
            "serial": {"port": os.ttyname(port), "baud": scenario.config.line.baud},
            "sightings": {"unix": sock},
            "clock": {"start": start},
        }
        if scenario.config.firmware:
            settings["firmware"] = {"parameters": scenario.config.firmware}
        config.write_text(write_settings(settings), encoding="utf-8")
        self._log = (folder / f"vehicle_{self.number}.log").open("wb")
        command = [sys.executable, "-m", "companion.cli", "run", "--config", str(config), "--status-json"]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=self._log, stdin=subprocess.DEVNULL)
        assert self.process.stdout is not None
        self._reader = threading.Thread(target=self._read, args=(self.process.stdout,), daemon=True)
        self._reader.start()

    def exchange(self, from_firmware: bytes) -> bytes:
        """Puts bytes of the firmware on the line and takes those of the companion."""
        if from_firmware:
            with contextlib.suppress(BlockingIOError):
                os.write(self._line, from_firmware)
        received = b""
        with contextlib.suppress(BlockingIOError):
            while select.select([self._line], [], [], 0.0)[0]:
                received += os.read(self._line, 4096)
        return received

    def show(self, line: bytes) -> None:
        """Sends a sighting to whoever listens."""
        if self._viewer is None:
            with contextlib.suppress(BlockingIOError):
                self._viewer, _ = self._server.accept()
                self._viewer.setblocking(False)
        if self._viewer is not None:
            try:
                self._viewer.sendall(line)
            except BlockingIOError:
                pass
            except OSError:
                self._viewer.close()
                self._viewer = None

    def events(self) -> list[Event]:
        """What the companion had to say since the last call."""
        with self._lock:
            events, self._events = self._events, []
        return events

    def stop(self) -> None:
        """Asks the process to end."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)

    def close(self) -> None:
        """Ends the process for certain and lets go of its lines."""
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        self._reader.join()
        for handle in (self._server, self._viewer, self._log, self.process.stdout):
            if handle is not None:
                handle.close()
        os.close(self._line)
        os.close(self._port)

    # In a thread of its own: one status a line.
    def _read(self, stream: IO[bytes]) -> None:
        for line in stream:
            with contextlib.suppress(ValueError, KeyError, TypeError):
                status: StatusJson = json.loads(line)
                events = events_of(status)
                with self._lock:
                    self.status = status
                    self._events += events


def run_processes(
    scenario: Scenario,
    make: str,
    folder: Path,
    *,
    threads: int = 2,
    image: Path | None = None,
    observers: Iterable[Observer] = (),
) -> Outcome:
    """Runs a scenario in real time with a process for each companion; `folder` takes their settings and logs."""
    folder.mkdir(parents=True, exist_ok=True)
    basin = Basin(scenario, make, threads, image)
    (folder / "mission.toml").write_text(write_settings(scenario.mission), encoding="utf-8")
    start = datetime.datetime.now(datetime.UTC) + datetime.timedelta(seconds=_LEAD_S)
    zero = time.monotonic() + _LEAD_S
    with tempfile.TemporaryDirectory(prefix="shoal-") as sockets, contextlib.ExitStack() as stack_of_boats:
        boats = []
        for i in range(scenario.mission.vehicles):
            boat = Boat(scenario, i, folder, Path(sockets), start)
            stack_of_boats.callback(boat.close)
            boats.append(boat)
        snapshots, effort = _swim(basin, boats, zero, [*observers])
        _say_farewell(basin, boats, zero)
        failures = dict(basin.failures)
        for boat in boats:
            status = boat.process.poll()
            if status != 0:
                failures[boat.number] = f"its companion ended with status {status}, see {folder}"
    return Outcome(stack(snapshots), failures, effort)


# The run itself; a companion that ends is an event, and its vehicle is left to the firmware's failsafe.
def _swim(
    basin: Basin, boats: Sequence[Boat], zero: float, watchers: Sequence[Observer]
) -> tuple[list[Snapshot], Effort]:
    snapshots: list[Snapshot] = []
    effort = Effort()
    gone: set[int] = set()
    for sync in range(round(basin.end_s / SYNC_S) + 1):
        now = sync * SYNC_S
        _meet(basin, boats, sync, zero)
        basin.referee()
        if sync % SYNCS_A_SAMPLE == 0:
            events = [event for boat in boats for event in boat.events()]
            events += [Event(now, i, f"firmware failed: {why}", Severity.ERROR) for i, why in basin.new_failures()]
            for boat in boats:
                if boat.number not in gone and boat.process.poll() is not None:
                    gone.add(boat.number)
                    events.append(Event(now, boat.number, "companion ended", Severity.ERROR))
            snapshots.append(basin.snapshot([boat.status for boat in boats], events))
            for watcher in watchers:
                watcher.observe(snapshots[-1])
        basin.advance(now + SYNC_S)
    effort.wall_s = time.monotonic() - zero
    return snapshots, effort


# Water goes on while the companions bring their vehicles to rest.
def _say_farewell(basin: Basin, boats: Sequence[Boat], zero: float) -> None:
    for boat in boats:
        boat.stop()
    first = round(basin.now / SYNC_S) + 1
    for sync in range(first, first + round(_FAREWELL_S / SYNC_S)):
        if all(boat.process.poll() is not None for boat in boats):
            return
        _meet(basin, boats, sync, zero)
        basin.advance((sync + 1) * SYNC_S)


# Waits for the wall clock, then carries bytes and sightings to and fro.
def _meet(basin: Basin, boats: Sequence[Boat], sync: int, zero: float) -> None:
    now = sync * SYNC_S
    time.sleep(max(0.0, zero + now - time.monotonic()))
    basin.look(now)
    for i, boat in enumerate(boats):
        data = boat.exchange(basin.plant.uart_read(i))
        if data:
            basin.plant.uart_write(i, data, at=now)
        if (sync - i) % SYNCS_A_TICK == 0:
            boat.show(to_line(basin.sight(i)))
