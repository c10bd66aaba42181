"""Work–precision of a scene: error over time for every setting.

One setting is changed at a time. The reference of a setting is its finest level; all other settings stay as in the
scene. The error bar of a reference is its difference to the level before it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gearbench.accuracy.measure import relative_errors, scales
from gearbench.accuracy.settings import GAUSS_POINTS, SETTINGS, Setting
from gearbench.effort.clock import Cost, measured, timed
from gearbench.effort.curves import WorkPrecision, as_dataset, setting_curve
from gearbench.errors import InputError
from gearbench.lazy import xr
from gearbench.results.provenance import provenance
from gearbench.robustness.montecarlo import prepare_scene, respond
from gearbench.robustness.sampling import Sampler
from gearbench.robustness.statistics import average_error
from gearbench.scene import Scene

COUNTS = (16, 32, 64, 128, 256, 512, 1024)
SAMPLERS: tuple[tuple[Sampler, str], ...] = (("sobol", "¾ to 1"), ("latin_hypercube", "½"), ("random", "½"))
#: Number of samples of the reference, and its seed, which differs from those of the runs compared with it.
REFERENCE, REFERENCE_SEED = 2**14, 987_654


def sample_curves(
    scene: Scene, repeats: int, seeds: int, reference: int = REFERENCE, counts: Sequence[int] = COUNTS
) -> list[WorkPrecision]:
    """Measure one curve per sampler, on one thread; errors are RMS values over ``seeds`` draws.

    The list is empty if the scene has no random errors.
    """
    if scene.effect("manufacturing_errors") is None:
        return []
    problem = prepare_scene(scene)
    responses, _ = respond(problem, problem.draw(reference, REFERENCE_SEED, "sobol"))
    exact = responses.numbers.mean(axis=1)
    bar = np.array([average_error(values, "sobol") for values in responses.numbers]) / scales(exact)

    def run(sampler: Sampler, count: int) -> tuple[NDArray, Cost]:
        answers = [respond(problem, problem.draw(count, i, sampler))[0].numbers.mean(axis=1) for i in range(seeds)]
        errors = np.sqrt(np.mean([relative_errors(a, exact) ** 2 for a in answers], axis=0))
        return errors, measured(lambda: respond(problem, problem.draw(count, 0, sampler)), max(3, repeats // 2))

    return [
        WorkPrecision(
            setting=f"samples, {sampler.replace('_', ' ')}",
            expected=order,
            labels=[str(count) for count in counts],
            sizes=counts,
            runs=[run(sampler, count) for count in counts],
            bar=bar,
        )
        for sampler, order in SAMPLERS
    ]


#: Number of repeats of a timed run.
REPEATS = 7
#: Greatest sizes of the levels of a train by setting: each mesh is solved at the phases of all.
LARGEST_OF_TRAIN = {"segments": 128, "gauss_points": 24, "positions": 180, "solid order": 20}


def settings_of(scene: Scene) -> Iterator[Setting]:
    """Settings of ``scene``; those of a train have no levels beyond ``LARGEST_OF_TRAIN``."""

    def cut(setting: Setting) -> Setting:
        """The setting without the levels that are too large for a train."""
        most = LARGEST_OF_TRAIN.get(setting.name, math.inf)
        return replace(
            setting,
            levels=lambda scene: tuple(level for level in setting.levels(scene) if setting.size(level) <= most),
            limit=setting.limit and cut(GAUSS_POINTS).finest,
        )

    return (cut(each) if scene.coupled else each for each in SETTINGS.values() if each.applies(scene))


def cost(scene: Scene, repeats: int = REPEATS, seeds: int = 8) -> xr.Dataset:
    """Measure the work–precision of all settings of ``scene``: ``settings.SETTINGS`` and error samples.

    A planetary set, or a train of parallel paths, is measured by the transmission error and the stiffness of the whole
    train, at the levels that ``LARGEST_OF_TRAIN`` allows and without error samples, for which ``robust`` gives the
    standard errors.

    Parameters
    ----------
    scene
        The scene; its resolution gives the settings that are not varied.
    repeats
        Number of timed runs per level; the median counts.
    seeds
        Number of draws of the error samples; their errors are RMS values over the draws.

    Returns
    -------
    Dataset over ``setting`` (one entry per level of every setting), ``knob`` (one entry per setting) and ``quantity``:
    relative ``error`` and ``error_bar`` (setting, quantity), ``seconds``, ``processor_seconds`` and ``megabytes``
    (setting), ``observed_order`` (knob, quantity).

    Raises
    ------
    InputError
        If the scene asks for an accuracy instead of a resolution, or has several loads.
    """
    scene = scene.single_load if scene.coupled else scene.one_load
    if (accuracy := scene.resolution.accuracy) is not None:
        raise InputError("resolution.accuracy", accuracy, "is for simulate and robust: give segments")

    def curves() -> list[WorkPrecision]:
        """Curves of all settings of the scene."""
        return [
            *(setting_curve(scene, setting, repeats) for setting in settings_of(scene)),
            *(() if scene.coupled else sample_curves(scene, repeats, seeds)),
        ]

    measured, cost = timed(curves)
    return as_dataset(measured).assign_attrs(provenance(scene, wall_time=cost.seconds))
