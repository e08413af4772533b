"""Formation: the paper's competition for points, its virtual formation, and the rules that do it without messages."""

from companion.formation.competition import FORMS, Assignment, compete
from companion.formation.formation import Formation
from companion.formation.som import PAPER, PAPER_TYPICAL, SOM, Organisation, SomSettings, organise
from companion.formation.tuning import Tuning
from companion.formation.virtual import VirtualFormation, VirtualState

__all__ = [
    "FORMS",
    "PAPER",
    "PAPER_TYPICAL",
    "SOM",
    "Assignment",
    "Formation",
    "Organisation",
    "SomSettings",
    "Tuning",
    "VirtualFormation",
    "VirtualState",
    "compete",
    "organise",
]
