"""Contact on the line of action against contact finite elements, which assume neither contact line nor contact law."""

from studies.s08_contact.data import compute, scene
from studies.s08_contact.findings import checks, figures

QUESTION = "Where do flanks touch, and what does contact on the theoretical line cost, against contact finite elements?"

__all__ = ["QUESTION", "checks", "compute", "figures", "scene"]
