"""Pictures of the report on the paper, as small SVG files that the colour-blind can read: vehicles carry numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from sim.paper import printed
from sim.paper.experiments import OBSTACLES_M, Case, Fault, Voyage
from sim.paper.trace import Array, Trace
from sim.report.pictures import COLOURS, colour

_INK, _SOFT, _BAD = "#22303a", "#7b8790", "#b8410b"
_STYLE: dict[str, Any] = {
    "font.size": 9.0,
    "axes.grid": True,
    "grid.alpha": 0.25,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 9.5,
    "axes.titlelocation": "left",
    "figure.constrained_layout.use": True,
    "svg.hashsalt": "shoal",
    "path.simplify_threshold": 0.3,
}
_MARKS = ("o", "s", "^", "D", "v", "P", "X")


def save(folder: Path, name: str, size: tuple[float, float], draw: Callable[[Figure], None]) -> Path:
    """Draws one picture into the folder, the same bytes for the same picture."""
    path = folder / name
    with mpl.rc_context(_STYLE):
        figure = Figure(figsize=size)
        draw(figure)
        figure.savefig(path, metadata={"Date": None, "Creator": "shoal"})
    return path


def transformation(figure: Figure, trace: Trace) -> None:
    """Fig. 4: the basin from above, with the formation at a few moments."""
    axes = figure.add_subplot()
    for north, east, radius in OBSTACLES_M:
        axes.add_patch(Circle((east, north), radius, facecolor="#d9d4cc", edgecolor=_SOFT, hatch="///", linewidth=0.8))
        axes.annotate("obstacle", (east, north), ha="center", va="center", color=_INK, backgroundcolor="#ffffffcc")
    _tracks(axes, trace)
    for share in (0.22, 0.5, 0.73, 1.0):
        _formation(axes, trace, int(share * (len(trace.times) - 1)))
    _basin(axes)
    _say(axes, "start", trace.positions[0], -1.0)
    _say(axes, "destination", trace.points[-1], 1.0)


def tracking(figure: Figure, traces: Mapping[str, Trace], limit_m: float = 14.0) -> None:
    """Fig. 5: tracking errors over time, one row for each way of moving the virtual formation."""
    rows = figure.subplots(len(traces), 1, sharex=True)
    for axes, (title, trace) in zip(rows, traces.items(), strict=True):
        _errors(axes, trace)
        axes.set_title(title)
        axes.set_ylim(0.0, limit_m)
    rows[-1].set_xlabel("time (s)")
    rows[0].legend(ncols=6, fontsize=8, frameon=False, loc="upper right")


def chain(figure: Figure, fault: Fault, team: Fault) -> None:
    """Fig. 6: who follows whom, then Shoal and the chain of leaders after the same fault."""
    left, middle, right = figure.subplots(1, 3, width_ratios=(0.62, 1.0, 1.0))
    _chain(left, fault)
    for axes, each, title in ((middle, fault, "Shoal"), (right, team, "leader-follower")):
        _tracks(axes, each.trace, number=False)
        moment = each.trace.at(each.broken_s)
        wreck = each.trace.positions[moment, each.broken]
        for k in (moment, len(each.trace.times) - 1):
            _formation(axes, each.trace, k)
        axes.plot(wreck[1], wreck[0], "X", color=_BAD, markersize=10, zorder=6, mec="white")
        axes.annotate("broken", (wreck[1], wreck[0]), (-8, 9), textcoords="offset points", color=_BAD, ha="right")
        spare = each.trace.positions[each.trace.at(each.spare_s + 1.0), 6]
        axes.plot(spare[1], spare[0], "*", color=_INK, markersize=10, zorder=6, mec="white")
        axes.annotate("spare", (spare[1], spare[0]), (7, -3), textcoords="offset points", color=_INK)
        _basin(axes)
        axes.set_title(title)
    right.set_ylabel("")
    end = team.trace.points[-1]
    for i, leader in enumerate(team.chain):
        where = team.trace.positions[-1, i]
        if leader is not None and np.linalg.norm(where - end[i]) > 1.0 and i != team.broken:
            right.annotate(
                f"{i + 1} stopped", (where[1], where[0]), (-8, -3), textcoords="offset points", color=_BAD, ha="right"
            )


def voyage(figure: Figure, run: Voyage) -> None:
    """Fig. 8: trajectories and tracking errors of six hulls in a current."""
    left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.05))
    _tracks(left, run.trace)
    for time in np.linspace(run.travel_s, run.trace.times[-1], 4):
        _formation(left, run.trace, run.trace.at(float(time)))
    north, east = run.current_mps
    left.annotate(
        "",
        (44.0 + 60.0 * east, 8.0 + 60.0 * north),
        (44.0, 8.0),
        arrowprops={"arrowstyle": "->", "color": _INK, "lw": 1.6},
    )
    left.annotate(f"current {np.hypot(north, east):.2f} m/s", (36.0, 4.5), color=_INK, ha="left")
    _basin(left)
    left.set_title("(a) trajectories")
    _errors(right, run.trace)
    right.axvline(run.travel_s, color=_SOFT, linestyle=":", linewidth=1.0)
    right.annotate(
        "travel", (run.travel_s, 0.93), (4, 0), xycoords=("data", "axes fraction"), textcoords="offset points"
    )
    right.set_xlabel("time (s)")
    right.set_title("(b) tracking errors")
    right.set_ylim(bottom=0.0)
    right.legend(ncols=3, fontsize=8, frameon=False, loc="upper right", bbox_to_anchor=(1.0, 0.9))


def published_case(figure: Figure, case: Case) -> None:
    """The published case from above."""
    axes = figure.add_subplot()
    _tracks(axes, case.trace)
    for share in (0.2, 0.45, 0.7, 1.0):
        _formation(axes, case.trace, int(share * (len(case.trace.times) - 1)))
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("x (m)")
    axes.set_ylabel("y (m)")


def evenness(figure: Figure, teams: Mapping[int, Mapping[str, tuple[Array, Array]]]) -> None:
    """Mean against standard deviation of the lengths of every team, a panel for each size."""
    panels = figure.subplots(1, len(teams), squeeze=False)[0]
    for axes, (count, methods) in zip(panels, teams.items(), strict=True):
        for i, (title, (means, spreads)) in enumerate(methods.items()):
            axes.plot(means, spreads, _MARKS[i], color=COLOURS[i], markersize=2.6, alpha=0.35, zorder=2, mew=0)
            axes.plot(
                means.mean(),
                spreads.mean(),
                _MARKS[i],
                color=COLOURS[i],
                markersize=9,
                mec="white",
                zorder=4,
                label=title,
            )
        for mark, name in (("+", "traditional"), ("x", "proposed")):
            said = printed.TABLE_II[count][name]
            axes.plot(said.mean, said.sd, mark, color=_INK, markersize=9, mew=1.8, zorder=5, label=f"paper, {name}")
        axes.set_title(f"{count} vehicles")
        axes.set_xlabel("mean length of a vehicle (m)")
        axes.set_ylim(bottom=0.0)
    panels[0].set_ylabel("standard deviation (m)")
    panels[0].legend(fontsize=8, frameon=True, framealpha=0.85, edgecolor="none")


def _tracks(axes: Axes, trace: Trace, number: bool = True) -> None:
    for i in range(trace.positions.shape[1]):
        north, east = trace.positions[:, i, 0], trace.positions[:, i, 1]
        axes.plot(east, north, color=colour(i), linewidth=1.2, alpha=0.9, zorder=2)
        there = np.flatnonzero(np.isfinite(north))
        if not len(there):
            continue
        first = there[0]
        axes.plot(east[first], north[first], _MARKS[i % len(_MARKS)], color=colour(i), markersize=5, zorder=3)
        if number:
            axes.annotate(
                f"{i + 1}",
                (east[first], north[first]),
                (5, 4),
                textcoords="offset points",
                color=colour(i),
                weight="bold",
            )


# The points at one moment as rings, and the vehicles in them.
def _formation(axes: Axes, trace: Trace, k: int) -> None:
    points = trace.points[k]
    axes.plot(points[:, 1], points[:, 0], "o", mfc="none", mec=_INK, mew=0.9, markersize=8, zorder=3)
    for i in range(trace.positions.shape[1]):
        axes.plot(*trace.positions[k, i, 1::-1], ".", color=colour(i), markersize=7, zorder=5)


def _chain(axes: Axes, fault: Fault) -> None:
    points = fault.trace.points[0]
    points = points - points.mean(axis=0)
    for i, leader in enumerate(fault.chain):
        if leader is not None:
            cut = 1 in (i, leader)
            axes.annotate(
                "",
                points[leader, 1::-1],
                points[i, 1::-1],
                arrowprops={
                    "arrowstyle": "-|>",
                    "color": _BAD if cut else _SOFT,
                    "lw": 1.4,
                    "ls": "--" if cut else "-",
                    "shrinkA": 9,
                    "shrinkB": 9,
                },
            )
    for i, (north, east, _) in enumerate(points):
        axes.plot(east, north, "o", color=_BAD if i == 1 else _INK, markersize=15, zorder=4)
        axes.annotate(
            f"{i + 1}", (east, north), ha="center", va="center_baseline", color="white", weight="bold", zorder=5
        )
    axes.set_title("each follows one ahead")
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.25)
    axes.axis("off")


def _errors(axes: Axes, trace: Trace) -> None:
    errors = trace.errors()
    for i in range(errors.shape[1]):
        axes.plot(trace.times, errors[:, i], color=colour(i), linewidth=1.1, label=f"{i + 1}")
    axes.set_xlim(trace.times[0], trace.times[-1])
    axes.set_ylabel("tracking error (m)")


def _basin(axes: Axes) -> None:
    axes.set_xlim(0.0, printed.WORKSPACE_M)
    axes.set_ylim(0.0, printed.WORKSPACE_M)
    axes.set_aspect("equal")
    axes.set_xlabel("x, east (m)")
    axes.set_ylabel("y, north (m)")


def _say(axes: Axes, text: str, places: Array, side: float) -> None:
    edge = places[:, 0].max() if side > 0.0 else places[:, 0].min()
    axes.annotate(
        text,
        (float(places[:, 1].mean()), float(edge)),
        (0, 14 * side),
        textcoords="offset points",
        ha="center",
        color=_INK,
    )
