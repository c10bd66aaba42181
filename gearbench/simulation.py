"""Simulate a scene: static transmission error and mesh stiffness over a mesh cycle."""

from __future__ import annotations

import logging
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from gearbench.results.cycle import peak_to_peak
from gearbench.results.origin import keeping
from gearbench.results.outputs import DEFAULT_OUTPUTS, check_outputs, output
from gearbench.results.solved import Solved
from gearbench.scene import Scene, check_scene
from gearbench.solution import dataset, solve_scene

if TYPE_CHECKING:
    import xarray as xr

#: Noise floors of harmonics, and of peak-to-peak values, over peak-to-peak above which a run says so.
NOISE, EXTREMES = 0.01, 0.07

_LOG = logging.getLogger(__name__)


def simulate(scene: Scene, *, outputs: Sequence[str] = DEFAULT_OUTPUTS) -> xr.Dataset:
    """Static transmission error, mesh stiffness and load distribution of ``scene`` over a mesh cycle.

    Parameters
    ----------
    scene
        The scene to simulate.
    outputs
        Names of the variables to compute: from ``gearbench.results.outputs.OUTPUTS``, or any response.

    Returns
    -------
    Dataset with the dimensions ``position``, ``pair``, ``segment``, names and units as in ``gearbench.results``,
    the residuals of the contact solution, and its provenance in the attributes. Of several loads, or meshes, it is
    that of ``sweep`` over them; where paths are parallel, that of all meshes together over the phase of the first, with
    load sharing and the transmission error of the train.

    Raises
    ------
    InputError
        If an output has no such name.
    ConvergenceError
        If the contact problem is not solved to its residual.

    Notes
    -----
    Where the scene gives ``resolution.accuracy``, settings are chosen for it. The Dataset holds the scene with them,
    the largest of the estimated errors in the attribute ``accuracy_estimated``, that of each number in
    ``accuracy_errors``; the wall time includes the choice, ``accuracy_seconds`` is its part [s].

    Examples
    --------
    >>> from gearbench import read_scene
    >>> dataset = simulate(read_scene("examples/sc.toml"))
    >>> k = dataset["mesh_stiffness"]
    >>> k.dims, k.units, k.symbol
    (('position',), 'N/µm', 'k')
    >>> print(f"{float(dataset['mesh_stiffness_rms']):.0f} {dataset['mesh_stiffness_rms'].units}")
    18 %
    """
    check_scene(scene)
    start = time.perf_counter()
    check_outputs(tuple(outputs))
    if scene.loads or scene.train is not None:
        from gearbench.sweeps.run import sweep

        return sweep(scene, outputs=outputs)
    if scene.resolution.accuracy is None:
        solved, chosen = solve_scene(scene), {}
        _warn_of_noise(solved)
    else:
        from gearbench.accuracy.choose import choose
        from gearbench.accuracy.measure import covered

        choice = choose(scene, solve_scene, lambda solved: covered(solved.cycle))
        solved, chosen = choice.run, choice.attrs
    return keeping(dataset(solved, outputs, start).assign_attrs(chosen), scene)


def _warn_of_noise(solved: Solved) -> None:
    """Say so where harmonics are not known to ``NOISE`` of peak-to-peak, or that not to ``EXTREMES``."""
    loud, extremes = [], []
    for curve in ("transmission_error", "mesh_stiffness"):
        whole = float(peak_to_peak(solved.phases, getattr(solved.cycle, curve)))
        floor = float(np.fmax.reduce(output(solved, f"{curve}_amplitude_noise_floor")[1], axis=None))
        # what hardly fluctuates has no harmonics to speak of
        level = abs(float(getattr(solved.cycle, curve).mean()))
        doubt = float(output(solved, f"{curve}_peak_to_peak_noise_floor")[1])
        if floor > NOISE * whole > 1e-6 * level:
            loud.append(f"{curve} {100 * floor / whole:.1f} %")
        elif doubt > EXTREMES * whole > EXTREMES * 1e-4 * level:
            extremes.append(f"{curve} {100 * doubt / whole:.0f} %")
    if loud:
        _LOG.warning(
            "noise floor of the harmonics, of peak-to-peak: %s; resolution.accuracy lowers it", ", ".join(loud)
        )
    if extremes:
        _LOG.warning("noise floor of peak-to-peak: %s; more resolution.gauss_points may lower it", ", ".join(extremes))
