"""Accuracy and run time: error over time for every setting, from the paper's plate to 3D finite elements.

Random scenes test whether a requested accuracy is met: the result is compared with a far finer reference, and its cost
with all settings of a grid. Times are processor times, which equal wall times on an idle machine.
"""

from studies.s07_accuracy_cost.data import compute, scene
from studies.s07_accuracy_cost.findings import checks
from studies.s07_accuracy_cost.pictures import figures

QUESTION = "What does accuracy cost in time, and is an accuracy that is asked for met?"

__all__ = ["QUESTION", "checks", "compute", "figures", "scene"]
