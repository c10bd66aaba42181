"""Findings: parts of the Dataset, and checks of promises, convergence orders and scaling."""

from __future__ import annotations

import numpy as np

from gearbench.lazy import xr
from studies.s07_accuracy_cost.scaling import DIMENSIONS, exponent

#: Limits: least share of the scenes whose true error is within the requested accuracy, and largest ratio of the time,
#: search included, to that of the best setting.
MET, TIMES = 0.95, 6.0


def diagram(dataset: xr.Dataset, scene: str) -> xr.Dataset:
    """Work–precision of one scene, as ``cost`` returned it."""
    names = ("error", "error_bar", "processor_seconds", "seconds", "megabytes", "observed_order", "curve_knob")
    rows = dataset[list(names)]
    rows = rows.isel(setting=dataset["setting_scene"].values == scene, curve=dataset["curve_scene"].values == scene)
    return rows.assign_coords(knob=("curve", rows["curve_knob"].values)).swap_dims({"curve": "knob"})


def met(dataset: xr.Dataset, kind: str) -> float:
    """Share of the promises of a kind whose true error is within the requested accuracy."""
    return float((dataset[f"{kind}_true"] <= dataset[f"{kind}_accuracy"]).mean())


def ratios(dataset: xr.Dataset) -> np.ndarray:
    """Ratios of the time with chosen settings to that with the best settings, for accuracies that could be met."""
    ratio = (dataset["promise_seconds"] / dataset["promise_best_seconds"]).values
    return ratio[np.isfinite(ratio)]


def checks(dataset: xr.Dataset) -> list[tuple[str, bool]]:
    """Check the promises, the observed convergence orders, and the growth of run time."""
    ratio = ratios(dataset)
    found = [
        (
            f"{text}: true error within the accuracy in {100 * met(dataset, kind):.0f} % of {dataset.sizes[kind]}",
            met(dataset, kind) >= MET,
        )
        for kind, text in (("promise", "plates"), ("solid", "solid teeth"), ("robust", "error samples"))
    ]
    within = float((ratio <= TIMES).mean())
    found.append(
        (
            f"time within {TIMES:g}× of the best setting in {100 * within:.0f} %, median {np.median(ratio):.2f}×, "
            f"largest {ratio.max():.2f}×",
            within >= MET,
        )
    )
    order = _order(dataset, "case 2", "segments")
    # contact lines are loaded over their whole length, so the quadrature over segments converges exponentially
    found.append((f"case 2: order {order:.2f} in the segments", order > 4))
    for name in DIMENSIONS[:3]:
        slope = exponent(scaling_part(dataset), name)
        found.append((f"time grows with {name} to the power {slope:.2f}", slope < 1.3))
    return found


def _order(dataset: xr.Dataset, scene: str, setting: str) -> float:
    """Median observed order over the quantities."""
    return float(np.nanmedian(diagram(dataset, scene)["observed_order"].sel(knob=setting)))


def scaling_part(dataset: xr.Dataset) -> xr.Dataset:
    """Part on scaling, as ``scaling`` returned it."""
    names = {"run_size": "size", "run_seconds": "seconds", "run_processor": "processor_seconds"}
    return dataset[list(names)].rename(names)
