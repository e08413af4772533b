"""The command `shoal-sim`: run a scenario, list them, run campaigns, report on the paper, measure the simulator."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path

from companion.config import ConfigError
from sim.campaign import conduct, open_campaign
from sim.campaign import names as campaign_names
from sim.campaign.table import page
from sim.grade import Grade
from sim.live import SPEEDS, LivePage, Pace
from sim.plant import PlantError
from sim.progress import Progress
from sim.record import Recorder
from sim.run import Observer, Outcome, run
from sim.scenario import Scenario, load_scenario, names
from sim.summary import Summary, summarise

ROOT = Path(__file__).resolve().parents[1]
EXIT_MISSED, EXIT_BAD_INPUT, EXIT_INTERRUPTED = 1, 2, 130
MAKES = ("avr", "native")

_EPILOG = "Exit status: 0 when the criteria of the scenario hold, 1 when not, 2 when a file or an argument is wrong."


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs one command of `shoal-sim`; returns its exit status."""
    options = _parser().parse_args(arguments)
    try:
        if options.command == "list":
            return _list()
        if options.command == "bench":
            from sim.bench import bench

            return bench(options.seconds, options.threads, ROOT)
        if options.command == "campaign":
            return _campaign(options)
        if options.command == "report":
            return _paper(options)
        return _run(options)
    except (ConfigError, PlantError) as error:
        for line in str(error).splitlines():
            print(f"shoal-sim: {line}", file=sys.stderr)
        return EXIT_BAD_INPUT
    except KeyboardInterrupt:
        return EXIT_INTERRUPTED


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="shoal-sim",
        description="Simulated water for a fleet: the same firmware, the same companions.",
        epilog=_EPILOG,
    )
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    command = commands.add_parser(
        "run",
        help="run a scenario, grade it and report",
        description="Runs a scenario and grades it by its own criteria. Writes summary.json, run.mcap (open it in "
        "Foxglove), pictures and report.html.",
        epilog=_EPILOG,
    )
    command.add_argument("scenario", metavar="NAME|FILE", help="a scenario of `shoal-sim list`, or a scenario file")
    command.add_argument("--mcu", choices=MAKES, default="avr", help="the flashed image in simavr, or the host build")
    command.add_argument("--seed", type=int, help="seed of every random draw; the mission's own when absent")
    command.add_argument(
        "--threads", type=int, default=2, metavar="N", help="threads of the plant; results are the same"
    )
    command.add_argument("--out", type=Path, metavar="DIR", help="where results go (runs/NAME)")
    command.add_argument("--headless", action="store_true", help="no live page, as fast as it goes")
    command.add_argument(
        "--speed", choices=[*(f"{speed:g}" for speed in SPEEDS), "max"], default="8", help="of a run with live page"
    )
    command.add_argument("--port", type=int, default=8642, help="of the live page; a free one when it is taken")
    command.add_argument(
        "--processes", action="store_true", help="each companion a process on a serial port, in real time"
    )
    bench = commands.add_parser("bench", help="how much faster than real time a run is, and what limits it")
    bench.add_argument("--seconds", type=float, default=60.0, help="simulated seconds a run (60)")
    bench.add_argument("--threads", type=int, default=2, metavar="N", help="threads of the plant")
    campaign = commands.add_parser(
        "campaign",
        help="an experiment over many seeds, judged by the figures it must reach",
        description="Runs campaigns and writes a table of each: what was asked, what was measured, over which seeds.",
        epilog="Exit status: 0 when every limit holds, 1 when not, 2 when an argument is wrong or a run broke off.",
    )
    campaign.add_argument("campaign", metavar="NAME", nargs="+", help=f"of {', '.join(campaign_names())}; or all")
    campaign.add_argument("--seeds", type=int, metavar="N", help="seeds a case, instead of the campaign's own number")
    campaign.add_argument("--cells", default="", metavar="TEXT", help="only the cases that have this in their name")
    campaign.add_argument("--jobs", type=int, default=2, metavar="N", help="processes beside each other (2)")
    campaign.add_argument("--resume", action="store_true", help="go on from the runs in the log")
    campaign.add_argument("--log", type=Path, default=Path("runs/campaigns"), metavar="DIR", help="where runs are kept")
    campaign.add_argument("--out", type=Path, default=Path("docs/figures"), metavar="DIR", help="where tables go")
    report = commands.add_parser(
        "report",
        help="the paper's figures and tables as Shoal does them",
        description="Runs the paper's experiments and writes a page with pictures and tables, beside what it prints.",
    )
    report.add_argument("subject", choices=("paper",), help="what to report on")
    report.add_argument("--seeds", type=int, default=30, metavar="N", help="seeds a case (30, some ten minutes)")
    report.add_argument("--jobs", type=int, default=2, metavar="N", help="processes beside each other (2)")
    report.add_argument("--quick", action="store_true", help="six vehicles in point dynamics only")
    report.add_argument("--log", type=Path, default=Path("runs/paper"), metavar="DIR", help="where runs are kept")
    report.add_argument("--out", type=Path, default=Path("docs/paper"), metavar="DIR", help="where the page goes")
    commands.add_parser("list", help="the scenarios that come with the simulator")
    return parser


def _list() -> int:
    for name in names():
        print(f"{name:12} {load_scenario(name).config.title}")
    return 0


def _check_effort(options: argparse.Namespace) -> None:
    if options.seeds is not None and options.seeds < 1:
        raise ConfigError([f"--seeds {options.seeds}: must be at least 1"])
    if not 1 <= options.jobs <= 64:
        raise ConfigError([f"--jobs {options.jobs}: must be from 1 to 64"])


def _paper(options: argparse.Namespace) -> int:
    from sim.paper import Order, write_paper

    _check_effort(options)
    page = write_paper(Order(options.out, options.seeds, options.jobs, options.quick, options.log))
    print(f"report: {page}")
    return 0


def _campaign(options: argparse.Namespace) -> int:
    _check_effort(options)
    wanted = campaign_names() if options.campaign == ["all"] else options.campaign
    missed = False
    for campaign in [open_campaign(name) for name in wanted]:
        log: Path = options.log / f"{campaign.name}.jsonl"
        print(f"campaign {campaign.name}: {campaign.title}", file=sys.stderr)
        results = conduct(campaign, log, options.seeds, options.jobs, sys.stderr, options.cells, options.resume)
        text = page(campaign, results)
        options.out.mkdir(parents=True, exist_ok=True)
        (options.out / f"{campaign.name}.md").write_text(text, encoding="utf-8")
        print(text)
        missed |= any(result.misses(campaign.figures) for result in results)
    return EXIT_MISSED if missed else 0


def _run(options: argparse.Namespace) -> int:
    if not 1 <= options.threads <= 64:
        raise ConfigError([f"--threads {options.threads}: must be from 1 to 64"])
    if not 0 <= options.port <= 65535:
        raise ConfigError([f"--port {options.port}: must be from 0 to 65535"])
    scenario = load_scenario(options.scenario, options.seed)
    for warning in scenario.mission.warnings():
        print(f"shoal-sim: warning: {warning.line(str(scenario.config.mission))}", file=sys.stderr)
    folder: Path = options.out or Path("runs") / scenario.name
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigError([f"--out {folder}: must be a folder that can be written: {error.strerror}"]) from error
    pace = Pace(None if options.headless or options.speed == "max" else float(options.speed))
    page = None if options.headless else LivePage(scenario, options.mcu, None if options.processes else pace)
    with ExitStack() as closing:
        if page is not None:
            print(f"live page: {page.start(options.port)}", file=sys.stderr, flush=True)
            closing.callback(page.close)
        outcome = _swim(scenario, options, folder, pace, page)
        summary, grade = _report(scenario, options.mcu, outcome, folder)
        if page is not None:
            page.finish(grade)
            if page.watched:
                print("the page stays until it is closed, or Ctrl-C", file=sys.stderr)
            page.stay()
    return 0 if summary.success else EXIT_MISSED


# The run, with everybody who watches it.
def _swim(scenario: Scenario, options: argparse.Namespace, folder: Path, pace: Pace, page: LivePage | None) -> Outcome:
    with ExitStack() as closing:
        stream = closing.enter_context((folder / "run.mcap").open("wb"))
        mission = scenario.mission
        recorder = Recorder(stream, scenario.name, mission.seed, options.mcu, mission.vehicles)
        closing.enter_context(recorder)
        progress = Progress(scenario.end_s())
        closing.callback(progress.close)
        observers: list[Observer] = [recorder, progress, *([page] if page else [])]
        if options.processes:
            from sim.processes import run_processes

            place = folder / "processes"
            return run_processes(scenario, options.mcu, place, threads=options.threads, observers=observers)
        return run(scenario, options.mcu, threads=options.threads, observers=observers, pace=pace.wait)


# Grades the run, writes everything that stays, and says it in a few lines.
def _report(scenario: Scenario, mcu: str, outcome: Outcome, folder: Path) -> tuple[Summary, Grade]:
    from sim.report import write_report

    grade = outcome.grade(scenario)
    duration = float(outcome.history.time[-1])
    summary = summarise(scenario, mcu, outcome, grade, ROOT)
    summary.write(folder / "summary.json")
    report = write_report(folder, scenario, outcome.history, grade, summary)
    print(f"{scenario.config.title}\n{duration:.0f} s in {outcome.effort.wall_s:.1f} s, "
          f"{summary.realtime_factor:.1f} times real time, {mcu}, seed {summary.seed}")  # fmt: skip
    for verdict in grade.verdicts:
        sign = "ok  " if verdict.holds else "MISS"
        print(f"  {sign} {verdict.name}: {verdict.measured} ({verdict.required})")
    print(f"report: {report}")
    return summary, grade


if __name__ == "__main__":
    sys.exit(main())
