"""Pictures of a run: tracks from above, tracking errors, separations, and what one vehicle did."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from companion.formation import VirtualFormation
from companion.scene import Phase
from sim.grade import steady_travel
from sim.history import Array, History
from sim.scenario import Scenario
from sim.world import HULL_LENGTH_M, pairs

# Okabe and Ito's colours, in an order that stays apart on white; vehicles carry their number as well.
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#8a6d00", "#56b4e9", "#5b4bb0", "#4c5b63")
_STYLE = {
    "font.size": 9.0,
    "axes.grid": True,
    "grid.alpha": 0.3,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "figure.constrained_layout.use": True,
    "svg.hashsalt": "shoal",
}
_PHASE_SHADES = {Phase.WAITING: "#dddddd", Phase.FORMING: "#cfe6f5", Phase.TRAVEL: "#ffffff", Phase.DONE: "#d9efe4"}
_SNAPSHOTS = 5
_LEVEL_M = 0.5  # points within so much of depth swim in one plane


def colour(vehicle: int) -> str:
    """The colour of a vehicle by its index."""
    return COLOURS[vehicle % len(COLOURS)]


def draw_all(history: History, scenario: Scenario, folder: Path) -> list[tuple[Path, str]]:
    """Draws every picture into the folder; returns each file with its caption."""
    pictures: list[tuple[str, str, tuple[float, float], Callable[[Figure], None]]] = [
        (
            "tracks.png",
            "Tracks from above: crosses are the starts, rings the points of the formation, hulls are drawn enlarged.",
            (7.2, 7.2),
            lambda figure: tracks(figure, history, scenario),
        ),
        (
            "tracking.png",
            "Tracking error: distance of each vehicle to the point that it holds. The dashed line is the limit.",
            (7.2, 3.4),
            lambda figure: tracking(figure, history, scenario),
        ),
        (
            "separation.png",
            "Distance between the two nearest hulls (thick), and of each vehicle to its nearest neighbour.",
            (7.2, 2.8),
            lambda figure: separations(figure, history, scenario),
        ),
        (
            "vehicle_1.png",
            "Vehicle 1: depth, speed over ground, heading and pitch.",
            (7.2, 5.2),
            lambda figure: vehicle(figure, history, 0),
        ),
    ]
    drawn = []
    for name, caption, size, draw in pictures:
        with mpl.rc_context(_STYLE):
            figure = Figure(figsize=size, dpi=110)
            draw(figure)
            figure.savefig(folder / name, metadata={"Software": "shoal"})
        drawn.append((folder / name, caption))
    return drawn


def tracks(figure: Figure, history: History, scenario: Scenario) -> None:
    """North up, with the formation at a few moments; depths below where they differ."""
    if np.ptp(history.points[..., 2]) > _LEVEL_M:
        axes, below = figure.subplots(2, 1, height_ratios=(3.5, 1.0))
        depths(below, history)
    else:
        axes = figure.add_subplot()
    path = VirtualFormation(scenario.mission).way
    axes.plot(path[:, 1], path[:, 0], ":", color="#888888", linewidth=1.2, zorder=1)
    for i in range(history.position.shape[1]):
        north, east = history.position[:, i, 0], history.position[:, i, 1]
        axes.plot(east, north, color=colour(i), linewidth=1.1, alpha=0.85, zorder=2)
        axes.plot(east[0], north[0], "x", color=colour(i), markersize=6, zorder=3)
        axes.annotate(
            f"{i + 1}", (east[0], north[0]), (5, 4), textcoords="offset points", color=colour(i), weight="bold"
        )
    for k in snapshot_indices(history):
        points = history.points[k]
        axes.plot(points[:, 1], points[:, 0], "o", mfc="none", mec="#333333", markersize=8, linewidth=1, zorder=3)
        for i in range(history.position.shape[1]):
            _hull(axes, history.position[k, i], float(history.euler[k, i, 2]), colour(i))
        top = points[np.argmax(points[:, 0])]
        text = f"{history.time[k]:.0f} s"
        axes.annotate(text, (top[1], top[0]), (8, 8), textcoords="offset points", fontsize=8, color="#333333")
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("east (m)")
    axes.set_ylabel("north (m)")
    water = scenario.config.water
    if np.hypot(water.north_mps, water.east_mps) > 0.0:
        course = np.degrees(np.arctan2(water.east_mps, water.north_mps)) % 360.0
        speed = np.hypot(water.north_mps, water.east_mps)
        axes.set_title(f"current {speed:.2f} m/s toward {course:.0f} deg", fontsize=9, loc="right", color="#555555")


def depths(axes: Axes, history: History) -> None:
    """Depths of points and vehicles over time; dotted lines are the moments shown from above."""
    axes.plot(history.time, history.points[..., 2], color="#999999", linewidth=1.0)
    for i in range(history.position.shape[1]):
        axes.plot(history.time, history.position[:, i, 2], color=colour(i), linewidth=0.9)
    for k in snapshot_indices(history):
        axes.axvline(history.time[k], color="#555555", linewidth=0.8, linestyle=":")
    axes.invert_yaxis()
    axes.set_ylabel("depth (m)")
    _phases(axes, history)


def snapshot_indices(history: History) -> list[int]:
    """Moments worth a picture of the formation: the end of forming, then evenly to the end of the travel."""
    travel = np.flatnonzero(history.during(Phase.TRAVEL))
    if not len(travel):
        return [len(history.time) - 1]
    return sorted({int(k) for k in np.linspace(travel[0], travel[-1], _SNAPSHOTS)})


def tracking(figure: Figure, history: History, scenario: Scenario) -> None:
    """On a logarithmic scale, so that metres of forming and centimetres of travel are both seen."""
    axes = figure.add_subplot()
    error = history.tracking_error()
    for i in range(error.shape[1]):
        axes.semilogy(history.time, np.maximum(error[:, i], 1e-3), color=colour(i), linewidth=1.0, label=f"{i + 1}")
    limit = scenario.config.criteria.tracking_rms_m
    if limit is not None:
        axes.axhline(limit, color="#b8410b", linestyle="--", linewidth=1)
    axes.set_ylim(0.02, 40.0)
    axes.set_yticks([0.1, 0.3, 1, 3, 10], ["0.1", "0.3", "1", "3", "10"])
    axes.set_ylabel("tracking error (m)")
    steady = steady_travel(history, scenario.config.criteria.settling_s)
    if steady.any():
        axes.axvline(history.time[steady][0], color="#555555", linewidth=0.8, linestyle=":")
        axes.annotate("steady", (history.time[steady][0], 20), (3, 0), textcoords="offset points", fontsize=8)
    _phases(axes, history)
    axes.legend(ncols=8, fontsize=8, frameon=False, loc="upper right")


def separations(figure: Figure, history: History, scenario: Scenario) -> None:
    """Least distances between hulls over time."""
    axes = figure.add_subplot()
    count = history.position.shape[1]
    if history.separation.size:
        first, second = pairs(count)
        for i in range(count):
            mine = history.separation[:, (first == i) | (second == i)].min(axis=1)
            axes.plot(history.time, mine, color=colour(i), linewidth=0.7, alpha=0.7)
        axes.plot(history.time, history.separation.min(axis=1), color="#222222", linewidth=1.8)
        axes.axhline(scenario.config.criteria.separation_m, color="#b8410b", linestyle="--", linewidth=1)
    axes.set_ylim(bottom=0.0)
    axes.set_ylabel("hull to hull (m)")
    _phases(axes, history)


def vehicle(figure: Figure, history: History, i: int) -> None:
    """Depth, speed, heading and pitch of one vehicle."""
    rows = figure.subplots(4, 1, sharex=True)
    time, euler = history.time, np.degrees(history.euler[:, i])
    held = history.decided[:, i]
    wanted = np.where(held >= 0, history.points[np.arange(len(time)), np.maximum(held, 0), 2], np.nan)
    rows[0].plot(time, wanted, color="#999999", linewidth=1.2, label="its point")
    rows[0].plot(time, history.position[:, i, 2], color=colour(i), linewidth=1.0)
    rows[0].invert_yaxis()
    rows[0].set_ylabel("depth (m)")
    rows[0].legend(fontsize=8, frameon=False, loc="lower right")
    series: list[tuple[Array, str]] = [
        (np.linalg.norm(history.velocity[:, i], axis=1), "speed (m/s)"),
        (_unbroken(euler[:, 2] % 360.0), "heading (deg)"),
        (euler[:, 1], "pitch (deg)"),
    ]
    for axes, (values, label) in zip(rows[1:], series, strict=True):
        axes.plot(time, values, color=colour(i), linewidth=1.0)
        axes.set_ylabel(label)
    rows[2].set_yticks([0, 90, 180, 270, 360])
    for axes in rows:
        _phases(axes, history, label=axes is rows[-1])


# Leaves a gap where a heading passes north, instead of a line across the picture.
def _unbroken(heading: Array) -> Array:
    return np.where(np.abs(np.diff(heading, prepend=heading[0])) > 180.0, np.nan, heading)


# A hull from above, enlarged so that it shows.
def _hull(axes: Axes, position: Array, yaw: float, paint: str) -> None:
    half = 1.2 * HULL_LENGTH_M / 2 * np.array([np.cos(yaw), np.sin(yaw)])
    tail, nose = position[:2] - half, position[:2] + half
    axes.plot([tail[1], nose[1]], [tail[0], nose[0]], color=paint, linewidth=3.5, solid_capstyle="round", zorder=4)
    axes.plot(nose[1], nose[0], ".", color="#111111", markersize=3, zorder=5)


# Shades the phases behind a plot over time.
def _phases(axes: Axes, history: History, label: bool = True) -> None:
    changes = [0] + [k for k in range(1, len(history.phase)) if history.phase[k] is not history.phase[k - 1]]
    for k, begin in enumerate(changes):
        end = changes[k + 1] if k + 1 < len(changes) else len(history.phase) - 1
        axes.axvspan(history.time[begin], history.time[end], color=_PHASE_SHADES[history.phase[begin]], zorder=0, lw=0)
    axes.set_xlim(history.time[0], max(history.time[-1], history.time[0] + 1.0))
    if label:
        named = [k for k in changes if history.phase[k] is not Phase.WAITING]
        text = ", ".join(f"{history.phase[k].value} from {history.time[k]:.0f} s" for k in named)
        axes.set_xlabel(f"time (s): {text}" if text else "time (s)")
