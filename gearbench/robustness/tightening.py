"""Recommendation of the tolerance to tighten first: the largest decrease of the mean RMS of the STE per unit of cost.

One ISO class finer divides a tolerance, and thus the errors drawn within it, by √2 (ISO 1328-1:2013). The change of the
mean and its standard error follow from the samples that are already computed (``sensitivity``).
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.lazy import xr

#: Tolerance of the next finer class over the tolerance of a class.
FINER = 2**-0.5
#: Two gains that differ by less than this number of standard errors are not distinguished.
APART = 2.0


@dataclass(frozen=True, kw_only=True)
class Gain:
    """Gain of one finer class of a tolerance.

    Parameters
    ----------
    name
        Name of the error; all teeth of a gear have the same tolerance.
    change, error
        Change of the mean STE RMS, and its standard error [µm].
    cost
        Relative cost of one class finer.
    """

    name: str
    change: float
    error: float
    cost: float

    @property
    def per_cost(self) -> float:
        """Decrease of the mean STE RMS per unit of cost [µm]."""
        return -self.change / self.cost


def gains(dataset: xr.Dataset) -> list[Gain]:
    """Gains of all tolerances of a Dataset of ``robust``, the greatest per unit of cost first; [] if unknown.

    With several loads they are weighted means. The samples are the same under all loads, so standard errors add.
    """
    if "transmission_error_rms_tightened" not in dataset:
        return []
    change = _over_loads(dataset, "transmission_error_rms_tightened")
    error = _over_loads(dataset, "transmission_error_rms_tightened_standard_error")
    costs = _over_loads(dataset, "tightening_cost")
    names = [re.sub(r"_tooth[+-]\d+$", "", str(name)) for name in dataset["error_name"].values]
    listed = []
    for name in dict.fromkeys(names):
        columns = np.flatnonzero(np.array(names) == name)
        cost = float(costs[columns[0]])
        # teeth are drawn independently: their effects add, and so do the squares of their standard errors
        listed.append(
            Gain(
                name=name, change=float(change[columns].sum()), error=float(np.hypot.reduce(error[columns])), cost=cost
            )
        )
    if not all(np.isfinite(gain.change) for gain in listed):
        return []
    return sorted(listed, key=lambda gain: -gain.per_cost)


def tighten_first(dataset: xr.Dataset) -> str:
    """Recommendation in one line; "" if there are too few samples."""
    listed = gains(dataset)
    if not listed:
        return ""
    significant = [gain for gain in listed if gain.change < -APART * gain.error]
    if not significant:
        return "no tolerance lowers the mean STE RMS significantly when it is tightened: draw more samples"
    best = significant[0]
    mean = float(_over_loads(dataset, "transmission_error_rms_mean"))
    others = [gain for gain in listed if gain is not best]
    equal = [gain.name for gain in others if best.per_cost - gain.per_cost <= APART * _of_difference(best, gain)]
    costs = "" if all(gain.cost == best.cost for gain in listed) else f", {best.per_cost:.2g} µm for each unit of cost"
    among = f"; not distinguishable from {', '.join(map(_words, equal))}" if equal else ""
    return (
        f"tighten {_words(best.name)} first: one class finer changes the mean STE RMS by {best.change:.2g} ± "
        f"{best.error:.1g} µm ({100 * best.change / mean:.1f} %){costs}{among}"
    )


def _over_loads(dataset: xr.Dataset, name: str) -> NDArray:
    """Values of a variable; with several loads their weighted mean."""
    if "load_weight" not in dataset.coords:
        return dataset[name].values
    weight = dataset["load_weight"]
    return (dataset[name] * weight).sum(weight.dims, skipna=False).values


def _of_difference(a: Gain, b: Gain) -> float:
    """Standard error of the difference of two gains per unit of cost [µm]."""
    return float(np.hypot(a.error / a.cost, b.error / b.cost))


def _words(name: str) -> str:
    return name.replace("_", " ")
