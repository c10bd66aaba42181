"""Errors of the fast tooth models against finite elements on 200 random pairs of gears in use.

The ranges are: numbers of teeth 11–200, modules 0.3–25 mm, helix angles 0–40°, pressure angles 14.5–25°, face widths of
3–25 modules, rims from 1.5 modules to solid bodies. The pairs are drawn before anything is computed, and none is left
out because of its result.
"""

from studies.s11_gears_in_use.data import compute, scene
from studies.s11_gears_in_use.findings import checks, figures

QUESTION = "How far are the fast tooth models from finite elements of whole gears, on all gears in use?"

__all__ = ["QUESTION", "checks", "compute", "figures", "scene"]
