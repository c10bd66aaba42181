"""Convention of manufacturing errors that best reproduces Table 2 of Garambois et al. 2017.

The paper says that errors are random, of ISO class 6, linear and parabolic along profile and helix, plus parallelism
of the axes. It does not say how they are signed, anchored, distributed, or shared between the gears. The study tries a
small set of conventions on all known rows of the table, without fitting anything. Dataset and report contain all of
them.
"""

from studies.s01_table2.data import compute, scene
from studies.s01_table2.findings import checks, figures

QUESTION = "Which convention of manufacturing errors reproduces Table 2 of the paper?"

__all__ = ["QUESTION", "checks", "compute", "figures", "scene"]
