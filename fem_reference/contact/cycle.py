"""A mesh cycle by contact finite elements, as a Dataset."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fem_reference.contact.calculix import version
from fem_reference.contact.phase import Settings, solve_phase
from fem_reference.contact.result import PhaseResult
from fem_reference.contact.spatial import SpatialSettings, solve_spatial
from gearbench.contact.phases import uniform_phases
from gearbench.effects.base import GapEffect
from gearbench.effects.teeth import require_bores
from gearbench.errors import InputError
from gearbench.geometry.names import GEARS
from gearbench.geometry.pair import Pair
from gearbench.geometry.support import Support
from gearbench.lazy import xr
from gearbench.results.cycle import HARMONICS, MICROMETRES, MeshCycle, Phases, coefficients
from gearbench.results.provenance import provenance
from gearbench.results.responses import USUAL, described, response
from gearbench.scene import Scene

#: Number of phases computed with a coarser mesh and a stiffer contact for the error.
_CHECKED = 3
#: Factor on the accuracy of the bodies for the error of their compliance.
_COARSE = 5.0
#: Requested error bar over the mean STE, and largest number of refinements.
ERROR_BAR, _REFINEMENTS = 0.005, 3


def contact_cycle(
    scene: Scene,
    phases: int | Sequence[float] = 20,
    *,
    torques: Sequence[float] | None = None,
    width_factor: float = 1.0,
    settings: Settings | SpatialSettings | None = None,
    workers: int = 2,
    error_bar: float = ERROR_BAR,
    report: Callable[[str], None] = lambda _: None,
) -> xr.Dataset:
    """Mesh cycle by contact finite elements on the whole bodies held at their bores.

    Frictionless. Spur pairs in plane strain, tips, flanks and fillets of all near tooth pairs; helical pairs, and with
    ``SpatialSettings`` spur pairs, with their finite width. Gap effects of the scene are cut from the flanks.

    Parameters
    ----------
    scene
        The pair with its bores, the load and the modifications.
    phases
        Number of uniform mesh phases, or the phases themselves, ascending.
    torques
        Rising torques on the pinion [N·m] instead of the scene's; they become the dimension ``torque``.
    width_factor
        Factor on the elastic deflections in plane strain, not on gaps; narrow teeth deflect some 3 % more.
    settings, workers
        Initial settings of a phase, and number of parallel phases (one for finite width).
    error_bar
        Error bar over the mean transmission error for which meshes, contact and bodies are refined, thrice at most.
    report
        Called after each phase. Phases are stored on disk, so that an interrupted run continues.

    Returns
    -------
    Dataset like that of ``simulate``, with ``load_share`` and ``contact_radius`` (on the pinion) of each pair, and in
    ``transmission_error_uncertainty`` the error bar [µm]: what a mesh coarser by √2 and half the penalty, or a coarser
    compliance of the bodies, change at the greatest.

    Raises
    ------
    InputError
        If the pair lacks bores, or is helical and plane strain is asked for, or the torques do not rise.
    MissingDependencyError, ContactError
        If CalculiX is not installed or does not solve a phase.
    """
    start = time.perf_counter()
    loads = tuple(torques) if torques is not None else (scene.load.torque,)
    chosen = settings or (SpatialSettings() if scene.pair.helix_angle else Settings())
    _check(scene, loads, chosen, width_factor)
    if isinstance(phases, int):
        phase, weight = uniform_phases(phases)
    else:
        phase, weight = np.array(phases), np.full(len(phases), 1 / len(phases))
    force = 1e3 * np.array(loads)[:, None] / scene.pair.gears[0].base_radius
    solve = partial(_phases, scene, loads, workers, report)
    deflection = partial(widened, force=force, factor=width_factor)
    chosen, results, bar = _solved(solve, deflection, phase, chosen, error_bar)
    k = np.array([result.stiffness for result in results]).T / width_factor
    cycle = _mesh_cycle(scene, Phases(phase=phase, weight=weight, size=None), deflection(results), k)
    attrs = {"support": "finite_elements", "method": _method(chosen), "width_factor": width_factor}
    attrs |= provenance(scene, wall_time=time.perf_counter() - start)
    return _dataset(cycle, _of_pairs(results), MICROMETRES * bar, loads, torques is None).assign_attrs(attrs)


def _mesh_cycle(scene: Scene, phases: Phases, q: NDArray, k: NDArray) -> MeshCycle:
    """Cycle from q and ∂F_bt/∂q along the line of action of the transverse section."""
    cos_b = math.cos(scene.pair.meshing.beta_b)
    return MeshCycle.of(scene, phases, q * cos_b, k / cos_b**2)


def halfway(dataset: xr.Dataset, pair: Pair) -> NDArray:
    """Mesh phases half-way between both gears, for a mesh cycle by contact finite elements, (…, position).

    They hold the wheel at ``mesh_phase``; the pinion is ahead of it by the transmission error. Contact on lines counts
    the phase between the two (T3 of docs/theory.md): models are compared there.
    """
    ahead = dataset.transmission_error.values / MICROMETRES / pair.meshing.base_pitch
    return dataset.mesh_phase.values + ahead / 2


def _method(settings: Settings | SpatialSettings) -> str:
    if isinstance(settings, Settings):
        return f"contact finite elements, plane strain, CalculiX {version()}"
    return "contact finite elements, strips of contact on the compliance of the whole gears"


def _check(scene: Scene, loads: Sequence[float], settings: Settings | SpatialSettings, factor: float) -> None:
    if isinstance(settings, Settings) and scene.pair.helix_angle:
        raise InputError("pair.helix_angle", scene.pair.helix_angle, "must be 0 in plane strain")
    if isinstance(settings, SpatialSettings) and factor != 1:
        raise InputError("width_factor", factor, "must be 1 where the width is finite")
    if scene.pair.overhangs != ((0.0, 0.0), (0.0, 0.0)):
        raise InputError("pair", "faces that overhang", "contact finite elements need equal face widths")
    require_bores(scene.pair)
    for index, member in enumerate(scene.pair.members):
        support = member.support
        if isinstance(settings, Settings) and support is not None and support != Support(radial=0.0, tangential=0.0):
            allowed = "plane strain needs a firm or a free ring: take SpatialSettings"
            raise InputError(f"pair.{GEARS[index]}.support", "given", allowed)
        if isinstance(settings, Settings) and member.rim_thickness is not None:
            key, allowed = f"pair.{GEARS[index]}.rim_thickness", "plane strain knows no webs: leave it out"
            raise InputError(key, member.rim_thickness, allowed)
    if not loads or not all(a < b for a, b in pairwise((0.0, *loads))):
        raise InputError("torques", list(loads), "must be positive and rise")


def _solved(
    solve: Callable[[NDArray, Settings | SpatialSettings], list[PhaseResult]],
    deflection: Callable[[Sequence[PhaseResult]], NDArray],
    phase: NDArray,
    settings: Settings | SpatialSettings,
    error_bar: float,
) -> tuple[Settings | SpatialSettings, list[PhaseResult], NDArray]:
    """Settings refined for the error bar, all phases, and the error bar [mm], (torque,)."""
    for refinement in range(_REFINEMENTS + 1):
        checks, last = _checked(solve, phase, settings), refinement == _REFINEMENTS
        levels = [deflection(some) for some in (checks.own, checks.coarser, checks.softer)]
        error = np.stack([np.abs(level - levels[0]).max(axis=1) for level in levels[1:]])
        q = levels[0]
        if last or not _misses(error, q, error_bar):
            results = solve(phase, settings)
            q = deflection(results)
            if last or not _misses(error, q, error_bar):
                return settings, results, error.sum(axis=0)
        settings = _refined(settings, error / q.mean(axis=1), error_bar)
    raise AssertionError("the last refinement returns")


@dataclass(frozen=True, kw_only=True)
class _Checks:
    """Some phases as they are, on coarser meshes, and with a softer contact or coarser bodies."""

    own: list[PhaseResult]
    coarser: list[PhaseResult]
    softer: list[PhaseResult]


def _checked(
    solve: Callable[[NDArray, Settings | SpatialSettings], list[PhaseResult]],
    phase: NDArray,
    settings: Settings | SpatialSettings,
) -> _Checks:
    """Phases that determine the error bar."""
    checked = np.unique(np.linspace(0, len(phase) - 1, _CHECKED + 2).astype(int)[1:-1])
    if isinstance(settings, Settings):
        coarser = replace(settings, fineness=settings.fineness.halved())
        softer: Settings | SpatialSettings = replace(settings, penalty=settings.penalty / 2)
    else:
        coarser = replace(settings, fineness=settings.fineness.coarser())
        softer = replace(settings, accuracy=_COARSE * settings.accuracy)
    unchanged, coarse, soft = (solve(phase[checked], each) for each in (settings, coarser, softer))
    return _Checks(own=unchanged, coarser=coarse, softer=soft)


def _misses(error: NDArray, q: NDArray, limit: float) -> bool:
    """Whether the error bar (cause, torque) is more of the mean of q (torque, position) than it may be."""
    return bool(np.any(error.sum(axis=0) > limit * q.mean(axis=1)))


def _refined(settings: Settings | SpatialSettings, error: NDArray, limit: float) -> Settings | SpatialSettings:
    """Finer in each of both causes, mesh and contact or bodies, that takes more than half of the relative error bar."""
    mesh, rest = error.max(axis=1) > limit / 2
    if isinstance(settings, Settings):
        fineness = settings.fineness.doubled() if mesh else settings.fineness
        return replace(settings, fineness=fineness, penalty=settings.penalty * (2 if rest else 1))
    fineness = settings.fineness.finer() if mesh else settings.fineness
    return replace(settings, fineness=fineness, accuracy=settings.accuracy / (2 if rest else 1))


def _phases(
    scene: Scene,
    loads: tuple[float, ...],
    workers: int,
    report: Callable[[str], None],
    phase: NDArray,
    settings: Settings | SpatialSettings,
) -> list[PhaseResult]:
    """Phases, from the cache if available."""
    gaps = tuple(effect for effect in scene.flank_effects if isinstance(effect, GapEffect))
    spatial = isinstance(settings, SpatialSettings)
    solve = solve_spatial if spatial else solve_phase
    results: list[PhaseResult] = []
    with ThreadPoolExecutor(1 if spatial else workers) as pool:
        for result in pool.map(lambda tau: solve(scene.pair, gaps, float(tau), loads, settings), phase):  # type: ignore[arg-type]
            results.append(result)
            report(f"phase {len(results)} of {len(phase)}")
    return results


def widened(results: Sequence[PhaseResult], force: NDArray, factor: float) -> NDArray:
    """q [mm] with all compliances times ``factor``, (torque, position).

    The same as ``factor`` times the force, to first order; the gaps, which do not yield, are not multiplied.
    """
    q, k = (np.array([getattr(result, name) for result in results]).T for name in ("approach", "stiffness"))
    return q + (factor - 1) * force / k


def _of_pairs(results: Sequence[PhaseResult]) -> tuple[NDArray, dict[str, NDArray]]:
    """Numbers of the pairs, their ``load_share`` and ``contact_radius`` (torque, position, pair)."""
    names = np.array(sorted({k for result in results for k in result.share}))
    count = len(results[0].approach)
    none, zero = [np.nan] * count, [0.0] * count
    share = np.array([[result.share.get(int(k), zero) for k in names] for result in results])
    radius = np.array([[result.radius.get(int(k), none) for k in names] for result in results])
    return names, {"load_share": np.moveaxis(share, -1, 0), "contact_radius": np.moveaxis(radius, -1, 0)}


def _dataset(
    cycle: MeshCycle,
    pairs: tuple[NDArray, dict[str, NDArray]],
    uncertainty: NDArray,
    loads: Sequence[float],
    single: bool,
) -> xr.Dataset:
    phases, lead = cycle.phases, ("torque",)
    names, of_pairs = pairs
    variables: dict[str, tuple] = {}
    for name in ("transmission_error", "mesh_stiffness"):
        values = getattr(cycle, name)
        harmonics = coefficients(phases, values)
        variables[name] = ((*lead, "position"), values)
        variables[f"{name}_amplitude"] = ((*lead, "harmonic"), 2 * np.abs(harmonics))
        variables[f"{name}_phase"] = ((*lead, "harmonic"), np.angle(harmonics))
    variables |= {name: (lead, response(name).reduce(cycle)) for name in USUAL}
    variables |= {name: ((*lead, "position", "pair"), values) for name, values in of_pairs.items()}
    variables["transmission_error_uncertainty"] = (lead, uncertainty)
    coords: dict[str, tuple] = {
        **{name: ("position", values) for name, values in phases.coordinates.items()},
        "pair_index": ("pair", names),
        "harmonic": ("harmonic", np.arange(1, HARMONICS + 1)),
        "torque": ("torque", np.array(loads)),
    }
    dataset = xr.Dataset(described(variables), coords=described(coords))
    return dataset.isel(torque=0, drop=True) if single else dataset
