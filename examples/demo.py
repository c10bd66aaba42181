"""A first look in under a minute: five examples, each with a picture and a sentence."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gearbench import ToothBending, optimise, read_scene, read_study, robust, save, simulate, validate
from gearbench.plot import density, load_map, over_two_periods

if TYPE_CHECKING:
    import xarray as xr

EXAMPLES = Path(__file__).parent
#: Number of error samples.
SAMPLES = 1000


def main(folder: Path) -> None:
    """Run the five examples and leave pictures and Datasets in ``folder``."""
    from matplotlib import pyplot as plt

    folder.mkdir(parents=True, exist_ok=True)
    print("The first run after an installation compiles the solver: half a minute more.", flush=True)
    for number, (name, sentence, dataset) in enumerate(examples(), 1):
        picture = folder / f"{number}_{name}.png"
        plt.savefig(picture, dpi=110)
        plt.close()
        save(dataset, picture.with_suffix(".nc"))
        print(f"\n{number}. {sentence}\n   {picture}, {picture.with_suffix('.nc').name}", flush=True)


def examples() -> Iterator[tuple[str, str, xr.Dataset]]:
    """Name, sentence and Dataset of each example; its picture is the current figure."""
    compared = against_finite_elements()
    for index, name in enumerate(("plate", "solid")):
        yield name, *judged(compared.isel(scene=index), name)
    yield "electric_axle", *load_on_the_flank()
    yield "robust_gear", *scatter()
    yield "search", *front()


def against_finite_elements() -> xr.Dataset:
    """The paper's pair 1 with the paper's plate and with solid teeth, each against finite elements."""
    plate = read_scene(EXAMPLES / "case1.toml")
    effects = tuple(ToothBending(model="solid") if e.name == "tooth_bending" else e for e in plate.effects)
    return validate([plate, replace(plate, name="case 1, solid", effects=effects)], accuracy=0.01)


def judged(one: xr.Dataset, teeth: str) -> tuple[str, xr.Dataset]:
    """Transmission error of one tooth model compared with finite elements."""
    from matplotlib import pyplot as plt

    _, axes = plt.subplots(figsize=(7, 4), layout="constrained")
    for model, colour in (("fast", "tab:blue"), ("reference", "tab:orange")):
        over_two_periods(one.sel(model=model), "transmission_error", axes, colour)
    axes.set_ylabel("static transmission error [µm]")
    axes.legend(axes.lines[:3:2], (f"{teeth} teeth", "finite elements"), frameon=False)
    error = {
        f"{kind} {symbol}": float(one[f"{name}_{key}_error"])
        for name, symbol in (("transmission_error", "STE"), ("mesh_stiffness", "k"))
        for key, kind in (("mean", "mean"), ("peak_to_peak", "peak-to-peak"))
    }
    listed = ", ".join(f"{what} {value:+.1f} %" for what, value in error.items())
    axes.set_title(f"Pair 1 of the paper: mean STE of {teeth} teeth {error['mean STE']:+.1f} % from finite elements")
    fast, reference = one["compliance_seconds"].values
    return (
        f"{teeth.capitalize()} teeth against finite elements: {listed}; MAC of the deflection shapes at least "
        f"{float(one['mac_worst'].min()):.3f}; {fast:.2g} s instead of {reference:.2g} s for the teeth.",
        one,
    )


def load_on_the_flank() -> tuple[str, xr.Dataset]:
    """Contact pressure on the flank of an electric axle's input stage, tips included."""
    result = simulate(
        read_scene(EXAMPLES / "gears" / "e_drive_input.toml"), outputs=["line_load", "flank_pressure_max"]
    )
    most = float(result["flank_pressure_max"])
    load_map(result, 0).set_title(f"Input pinion of an electric axle: largest pressure {most:.0f} MPa", fontsize=10)
    return (
        "An electric axle's input stage, contact off the line of action included: the largest pressure is "
        f"{most:.0f} MPa, and crowning keeps the load away from the ends of the face.",
        result,
    )


def scatter() -> tuple[str, xr.Dataset]:
    """Transmission error of gear 55 of the paper over random errors of class 6."""
    from matplotlib import pyplot as plt

    result = robust(read_scene(EXAMPLES / "gear55_robust.toml"), samples=SAMPLES)
    density(result, "transmission_error_rms")
    mean, std = (float(result[f"transmission_error_rms_{statistic}"]) for statistic in ("mean", "std"))
    perfect = float(simulate(read_scene(EXAMPLES / "gear55_robust.toml"))["transmission_error_rms"])
    plt.gcf().suptitle(f"Gear 55: errors of class 6 leave {mean:.2f} ± {std:.2f} µm of transmission error")
    return (
        f"Gear 55 of the paper with {SAMPLES} samples of its errors: the RMS of its transmission error is "
        f"{mean:.2f} ± {std:.2f} µm, {perfect:.2f} µm with every error at its mean.",
        result,
    )


def front() -> tuple[str, xr.Dataset]:
    """A small search with its front as a Dataset."""
    from matplotlib import pyplot as plt

    result = optimise(read_study(EXAMPLES / "optimise_small.toml"))
    feasible = result["objective"].values[result["feasible"].values == 1]
    best = result["objective"].values[result["on_front"].values == 1]
    best = best[np.argsort(best[:, 0])]
    _, axes = plt.subplots(figsize=(7, 4), layout="constrained")
    axes.plot(*feasible.T, "o", color="0.75", label=f"{len(feasible)} feasible gears")
    axes.step(*best.T, where="post", marker="o", label=f"front, {len(best)} gears")
    axes.set(xlabel="mean RMS of the mesh stiffness [%]", ylabel="mean RMS of the transmission error [µm]")
    axes.set_title(f"Reverse gear: {len(best)} Pareto-optimal of {result.sizes['design']} gears searched")
    axes.legend()
    return (
        f"A search over {result.sizes['design']} gears: along the front the transmission error falls from "
        f"{best[0, 1]:.2f} to {best[-1, 1]:.2f} µm while the stiffness fluctuation rises from {best[0, 0]:.1f} to "
        f"{best[-1, 0]:.1f} %.",
        result,
    )


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out/demo"))
