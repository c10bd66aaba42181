"""Findings: errors of the means by sampler and number of samples; checks and figure."""

from __future__ import annotations

from pathlib import Path

from gearbench.lazy import xr
from gearbench.plotting import BLUE, ORANGE, new_figure, write_figure
from studies.s02_sampling.data import COUNTS, QUANTITIES


def relative_error(dataset: xr.Dataset, sampler: str, quantity: str) -> xr.DataArray:
    """RMS over the seeds of the relative error of a mean, (gear, count)."""
    rows = dataset["error"].isel(setting=dataset["setting_knob"].values == f"samples, {sampler}")
    return rows.sel(quantity=QUANTITIES[quantity]).swap_dims(setting="size")


def compared(dataset: xr.Dataset, quantity: str) -> tuple[float, float]:
    """RMS errors over all gears with 256 Sobol points, and with 1000 pseudo-random samples."""
    sobol = relative_error(dataset, "sobol", quantity).sel(size=256)
    random = relative_error(dataset, "random", quantity).sel(size=1000)
    return float((sobol**2).mean() ** 0.5), float((random**2).mean() ** 0.5)


def checks(dataset: xr.Dataset) -> list[tuple[str, bool]]:
    """Check that the error over all gears with 256 Sobol points is no larger than with 1000 pseudo-random samples."""
    found = []
    for quantity in QUANTITIES:
        sobol, random = compared(dataset, quantity)
        text = f"{100 * sobol:.2f} % with 256 Sobol points, {100 * random:.2f} % with 1000 pseudo-random samples"
        found.append((f"{quantity}: error {text}", sobol <= random))
    return found


def figures(dataset: xr.Dataset, folder: Path) -> None:
    """Draw the error of the means over the number of samples."""
    figure, axes = new_figure(1, 2, (10, 4.5), sharey=True)
    styles = {"sobol": (BLUE, "o", "scrambled Sobol"), "random": (ORANGE, "s", "pseudo-random")}
    for axis, quantity in zip(axes[0], QUANTITIES, strict=True):
        for sampler, (colour, marker, label) in styles.items():
            error = 100 * relative_error(dataset, sampler, quantity)
            axis.loglog(COUNTS, error.T, marker, color=colour, alpha=0.35, ms=4)
            axis.loglog(COUNTS, (error**2).mean("gear") ** 0.5, f"-{marker}", color=colour, label=label)
        axis.set(xlabel="samples [–]", title=quantity.replace("_", " "))
        axis.set_xticks(COUNTS, [str(count) for count in COUNTS])
        axis.minorticks_off()
        axis.grid(alpha=0.3)
    axes[0, 0].set_ylabel("RMS error of the mean over the seeds [%]")
    axes[0, 0].legend(frameon=False)
    gain = {quantity: random / sobol for quantity in QUANTITIES for sobol, random in [compared(dataset, quantity)]}
    figure.suptitle(
        "256 Sobol points against 1000 pseudo-random samples: errors smaller by a factor of "
        f"{gain['m_k']:.1f} (m k) and {gain['m_ste']:.1f} (m ste)"
    )
    write_figure(figure, folder / "sampling.png")
