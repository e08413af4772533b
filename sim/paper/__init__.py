"""The report on the paper: its figures and tables as Shoal does them, beside what it prints."""

from sim.paper.report import write_paper

__all__ = ["write_paper"]
