"""The report on the paper: its figures and tables as Shoal does them, beside what it prints."""

from sim.paper.report import DEFAULT_SEEDS, Order, write_paper

__all__ = ["DEFAULT_SEEDS", "Order", "write_paper"]
