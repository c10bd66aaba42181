"""Simulation of a scene: static transmission error and mesh stiffness over a mesh cycle."""

from __future__ import annotations

import logging
import time
from collections.abc import Sequence

import numpy as np

from gearbench.lazy import xr
from gearbench.results.origin import with_grids
from gearbench.results.outputs import DEFAULT_OUTPUTS, check_outputs, output
from gearbench.results.solved import Solved
from gearbench.scene import Scene, check_scene
from gearbench.solution import dataset, solve_scene

#: Noise floors of the harmonics and of the peak-to-peak value, over the peak-to-peak value, above which a run warns.
NOISE, EXTREMES = 0.01, 0.07

_LOG = logging.getLogger(__name__)


def simulate(scene: Scene, *, outputs: Sequence[str] = DEFAULT_OUTPUTS) -> xr.Dataset:
    """Compute static transmission error, mesh stiffness and load distribution of ``scene`` over a mesh cycle.

    Parameters
    ----------
    scene
        The scene to simulate.
    outputs
        Names of the variables to compute: outputs of ``gearbench.results.outputs.OUTPUTS``, or responses.

    Returns
    -------
    Dataset with the dimensions ``position``, ``pair`` and ``segment``, names and units as in ``gearbench.results``, the
    residuals of the contact solution, and the provenance in the attributes. For several loads or meshes, it is the
    Dataset of ``sweep`` over them. If power takes parallel paths, all meshes are solved together over the phase of the
    first, and the Dataset also has load sharing and the transmission error of the train.

    Raises
    ------
    InputError
        If the name of an output is unknown.
    ConvergenceError
        If the contact solver does not reach its residual.

    Notes
    -----
    If the scene gives ``resolution.accuracy``, the settings are chosen for it. The Dataset then holds the scene with
    these settings, the largest estimated error (attribute ``accuracy_estimated``), and the errors of all numbers
    (``accuracy_errors``). The wall time includes the search for the settings, ``accuracy_seconds`` [s].

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
    result = dataset(solved, outputs, start)
    result.attrs |= chosen
    return with_grids(result, scene)


def _warn_of_noise(solved: Solved) -> None:
    """Warn if harmonics or peak-to-peak values are uncertain by more than ``NOISE`` or ``EXTREMES`` of peak-to-peak."""
    loud, extremes = [], []
    for curve in ("transmission_error", "mesh_stiffness"):
        extent = float(output(solved, f"{curve}_peak_to_peak")[1])
        floor = float(np.fmax.reduce(output(solved, f"{curve}_amplitude_noise_floor")[1], axis=None))
        # a curve that hardly fluctuates has no harmonics worth a warning
        level = abs(float(getattr(solved.cycle, curve).mean()))
        doubt = float(output(solved, f"{curve}_peak_to_peak_noise_floor")[1])
        if floor > NOISE * extent > 1e-6 * level:
            loud.append(f"{curve} {100 * floor / extent:.1f} %")
        elif doubt > EXTREMES * extent > EXTREMES * 1e-4 * level:
            extremes.append(f"{curve} {100 * doubt / extent:.0f} %")
    if loud:
        _LOG.warning(
            "noise floor of the harmonics, of peak-to-peak: %s; resolution.accuracy lowers it", ", ".join(loud)
        )
    if extremes:
        _LOG.warning("noise floor of peak-to-peak: %s; more resolution.gauss_points may lower it", ", ".join(extremes))
