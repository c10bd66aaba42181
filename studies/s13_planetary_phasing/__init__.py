"""Planet phasing of an electric axle: planets in phase, sequential or counter phase, without and with errors.

Neighbouring tooth numbers give all three arrangements of four planets at nearly the same ratio. Every arrangement is
solved with a floating sun and with a held sun, without errors and for 1000 error samples of class 6.
"""

from studies.s13_planetary_phasing.data import compute, scene
from studies.s13_planetary_phasing.findings import checks
from studies.s13_planetary_phasing.pictures import figures

QUESTION = "What does phasing of the planets buy in torsion and cost in radial force, with errors, and what is K_γ?"

__all__ = ["QUESTION", "checks", "compute", "figures", "scene"]
