"""Shape, zero point and sign of every manufacturing error on the flank."""

from studies.s03_error_modes.data import compute, scene
from studies.s03_error_modes.findings import checks, figures

QUESTION = "What does each manufacturing error look like on the flank?"

__all__ = ["QUESTION", "checks", "compute", "figures", "scene"]
