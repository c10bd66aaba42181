"""Table 2 and the three fronts of Garambois et al. 2017 with contact off the line of action, and on it.

The paper keeps contact on the line of action and drops a tooth pair at the end of its path of contact. This study does
not search again: it evaluates the gears once more with ``[effects.off_line_contact]``, on the plate and on solid teeth.
"""

from studies.s12_fronts_off_line.data import compute, scene
from studies.s12_fronts_off_line.findings import checks, figures

QUESTION = "What do Table 2 and the paper's fronts become where flanks may touch off the line of action?"

__all__ = ["QUESTION", "checks", "compute", "figures", "scene"]
