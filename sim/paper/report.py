"""Writes the page: the paper's figures and tables as Shoal does them, beside what is printed there."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from textwrap import fill
from typing import TextIO

import numpy as np

from companion.formation import SOM
from companion.mission import DECISION_PERIOD_S
from sim.campaign import Campaign, conduct
from sim.campaign.campaign import Result
from sim.campaign.travel import METHODS, Journey, swim
from sim.paper import experiments, pictures, printed, tables
from sim.points import SPEED

DEFAULT_SEEDS = 30
NONE = "–"


@dataclass(frozen=True, slots=True)
class Order:
    """What to write: `seeds` a case, into `out`, by `jobs` processes, only the `quick` part if so wished."""

    out: Path
    seeds: int = DEFAULT_SEEDS
    jobs: int = 2
    quick: bool = False
    log: Path = Path("runs/paper")
    progress: TextIO = field(default_factory=lambda: sys.stderr)

    @property
    def counts(self) -> tuple[int, ...]:
        """Sizes of the teams."""
        return (6,) if self.quick else (6, 15)

    def command(self) -> str:
        """The command that writes this page again."""
        return f"shoal-sim report paper --seeds {self.seeds}" + (" --quick" if self.quick else "")


def write_paper(order: Order) -> Path:
    """Runs everything and writes README.md with its pictures; returns its path."""
    order.out.mkdir(parents=True, exist_ok=True)
    begun = time.monotonic()
    sections = [_head(order)]
    for section in SECTIONS:
        sections += ["\n".join(section(order))]
        _say(order, f"{section.__name__.strip('_').replace('_', ' ')}: done after {time.monotonic() - begun:.0f} s")
    page = order.out / "README.md"
    page.write_text("\n\n".join(sections) + "\n", encoding="utf-8")
    return page


def _head(order: Order) -> str:
    return "\n".join(
        [
            "# The paper, reproduced",
            "",
            _text(
                "Li and Zhu, *An Adaptive SOM Neural Network Method to Distributed Formation Control of a Group of "
                "AUVs* (2018), section IV: its figures and tables as Shoal does them, with what is printed there "
                f"beside them. This page was written by `{order.command()}`. Seeds are 0, 1, ... of each case; "
                f"intervals are those of 95 % confidence; the pictures of point dynamics are of seed "
                f"{experiments.SEED}."
            ),
            "",
            _text(
                "What cannot be reproduced is said here once: the paper does not give its starts, its path, its "
                "shapes' spacing or its obstacles, each of its figures in Table II is one draw, and its algorithm does "
                "not converge with the parameters of Table I as printed. So digits cannot be compared. What can be: "
                "the same experiments, with path lengths as in Table II, over many seeds."
            ),
            "",
            _text(
                f"In point dynamics, as in the paper, a vehicle takes any velocity of at most {SPEED:g} m/s at once. "
                "Each decides alone, twice a second, from its own position and those of the neighbours that it sees "
                f"within {experiments.CONDITIONS.sensing_range:g} m, with {experiments.CONDITIONS.sigma:g} m of noise "
                "an axis; vehicles share mission and clock, and send no messages."
            ),
        ]
    )


def _table_i(order: Order) -> Iterator[str]:
    mission = experiments.basin_mission()
    used = {
        "S": f"{SOM.safe_length_m:g} m, in `paper` only: it has no effect on these lengths",
        "S_max": f"{SOM.max_length_m:g} m, reported when exceeded, never a silent exclusion",
        "gamma": "none: only the winner moves; neighbours that follow clump the group",
        "D_min": f"{SOM.reach_m:g} m, of the true distance",
        "lambda": f"{mission.path.step_m:g} m, under half the spacing of {mission.formation.spacing_m:g} m, "
        "else vehicles swap points",
        "G_o": f"{SOM.breadth_m:g} in `som`: the rows of G_o and mu are swapped",
        "mu": f"{SOM.decay:g} in `som`; as printed (1 - mu)^t grows",
        "\\|dT\\|": f"smooth; {100 * SPEED * DECISION_PERIOD_S:.0f} cm at most between two decisions of a vehicle",
        "alpha": f"{SPEED:g} m/s as the speed; {SOM.gain:g} as the gain of eq 6, which is another thing",
        "s": f"{SOM.slower:g}, per point, by mission",
        "f": f"{SOM.faster:g}, per point, by mission",
    }
    yield "## Table I: parameters"
    yield ""
    yield from _rows(
        ["symbol", "meaning", "typical", "for 6 vehicles", "Shoal"],
        [[row.symbol, row.meaning, row.typical, row.optimised, used[row.symbol]] for row in printed.TABLE_I],
    )


def _figure_4(order: Order) -> Iterator[str]:
    trace = experiments.transformation()
    pictures.save(order.out, "fig4.svg", (6.2, 6.2), lambda figure: pictures.transformation(figure, trace))
    late = trace.errors()[trace.at(experiments.FORMING_S) :]
    yield "## Fig. 4: forming, and transformation between obstacles"
    yield ""
    yield "![Six tracks from random starts to a triangle, through the gap in two files, and to a triangle](fig4.svg)"
    yield ""
    yield _text(
        "A triangle forms, becomes two files that fit through the gap, and a triangle again. Rings are the points of "
        "the virtual formation at a few moments. The mission says where it transforms and into what; who goes where "
        "each vehicle decides. The path lies between the obstacles, which the vehicles do not see: the nearest comes "
        f"within {experiments.clearance(trace):.1f} m of one. From the end of forming on no vehicle was ever more than "
        f"{100 * np.nanmax(late):.0f} cm from its point."
    )


def _figure_5(order: Order) -> Iterator[str]:
    traces = {
        f"in steps of |ΔT| = {step:g} m, as in the paper": experiments.tracking(step) for step in printed.STEPS_M
    } | {"smooth, as Shoal travels": experiments.tracking(None)}
    pictures.save(order.out, "fig5.svg", (7.2, 6.4), lambda figure: pictures.tracking(figure, traces))
    peaks = [float(np.nanmax(trace.errors()[trace.at(experiments.FORMING_S) :])) for trace in traces.values()]
    yield "## Fig. 5: tracking errors"
    yield ""
    yield "![Tracking errors over time for two step lengths, and for a formation that moves smoothly](fig5.svg)"
    yield ""
    yield _text(
        "In the paper the virtual formation jumps by |dT| and waits until all are there again, so the error is a saw "
        f"with teeth of |dT|: up to {peaks[0]:.2f} m and {peaks[1]:.2f} m here. Shoal's moves smoothly at a pace below "
        f"the vehicles' speed, and a vehicle knows its point's velocity: at most {100 * peaks[2]:.1f} cm."
    )


def _figure_6(order: Order) -> Iterator[str]:
    shoal, team = experiments.fault(fixed=False), experiments.fault(fixed=True)
    pictures.save(order.out, "fig6.svg", (10.0, 4.4), lambda figure: pictures.chain(figure, shoal, team))
    whole = np.flatnonzero((shoal.trace.errors() <= 0.1).sum(axis=1) == printed.VEHICLES)
    whole = whole[shoal.trace.times[whole] > shoal.spare_s]
    stopped = np.nanmax(team.trace.errors()[-1])
    yield "## Fig. 6: a fault after ten steps"
    yield ""
    yield "![The chain of leaders; after the fault Shoal goes on and takes the spare in, followers stop](fig6.svg)"
    yield ""
    again = f"{shoal.trace.times[whole[0]] - shoal.spare_s:.0f} s later" if len(whole) else "never"
    yield _text(
        f"After {printed.STEPS_TO_FAULT} steps of {experiments.FAULT_STEP_M:g} m the vehicle on point 2 breaks, which "
        "in a chain of leaders follows the tip and leads two others (left). With Shoal nobody led: the rest travel on, "
        f"and a spare that enters the water {experiments.FAULT_WAIT_S:g} s later makes the formation whole again "
        f"{again}. With leader-follower, roles 4 and 5 stop behind role 2 and end {stopped:.0f} m from their points; "
        "the spare has no role. Had the tip broken, all would have stopped."
    )


def _figure_8(order: Order) -> Iterator[str]:
    yield "## Fig. 8: full dynamics in a current"
    yield ""
    if order.quick:
        yield "Left out of a quick report."
        return
    run, _ = experiments.voyage(1)
    pictures.save(order.out, "fig8.svg", (9.6, 4.6), lambda figure: pictures.voyage(figure, run))
    results = _conduct(order, tables.voyages(order.seeds))
    yield "![Tracks of six hulls in a current, and their tracking errors](fig8.svg)"
    yield ""
    yield _text(
        "The paper's last experiment simulates the constraints of its hulls in a simplified current. Here six "
        "simulated hulls with the firmware that is flashed (compiled for the host) and their companions cross the "
        "basin: scenario `paper`, seed 1, which `shoal-sim run paper` runs by itself. A hull cannot stand still, so it "
        "waits on a circle round its point until travel begins; from then on the tracking error falls to "
        f"{run.tracking_rms_m:.2f} m RMS. It grows at the very end, when the formation stops and hulls cannot. Lengths "
        "count the way to the point and the journey, not the circles."
    )
    yield ""
    yield from _results(results, tables.voyages(order.seeds))


def _table_ii(order: Order) -> Iterator[str]:
    results = _conduct(order, tables.journeys(order.counts, order.seeds))
    yield "## Table II: lengths"
    yield ""
    yield _text(
        "Mean and standard deviation, within a team, of the lengths of its vehicles: first as printed, then the mean "
        "over seeds. Ways are as long as the paper's mean. Fixed roles are leader-follower in its strongest form: "
        "followers know their leader's true position, and form up straight to their points. Starts lie in a box over "
        "the place of the formation (centred) or beside it (displaced); the way has one bend, with which the formation "
        "turns in one case; in the last it becomes a diamond and a triangle again. p = 1.2 is Shoal's default "
        "exponent, p = 2 the most even; `som` sees all vehicles, which it needs."
    )
    yield ""
    head = ["case", "seeds"] + [f"{method.title}: {what}" for method in METHODS for what in ("mean (m)", "sd (m)")]
    rows: list[list[str]] = []
    for count in order.counts:
        said = printed.TABLE_II[count]
        old, new = said["traditional"], said["proposed"]
        rows.append(
            [f"J = {count}, **printed**", "1", f"{old.mean:.2f}", f"{old.sd:.2f}", f"{new.mean:.2f}", f"{new.sd:.2f}"]
            + [NONE] * 4
        )
        for result in results:
            if result.cell.name.startswith(f"J = {count},"):
                spelled = [
                    figure.spell(estimate)
                    for figure, estimate in zip(tables.LENGTH_FIGURES, result.estimates, strict=True)
                ]
                rows.append([result.cell.name, str(result.runs), *spelled])
    yield from _rows(head, rows)
    teams = {}
    for count in order.counts:
        seeds = range(tables.fewer(order.seeds, count))
        swums = {m.title: [swim(Journey(count), m, seed, full=False).lengths for seed in seeds] for m in METHODS}
        teams[count] = {
            title.replace("`", ""): (np.array([x.mean() for x in lengths]), np.array([x.std() for x in lengths]))
            for title, lengths in swums.items()
        }
    pictures.save(order.out, "table2.svg", (8.6, 4.0), lambda figure: pictures.evenness(figure, teams))
    yield ""
    yield "![Mean against standard deviation of every team, and what the paper prints](table2.svg)"
    yield ""
    yield _text(
        "Each small mark is one team from centred starts with translation, each large one the mean of a method. "
        "`shoal-sim campaign travel` holds these lengths against what is asked of them."
    )


def _forms(order: Order) -> Iterator[str]:
    results = {result.cell.name: result for result in _conduct(order, tables.forms(order.counts, order.seeds))}
    yield "## Forms of the competition"
    yield ""
    yield _text(
        "Forming alone, from centred starts: straight ways to the points that each form gives, by somebody who sees "
        f"everything, over {tables.STARTS_A_SEED * order.seeds} starts; and, in the last row, ways really swum "
        f"by vehicles that decide alone, over {order.seeds} or, of large teams, a third as many. Lengths are of those "
        "that fill all points. The optimum is the least total; fixed roles take no account of where vehicles are. As "
        "printed, the algorithm gets the parameters of Table I that are optimised for 6 vehicles, and 200 sweeps."
    )
    yield ""
    head = ["form"] + [f"J = {count}: {figure.title}" for count in order.counts for figure in tables.FORMING_FIGURES]
    rows = []
    for title in (*tables.FORMS, tables.AT_SEA):
        found = [results[f"J = {count}, {title}"] for count in order.counts]
        pairs = [pair for each in found for pair in zip(tables.FORMING_FIGURES, each.estimates, strict=True)]
        rows.append([title, *(figure.spell(estimate) for figure, estimate in pairs)])
    yield from _rows(head, rows)


def _potential_field(order: Order) -> Iterator[str]:
    campaign = tables.motions(order.counts, order.seeds)
    yield "## The potential field between vehicles"
    yield ""
    yield _text(
        "While it forms, the paper keeps vehicles apart by a potential field, of which it gives no constants. Shoal "
        "uses half-planes that bound the speed toward each hull. Both from the same starts; a field of full strength "
        "holds a vehicle off at the distance that half-planes keep. Where vehicles compete for points their straight "
        "ways hardly cross; with fixed roles they do."
    )
    yield ""
    yield from _results(_conduct(order, campaign), campaign)


def _published_case(order: Order) -> Iterator[str]:
    case = experiments.published_case()
    pictures.save(order.out, "case.svg", (6.4, 5.2), lambda figure: pictures.published_case(figure, case))
    yield "## A published case"
    yield ""
    yield "![Six tracks of the published case](case.svg)"
    yield ""
    yield _text(
        "Starts, points and the twenty moves of one case have been published by the same author, so this one can be "
        "run as it is. Its longest move is "
        f"{printed.CASE_STEP_M:.1f} m, above the lambda of Table I. Shoal forms it with {case.forming:.2f} m in all, "
        f"the least possible being {case.optimum:.2f} m. Over the whole journey its lengths have a mean of "
        f"{case.lengths.mean():.2f} m and a standard deviation of {case.lengths.std():.2f} m; with fixed roles "
        f"{case.fixed.mean():.2f} m and {case.fixed.std():.2f} m. Algorithm 1 with the parameters of that case brings "
        f"{case.printed_arrived} of {printed.VEHICLES} neurons to their points in its {case.sweeps} sweeps as printed, "
        f"and {case.repaired_arrived} where only winners move."
    )


SECTIONS: Sequence[Callable[[Order], Iterator[str]]] = (
    _figure_4,
    _figure_5,
    _figure_6,
    _figure_8,
    _table_i,
    _table_ii,
    _forms,
    _potential_field,
    _published_case,
)


def _conduct(order: Order, campaign: Campaign) -> list[Result]:
    _say(order, f"{campaign.title}: {sum(cell.seeds for cell in campaign.cells)} runs")
    return conduct(campaign, order.log / f"{campaign.name}.jsonl", None, order.jobs, order.progress)


def _results(results: Sequence[Result], campaign: Campaign) -> Iterator[str]:
    yield from _rows(
        ["case", "seeds", *(figure.title for figure in campaign.figures)],
        [
            [
                result.cell.name,
                str(result.runs),
                *(f.spell(e) for f, e in zip(campaign.figures, result.estimates, strict=True)),
            ]
            for result in results
        ],
    )


def _rows(head: Sequence[str], rows: Sequence[Sequence[str]]) -> Iterator[str]:
    yield "| " + " | ".join(head) + " |"
    yield "|" + "---|" * len(head)
    for row in rows:
        yield "| " + " | ".join(row) + " |"


def _text(text: str) -> str:
    return fill(text, 120, break_long_words=False, break_on_hyphens=False)


def _say(order: Order, text: str) -> None:
    print(f"paper: {text}", file=order.progress, flush=True)
