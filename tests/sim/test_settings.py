"""Settings written to a file come back as they were."""

import datetime
import tomllib

from companion.config import loads
from companion.config.vehicle import VehicleConfig
from companion.mission import Mission
from sim.scenario import load_scenario
from sim.settings import write_settings


def test_a_mission_survives_being_written() -> None:
    mission = load_scenario("demo", seed=41).mission
    assert loads(Mission, write_settings(mission), "mission.toml") == mission


def test_a_vehicle_file_is_good() -> None:
    start = datetime.datetime(2026, 6, 1, 10, 0, 0, 250000, tzinfo=datetime.UTC)
    settings = {
        "vehicle": 2,
        "mission": 'a "quoted" name.toml',
        "serial": {"port": "/dev/pts/3", "baud": 115200},
        "sightings": {"unix": "2.sock"},
        "clock": {"start": start},
        "firmware": {"parameters": {"ATT_KP": 0.5}},
    }
    text = write_settings(settings)
    assert tomllib.loads(text) == settings
    vehicle = loads(VehicleConfig, text, "vehicle.toml")
    assert vehicle.clock.start == start
    assert vehicle.firmware.parameters == {"ATT_KP": 0.5}
