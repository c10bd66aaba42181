"""``gearbench verify``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from gearbench.cli.options import Output, Plots, Stored, Threads, plot_folder, saved, to_file
from gearbench.cli.output import answer, progress
from gearbench.lazy import xr

Designs = Annotated[list[int] | None, typer.Option("--design", metavar="N", help="Only this design; repeatable.")]
Accuracy = Annotated[
    float, typer.Option(min=1e-4, max=0.1, help="Relative error of the compliance of the finite elements.")
]
Markdown = Annotated[Path | None, to_file("FILE", "Write all designs as a Markdown table.")]


def verify(
    stored: Stored,
    output: Output = None,
    design: Designs = None,
    accuracy: Accuracy = 0.01,
    markdown: Markdown = None,
    plots: Plots = None,
    threads: Threads = None,
) -> None:
    """Evaluate the front of an optimisation again with finite elements: shifts of designs, and rank correlation.

    Each macro-geometry needs one finite element model, a few seconds each, kept on disk.

    Example: gearbench verify front -o verified.nc --plots plots
    """
    from gearbench.files import write_text
    from gearbench.optimisation.select import open_designs
    from gearbench.optimisation.verify import verify as run
    from gearbench.validation.verification import draw_verification, findings
    from gearbench.validation.verification import markdown as text

    folder = plot_folder(plots)
    designs = open_designs(stored)
    dataset = run(designs, numbers=design, accuracy=accuracy, threads=threads, progress=progress)
    name = designs.study.name
    written = saved(dataset, output)
    if markdown is not None:
        written.append(write_text(markdown, text(dataset, name)))
    if folder is not None:
        written.append(draw_verification(dataset, folder, name))
    head = f"{name or 'study'}: {dataset.sizes['design']} designs, {dataset.attrs['macro_geometries']} FE models"
    answer(_json(dataset) | {"files": written}, [head, *findings(dataset)])


def _json(dataset: xr.Dataset) -> dict[str, Any]:
    objectives = map(str, dataset["objective_name"].values)
    return {
        "study_sha256": dataset.attrs["study_sha256"],
        "designs": dataset.sizes["design"],
        "macro_geometries": dataset.attrs["macro_geometries"],
        "rank_correlation": dict(zip(objectives, dataset["rank_correlation"].values.tolist(), strict=True)),
        "shift_percent": dataset["shift"].values.tolist(),
        "number": dataset["number"].values.tolist(),
        "on_front_verified": int(dataset["on_front_verified"].sum()),
        "wall_time_s": dataset.attrs["wall_time_s"],
    }
