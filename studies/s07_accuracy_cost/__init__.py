"""Accuracy and run time: error against time for every setting, from the paper's plate to 3D finite elements.

Whether an accuracy that is asked for is met is tried on random scenes, each against a reference far finer than what was
chosen, and against all settings of the grid. Times are processor times: on an idle machine those are wall times.
"""

from studies.s07_accuracy_cost.data import compute, scene
from studies.s07_accuracy_cost.findings import checks
from studies.s07_accuracy_cost.pictures import figures

QUESTION = "What does accuracy cost in time, and is an accuracy that is asked for met?"

__all__ = ["QUESTION", "checks", "compute", "figures", "scene"]
