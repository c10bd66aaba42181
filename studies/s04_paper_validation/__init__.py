"""Test of the paper's Figure 4 and of its claims on accuracy, deflection shapes and time by our finite elements."""

from studies.s04_paper_validation.data import compute, scene
from studies.s04_paper_validation.findings import checks, figures

QUESTION = "Does the paper's 9-unknown plate come within 10 % of finite elements, 1000 times faster, as claimed?"

__all__ = ["QUESTION", "checks", "compute", "figures", "scene"]
