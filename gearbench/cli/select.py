"""``gearbench select``."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gearbench.cli.options import Stored, target, to_file
from gearbench.cli.output import answer, say
from gearbench.cli.table import print_columns
from gearbench.errors import InputError

if TYPE_CHECKING:
    from gearbench.optimisation.select import Resonance, Selection

Where = Annotated[
    list[str] | None,
    typer.Option(metavar="CONDITION", help='Condition, e.g. "helix_angle<=15"; repeatable.'),
]
Rank = Annotated[
    str | None, typer.Option(metavar="SUM", help='Weights, e.g. "mesh_stiffness_rms_mean + 2*axial_force".')
]
WorstCase = Annotated[bool, typer.Option("--worst-case", help="Rank by the maxima over the error samples.")]
Avoid = Annotated[
    list[str] | None, typer.Option(metavar="LOW:HIGH", help="Mesh frequencies to avoid [Hz]; needs --speed.")
]
Speed = Annotated[str | None, typer.Option(metavar="LOW:HIGH", help="Speeds of the pinion [1/min], for --avoid.")]
Orders = Annotated[int, typer.Option(min=1, max=100, help="Mesh orders for --avoid.")]
Top = Annotated[int, typer.Option(min=1, help="Number of designs to print.")]
Csv = Annotated[Path | None, to_file("FILE", "Write all remaining designs as CSV.")]
Markdown = Annotated[Path | None, to_file("FILE", "Write the printed designs as Markdown.")]
Export = Annotated[
    tuple[int, Path] | None,
    typer.Option(metavar="N SCENE.toml", help="Write design N as a scene."),
]


def select(
    stored: Stored,
    where: Where = None,
    rank: Rank = None,
    worst_case: WorstCase = False,
    avoid: Avoid = None,
    speed: Speed = None,
    orders: Orders = 1,
    top: Top = 10,
    csv: Csv = None,
    markdown: Markdown = None,
    export: Export = None,
) -> None:
    """Filter, rank and list the designs of an optimisation, and export one as a scene.

    Conditions may name variables, objectives and limits of the study, on_front, mass, gear_ratio, axial_force [N],
    modifications (number of kinds of micro-geometry), pinion_teeth, wheel_teeth, pinion_addendum, wheel_addendum.

    Example: gearbench select front --where "modifications==0" --where "pinion_addendum==1" --worst-case
    """
    from gearbench.files import write_text
    from gearbench.optimisation.conditions import parse_condition, parse_ranking
    from gearbench.optimisation.select import csv_text, markdown_text, open_designs
    from gearbench.optimisation.select import select as run

    conditions = [parse_condition(text) for text in where or ()]
    ranking = None if rank is None else parse_ranking(rank)
    resonances = _resonances(avoid or [], speed, orders)
    targets = [path for path in (csv, markdown, export[1] if export else None) if path is not None]
    target(export[1] if export else None)
    designs = open_designs(stored)
    selection = run(designs, where=conditions, avoid=resonances, rank=ranking, worst_case=worst_case)
    scene = selection.scene(export[0]) if export is not None else None
    if csv is not None:
        write_text(csv, csv_text(selection))
    if markdown is not None:
        write_text(markdown, markdown_text(selection, top))
    if export is not None and scene is not None:
        write_text(export[1], scene.to_toml())
    answer(_json(selection, top) | {"files": targets}, show=lambda: _print_list(selection, top))


def _resonances(bands: list[str], speed: str | None, orders: int) -> list[Resonance]:
    from gearbench.optimisation.conditions import parse_range
    from gearbench.optimisation.select import Resonance

    if bands and speed is None:
        raise InputError("avoid", bands[0], "needs --speed, the range of speeds of the pinion")
    if speed is None:
        return []
    if not bands:
        raise InputError("speed", speed, "needs --avoid, the mesh frequencies to avoid")
    speeds = parse_range("speed", speed)
    return [Resonance(frequency=parse_range("avoid", band), speed=speeds, orders=orders) for band in bands]


def _json(selection: Selection, top: int) -> dict[str, Any]:
    table = selection.table(top)
    rows = [dict(zip(table, (v.item() for v in row), strict=True)) for row in zip(*table.values(), strict=True)]
    steps = [{"condition": condition, "left": left} for condition, left in selection.steps]
    return {"steps": steps, "ranking": selection.ranking, "designs": rows}


def _print_list(selection: Selection, top: int) -> None:
    """Print how many designs are left after every condition, and the best of the selected designs."""
    from gearbench.optimisation.select import heading, ranking_text

    for condition, left in selection.steps:
        say(f"{left:7d}  {condition}")
    if len(selection.numbers) == 0:
        say("no design is left")
        return
    support = selection.designs.support(selection.numbers[:top])
    columns = selection.table(top)
    names = ["design", "score", *map(str, selection.designs.dataset["variable"].values), *selection.ranking]
    names = list(dict.fromkeys(names))
    short = [heading(selection, name).removeprefix("pair.").removeprefix("effects.") for name in names]
    rows = [
        [f"{x:.4g}" if isinstance(x, float) else str(x) for x in (value.item() for value in row)]
        for row in zip(*(columns[name] for name in names), strict=True)
    ]
    title = f"by {ranking_text(selection)}, support: {support}"
    print_columns(title, ["\n".join(re.split(r"[._ ]", name)) for name in short], rows, left=())
