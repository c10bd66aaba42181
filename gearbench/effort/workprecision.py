"""Work–precision of a scene: error against time of every setting, each against a converged reference of its own.

One setting is turned at a time; the others stay as the scene has them, also in the reference, which is the finest level
of the setting. The error bar of a reference is its difference to the level before it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from gearbench.accuracy.knobs import KNOBS
from gearbench.effort.clock import timed
from gearbench.effort.curves import as_dataset, knob_curve
from gearbench.effort.elements import Meshes, element_curves
from gearbench.effort.samples import sample_curves
from gearbench.errors import InputError
from gearbench.results.provenance import provenance
from gearbench.scene import Scene

if TYPE_CHECKING:
    import xarray as xr

    from gearbench.effort.curves import WorkPrecision

#: Repeats of every timed run.
REPEATS = 7


def cost(scene: Scene, repeats: int = REPEATS, seeds: int = 8, meshes: Meshes | None = None) -> xr.Dataset:
    """Work–precision of all settings that ``scene`` has: ``knobs.KNOBS``, finite elements, samples.

    Parameters
    ----------
    scene
        Its resolution is that of the other settings.
    repeats
        Timed runs of each setting; medians count.
    seeds
        Draws of the error samples, where the scene has random errors: their errors are RMS values over them.
    meshes
        Meshes of the finite elements, where the scene has them; ``all_meshes`` by default.

    Returns
    -------
    Dataset over ``setting`` (one level of one knob) and ``quantity``: relative ``error`` and ``error_bar`` of its
    reference, ``seconds``, ``processor_seconds``, ``megabytes``; over ``knob`` and ``quantity``: ``observed_order``.
    Of finite elements also ``compliance_error``, its error bar and ``unknowns`` over ``setting``, ``compliance_order``
    over ``knob``; NaN for the other knobs.

    Raises
    ------
    InputError
        If the scene leaves its resolution to an accuracy, or has several loads.
    """
    scene = scene.one_load
    if (accuracy := scene.resolution.accuracy) is not None:
        raise InputError("resolution.accuracy", accuracy, "is for simulate and robust; here give segments")

    def curves() -> list[WorkPrecision]:
        """A curve for each setting of the scene."""
        return [
            *(knob_curve(scene, knob, repeats) for knob in KNOBS.values() if knob.applies(scene)),
            *element_curves(scene, meshes),
            *sample_curves(scene, repeats, seeds),
        ]

    found, cost = timed(curves)
    return as_dataset(found).assign_attrs(provenance(scene, wall_time=cost.seconds))
