"""Contact on the theoretical line held to contact finite elements, which assume neither line nor law of contact."""

from studies.s08_contact.data import compute, scene
from studies.s08_contact.findings import checks, figures

QUESTION = "Where do flanks touch, and what does contact on the theoretical line cost, against contact finite elements?"

__all__ = ["QUESTION", "checks", "compute", "figures", "scene"]
