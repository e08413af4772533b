"""A campaign's results as a page of Markdown: what was asked, what was measured, over which seeds, by which command."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import fill

from sim.campaign.campaign import Campaign, Result
from sim.campaign.figures import Figure


def page(campaign: Campaign, results: Sequence[Result]) -> str:
    """The whole page."""
    head = ["case", "seeds", *(figure.title for figure in campaign.figures)]
    lines = [
        f"# {campaign.title}",
        "",
        fill(campaign.text, 120),
        "",
        f"Made by `shoal-sim campaign {campaign.name}`; intervals are those of 95 % confidence.",
        "",
        "| " + " | ".join(head) + " |",
        "|" + "---|" * len(head),
    ]
    for result in results:
        if result.runs:
            cells = [result.cell.name, f"0 to {result.runs - 1}", *_figures(campaign.figures, result)]
            lines.append("| " + " | ".join(cells) + " |")
    missed = [f"{result.cell.name}: {title}" for result in results for title in result.misses(campaign.figures)]
    waiting = [result.cell.name for result in results if not result.runs]
    lines += ["", f"Missed: {'; '.join(missed)}." if missed else "Every limit holds."]
    if waiting:
        lines += ["", f"Not run: {'; '.join(waiting)}."]
    return "\n".join(lines) + "\n"


def _figures(figures: Sequence[Figure], result: Result) -> list[str]:
    missed, cells = result.misses(figures), []
    for figure, estimate in zip(figures, result.estimates, strict=True):
        text = figure.spell(estimate)
        limit = result.cell.asked.get(figure.title)
        if limit is not None:
            text = f"**{text}**" if figure.title in missed else text
            text += f", asked {limit.spell(figure.spelling)}"
        cells.append(text)
    return cells
