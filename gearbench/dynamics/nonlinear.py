"""Response with loss of contact and back-side impact: harmonic balance with the force over time, followed in speed."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearbench.dynamics import waves
from gearbench.dynamics.analysis import HARMONICS, check_harmonics, check_speeds, modal_variables
from gearbench.dynamics.balance import orders
from gearbench.dynamics.branches import Branches, branches, remarks, sweeps
from gearbench.dynamics.force_curve import force_curve
from gearbench.dynamics.model import Group, Model
from gearbench.dynamics.oscillator import Oscillator
from gearbench.dynamics.size import nonlinear_memory, require_each
from gearbench.results.origin import keeping
from gearbench.results.provenance import provenance
from gearbench.results.responses import described
from gearbench.scene import Scene
from gearbench.threads import single_threaded_blas

if TYPE_CHECKING:
    import xarray as xr

#: Steps of the period at which the force is evaluated, at least, and for each order.
STEPS, PER_ORDER = 128, 8
#: Ways in which the speed changes.
SWEEPS = ("up", "down")


@single_threaded_blas()
def nonlinear_response(scene: Scene, *, speed: ArrayLike, harmonics: int = HARMONICS) -> xr.Dataset:
    """Steady response of the scene's own pair with loss of contact, as the speed rises and as it falls.

    Curves of periodic solutions are followed around their folds, from the linear responses at the lowest and the
    highest speed and wherever these leave a speed without a stable one. A sweep keeps to its branch until that ends,
    then jumps to the nearest stable one. Other meshes are springs of their mean stiffness.

    Parameters
    ----------
    scene
        With ``[system]``.
    speed
        Of the pinion [1/min].
    harmonics
        Orders of the mesh frequency.

    Returns
    -------
    Dataset with the dimensions ``sweep`` ("up", "down"), ``speed``, ``mesh``, ``harmonic``: NaN where no solution with
    the period of the mesh is stable. ``branches`` counts the solutions at each speed, stable or not.

    Raises
    ------
    InputError
        As ``response``.
    """
    start = time.perf_counter()
    speeds = check_speeds(speed)
    check_harmonics(harmonics)
    model, steps = Model(scene=scene, rows=1), max(STEPS, PER_ORDER * harmonics)
    require_each(nonlinear_memory(steps), len(speeds), "speed", f"{steps} steps of the period")
    first = model.groups[0]
    group = Group(meshes=first.meshes[:1], rate=first.rate, phase=first.phase[:1])
    low, high = float(speeds.min()), float(speeds.max())
    oscillator = Oscillator(
        model=model,
        group=group,
        curve=force_curve(model.cycles[0], steps),
        harmonics=harmonics,
        speeds=(low, high if high > low else 1.01 * low),
    )
    found = branches(oscillator, speeds)
    return _dataset(oscillator, speeds, found, start)


def _dataset(oscillator: Oscillator, speeds: NDArray, known: Branches, start: float) -> xr.Dataset:
    import xarray as xr

    model, unit, met = oscillator.model, oscillator.unit, sweeps(known, speeds)
    # a last row for speeds at which nothing is stable
    found = np.concatenate([known.solutions, np.full((1, known.solutions.shape[1]), np.nan)])[met]
    growth = np.append(known.multiplier, np.nan)[met]
    count = np.bincount(known.speed, minlength=len(speeds))
    te = orders(found) * unit
    force = orders(oscillator.forces(found)[0])
    mean = model.force[oscillator.group.meshes]
    over_time = oscillator.curve.force(oscillator.values(found))[0]
    over_time[np.isnan(growth)] = np.nan
    force[np.isnan(growth)] = np.nan
    dims = ("sweep", "speed", "mesh")
    variables = {
        "dynamic_transmission_error_amplitude": ((*dims, "harmonic"), 1e3 * waves.amplitude(te)[:, :, None]),
        "dynamic_transmission_error_phase": ((*dims, "harmonic"), waves.phase(te)[:, :, None]),
        "dynamic_transmission_error_rms": (dims, 1e3 * waves.rms(te)[:, :, None]),
        "mesh_force_amplitude": ((*dims, "harmonic"), waves.amplitude(force)[:, :, None]),
        "mesh_force_phase": ((*dims, "harmonic"), waves.phase(force)[:, :, None]),
        "mesh_force_rms": (dims, waves.rms(force)[:, :, None]),
        "mean_force": (("mesh",), mean),
        "dynamic_factor": (dims, (over_time.max(axis=-1) / mean)[:, :, None]),
        "contact_kept": (dims, ~(over_time.min(axis=-1) <= 0)[:, :, None]),
        "floquet_multiplier": (dims, growth[:, :, None]),
        "branches": (("speed",), count),
    }
    one = {k: v for k, v in modal_variables(model, speeds, oscillator.harmonics).items() if k == "natural_frequency"}
    rate = np.array([oscillator.group.rate])
    coords = {
        "sweep": ("sweep", list(SWEEPS)),
        "speed": ("speed", speeds),
        "mesh": ("mesh", list(model.names[:1])),
        "harmonic": ("harmonic", np.arange(1, oscillator.harmonics + 1)),
        "mesh_frequency": (("speed", "mesh"), speeds[:, None] / 60 * rate),
    }
    notes = "\n".join(remarks(oscillator, known, met, speeds))
    attrs = provenance(model.scene, wall_time=time.perf_counter() - start) | {"notes": notes}
    return keeping(xr.Dataset(described(variables | one), coords=described(coords), attrs=attrs), model.scene)
