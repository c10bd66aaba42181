"""Shape of each manufacturing error on the flank, its zero point and its sign."""

from studies.s03_error_modes.data import compute, scene
from studies.s03_error_modes.findings import checks, figures

QUESTION = "What does each manufacturing error look like on the flank?"

__all__ = ["QUESTION", "checks", "compute", "figures", "scene"]
