"""``gearbench polish``."""

from __future__ import annotations

from typing import Annotated

import typer

from gearbench.cli.options import Json, Memory, Output, Quiet, Stored, Threads, Verbose, progress_lines, say

Evaluations = Annotated[int, typer.Option(min=8, help="Largest number of evaluations of each design.")]


def polish(
    stored: Stored,
    output: Output = None,
    evaluations: Evaluations = 60,
    threads: Threads = None,
    memory: Memory = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
) -> None:
    """Improve every design of a front over its continuous variables, in all objectives at once.

    Variables with decimal steps become real. select, verify and explore open the result like a front.

    Example: gearbench polish front -o polished.nc
    """
    from gearbench.cli.summary import print_mapping
    from gearbench.optimisation.refinement import polish as run
    from gearbench.optimisation.select import open_designs
    from gearbench.results.netcdf import save

    designs = open_designs(stored)
    tell = progress_lines(quiet=quiet, json=json)
    dataset = run(
        designs, evaluations=evaluations, threads=threads, progress=lambda done, of: tell(f"{done} of {of} designs")
    )
    files = [] if output is None else [save(dataset, output)]
    before, after = (dataset.attrs[f"hypervolume_{when}"] for when in ("before", "after"))
    improved = int((dataset["objective"] < dataset["objective_before"]).any("objective_name").sum())
    count = dataset.sizes["design"]
    if json:
        volumes = {"hypervolume_before": before, "hypervolume_after": after}
        print_mapping({"designs": count, "improved": improved, **volumes, "files": files})
    elif not quiet:
        name = designs.study.name or "study"
        say(f"{name}: {improved} of {count} designs improved, hypervolume {before:.4f} → {after:.4f}")
        for path in files:
            say(f"wrote {path}")
