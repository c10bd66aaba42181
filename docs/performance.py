"""Write docs/performance.md from the stored Dataset of the study on the cost of accuracy.

python -m studies run s07_accuracy_cost
python -m docs.performance out/studies/s07_accuracy_cost
"""

from __future__ import annotations

import shutil
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gearbench.accuracy.knobs import with_resolution
from gearbench.contact.assemble import mesh_phases
from gearbench.effort.figures import cheapest
from gearbench.results.netcdf import load
from studies.report import table
from studies.s07_accuracy_cost.data import ACCURACIES, MESHED, scenes
from studies.s07_accuracy_cost.findings import TIMES, diagram, meshed, met, ratios, scaling_part
from studies.s07_accuracy_cost.gears import gears
from studies.s07_accuracy_cost.pictures import cheapest_mesh, pareto
from studies.s07_accuracy_cost.scaling import exponent, speed_up

if TYPE_CHECKING:
    import xarray as xr

DOCS = Path(__file__).parent
NAME = "s07_accuracy_cost"
#: The Dataset that the page was written from, and the page.
DATA, PAGE = DOCS / "data" / f"{NAME}.nc", DOCS / "performance.md"
FIGURES = ("work_precision_time", "front", "work_precision_memory", "promises", "scaling")

HEAD = """# What accuracy costs

Written by `docs/performance.py` from the Dataset of `studies/s07_accuracy_cost/data.py`; do not edit.

Errors are the largest relative error of four numbers: mean and RMS of the static transmission error (STE), mean and RMS
of the mesh stiffness. The error of a fluctuation is relative to itself, but to no less than 1 % of the mean. Every knob
has a converged reference of its own, with the difference of its two finest levels as error bar. Times are medians of
repeated runs, processor time of one thread: on an idle machine that is wall time. The two processors of the machine
were busy with tests meanwhile, which lengthens processor times too. The diagrams of the knobs, those of the gears in
use and the scaling were computed again for this page, before a gear body was joined to its teeth in two thirds of the
time; finite elements, the front over all models and accuracies asked for are of earlier states of the program.
`gearbench cost SCENE -o DIR` draws the same diagrams for any scene.
"""
ASKED = """## Accuracy asked for

`accuracy = 0.01` in `[resolution]`, or `--accuracy 1%` for `simulate` and `robust`, chooses settings whose estimated
error is within it: that of mean, RMS, peak-to-peak value and harmonics 1 to 5 of STE and mesh stiffness, against the
converged solution of the scene's own effects. Peak-to-peak values are relative to themselves, but to no less than 1 %
of the mean, harmonics to no less than 20 % of peak-to-peak. The Dataset states what was asked, chosen and estimated
in `accuracy_requested`, `accuracy_settings`, `accuracy_estimated` and, number by number, `accuracy_errors`; the time
spent choosing is `accuracy_seconds`. The tooth model is never changed. The order of a solid tooth is chosen where the
scene gives none, the accuracy of finite elements where it has its default; the order of a plate is part of the model
and is kept.

1. Finite elements get half of the budget.
2. The scene runs at settings that left the error asked for on gears in use: at 1 % with 16 segments and 5 Gauss
   points, and again with 0.6 of the segments and 0.8 of the Gauss points: 0.6 of the difference counts as error.
   Solid teeth have half as many segments more, and 7 functions along the height meanwhile. Where that is above the
   budget, or 0.6 of it with solid teeth, only what contributes is raised, in at most six rounds.
3. With these segments and Gauss points solid teeth climb, at 1 % to 9 functions along the height: the difference
   between two rungs is extrapolated with order 2.2, from 14 functions on with 1.5, and its square and that of the error
   before add up. Where that is above the budget they climb on, rung by rung.
4. The last run is the result. What cannot be met is refused in one line, which says what was reached, and what solid
   teeth of the highest order would leave, as soon as that is known.
5. `robust` does this on 128 samples with 40 % of the budget for the means of mean and RMS, with 1.5 of the difference
   for an error, then doubles the samples until three standard errors fit into the rest.

On wide helical pairs with relief on their bodies, a third of them off the line of action
(`python -m studies.s07_accuracy_cost.bodies`, rows in `bodies.csv` beside it) 1 % was met on 19 of 19 that nothing was
settled on, at 3.4 times the processor time of the cheapest settings, which nobody knows beforehand (median; above 6 on
five, at most 15, off the line of action). Of seven others off the line two missed it, by 1.06 and 1.15 % in the
peak-to-peak value of k, which polynomials overshoot at births. The order of teeth was settled on 37 other pairs. 0.1 %
is refused on many: with 23 functions along the height the order leaves 0.01 to 0.6 %, and the line says what the
highest would leave.

The random scenes are spur and helical pairs, half of them each with tip relief, crowning, a slope of the helix; none
was left out. The best setting is the quickest on the grid of all segments up to 128 and Gauss points up to 32 whose
true error is within the accuracy. Where an accuracy is refused as out of reach, it counts as not met. The table and
the picture are of the search before this one, by 50 to 70 trial runs, for mean and RMS only; its times of choosing
are not those of today. Today's search, in all the numbers it covers, met 1 % on 98 and 0.1 % on 99 of 100 other pairs
with plates (`tests/accuracy/test_by_seed.py`).
"""
LIMITS = """Where the load leaves part of the flank, segment after segment loses contact and the stiffness jumps each
time: the RMS of k then falls like 1/segments, irregularly, whatever the quadrature over the phases. It is this number
that is dear where patches of contact cannot be followed, as over error samples.
Settings found once are in the Dataset's scene and may be kept.
"""


GEARS = """The pairs of `examples/gears`: solid teeth on their gear bodies, contact on the line of action, with the
modifications of their files. The other knobs are those of the file: 15 segments, 8 Gauss points on each panel. The pair
is known where segments and Gauss points are turned, new where the order of its teeth is. The last column is the error
bar of the reference.
"""
ELEMENTS = """Mesh m has m cells across the tooth and cells in proportion elsewhere; tetrahedra are about as large as
the hexahedra of the flank. A run meshes both gears, solves for all loads on a flank, and solves the mesh cycle. Each
type of element runs in a process of its own, from coarse to fine, its libraries loaded and a first small mesh solved;
each accuracy of finite elements in one that finds nothing kept. Memory: the largest that process took beyond its
libraries. The error is that of the compliance of the flanks (Frobenius norm, the worse gear) against Richardson's value
of the two finest meshes of 20-node hexahedra, whose error bar is half the difference to the value of the two meshes
before.
"""


def page(dataset: xr.Dataset) -> str:
    """Text of docs/performance.md."""
    parts = [
        HEAD,
        _knobs(dataset),
        _gears(dataset),
        elements(dataset),
        _front(dataset),
        ASKED,
        _promises(dataset),
        LIMITS,
        _scaling(dataset),
    ]
    return "\n".join(part.rstrip() + "\n" for part in parts if part)


def _table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    return "\n".join(table(head, rows)) + "\n"


def _picture(name: str, words: str) -> str:
    return f"![{words}](figures/performance_{name}.png)\n"


def _knobs(dataset: xr.Dataset) -> str:
    """Orders observed, and times of 1 % and 0.1 %."""
    rows = []
    for name in (n for n in dict.fromkeys(dataset["setting_scene"].values.tolist()) if n not in gears()):
        part = diagram(dataset, name)
        for knob in part["knob"].values.tolist():
            orders = part["observed_order"].sel(knob=knob).values
            seen = ", ".join(_order_word(p) for p in orders)
            times = [_milliseconds(cheapest(part, knob, error)) for error in (0.01, 0.001)]
            expected = str(part["expected_order"].sel(knob=knob).values)
            rows.append((name, knob.replace("_", " "), expected, seen, *times))
    head = ("scene", "knob", "order expected", "observed: mean, RMS of STE; mean, RMS of k", "1 % [ms]", "0.1 % [ms]")
    text = "## Each knob by itself\n\nThe other knobs as in the scene (15 segments, 8 Gauss points on each panel).\n\n"
    text += _picture("work_precision_time", "error against time of every knob")
    text += "\n" + _table(head, rows)
    return text + f"\n{_phase_sentence(dataset)}\n\n" + _picture("work_precision_memory", "error against memory")


def _gears(dataset: xr.Dataset) -> str:
    """The gears in use: order observed and time of each setting; nothing where the Dataset has none."""
    rows = []
    for name in (n for n in dict.fromkeys(dataset["setting_scene"].values.tolist()) if n in gears()):
        part = diagram(dataset, name)
        for knob in part["knob"].values.tolist():
            seen = ", ".join(_order_word(p) for p in part["observed_order"].sel(knob=knob).values)
            times = [_milliseconds(cheapest(part, knob, error)) for error in (0.01, 0.001)]
            bar = float(part["error_bar"].values[part["setting_knob"].values == knob].max())
            rows.append((name, knob.replace("_", " "), seen, *times, f"{100 * bar:.2g}"))
    if not rows:
        return ""
    head = ("gears", "knob", "observed: mean, RMS of STE; mean, RMS of k", "1 % [ms]", "0.1 % [ms]", "bar [%]")
    text = f"## The gears in use\n\n{GEARS}\n" + _picture("gears", "error against time on the twelve gears in use")
    return text + "\n" + _table(head, rows)


def _number(x: float) -> str:
    return f"{x:.0f}" if x >= 100 else f"{x:.3g}"


def _order_word(p: float) -> str:
    """An order observed; far above those of algebraic convergence it is none."""
    return "–" if not np.isfinite(p) else f"{p:.1f}" if p <= 4 else "> 4"


def _milliseconds(seconds: float | None) -> str:
    return "–" if seconds is None else f"{1e3 * seconds:.3g}"


def _phase_sentence(dataset: xr.Dataset) -> str:
    """Time of one more mesh phase."""
    words = []
    names = dict.fromkeys(dataset["setting_scene"].values.tolist())
    plain = [name for name in names if not name.endswith(MESHED) and name not in gears()]
    for name, scene in ((name, scenes()[name]) for name in plain):
        part = diagram(dataset, name)
        rows = part.isel(setting=part["setting_knob"].values == "gauss_points")
        few, many = (i for i, level in enumerate(rows["level"].values) if level in ("8", "32"))
        phases = [
            len(mesh_phases(with_resolution(scene, gauss_points=int(rows["level"].values[i])))[0]) for i in (few, many)
        ]
        spent = float(rows["processor_seconds"][many] - rows["processor_seconds"][few])
        words.append(f"{name} {1e6 * spent / (phases[1] - phases[0]):.0f} µs")
    return f"One more mesh phase takes: {', '.join(words)}. The rest of a run is the same for any number of them."


def elements(dataset: xr.Dataset) -> str:
    """Finite element types and meshes; nothing where the Dataset has none."""
    rows = []
    for name, part in meshed(dataset).items():
        for knob in part["knob"].values.tolist():
            expected = str(part["expected_order"].sel(knob=knob).values)
            row = (name.removesuffix(f", {MESHED}"), knob, expected)
            row += (_order_word(float(part["compliance_order"].sel(knob=knob))),)
            rows.append((*row, *(_mesh_words(cheapest_mesh(part, knob, error)) for error in (0.01, 0.003))))
    if not rows:
        return ""
    bars = ", ".join(f"{100 * float(p['compliance_error_bar'].max()):.2g} %" for p in meshed(dataset).values())
    head = ("scene", "knob", "order expected", "observed: compliance", "1 % of the compliance", "0.3 %")
    text = f"## Finite elements: type and mesh\n\n{ELEMENTS}\n" + _table(head, rows)
    text += f"\nIn the last columns: level, unknowns of the larger mesh, time [s], memory [MB]. Error bars: {bars}.\n\n"
    return text + _picture("elements", "error of finite elements against time and memory, by type and mesh")


def _mesh_words(row: xr.Dataset | None) -> str:
    if row is None:
        return "–"
    cost = float(row["processor_seconds"]), float(row["megabytes"])
    return f"{row['level'].values}: {int(row['unknowns'])}, {cost[0]:.2g}, {_number(cost[1])}"


def _front(dataset: xr.Dataset) -> str:
    """What no other model beats in both error and time."""
    text = (
        "## From the paper's plate to finite elements\n\nTeeth set up anew for each run, as for a new design; errors "
    )
    text += "against the finest mesh.\nWhat no other setting beats in both error and time:\n\n"
    rows = []
    for name in dict.fromkeys(dataset["model_scene"].values.tolist()):
        part = dataset.isel(model=dataset["model_scene"].values == name)
        error = part["model_error"].max("quantity").values
        for i in pareto(part["model_seconds"].values, error):
            label, points = str(part["model_label"].values[i]), f"{int(part['model_points'].values[i])}"
            cost = _number(1e3 * float(part["model_seconds"][i])), _number(float(part["model_megabytes"][i]))
            rows.append((name, label, points, f"{100 * error[i]:.2f}", *cost))
    head = ("scene", "tooth model", "Gauss points", "error [%]", "time [ms]", "memory [MB]")
    bar = 100 * float(dataset["model_bar"].max())
    text += _table(head, rows) + f"\nThe compliance of the reference is good to {bar:.2g} %. "
    text += "Memory: arrays and objects; of finite elements, what a process of its own takes.\n\n"
    return text + _picture("front", "error against time and memory of all tooth models")


def _promises(dataset: xr.Dataset) -> str:
    """What became of the accuracies asked for."""
    rows = []
    for kind, words in (("promise", "plate"), ("solid", "solid tooth"), ("robust", "plate, error samples")):
        for accuracy in ACCURACIES if kind == "promise" else np.unique(dataset[f"{kind}_accuracy"].values):
            part = dataset.isel({kind: dataset[f"{kind}_accuracy"].values == accuracy})
            share = part[f"{kind}_true"] / accuracy
            row = (words, f"{100 * accuracy:g} %", str(part.sizes[kind]), f"{100 * met(part, kind):.0f} %")
            row += (f"{float(share.median()):.2f}", f"{float(share.max()):.2f}")
            if kind == "promise":
                ratio, search = ratios(part), part["promise_search_seconds"]
                row += (f"{100 * float((ratio <= TIMES).mean()):.0f} %", f"{np.median(ratio):.2f}, {ratio.max():.2f}")
                row += (f"{1e3 * float(search.median()):.0f}, {1e3 * float(search.max()):.0f}",)
            rows.append((*row, *["–"] * (9 - len(row))))
    head = ("teeth", "accuracy", "scenes", "met", "true/asked, median", "largest", f"within {TIMES:g}× of the best")
    head += ("time over the best's: median, largest", "choice [ms]: median, most")
    return _table(head, rows) + "\n" + _picture("promises", "true and estimated errors, and time against the best")


def _scaling(dataset: xr.Dataset) -> str:
    """Times over segments, samples, pairs, workers."""
    part, rows = scaling_part(dataset), []
    for name in ("segments", "samples", "pairs", "workers"):
        mine = part.isel(run=part["grows"].values == name)
        which = "seconds" if name == "workers" else "processor_seconds"
        growth = f"{exponent(part, name):.2f}" if name != "workers" else "–"
        sizes, times = ", ".join(_number(x) for x in mine["size"].values), 1e3 * mine[which].values
        rows.append((name, sizes, ", ".join(_number(t) for t in times), growth))
    text = "## Scaling\n\nSegments and pairs: case 2, the face up to 16 times as wide for more pairs (sizes: total "
    text += "contact ratio). Samples and workers:\n"
    text += "gear 55 with its errors, workers on 4096 samples and by wall time.\n\n"
    text += _table(("what grows", "sizes", "time [ms]", "exponent at the large end"), rows)
    words = f"\nAll workers together are {speed_up(part):.2f} times as fast as one"
    workers = part.isel(run=part["grows"].values == "workers")["size"].values
    return text + f"{words} ({workers.max():.0f} of them).\n\n" + _picture("scaling", "time against size")


def figures_of(dataset: xr.Dataset) -> tuple[str, ...]:
    """Figures of the page; those of finite elements and of gears in use where the Dataset has such scenes."""
    in_use = np.isin(dataset["setting_scene"].values, [*gears()]).any()
    return (*FIGURES, *(("elements",) if meshed(dataset) else ()), *(("gears",) if in_use else ()))


def main(folder: Path) -> None:
    """Write page, Dataset and figures from the folder of the study."""
    dataset = load(folder / f"{NAME}.nc")
    DATA.parent.mkdir(exist_ok=True)
    shutil.copyfile(folder / f"{NAME}.nc", DATA)
    for name in figures_of(dataset):
        shutil.copyfile(folder / f"{name}.png", DOCS / "figures" / f"performance_{name}.png")
    PAGE.write_text(page(dataset), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
