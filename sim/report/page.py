"""Writes report.html: one file that holds its pictures, the verdicts and the figures of a run."""

from __future__ import annotations

import base64
import html
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path

from sim.grade import Grade
from sim.history import Event, History
from sim.report.pictures import draw_all
from sim.scenario import Scenario
from sim.summary import Summary

_EVENTS_SHOWN = 60
_STYLE = """
:root { color-scheme: light dark; --ink: #14232d; --soft: #566873; --line: #d5dee4; --ground: #f8fafb;
  --good: #00795c; --bad: #b8410b; }
@media (prefers-color-scheme: dark) { :root { --ink: #e6eef3; --soft: #9db1bd; --line: #263945; --ground: #0c151b;
  --good: #35c79d; --bad: #ff9155; } }
body { max-width: 860px; margin: 24px auto; padding: 0 16px; color: var(--ink); background: var(--ground);
  font: 15px/1.5 system-ui, "Segoe UI", Roboto, "DejaVu Sans", sans-serif; }
h1 { font-size: 24px; margin-bottom: 0; } h2 { font-size: 17px; margin: 28px 0 8px; }
.lead { color: var(--soft); margin-top: 4px; }
.verdict { font-weight: 650; font-size: 17px; color: var(--good); } .failed { color: var(--bad); }
table { border-collapse: collapse; }
td, th { text-align: left; padding: 4px 18px 4px 0; border-top: 1px solid var(--line);
  font-variant-numeric: tabular-nums; }
th { font-weight: 500; color: var(--soft); }
figure { margin: 22px 0; } img { max-width: 100%; border-radius: 8px; background: #fff; }
figcaption { color: var(--soft); font-size: 13px; }
.events td { padding: 1px 14px 1px 0; border: 0; font-size: 13px; }
"""


def write_report(folder: Path, scenario: Scenario, history: History, grade: Grade, summary: Summary) -> Path:
    """Draws the pictures into the folder and writes report.html beside them; returns its path."""
    pictures = draw_all(history, scenario, folder)
    path = folder / "report.html"
    path.write_text(_page(scenario, history, grade, summary, pictures), encoding="utf-8")
    return path


def _page(
    scenario: Scenario,
    history: History,
    grade: Grade,
    summary: Summary,
    pictures: Iterable[tuple[Path, str]],
) -> str:
    title = html.escape(scenario.config.title)
    mission = scenario.mission
    lead = (
        f"Scenario {scenario.name}, {mission.vehicles} vehicles, {mission.formation.shape} with "
        f"{mission.formation.spacing_m:g} m spacing, seed {mission.seed}, {summary.mcu} make of the microcontroller"
    )
    success = (
        '<p class="verdict">✓ The run meets its criteria.</p>'
        if grade.success
        else '<p class="verdict failed">✗ The run does not meet its criteria.</p>'
    )
    verdicts = _table(
        ("criterion", "measured", "required", ""),
        [(v.name, v.measured, v.required, "✓" if v.holds else "✗") for v in grade.verdicts],
    )
    figures = _table(("figure", "value"), [(name, _spell(value)) for name, value in _figures(summary)])
    images = "\n".join(_figure(path, caption) for path, caption in pictures)
    return f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title><style>{_STYLE}</style></head>
<body>
<h1>{title}</h1>
<p class="lead">{html.escape(lead)}</p>
{success}
{verdicts}
{images}
<h2>Figures</h2>
{figures}
<h2>Events</h2>
{_events(history.events)}
</body></html>
"""


# The summary without what the page says elsewhere.
def _figures(summary: Summary) -> list[tuple[str, object]]:
    return [(name, value) for name, value in asdict(summary).items() if name not in ("title", "criteria")]


def _table(head: tuple[str, ...], rows: Iterable[tuple[str, ...]], kind: str = "") -> str:
    top = "".join(f'<th scope="col">{html.escape(cell)}</th>' for cell in head)
    body = "\n".join("<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    return f'<table class="{kind}"><tr>{top}</tr>\n{body}</table>'


def _figure(path: Path, caption: str) -> str:
    data = base64.b64encode(path.read_bytes()).decode()
    text = html.escape(caption)
    return f'<figure><img alt="{text}" src="data:image/png;base64,{data}"><figcaption>{text}</figcaption></figure>'


def _events(events: tuple[Event, ...]) -> str:
    if not events:
        return "<p>None.</p>"
    rows = [(f"{e.stamp:.1f} s", f"vehicle {e.vehicle}" if e.vehicle else "fleet", e.text) for e in events]
    more = len(rows) - _EVENTS_SHOWN
    note = f"<p>{more} more are in the recording.</p>" if more > 0 else ""
    return _table(("time", "who", "what"), rows[:_EVENTS_SHOWN], "events") + note


def _spell(value: object) -> str:
    if value is None:
        return "–"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
