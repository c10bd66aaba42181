"""Work–precision of a scene: error against time of every setting, each against a converged reference of its own.

One setting is changed at a time; the others stay as the scene has them, also in the reference, which is the finest
level of the setting. The error bar of a reference is its difference to the level before it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from gearbench.accuracy.measure import relative_errors, scales
from gearbench.accuracy.settings import SETTINGS
from gearbench.effort.clock import measured, timed
from gearbench.effort.curves import Point, WorkPrecision, as_dataset, setting_curve
from gearbench.effort.elements import Meshes, element_curves
from gearbench.errors import InputError
from gearbench.results.provenance import provenance
from gearbench.robustness.montecarlo import prepare_scene, respond
from gearbench.robustness.sampling import Sampler
from gearbench.robustness.statistics import average_error
from gearbench.scene import Scene

if TYPE_CHECKING:
    import xarray as xr

    from gearbench.effort.curves import WorkPrecision


COUNTS = (16, 32, 64, 128, 256, 512, 1024)
SAMPLERS: tuple[tuple[Sampler, str], ...] = (("sobol", "¾ to 1"), ("latin_hypercube", "½"), ("random", "½"))
#: Samples of the reference, and its seed: none of those that are compared with it.
REFERENCE, REFERENCE_SEED = 2**14, 987_654


def sample_curves(
    scene: Scene, repeats: int, seeds: int, reference: int = REFERENCE, counts: Sequence[int] = COUNTS
) -> list[WorkPrecision]:
    """One curve a sampler, on one thread; errors are RMS values over ``seeds`` draws. None without random errors."""
    if scene.effect("manufacturing_errors") is None:
        return []
    problem = prepare_scene(scene)
    responses, _ = respond(problem, problem.draw(reference, REFERENCE_SEED, "sobol"))
    exact = responses.numbers.mean(axis=1)
    bar = np.array([average_error(values, "sobol") for values in responses.numbers]) / scales(exact)

    def point(sampler: Sampler, count: int) -> Point:
        answers = [respond(problem, problem.draw(count, i, sampler))[0].numbers.mean(axis=1) for i in range(seeds)]
        errors = np.sqrt(np.mean([relative_errors(a, exact) ** 2 for a in answers], axis=0))
        cost = measured(lambda: respond(problem, problem.draw(count, 0, sampler)), max(3, repeats // 2))
        return Point(label=str(count), size=count, errors=errors, cost=cost)

    return [
        WorkPrecision(
            setting=f"samples, {sampler.replace('_', ' ')}",
            expected=order,
            points=tuple(point(sampler, count) for count in counts),
            bar=bar,
        )
        for sampler, order in SAMPLERS
    ]


#: Repeats of every timed run.
REPEATS = 7


def cost(scene: Scene, repeats: int = REPEATS, seeds: int = 8, meshes: Meshes | None = None) -> xr.Dataset:
    """Work–precision of all settings that ``scene`` has: ``settings.SETTINGS``, finite elements, samples.

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
    Dataset over ``setting`` (one level of one setting) and ``quantity``: relative ``error`` and ``error_bar`` of its
    reference, ``seconds``, ``processor_seconds``, ``megabytes``; over ``knob`` (a setting with all its levels) and
    ``quantity``: ``observed_order``.
    Of finite elements also ``compliance_error``, its error bar and ``unknowns`` over ``setting``, ``compliance_order``
    over ``knob``; NaN for the other settings.

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
            *(setting_curve(scene, setting, repeats) for setting in SETTINGS.values() if setting.applies(scene)),
            *element_curves(scene, meshes),
            *sample_curves(scene, repeats, seeds),
        ]

    found, cost = timed(curves)
    return as_dataset(found).assign_attrs(provenance(scene, wall_time=cost.seconds))
