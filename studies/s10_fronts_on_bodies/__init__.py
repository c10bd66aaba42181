"""The fronts of Garambois et al. 2017 on solid teeth on their gear bodies, beside those on the paper's clamped plate.

The paper's plate is too soft, and its teeth stand on nothing that yields. Here the reverse gear is searched once more,
with the tooth model that is within a percent of finite elements: which gears the front then holds, which of the
paper's remain, and what the plate said about each of them.
"""

from studies.s10_fronts_on_bodies.data import compute, scene
from studies.s10_fronts_on_bodies.findings import checks, figures

QUESTION = "What do the paper's fronts become on teeth and bodies as finite elements have them?"

__all__ = ["QUESTION", "checks", "compute", "figures", "scene"]
