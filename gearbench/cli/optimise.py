"""``gearbench optimise``."""

from __future__ import annotations

import sys
from collections import Counter
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gearbench.cli.output import answer, progress_line, say
from gearbench.cli.table import print_columns
from gearbench.lazy import xr

if TYPE_CHECKING:
    from gearbench.optimisation.run import Progress

StudyFile = Annotated[Path, typer.Argument(metavar="STUDY", help="Study file (TOML).", show_default=False)]
Folder = Annotated[
    Path, typer.Option("--output", "-o", metavar="DIR", help="Folder for the generations and the front.")
]
Resume = Annotated[bool, typer.Option("--resume", help="Continue the search in DIR.")]
Scheduler = Annotated[str | None, typer.Option(metavar="ADDRESS|local:N", help="Evaluate designs on dask.distributed.")]
Threads = Annotated[int | None, typer.Option(min=1, help="Number of worker processes; by default all processors.")]
#: Number of designs of the front in the summary.
SHOWN = 12


def optimise(
    study: StudyFile,
    output: Folder,
    resume: Resume = False,
    scheduler: Scheduler = None,
    threads: Threads = None,
) -> None:
    """Search for better gears as STUDY says. Every generation is kept in DIR; --resume continues after an interruption.

    Example: gearbench optimise examples/optimise_pair.toml -o front
    """
    from gearbench.optimisation.run import optimise as run
    from gearbench.optimisation.scheduler import dask_workers
    from gearbench.optimisation.study_file import read_study

    loaded = read_study(study)
    try:
        workers = nullcontext() if scheduler is None else dask_workers(scheduler)
        with progress_line() as tell, workers as executor:
            options = {"resume": resume, "threads": threads, "executor": executor}
            dataset = run(loaded, directory=output, progress=lambda state: tell(_line(state)), **options)
    except KeyboardInterrupt:
        kept = len(list(output.glob("generation_*.nc")))
        again = f"gearbench optimise {study} -o {output} --resume"
        print(f"gearbench: interrupted; {kept} generations are kept. Continue with: {again}", file=sys.stderr)
        raise typer.Exit(130) from None
    data = {"study_sha256": dataset.attrs["study_sha256"], **_numbers(dataset), "files": [output / "front.nc"]}
    answer(data, show=lambda: _print_summary(loaded.name, dataset))


def _line(state: Progress) -> str:
    left = state.remaining
    eta = "–" if left is None else f"{int(left) // 3600}:{int(left) // 60 % 60:02d}:{int(left) % 60:02d}"
    return (
        f"generation {state.generation}/{state.generations}, {state.evaluated} evaluated, {state.feasible} feasible, "
        f"hypervolume {state.hypervolume:.4f}, {eta} left"
    )


def _numbers(dataset: xr.Dataset) -> dict[str, float]:
    asked, evaluated = int(dataset["asked"].sum()), dataset.sizes["design"]
    return {
        "generations": dataset.sizes["generation"],
        "asked": asked,
        "evaluated": evaluated,
        "cached_share": 1 - evaluated / asked,
        "feasible": int(dataset["feasible"].sum()),
        "on_front": int(dataset["on_front"].sum()),
        "hypervolume": float(dataset["hypervolume"][-1]),
        "wall_time_s": dataset.attrs["wall_time_s"],
    }


def _print_summary(name: str, dataset: xr.Dataset) -> None:
    n = _numbers(dataset)
    say(
        f"{name or 'study'}: {n['generations']} generations, {n['asked']} designs asked for, "
        f"{n['evaluated']} evaluated, {n['feasible']} feasible, {n['on_front']} on the front, "
        f"hypervolume {n['hypervolume']:.4f}"
    )
    if n["on_front"]:
        _print_front(dataset)
    else:
        ((reason, count),) = Counter(map(str, dataset["reason"].values)).most_common(1)
        say(f"no feasible design; most often: {reason} ({count} designs)")


def _print_front(dataset: xr.Dataset) -> None:
    """Print at most ``SHOWN`` designs of the front, from one end to the other."""
    from gearbench.optimisation.designs import Designs

    on_front = dataset["on_front"].values.nonzero()[0]
    front = dataset.isel(design=on_front[dataset["objective"].values[on_front, 0].argsort(kind="stable")])
    names = [str(name) for name in front["variable"].values]
    support = Designs(dataset).support(on_front)
    headings = [name.replace(".", ".\n").replace("_", "_\n") for name in names]
    headings += [_heading(i, str(label)) for i, label in enumerate(front["objective_name"].values)]
    rows = []
    for number in sorted({round(i * (len(on_front) - 1) / (SHOWN - 1)) for i in range(SHOWN)}):
        row = front.isel(design=number)
        values = [f"{row[v].item():g}" if row[v].dtype.kind in "if" else str(row[v].item()) for v in names]
        rows.append([*values, *(f"{x:.4g}" for x in row["objective"].values)])
    print_columns(f"front, support: {support}", headings, rows, left=())


def _heading(number: int, label: str) -> str:
    """Column heading of an objective: symbol and unit; for a weighted sum, its number."""
    from gearbench.results.responses import quantity

    q = quantity(label)
    return f"objective\n{number + 1}" if q is None else f"{q.symbol}\n{q.units}"
