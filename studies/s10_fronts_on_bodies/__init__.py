"""Fronts of Garambois et al. 2017 with solid teeth on gear bodies, compared with those with the paper's clamped plate.

The paper's plate is too soft, and its gear body is rigid. Here the reverse gear is searched once more with the tooth
model that is within one percent of finite elements. The study shows the gears of the new front, which gears of the
paper's front remain, and what the plate predicted for them.
"""

from studies.s10_fronts_on_bodies.data import compute, scene
from studies.s10_fronts_on_bodies.findings import checks, figures

QUESTION = "What do the paper's fronts become on teeth and bodies as finite elements have them?"

__all__ = ["QUESTION", "checks", "compute", "figures", "scene"]
