"""``gearbench polish``."""

from __future__ import annotations

from typing import Annotated

import typer

from gearbench.cli.options import Output, Stored, Threads, saved
from gearbench.cli.output import answer, progress

Evaluations = Annotated[int, typer.Option(min=8, help="Largest number of evaluations of each design.")]


def polish(
    stored: Stored,
    output: Output = None,
    evaluations: Evaluations = 60,
    threads: Threads = None,
) -> None:
    """Improve every design of a front over its continuous variables, in all objectives at once.

    Variables with decimal steps become continuous. select, verify and explore open the result like a front.

    Example: gearbench polish front -o polished.nc
    """
    from gearbench.optimisation.refinement import polish as run
    from gearbench.optimisation.select import open_designs

    designs = open_designs(stored)
    dataset = run(
        designs, evaluations=evaluations, threads=threads, progress=lambda done, of: progress(f"{done} of {of} designs")
    )
    before, after = (dataset.attrs[f"hypervolume_{when}"] for when in ("before", "after"))
    improved = int((dataset["objective"] < dataset["objective_before"]).any("objective_name").sum())
    count = dataset.sizes["design"]
    volumes = {"hypervolume_before": before, "hypervolume_after": after}
    name = designs.study.name or "study"
    answer(
        {"designs": count, "improved": improved, **volumes, "files": saved(dataset, output)},
        [f"{name}: {improved} of {count} designs improved, hypervolume {before:.4f} → {after:.4f}"],
    )
