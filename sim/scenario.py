"""A scenario file: a mission, the water it swims in, how well sensors and lines work, and what must come out."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from companion.config import ConfigError, Problem, load, option, section
from companion.formation import VirtualFormation
from companion.mission import Mission, load_mission
from sim.sighting import SightingModel
from sim.world import Current

SCENARIOS = Path(__file__).parent / "scenarios"
SYNC_S = 0.02  # how often the fleet and its companions meet
_ATTEMPTS = 10_000


@dataclass(frozen=True, slots=True, kw_only=True)
class StartsConfig:
    """Where the vehicles lie when the run begins, at rest, each with a random heading."""

    centre_m: tuple[float, float] = option(
        "Middle of the box: north, east", default=(0.0, 0.0), low=-1e4, high=1e4, unit="m"
    )
    box_m: tuple[float, float] = option(
        "Size of the box: north, east", default=(24.0, 24.0), low=0.0, high=1e4, unit="m"
    )
    least_distance_m: float = option("Least distance between two starts", default=4.0, low=1.0, high=100.0, unit="m")
    depth_m: float = option("Depth of the starts", default=0.5, low=0.0, high=100.0, unit="m")


@dataclass(frozen=True, slots=True, kw_only=True)
class WaterConfig:
    """The current, over ground."""

    north_mps: float = option("Mean current to the north", default=0.0, low=-1.0, high=1.0, unit="m/s")
    east_mps: float = option("Mean current to the east", default=0.0, low=-1.0, high=1.0, unit="m/s")
    shear_per_m: float = option(
        "Share of the mean that is lost with each metre of depth", default=0.0, low=0.0, high=1.0
    )
    turbulence_mps: float = option(
        "RMS of each horizontal component of the eddies", default=0.0, low=0.0, high=0.5, unit="m/s"
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorConfig:
    """The neighbour sensor."""

    range_m: float = option("How far vehicles are seen", default=20.0, low=1.0, high=1e4, unit="m")
    fix_sigma_m: float = option("Noise an axis of the own position", default=0.05, low=0.0, high=5.0, unit="m")
    relative_sigma_m: float = option("Noise an axis of a relative position", default=0.05, low=0.0, high=5.0, unit="m")
    missed: float = option("Share of detections that fail", default=0.0, low=0.0, high=0.9)


@dataclass(frozen=True, slots=True, kw_only=True)
class LineConfig:
    """The serial line between companion and firmware, and the companion's computer."""

    baud: int = option("Line speed", default=115200, choices=(115200, 250000), unit="bit/s")
    byte_noise: float = option("Share of bytes with one bit flipped", default=0.0, low=0.0, high=0.5)
    compute_latency_s: float = option(
        "Time from a sighting to the first byte of the answer", default=SYNC_S, low=SYNC_S, high=0.1, unit="s"
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class CriteriaConfig:
    """What must come out for the run to succeed, and by what measure."""

    points_filled: int | None = option(
        "Least number of points filled at the end of travel; all of them when absent", default=None, low=0, high=1000
    )
    fill_radius_m: float = option(
        "A point is filled while a vehicle of its own is this near", default=1.0, above=0.0, high=10.0, unit="m"
    )
    arrival_radius_m: float = option(
        "As fill_radius_m, while the formation waits and vehicles circle their points",
        default=2.5,
        above=0.0,
        high=10.0,
        unit="m",
    )
    hold_s: float = option("How long points must stay filled", default=5.0, low=0.0, high=600.0, unit="s")
    separation_m: float = option("Hulls nearer than this have collided", default=0.3, low=0.0, high=10.0, unit="m")
    collisions: int = option("Most collisions", default=0, low=0, high=1000)
    forming_time_s: float | None = option(
        "Latest time of the whole formation after the start of forming", default=None, above=0.0, high=86400.0, unit="s"
    )
    settling_s: float = option(
        "Time of travel before it counts as steady", default=20.0, low=0.0, high=86400.0, unit="s"
    )
    tracking_rms_m: float | None = option(
        "Greatest tracking error in steady travel, RMS of all vehicles", default=None, above=0.0, high=10.0, unit="m"
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class ScenarioConfig:
    """One scenario file."""

    title: str = option("What happens, in one line")
    mission: Path = option("Mission file, relative to this file")
    duration_s: float = option("Longest time of the run", above=0.0, high=86400.0, unit="s")
    linger_s: float = option("Time of the run after the end of the path", default=2.0, low=0.0, high=600.0, unit="s")
    firmware: dict[str, float] = option("Firmware parameters", default={}, pattern="[A-Z][A-Z0-9_]{0,15}")
    starts: StartsConfig = section("Where vehicles lie at the beginning", StartsConfig)
    water: WaterConfig = section("The water", WaterConfig)
    sensor: SensorConfig = section("The neighbour sensor", SensorConfig)
    line: LineConfig = section("The line to the firmware", LineConfig)
    criteria: CriteriaConfig = section("What must come out", CriteriaConfig)

    def problems(self) -> Iterator[Problem]:
        """The checks between settings."""
        if self.criteria.hold_s >= self.duration_s:
            yield Problem(
                "criteria", "hold_s", self.criteria.hold_s, f"must be under duration_s ({self.duration_s:g} s)"
            )


@dataclass(frozen=True, slots=True)
class Scenario:
    """A scenario with its mission, checked against each other and ready to run; every draw comes from mission.seed."""

    name: str
    config: ScenarioConfig
    mission: Mission
    starts: NDArray[np.float64]  # (N, 4): north, east, down m, heading rad

    def end_s(self) -> float:
        """When the run ends, s of the mission's clock: a little after the path, or when its time is up."""
        return min(self.config.duration_s, VirtualFormation(self.mission).end_s + self.config.linger_s)

    def current(self) -> Current:
        """The water of this scenario."""
        water = self.config.water
        return Current((water.north_mps, water.east_mps), water.shear_per_m, water.turbulence_mps)

    def sighting(self) -> SightingModel:
        """The neighbour sensor of this scenario."""
        sensor = self.config.sensor
        return SightingModel(sensor.range_m, sensor.fix_sigma_m, sensor.relative_sigma_m, sensor.missed)


def names() -> list[str]:
    """Names of the scenarios that come with the simulator."""
    return sorted(path.stem for path in SCENARIOS.glob("*.toml"))


def load_scenario(name_or_file: str, seed: int | None = None) -> Scenario:
    """A scenario by its name or file, with another seed if wanted; raises ConfigError with everything wrong with it."""
    path = SCENARIOS / f"{name_or_file}.toml"
    if not path.is_file():
        path = Path(name_or_file)
        if not path.is_file():
            known = ", ".join(names())
            raise ConfigError([f"{name_or_file}: no such scenario, must be a file or one of {known}"])
    config = load(ScenarioConfig, path)
    mission = load_mission(config.mission)
    if seed is not None:
        if not 0 <= seed < 2**63:
            raise ConfigError([f"--seed {seed}: must be from 0 to 2^63 - 1"])
        mission = replace(mission, seed=seed)
    points, wanted = len(mission.points()), config.criteria.points_filled
    if wanted is not None and wanted > points:
        line = f"{path}: [criteria] points_filled = {wanted}: must be at most the number of points ({points})"
        raise ConfigError([line])
    starts = _draw_starts(config.starts, mission)
    if starts is None:
        box = list(config.starts.box_m)
        text = (
            f"must hold {mission.vehicles} starts at least {config.starts.least_distance_m:g} m apart: enlarge the box"
        )
        raise ConfigError([f"{path}: [starts] box_m = {box}: {text}"])
    return Scenario(path.stem, config, mission, starts)


# Random starts (N, 4) by rejection, None when the box does not hold them.
def _draw_starts(config: StartsConfig, mission: Mission) -> NDArray[np.float64] | None:
    random = mission.generator(0, "starts")
    half = np.asarray(config.box_m) / 2.0
    taken: list[NDArray[np.float64]] = []
    for _ in range(_ATTEMPTS):
        place = np.asarray(config.centre_m) + random.uniform(-half, half)
        if all(np.linalg.norm(place - other) >= config.least_distance_m for other in taken):
            taken.append(place)
            if len(taken) == mission.vehicles:
                heading = random.uniform(-np.pi, np.pi, mission.vehicles)
                return np.column_stack([taken, np.full(mission.vehicles, config.depth_m), heading])
    return None
