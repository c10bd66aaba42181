"""Errors of the fast tooth models against finite elements on 48 random gear pairs.

The pairs vary in module, numbers of teeth, helix angle, pressure angle, profile shifts, addendum, face width, bores and
torque. They are drawn before anything is computed, none is left out because of its result, and no constant of a model
was fitted to them.
"""

from studies.s05_tooth_models.data import compute, scene
from studies.s05_tooth_models.findings import checks, figures

QUESTION = "How far are the fast tooth models from finite elements, over the range of gears in use?"

__all__ = ["QUESTION", "checks", "compute", "figures", "scene"]
