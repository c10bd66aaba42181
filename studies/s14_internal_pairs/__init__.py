"""Errors of solid teeth on pinion and ring against finite elements on random internal pairs.

Pinions of 15–60 teeth in rings of 30–180, spur and helical, rims of 1.2 to 6 modules held all around, on springs, on
lugs, or free. The pairs are drawn before anything is computed, and none is left out because of its result.
"""

from studies.s14_internal_pairs.data import compute, scene
from studies.s14_internal_pairs.findings import checks, figures

QUESTION = "How far are solid teeth on pinion and ring from finite elements of both, on random internal pairs?"

__all__ = ["QUESTION", "checks", "compute", "figures", "scene"]
