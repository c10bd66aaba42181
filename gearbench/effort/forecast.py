"""Predicted cost of the commands beside ``simulate`` and ``robust`` that a scene is fit for, at their defaults.

Memory is that by which they refuse a scene. Times come from trials, as in ``gearbench.effort.plan``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gearbench.contact.assemble import assemble
from gearbench.contact.batch import prepare, solve_one_chunk
from gearbench.contact.size import contact_memory
from gearbench.dynamics.analysis import HARMONICS, response
from gearbench.dynamics.size import bearings, speed_memory
from gearbench.effort.trials import Reduced, Trial, Trials, spent
from gearbench.errors import GearbenchError, InputError
from gearbench.hunting import ORDERS, check_cycles, cycles_memory, order_coefficients, turning_gaps, unlike
from gearbench.results.cycle import Phases
from gearbench.scene import Scene
from gearbench.threads import default_threads
from gearbench.validation.reference import finite_elements, reference_memory, reference_scene

#: Speeds of ``response`` that are predicted, and those of its two trials.
SPEEDS, TRIED = 200, (1, 41)
#: Orders whose waves are timed.
WAVES = 1000
#: Runs of a scene and its reference in a comparison, and set-ups, most of them for their times; its first accuracy.
RUNS, SET_UPS, ACCURACY = 13, 6, 0.01


@dataclass(frozen=True, kw_only=True)
class Forecast:
    """Predicted cost of a command.

    Parameters
    ----------
    command
        Its name.
    size
        What it computes, in words.
    seconds, megabytes
        Time [s] and peak memory [MB].
    """

    command: str
    size: str
    seconds: float
    megabytes: float


def forecasts(scene: Scene, small: Reduced, both: Trials, seconds: float, once: float) -> tuple[Forecast, ...]:
    """Forecasts for ``scene``, with trials as in ``plan``.

    ``seconds`` is the predicted time of ``simulate``, of which ``once`` are the set-ups of a new pair.
    """
    found = (
        _hunting(scene, small, both, seconds),
        _response(scene, small, both, seconds),
        _validate(scene, both, seconds - once, once),
    )
    return tuple(each for each in found if each is not None)


def _hunting(scene: Scene, small: Reduced, both: Trials, seconds: float) -> Forecast | None:
    """All mesh cycles, from one chunk of them at a few phases."""
    from gearbench.contact._lane_kernels import LANES

    turning = unlike(scene)
    if not turning or scene.has_shafts:
        return None
    try:
        count = check_cycles(scene.pair)
    except InputError:
        return None
    trial, threads = both.short, default_threads()
    modes, amounts = turning_gaps(turning, trial.lines, LANES)
    rest = tuple(effect for effect in trial.scene.flank_effects if effect not in turning)
    batch = prepare(assemble(trial.scene, trial.lines, rest), modes)
    solve_one_chunk(batch, amounts)  # compiled code is loaded
    chunk = spent(lambda: solve_one_chunk(batch, amounts))[1] * both.total / len(trial.weight)
    chunk *= small.segments * small.pairs
    waves = _seconds_of_waves(trial, both.total) * ORDERS * count / WAVES
    need = cycles_memory(scene, both.total, count, ORDERS, amounts.shape[1])
    return Forecast(
        command="hunting",
        size=f"{count} mesh cycles, {ORDERS:g} orders",
        seconds=seconds + chunk * -(-count // (LANES * threads)) + 2 * waves,
        megabytes=need / 1e6,
    )


def _seconds_of_waves(trial: Trial, positions: int) -> float:
    """Time [s] that ``WAVES`` orders of a curve take."""
    few = len(trial.weight)
    phases = Phases(phase=trial.lines.mesh_phase, weight=trial.weight, size=trial.scene.resolution.panel_size)
    curves = np.zeros((WAVES, few))
    return spent(lambda: order_coefficients(phases, curves, WAVES))[1] * positions / few


def _response(scene: Scene, small: Reduced, both: Trials, seconds: float) -> Forecast | None:
    """Linear response, from two trials at a coarse resolution."""
    if scene.one_load.system is None:
        return None
    coarse = replace(small.scene, resolution=replace(small.scene.resolution, gauss_points=None, positions=8))

    def tried(speeds: int) -> float:
        """Time at so many speeds [s]."""
        return spent(lambda: response(coarse, speed=np.linspace(500.0, 6000.0, speeds), harmonics=1))[1]

    try:
        few, many = (tried(speeds) for speeds in TRIED)
    except (InputError, GearbenchError):  # it says so itself
        return None
    each = HARMONICS * max(many - few, 0.0) / (TRIED[1] - TRIED[0])
    meshes = len(scene.pairs)
    need = SPEEDS * speed_memory(HARMONICS, meshes, bearings(scene)) + contact_memory(scene, both.total)
    return Forecast(
        command="response",
        size=f"{SPEEDS} speeds, {HARMONICS} orders",
        seconds=seconds + few + SPEEDS * each,
        megabytes=need / 1e6,
    )


def _validate(scene: Scene, both: Trials, cycle: float, once: float) -> Forecast | None:
    """The comparison with the first reference that is tried; ``cycle`` and ``once``: time of a run and its set-ups."""
    try:
        reference = reference_scene(scene, ACCURACY)
        meshed = finite_elements(reference).preparation(scene.pair, reference.effects_by_name) or 0.0
        need = reference_memory(reference, both.total)
    except (InputError, GearbenchError):  # it says so itself
        return None
    return Forecast(
        command="validate",
        size=f"finite elements of {100 * ACCURACY:g} %, more where differences are small",
        seconds=meshed + RUNS * cycle + SET_UPS * once,
        megabytes=need / 1e6,
    )
