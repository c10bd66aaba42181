"""How many samples a robust evaluation needs: scrambled Sobol points against pseudo-random ones, over 20 seeds."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gearbench.library.garambois2017 import gear
from gearbench.robustness.montecarlo import RobustProblem, default_threads, prepare_scene, respond
from gearbench.robustness.sampling import Sampler

if TYPE_CHECKING:
    import xarray as xr

QUESTION = "Are 256 Sobol points at least as accurate as 1000 pseudo-random samples?"

GEARS = ("SC", "7", "19", "36", "55")
COUNTS = {"sobol": (64, 128, 256, 512, 1024), "random": (64, 128, 256, 512, 1000)}
QUANTITIES = ("m_k", "m_ste")


def means(problem: RobustProblem, sampler: Sampler, count: int, seed: int) -> tuple[float, float]:
    """m_k [%] and m_ste [µm] of a prepared scene."""
    answer, _ = respond(problem, problem.draw(count, seed, sampler), default_threads())
    return float(answer["mesh_stiffness_rms"].mean()), float(answer["transmission_error_rms"].mean())


def compute(*, quick: bool = False) -> xr.Dataset:
    """Means of five gears for every sampler, count and seed, and reference means from 65 536 Sobol points."""
    import xarray as xr

    gears, seeds = GEARS[:1] if quick else GEARS, range(4 if quick else 20)
    problems = [prepare_scene(gear(name).scene(errors=True)) for name in gears]
    reference = [means(p, "sobol", 2**13 if quick else 2**16, 987_654) for p in problems]
    data: dict[str, tuple] = {"reference": (("gear", "quantity"), np.array(reference))}
    for sampler in COUNTS:
        counts = COUNTS[sampler]
        values = [[[means(p, sampler, n, seed) for seed in seeds] for n in counts] for p in problems]
        data[sampler] = (("gear", f"{sampler}_count", "seed", "quantity"), np.array(values))
    coords = {f"{sampler}_count": list(counts) for sampler, counts in COUNTS.items()}
    return xr.Dataset(data, coords={**coords, "gear": list(gears), "quantity": list(QUANTITIES), "seed": list(seeds)})


def relative_error(dataset: xr.Dataset, sampler: str) -> xr.DataArray:
    """RMS over the seeds of the relative error of the means, (gear, count, quantity)."""
    error = dataset[sampler] / dataset["reference"] - 1
    return np.sqrt((error**2).mean("seed"))


def checks(dataset: xr.Dataset) -> list[tuple[str, bool]]:
    """256 Sobol points against 1000 pseudo-random ones: the error over all gears, each quantity."""
    found = []
    for quantity in QUANTITIES:
        sobol, random = (
            float(np.sqrt((error.sel(quantity=quantity) ** 2).mean("gear")))
            for error in (
                relative_error(dataset, "sobol").sel(sobol_count=256),
                relative_error(dataset, "random").sel(random_count=1000),
            )
        )
        text = f"{100 * sobol:.2f} % with 256 Sobol points, {100 * random:.2f} % with 1000 pseudo-random samples"
        found.append((f"{quantity}: error {text}", sobol <= random))
    return found


def figures(dataset: xr.Dataset, folder: Path) -> None:
    """Error of the means against the number of samples."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(10, 4.5), layout="constrained", sharey=True)
    styles = {"sobol": ("#0072B2", "o", "scrambled Sobol"), "random": ("#D55E00", "s", "pseudo-random")}
    for axis, quantity in zip(axes, QUANTITIES, strict=True):
        for sampler, (colour, marker, label) in styles.items():
            error = 100 * relative_error(dataset, sampler).sel(quantity=quantity)
            counts = dataset[f"{sampler}_count"]
            axis.loglog(counts, error.T, marker, color=colour, alpha=0.35, ms=4)
            axis.loglog(counts, np.sqrt((error**2).mean("gear")), f"-{marker}", color=colour, label=label)
        axis.set_xlabel("samples [–]")
        axis.set_title(f"{quantity.replace('_', ' ')}")
        axis.set_xticks([64, 128, 256, 512, 1000], ["64", "128", "256", "512", "1000"])
        axis.minorticks_off()
        axis.grid(alpha=0.3)
    axes[0].set_ylabel("RMS error of the mean over the seeds [%]")
    axes[0].legend(frameon=False)
    sobol = relative_error(dataset, "sobol").sel(sobol_count=256)
    random = relative_error(dataset, "random").sel(random_count=1000)
    gain = np.sqrt((random**2).mean("gear") / (sobol**2).mean("gear"))
    figure.suptitle(
        "256 Sobol points against 1000 pseudo-random samples: errors smaller by a factor of "
        f"{float(gain.sel(quantity='m_k')):.1f} (m k) and {float(gain.sel(quantity='m_ste')):.1f} (m ste)"
    )
    figure.savefig(folder / "sampling.png", dpi=150)
    plt.close(figure)
