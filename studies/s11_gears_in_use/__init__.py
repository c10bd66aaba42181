"""Errors of each fast tooth model on gears in use against finite elements on 200 pairs drawn at random.

Numbers of teeth 11–200, modules 0.3–25 mm, helix angles 0–40°, pressure angles 14.5–25°, face widths of 3–25 modules,
rims from 1.5 modules to solid bodies. Drawn before anything is computed, none left out because of its result.
"""

from studies.s11_gears_in_use.data import compute, scene
from studies.s11_gears_in_use.findings import checks, figures

QUESTION = "How far are the fast tooth models from finite elements of whole gears, on all gears in use?"

__all__ = ["QUESTION", "checks", "compute", "figures", "scene"]
