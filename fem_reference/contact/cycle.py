"""A mesh cycle by contact finite elements, as a Dataset."""

from __future__ import annotations

import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fem_reference.contact.calculix import version
from fem_reference.contact.phase import PhaseResult, Settings, solve_phase
from gearbench.contact.phases import uniform_phases
from gearbench.effects.base import GapEffect
from gearbench.effects.teeth import require_bores
from gearbench.errors import InputError
from gearbench.results.cycle import HARMONICS, MICROMETRES, MeshCycle, Phases, coefficients
from gearbench.results.provenance import provenance
from gearbench.results.responses import USUAL, described, response
from gearbench.scene import Scene

if TYPE_CHECKING:
    import xarray as xr

#: Phases at which a coarser mesh and a stiffer contact tell the error.
_CHECKED = 3


def contact_cycle(
    scene: Scene,
    phases: int = 20,
    *,
    torques: Sequence[float] | None = None,
    width_factor: float = 1.0,
    settings: Settings | None = None,
    workers: int = 2,
) -> xr.Dataset:
    """Mesh cycle of a spur pair by contact finite elements in plane strain, on the whole bodies held at their bores.

    Tips, flanks and fillets of all near tooth pairs may touch, frictionless. The compliance effects of the scene are
    not used; its gaps are cut from the flanks.

    Parameters
    ----------
    scene
        The pair with its bores, the load and the modifications.
    phases
        Number of uniform mesh phases.
    torques
        Torques on the pinion [N·m], rising, in place of the scene's; they become the dimension ``torque``.
    width_factor
        Factor on the elastic deflections, not on gaps: 1 is plane strain; narrow teeth deflect some 3 % more.
    settings, workers
        How each phase is computed, and how many at a time.

    Returns
    -------
    Dataset like that of ``simulate``, with ``load_share`` and ``contact_radius`` (on the pinion) of each pair, and in
    ``transmission_error_uncertainty`` the error bar [µm]: what a mesh coarser by √2 and half the penalty change.

    Raises
    ------
    InputError
        If the pair is helical or lacks bores, or the torques do not rise.
    MissingDependencyError
        If CalculiX is not there.
    ContactError
        If it does not solve a phase.
    """
    start = time.perf_counter()
    loads = tuple(torques) if torques is not None else (scene.load.torque,)
    _check(scene, loads)
    phase, weight = uniform_phases(phases)
    found, checks = _solved(scene, phase, loads, settings or Settings(), workers)
    force = 1e3 * np.array(loads)[:, None] / scene.pair.gears[0].base_radius
    q = widened(found, force, width_factor)
    k = np.array([each.stiffness for each in found]).T / width_factor
    cycle = MeshCycle.of(scene, Phases(phase=phase, weight=weight, size=None), q, k)
    names, share, radius = _of_pairs(found)
    changed = [widened(some, force, width_factor) for some in (checks.coarser, checks.softer)]
    error = MICROMETRES * np.sum([np.abs(other - q[:, checks.at]).max(axis=1) for other in changed], axis=0)
    of_pairs = {"load_share": share, "contact_radius": radius}
    attrs = {
        **provenance(scene, wall_time=time.perf_counter() - start),
        "support": "finite_elements",
        "method": f"contact finite elements, plane strain, CalculiX {version()}",
        "width_factor": width_factor,
    }
    return _dataset(cycle, of_pairs, names, error, loads, torques is None).assign_attrs(attrs)


def _check(scene: Scene, loads: Sequence[float]) -> None:
    if scene.pair.helix_angle:
        raise InputError("pair.helix_angle", scene.pair.helix_angle, "must be 0: contact is computed in plane strain")
    require_bores(scene.pair)
    if not loads or not all(a < b for a, b in pairwise((0.0, *loads))):
        raise InputError("torques", list(loads), "must be positive and rise")


@dataclass(frozen=True, kw_only=True)
class _Checks:
    """Some phases once more, at the numbers ``at``: with a coarser mesh, and with a softer contact."""

    at: NDArray
    coarser: list[PhaseResult]
    softer: list[PhaseResult]


def _solved(
    scene: Scene, phase: NDArray, loads: tuple[float, ...], settings: Settings, workers: int
) -> tuple[list[PhaseResult], _Checks]:
    """All phases, and what tells their error."""
    at = np.unique(np.linspace(0, len(phase) - 1, _CHECKED + 2).astype(int)[1:-1])
    coarser = replace(settings, fineness=settings.fineness.halved())
    softer = replace(settings, penalty=settings.penalty / 2)
    jobs = [(float(tau), settings) for tau in phase]
    jobs += [(float(phase[i]), other) for other in (coarser, softer) for i in at]
    gaps = tuple(effect for effect in scene.flank_effects if isinstance(effect, GapEffect))
    with ThreadPoolExecutor(workers) as pool:
        found = list(pool.map(lambda job: solve_phase(scene.pair, gaps, job[0], loads, job[1]), jobs))
    n, m = len(phase), len(phase) + len(at)
    return found[:n], _Checks(at=at, coarser=found[n:m], softer=found[m:])


def widened(found: Sequence[PhaseResult], force: NDArray, factor: float) -> NDArray:
    """q [mm] with all compliances times ``factor``, (torque, position).

    The same as ``factor`` times the force, to first order; the gaps, which do not yield, are not multiplied.
    """
    q, k = (np.array([getattr(each, name) for each in found]).T for name in ("approach", "stiffness"))
    return q + (factor - 1) * force / k


def _of_pairs(found: Sequence[PhaseResult]) -> tuple[NDArray, NDArray, NDArray]:
    """Numbers of the pairs, their shares and radii (torque, position, pair)."""
    names = np.array(sorted({k for each in found for k in each.share}))
    count = len(found[0].approach)
    none, zero = [np.nan] * count, [0.0] * count
    share = np.array([[each.share.get(int(k), zero) for k in names] for each in found])
    radius = np.array([[each.radius.get(int(k), none) for k in names] for each in found])
    return names, np.moveaxis(share, -1, 0), np.moveaxis(radius, -1, 0)


def _dataset(
    cycle: MeshCycle,
    of_pairs: dict[str, NDArray],
    names: NDArray,
    uncertainty: NDArray,
    loads: Sequence[float],
    single: bool,
) -> xr.Dataset:
    import xarray as xr

    phases, lead = cycle.phases, ("torque",)
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
    found = xr.Dataset(described(variables), coords=described(coords))
    return found.isel(torque=0, drop=True) if single else found
