"""The command `shoal` on the vehicle: run the companion, check its files."""

from __future__ import annotations

import argparse
import json
import sys
import tomllib
from collections.abc import Sequence
from pathlib import Path

from companion.config import ConfigError, load
from companion.config.vehicle import VehicleConfig, load_vehicle
from companion.mission import Mission, load_mission

EXIT_BAD_CONFIG = 2

_EPILOG = (
    "Exit status: 0 when all is well, 2 when a file or an argument is wrong. Errors name file, section, key and range."
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs one command of `shoal`; returns its exit status."""
    parser = _parser()
    options = parser.parse_args(arguments)
    try:
        if options.command == "run":
            return _run(options)
        return _check(options.files) if options.command == "check" else _bench(parser, options)
    except ConfigError as error:
        for line in error.lines:
            print(f"shoal: {line}", file=sys.stderr)
        return EXIT_BAD_CONFIG


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="shoal", description="The companion of one vehicle of a formation without leader.", epilog=_EPILOG
    )
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    run = commands.add_parser(
        "run",
        help="run the companion until SIGTERM",
        description=(
            "Runs the companion of this vehicle: ten times a second it takes sightings and telemetry, picks its point "
            "of the formation and commands the firmware. A serial port or a source of sightings that is absent is "
            "waited for. SIGTERM or Ctrl-C: neutral, disarmed, end."
        ),
        epilog=_EPILOG,
    )
    run.add_argument("--config", type=Path, required=True, metavar="FILE", help="the vehicle file (TOML)")
    run.add_argument(
        "--status-json", action="store_true", help="print every tick's status as one line of JSON instead of text"
    )
    check = commands.add_parser(
        "check",
        help="validate vehicle and mission files",
        description="Validates vehicle files (those with a `vehicle` key or a [serial] section) and mission files, and "
        "says what they ask for. A vehicle file's mission is validated with it.",
        epilog=_EPILOG,
    )
    check.add_argument("files", type=Path, nargs="+", metavar="FILE", help="a vehicle or mission file (TOML)")
    bench = commands.add_parser(
        "bench",
        help="measure the time of a tick on this computer",
        description="Runs ticks of one vehicle in a travelling formation on made-up telemetry; prints one JSON line: "
        "mean microseconds of CPU of each part and of the whole tick. A tick may take 100,000.",
    )
    bench.add_argument("--ticks", type=int, default=1000, metavar="N", help="ticks to measure (default %(default)s)")
    bench.add_argument("--vehicles", type=int, default=6, metavar="N", help="vehicles of the formation (default 6)")
    return parser


def _run(options: argparse.Namespace) -> int:
    vehicle, mission = _load_both(options.config)
    from companion.run import run  # the parts that need hardware libraries, after the files were found good

    return run(vehicle, mission, json_lines=options.status_json)


def _bench(parser: argparse.ArgumentParser, options: argparse.Namespace) -> int:
    if options.ticks < 1 or not 1 <= options.vehicles <= 250:
        parser.error("bench: --ticks must be at least 1 and --vehicles from 1 to 250")
    from companion.bench import measure

    print(json.dumps(measure(options.ticks, options.vehicles)))
    return 0


# Checks every file, so that all that is wrong is told at once.
def _check(files: Sequence[Path]) -> int:
    complaints: list[str] = []
    for path in files:
        try:
            if _is_vehicle(path):
                vehicle, mission = _load_both(path)
                print(
                    f"{path}: vehicle {vehicle.vehicle} on {vehicle.serial.port} at {vehicle.serial.baud} bit/s, good"
                )
                _show(vehicle.mission, mission)
            else:
                _show(path, load_mission(path))
        except ConfigError as error:
            complaints += error.lines
    if complaints:
        raise ConfigError(complaints)
    return 0


# What a file wants to be; one that cannot be read is left to its loader to complain about.
def _is_vehicle(path: Path) -> bool:
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return False
    return "vehicle" in table or "serial" in table


def _load_both(path: Path) -> tuple[VehicleConfig, Mission]:
    vehicle = load_vehicle(path)
    mission = load(Mission, vehicle.mission)
    if vehicle.vehicle > mission.vehicles:
        text = f"must be from 1 to the mission's number of vehicles ({mission.vehicles} in {vehicle.mission})"
        raise ConfigError([f"{path}: vehicle = {vehicle.vehicle}: {text}"])
    return vehicle, mission


# Says what a good mission asks for, when it changes its shape, and what is worth a second thought.
def _show(path: Path, mission: Mission) -> None:
    from companion.formation import VirtualFormation

    virtual = VirtualFormation(mission)
    print(
        f'{path}: mission "{mission.name}", {mission.vehicles} vehicles for {len(mission.points())} points '
        f"({mission.formation.shape}), path of {virtual.length_m:.0f} m at {mission.path.pace_mps:g} m/s, "
        f"until {virtual.end_s:.0f} s, good"
    )
    for config, span in zip(mission.transform, virtual.spans, strict=True):
        begin, end = (f"{value:.1f}" for value in (span.first, span.last))
        unit = "s" if span.stands else "m of the path"
        when = (
            f"jumps to {config.shape} at {begin} {unit}"
            if config.jump
            else f"{config.shape} from {begin} to {end} {unit}"
        )
        print(f"{path}: transformation: {when}")
    for warning in mission.warnings():
        print(f"shoal: warning: {warning.line(str(path))}", file=sys.stderr)


if __name__ == "__main__":
    sys.exit(main())
