"""Contact off the line of action on gears in use: spur and helical, with and without relief, light to heavy loads."""

from studies.s09_contact_in_use.data import compute, scene
from studies.s09_contact_in_use.findings import checks, figures

QUESTION = "On gears in use, does contact off the line keep the fast teeth within 1 % of contact finite elements?"

__all__ = ["QUESTION", "checks", "compute", "figures", "scene"]
