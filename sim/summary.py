"""The summary of a run: what `summary.json` holds."""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sim.grade import Grade
from sim.run import Outcome
from sim.scenario import Scenario

SIZE_FILE = Path("build/firmware/size.json")


@dataclass(frozen=True, slots=True)
class Summary:
    """Figures of one run; None where a run never came to what a figure measures, or has no such thing.

    `realtime_factor` is simulated seconds a second of wall time, waits for viewers left out; it alone depends on the
    machine.
    """

    scenario: str
    title: str
    seed: int
    mcu: str
    vehicles: int
    success: bool
    points_filled: int
    collisions: int
    min_separation_m: float | None
    mean_length_m: float
    sd_length_m: float
    forming_time_s: float | None
    forming_ratio: float | None
    forming_ratio_hull: float | None
    tracking_rms_m: float | None
    tracking_best_rms_m: float | None
    tracking_max_m: float | None
    duration_s: float
    realtime_factor: float
    firmware_flash_bytes: int | None
    firmware_ram_bytes: int | None
    firmware_worst_tick_ms: float | None
    firmware_missed_ticks: int | None
    criteria: list[dict[str, Any]]

    def write(self, path: Path) -> None:
        """Writes the summary as JSON."""
        path.write_text(json.dumps(dataclasses.asdict(self), indent=2) + "\n", encoding="utf-8")


def summarise(scenario: Scenario, mcu: str, outcome: Outcome, grade: Grade, root: Path) -> Summary:
    """The summary of a graded run; firmware sizes come from the build under `root` and belong to the `avr` make."""
    duration_s, ticks = float(outcome.history.time[-1]), outcome.ticks
    size = firmware_size(root) if mcu == "avr" else {}
    shared = {field.name for field in dataclasses.fields(Summary)} & {f.name for f in dataclasses.fields(Grade)}
    return Summary(
        scenario=scenario.name,
        title=scenario.config.title,
        seed=scenario.mission.seed,
        mcu=mcu,
        vehicles=scenario.mission.vehicles,
        success=grade.success,
        **{name: _rounded(getattr(grade, name)) for name in shared},
        duration_s=round(duration_s, 3),
        realtime_factor=round(duration_s / outcome.effort.wall_s, 2),
        firmware_flash_bytes=size.get("flash_bytes"),
        firmware_ram_bytes=size.get("ram_bytes"),
        firmware_worst_tick_ms=None if ticks is None else round(1e3 * ticks.worst_s, 3),
        firmware_missed_ticks=None if ticks is None else ticks.missed,
        criteria=[dataclasses.asdict(verdict) for verdict in grade.verdicts],
    )


def firmware_size(root: Path) -> dict[str, int]:
    """Flash and RAM of the image as its build measured them; empty when it was not built."""
    try:
        size: dict[str, int] = json.loads((root / SIZE_FILE).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return size


def _rounded(value: Any) -> Any:
    return round(value, 4) if isinstance(value, float) else value
