"""Optimisation of Garambois et al. 2017, §6: Pareto fronts of a reverse gear for three tools, against Table 2.

Every gear of the searches and every row of the table is evaluated with the same model, resolution and error samples.
The searches store every generation beside the Dataset, so that an interrupted run continues with the next one.
"""

from studies.s06_paper_fronts.data import compute, scene
from studies.s06_paper_fronts.findings import checks
from studies.s06_paper_fronts.pictures import figures

QUESTION = "Does the search find the paper's three Pareto fronts, and does any gear of Table 2 beat them?"

__all__ = ["QUESTION", "checks", "compute", "figures", "scene"]
