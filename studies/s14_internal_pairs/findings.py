"""Findings: errors within 1 % (means) and 3 % (peak-to-peak), a table of all pairs, and a picture over the rim."""

from __future__ import annotations

import csv
import tomllib
from pathlib import Path

from gearbench.lazy import xr
from gearbench.plotting import BLUE, GREEN, ORANGE, new_figure, write_figure
from gearbench.scene_file import parse_scene
from studies.s05_tooth_models.data import ERRORS
from studies.s05_tooth_models.findings import LABELS
from studies.s14_internal_pairs.pairs import SUPPORTS

#: Limits for the errors of means and of peak-to-peak values [%].
LIMITS = {"mean": 1.0, "peak_to_peak": 3.0}
TABLE = "internal_pairs.csv"
_COLOURS = dict(zip(SUPPORTS, (BLUE, ORANGE, GREEN, "black"), strict=True))


def limit(name: str) -> float:
    """Limit of an error [%]."""
    return LIMITS["mean" if "mean" in name else "peak_to_peak"]


def checks(dataset: xr.Dataset) -> list[tuple[str, bool]]:
    """Check that no error exceeds its limit."""
    found = []
    for name in ERRORS:
        error = abs(dataset[name].values)
        text = f"{name.replace('_', ' ')} at most {limit(name):g} % on {dataset.sizes['design']} internal pairs"
        found.append((f"{text}, largest {error.max():.2f} %", bool((error <= limit(name)).all())))
    return found


def figures(dataset: xr.Dataset, folder: Path) -> None:
    """Write the table of all pairs, and draw their errors over the thickness of the ring's rim."""
    with (folder / TABLE).open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows(table(dataset))
    figure, (axes,) = new_figure(1, 2, (10, 3.8))
    for axis, part in zip(axes, LIMITS, strict=True):
        for support in SUPPORTS:
            here = dataset.isel(design=dataset["support"].values == support)
            for name, marker in ((f"transmission_error_{part}", "o"), (f"mesh_stiffness_{part}", "s")):
                label = f"{support}, {'STE' if marker == 'o' else 'k'}"
                colour = _COLOURS[support]
                axis.plot(here["rim"], here[f"{name}_error"], marker, ms=4, mfc="none", color=colour, label=label)
        for bound in (-LIMITS[part], LIMITS[part]):
            axis.axhline(bound, color="0.4", lw=0.8, ls=":")
        axis.set(xscale="log", xlabel="rim of the ring [modules]", ylabel=f"error of the {part.replace('_', '-')} [%]")
    axes[0].legend(frameon=False, fontsize=7, ncols=2)
    figure.suptitle(
        f"{dataset.sizes['design']} random internal pairs against finite elements of pinion and ring", fontsize=10
    )
    write_figure(figure, folder / "internal_pairs.png")


def table(dataset: xr.Dataset) -> list[list[str]]:
    """Rows of all pairs, the heads first."""
    heads = ["pair", "teeth", "helix [°]", "face width [modules]", "rim of the ring [modules]", "support"]
    rows = [heads + [f"{label} [%]" for label in LABELS]]
    for i in range(dataset.sizes["design"]):
        here = dataset.isel(design=i)
        pair = parse_scene(tomllib.loads(str(here["scene"].values))).pair
        sizes = f"{pair.helix_angle:g}", f"{pair.face_width / pair.normal_module:.3g}", f"{float(here['rim']):.2f}"
        errors = (f"{float(here[name]):.2f} ± {float(here[f'{name}_bar']):.2f}" for name in ERRORS)
        teeth = f"{pair.pinion.teeth}/{pair.wheel.teeth}"
        rows.append([str(int(here["number"])), teeth, *sizes, str(here["support"].values), *errors])
    return rows
