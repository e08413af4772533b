"""The report of a run: pictures, and a page that holds them with the figures and verdicts."""

from sim.report.page import write_report

__all__ = ["write_report"]
