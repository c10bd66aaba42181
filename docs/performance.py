"""Tables and figures of docs/performance.md, from the stored Dataset of the study on the cost of accuracy.

python -m studies run s07_accuracy_cost
python -m docs.performance out/studies/s07_accuracy_cost
"""

from __future__ import annotations

import csv
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gearbench.effort.figures import cheapest
from gearbench.results.netcdf import open_result
from studies.s07_accuracy_cost.data import ACCURACIES
from studies.s07_accuracy_cost.findings import TIMES, diagram, met, ratios, scaling_part
from studies.s07_accuracy_cost.pictures import pareto
from studies.s07_accuracy_cost.scaling import exponent

if TYPE_CHECKING:
    import xarray as xr

DOCS = Path(__file__).parent
NAME = "s07_accuracy_cost"
#: Folder of the tables, and the Dataset that they were written from.
TABLES = DOCS / "data"
DATA = TABLES / f"{NAME}.nc"
FIGURES = ("work_precision_time", "front", "work_precision_memory", "promises", "scaling", "gears")

Row = tuple[str, ...]


def settings(dataset: xr.Dataset) -> Iterator[Row]:
    """Each setting by itself: order observed, and cheapest time that reaches 1 % and 0.1 %."""
    orders = "observed order of mean and RMS of STE, mean and RMS of k"
    yield "scene", "setting", "expected order", orders, "time for 1 % [ms]", "time for 0.1 % [ms]"
    for name in dict.fromkeys(dataset["setting_scene"].values.tolist()):
        part = diagram(dataset, name)
        for setting in part["knob"].values.tolist():
            seen = " ".join(_order(p) for p in part["observed_order"].sel(knob=setting).values)
            times = [_milliseconds(cheapest(part, setting, error)) for error in (0.01, 0.001)]
            yield name, setting.replace("_", " "), str(part["expected_order"].sel(knob=setting).values), seen, *times


def models(dataset: xr.Dataset) -> Iterator[Row]:
    """Tooth models that no other one beats in both error and time."""
    yield "scene", "tooth model", "Gauss points", "error [%]", "time [ms]", "memory [MB]"
    for name in dict.fromkeys(dataset["model_scene"].values.tolist()):
        part = dataset.isel(model=dataset["model_scene"].values == name)
        error = part["model_error"].max("quantity").values
        for i in pareto(part["model_seconds"].values, error):
            one = part.isel(model=i)
            cost = _number(1e3 * float(one["model_seconds"])), _number(float(one["model_megabytes"]))
            yield name, str(one["model_label"].values), f"{int(one['model_points'])}", f"{100 * error[i]:.2f}", *cost


def accuracies(dataset: xr.Dataset) -> Iterator[Row]:
    """Accuracies that were asked for: how often they were met, and the time beside that of the best settings."""
    yield (
        "teeth", "accuracy [%]", "scenes", "met [%]", "true over asked, median", "true over asked, largest",
        f"within {TIMES:g} times the best [%]", "time over the best, median", "time over the best, largest",
    )  # fmt: skip
    for kind, words in (("promise", "plate"), ("solid", "solid tooth"), ("robust", "plate, error samples")):
        for accuracy in ACCURACIES if kind == "promise" else np.unique(dataset[f"{kind}_accuracy"].values):
            part = dataset.isel({kind: dataset[f"{kind}_accuracy"].values == accuracy})
            share = part[f"{kind}_true"] / accuracy
            row = (words, f"{100 * accuracy:g}", str(part.sizes[kind]), f"{100 * met(part, kind):.0f}")
            row += (f"{float(share.median()):.2f}", f"{float(share.max()):.2f}")
            if kind == "promise":
                ratio = ratios(part)
                row += (f"{100 * float((ratio <= TIMES).mean()):.0f}", f"{np.median(ratio):.2f}", f"{ratio.max():.2f}")
            yield row + ("",) * (9 - len(row))


def scaling(dataset: xr.Dataset) -> Iterator[Row]:
    """Times over segments, samples, tooth pairs in contact and workers."""
    yield "what grows", "sizes", "times [ms]", "exponent at the large end"
    part = scaling_part(dataset)
    for name in ("segments", "samples", "pairs", "workers"):
        mine = part.isel(run=part["grows"].values == name)
        times = 1e3 * mine["seconds" if name == "workers" else "processor_seconds"].values
        growth = "" if name == "workers" else f"{exponent(part, name):.2f}"
        yield name, *(" ".join(_number(x) for x in values) for values in (mine["size"].values, times)), growth


def _number(x: float) -> str:
    return f"{x:.0f}" if x >= 100 else f"{x:.3g}"


def _order(p: float) -> str:
    """An order observed; far above those of algebraic convergence it is none."""
    return "–" if not np.isfinite(p) else f"{p:.1f}" if p <= 4 else ">4"


def _milliseconds(seconds: float | None) -> str:
    return "" if seconds is None else f"{1e3 * seconds:.3g}"


PARTS = (settings, models, accuracies, scaling)


def write_tables(dataset: xr.Dataset, folder: Path) -> list[Path]:
    """Write each table as performance_NAME.csv into ``folder``."""
    written = []
    for part in PARTS:
        written.append(folder / f"performance_{part.__name__}.csv")
        with written[-1].open("w", encoding="utf-8", newline="") as file:
            csv.writer(file, lineterminator="\n").writerows(part(dataset))
    return written


def main(folder: Path) -> None:
    """Take Dataset and figures over from the folder of the study, and write the tables."""
    shutil.copyfile(folder / f"{NAME}.nc", DATA)
    for name in FIGURES:
        shutil.copyfile(folder / f"{name}.png", DOCS / "figures" / f"performance_{name}.png")
    write_tables(open_result(DATA), TABLES)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
