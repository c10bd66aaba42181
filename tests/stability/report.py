"""Writes docs/data/stability.csv: every hard case, why it is hard, and how many digits of it are correct.

``python -m tests.stability.report`` from the top of the repository.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator

from gearbench.contact.assemble import assemble
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.solver import solve
from gearbench.contact.transitions import mesh_phases
from tests.stability.catalogue import CASES
from tests.stability.measure import compare, compare_body, compare_problem, compare_solid
from tests.stability.models import BODIES, SOLIDS
from tests.stability.problems import PROBLEMS
from tests.support.paths import ROOT

TARGET = ROOT / "docs" / "data" / "stability.csv"
#: Columns of digits that were compared, each of one quantity.
DIGITS = ("compliance_digits", "transmission_error_digits", "stiffness_digits", "force_digits")
COLUMNS = ("kind", "case", "why_it_is_hard", *DIGITS, "asserted_digits", "newton_steps")


def rows() -> Iterator[tuple[object, ...]]:
    """One row for each case, in the order of ``COLUMNS``; a cell is empty where nothing was compared."""
    for case in CASES.values():
        scene = case.build()
        solution = solve(assemble(scene, scene_lines(scene, mesh_phases(scene)[0])))
        assert solution.corrected == 0, case.name
        found = compare(scene, case.phases)
        steps = max(found.steps, int(solution.iterations.max()))
        yield "scene", case.name, case.why, "", *_digits(found), case.digits, steps
    for case in PROBLEMS.values():
        found = compare_problem(case.build())
        yield "contact problem", case.name, case.why, "", *_digits(found), case.digits, found.steps
    for case in SOLIDS.values():
        found, compliance = compare_solid(case)
        yield "solid tooth", case.name, case.why, f"{compliance:.1f}", *_digits(found), case.digits, ""
    for case in BODIES.values():
        yield "gear body", case.name, case.why, f"{compare_body(case):.1f}", "", "", "", case.digits, ""


def _digits(found) -> tuple[str, str, str]:
    return f"{found.approach:.1f}", f"{found.stiffness:.1f}", f"{found.force:.1f}"


if __name__ == "__main__":
    with TARGET.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        writer.writerows(rows())
