"""Campaigns: the same experiment over many seeds, judged by the figures it must reach and written down as a table."""

from sim.campaign.campaign import Campaign, Cell, conduct, names, open_campaign
from sim.campaign.figures import Estimate, Figure, Limit, at_least, at_most, least, mean, most, quantile, ratio, share

__all__ = [
    "Campaign",
    "Cell",
    "Estimate",
    "Figure",
    "Limit",
    "at_least",
    "at_most",
    "conduct",
    "least",
    "mean",
    "most",
    "names",
    "open_campaign",
    "quantile",
    "ratio",
    "share",
]
