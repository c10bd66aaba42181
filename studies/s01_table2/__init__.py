"""The convention of manufacturing errors that reproduces Table 2 of Garambois et al. 2017, and how well it does.

The paper says that errors are random, of ISO class 6, linear and parabolic along profile and helix, plus parallelism
of the axes; it does not print how they are signed, anchored, distributed or shared. A small set of conventions is
tried on all known rows of the table, with nothing fitted; every one tried is in the Dataset and in the report.
"""

from studies.s01_table2.data import compute, scene
from studies.s01_table2.findings import checks, figures

QUESTION = "Which convention of manufacturing errors reproduces Table 2 of the paper?"

__all__ = ["QUESTION", "checks", "compute", "figures", "scene"]
