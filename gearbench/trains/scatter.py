"""Load sharing and transmission error of a train with random errors of its members and flanks.

Errors of pins and planets, and run-out, displace whole flanks. They leave the contact law of a mesh, force over
approach and phase, unchanged. This law is tabulated once, and a sample only needs the equilibrium of a few motions,
(M2) of docs/theory.md. Flank errors change the contact. Starting from the solution with the tables,
``gearbench.contact.equilibrium`` then solves the contact of all samples together.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from types import MappingProxyType
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.batch import chunks, on_threads
from gearbench.contact.equilibrium import SEPARATED_STIFFNESS, ForceSearch, MeshAt, Statics
from gearbench.contact.problem import part_of
from gearbench.contact.solver import Guess
from gearbench.effects.distributions import DISTRIBUTIONS
from gearbench.errors import InputError
from gearbench.geometry.planetary import DEVIATIONS, PlanetaryScatter
from gearbench.results.cycle import coefficients
from gearbench.results.points import Columns
from gearbench.results.responses import is_of_train, response
from gearbench.results.train_cycle import USUAL_OF_TRAIN, TrainCycle
from gearbench.robustness.montecarlo import Responses, Sampled
from gearbench.scene import Scene
from gearbench.threads import default_threads, single_threaded_blas
from gearbench.trains.flanks import FlankErrors, check_flanks
from gearbench.trains.solve import SolvedTrain, solve_train

#: Number of force levels of the table, and the lowest one relative to the force under even sharing.
LEVELS, LEAST = 32, 1e-3
#: Number of samples without flank errors that are solved together.
CHUNK = 50
#: Number of positions and levels of a mesh that are solved together, so that memory does not grow with the cycle.
TOGETHER = 4096
#: Change of a mesh force, relative to the largest, in the last Newton step of samples with flank errors. Convergence is
#: quadratic: forces are then known to 1e-5.
FORCE_CHANGE = 5e-4
#: Residual of the equilibrium, relative to the load, at which a sample has converged.
FORCE_TOLERANCE = 1e-9


@dataclass(frozen=True, kw_only=True)
class Curves:
    """Tabulated F(δ) of all meshes at all positions: cubic Hermite between levels, 0 after separation of the flanks.

    Parameters
    ----------
    approach, force, slope
        δ [mm], F [N] and dF/dδ [N/mm] at the levels, (mesh, position, level).
    statics
        Coupling of the meshes. Body compliance that it contains (``shifted``) is excluded when F(δ) is evaluated.
    """

    approach: NDArray
    force: NDArray
    slope: NDArray
    statics: Statics

    @cached_property
    def _without_bodies(self) -> tuple[NDArray, NDArray]:
        """Approach and slope without the compliance ``shifted`` to the coupling."""
        shifted = np.expand_dims(np.transpose(self.statics.shifted), -1)
        return self.approach - shifted * self.force, self.statics.without_shifted(self.slope.T).T

    def __call__(self, x: NDArray) -> tuple[NDArray, NDArray]:
        """Force [N] and stiffness [N/mm] at the approach x [mm], all (sample, position, mesh)."""
        x = np.moveaxis(x, -1, 0)
        approach, slope = self._without_bodies
        level, mesh, position = np.zeros(x.shape, dtype=np.int64), *np.ogrid[: x.shape[0], : x.shape[2]]

        def at(values: NDArray, level: NDArray) -> NDArray:
            return values[mesh[:, None], position[None], level]

        last = approach.shape[2] - 2
        for step in (1 << k for k in reversed(range(last.bit_length()))):  # bisection
            beyond = np.minimum(level + step, last)
            level = np.where(x >= at(approach, beyond), beyond, level)
        x0, x1 = at(approach, level), at(approach, level + 1)
        h = x1 - x0
        t = (x - x0) / h
        (f0, f1), (k0, k1) = ([at(values, level + more) for more in (0, 1)] for values in (self.force, slope))
        k0, k1 = h * k0, h * k1
        inside = np.clip(t, 0.0, 1.0)
        c2, c3 = 3 * (f1 - f0) - 2 * k0 - k1, 2 * (f0 - f1) + k0 + k1
        f = f0 + inside * (k0 + inside * (c2 + inside * c3))
        k = k0 + inside * (2 * c2 + 3 * c3 * inside)
        f, k = f + (t - inside) * np.where(t > 1, k1, k0), np.where(t > 1, k1, np.where(t < 0, k0, k)) / h
        separated = f <= 0
        return np.moveaxis(np.where(separated, 0.0, f), 0, -1), np.moveaxis(
            np.where(separated, SEPARATED_STIFFNESS * self.slope.max(), k), 0, -1
        )

    def stiffness(self, force: NDArray) -> NDArray:
        """∂F/∂δ [N/mm] under forces [N], both (sample, position, mesh); 0 where flanks are separated."""
        slope = np.empty_like(force)
        for m, p in np.ndindex(self.force.shape[:2]):
            slope[:, p, m] = np.interp(force[:, p, m], self.force[m, p], self.slope[m, p])
        return np.where(force > 0, slope, 0.0)


def levels(most: float) -> NDArray:
    """Force levels of the table, relative to the force under even sharing, up to ``most``; (level,)."""
    return np.geomspace(LEAST, most, LEVELS)


def curves(solved: SolvedTrain, most: float) -> Curves:
    """Tabulate F(δ) of all meshes up to ``most`` times the force under even sharing."""
    shares = levels(most)
    # planets in phase share one contact
    known = {id(mesh): mesh for mesh in solved.contacts}
    found = on_threads(partial(_table, shares=shares), known.values(), default_threads())
    tables = dict(zip(known, found, strict=True))
    each = (tables[id(mesh)] for mesh in solved.contacts)
    approach, force, slope = (np.stack(arrays) for arrays in zip(*each, strict=True))
    return Curves(approach=approach, force=force, slope=slope, statics=solved.coupling)


def _table(mesh: MeshAt, shares: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Approach, force and slope of one mesh, (position, level) [mm, N, N/mm], at ``shares`` of its nominal force."""
    count = len(mesh.problem.gap)
    force = np.tile(shares * mesh.nominal, (count, 1))
    approach, slope = np.empty_like(force), np.empty_like(force)
    for block in np.array_split(np.arange(len(shares)), min(len(shares), -(-force.size // TOGETHER))):
        problem = part_of(mesh.problem, np.tile(np.arange(count), len(block)))
        solved = replace(mesh, problem=problem).under(force[:, block].T.ravel(), Guess.empty(problem))
        approach[:, block], slope[:, block] = (values.reshape(len(block), count).T for values in solved[:2])
    return approach, force, slope


def variables(scatter: PlanetaryScatter, planets: tuple[str, ...]) -> dict[str, float]:
    """Name of each random variable → its amplitude [µm]; each run-out is followed by its angle [revolutions]."""
    amplitudes = {}
    for key in DEVIATIONS:
        if (f := getattr(scatter, key)) is not None:
            amplitudes |= {f"{key} {name}": f for name in planets}
    for key, names in (("sun", ("sun",)), ("ring", ("ring",)), ("carrier", ("carrier",)), ("planet", planets)):
        if (f := getattr(scatter, f"{key}_run_out")) is not None:
            for name in names:
                amplitudes |= {f"run_out {name}": f, f"angle {name}": 1.0}
    return amplitudes


def offsets(solved: SolvedTrain, names: dict[str, float], errors: NDArray) -> NDArray:
    """Approach added to each mesh by ``errors`` (sample, variable) of the variables ``names``, (sample, mesh) [mm]."""
    planetary, approach = solved.scene.planetary, np.zeros((len(errors), len(solved.even)))
    if planetary is None:
        return approach
    modes, columns = planetary.modes(solved.linkage), dict(zip(names, errors.T, strict=False))
    for name, amount in columns.items():
        kind, _, body = name.partition(" ")
        if kind == "run_out":
            angle = 2 * np.pi * columns[f"angle {body}"]
            x, y = modes[f"{body} x"], modes[f"{body} y"]
            # the eccentricity is half of the run-out
            approach += amount[:, None] / 2 * (np.cos(angle)[:, None] * x + np.sin(angle)[:, None] * y)
        elif kind != "angle":
            approach += amount[:, None] * modes[name]
    return approach


def draw(scatter: PlanetaryScatter, names: dict[str, float], unit: NDArray) -> NDArray:
    """Errors (sample, variable) [µm; angles in revolutions] for points ``unit`` (sample, variable) of the unit cube."""
    law = DISTRIBUTIONS[scatter.distribution]
    errors = np.empty(unit.shape)
    for column, (name, f) in enumerate(names.items()):
        from_0 = name.startswith(("run_out", "angle"))  # uniform on [0, f]
        errors[:, column] = f * (unit[:, column] if from_0 else law.quantile(unit[:, column]))
    return errors


@dataclass(frozen=True, kw_only=True, eq=False)
class SampledTrain(Sampled):
    """A train prepared for samples of its errors.

    Parameters
    ----------
    scene, solved
        The scene, and the train with the errors given in it.
    forces
        Tabulated contact of its meshes.
    scatter, of_members
        Random errors of the members: the scene's table (None without one), and its ``variables``.
    flanks
        Random errors of the flanks, if there are any.
    """

    scene: Scene
    solved: SolvedTrain
    forces: Curves
    scatter: PlanetaryScatter | None
    of_members: dict[str, float]
    flanks: FlankErrors | None

    usual: ClassVar = USUAL_OF_TRAIN
    studied: ClassVar = ("mesh_load_factor", "train_transmission_error_rms")
    further: ClassVar = MappingProxyType(
        {
            "load_sharing_greatest": ("mesh", lambda c: c.sharing.max(axis=1)),
            "train_transmission_error_amplitude": (
                "harmonic",
                lambda c: 2 * np.abs(coefficients(c.phases, c.transmission_error)),
            ),
        }
    )

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the random errors, in the order of the columns of a sample."""
        return (*self.of_members, *(() if self.flanks is None else self.flanks.errors))

    def errors_at(self, points: NDArray) -> NDArray:
        """Errors (sample, error) for points (sample, error) of the unit cube [µm; angles in revolutions]."""
        count = len(self.of_members)
        parts = [] if self.scatter is None else [draw(self.scatter, self.of_members, points[:, :count])]
        parts += [] if self.flanks is None else [self.flanks.draw(points[:, count:])]
        return np.hstack(parts)

    def parts(
        self, errors: NDArray, threads: int, names: Sequence[str], more: Mapping[str, Callable[..., NDArray]]
    ) -> Iterator[tuple[NDArray, Responses]]:
        """Responses of one chunk of samples after the other, see ``Sampled``."""
        reductions, rows = {name: response(name).reduce for name in names} | dict(more), np.arange(len(errors))
        for cycle in on_threads(self._cycle, self.chunks(errors), threads):
            here, rows = np.split(rows, [len(cycle.force)])
            yield here, Responses(values={name: reduce(cycle) for name, reduce in reductions.items()})

    @property
    def coords(self) -> Columns:
        """Names of the errors and meshes, and numbers of the harmonics."""
        meshes, harmonics = np.array(list(self.solved.meshes)), np.array(self.solved.phases.orders)
        return super().coords | {"mesh": (("mesh",), meshes), "harmonic": (("harmonic",), harmonics)}

    def chunks(self, errors: NDArray) -> Iterator[NDArray]:
        """Samples that are solved together, (sample, error); the last chunk may be padded."""
        return chunks(errors) if self.flanks else (errors[i : i + CHUNK] for i in range(0, len(errors), CHUNK))

    def _cycle(self, errors: NDArray) -> TrainCycle:
        q, F, _ = self.balance(errors)
        return replace(self.solved.cycle, force=F, motion=q)

    def balance(self, errors: NDArray) -> tuple[NDArray, NDArray, NDArray]:
        """Motions q, forces F and stiffnesses ∂F/∂δ of the meshes (sample, position, …) for a chunk of samples."""
        solved, count = self.solved, len(self.of_members)
        offset = offsets(solved, self.of_members, errors)[:, None]
        statics = solved.statics(offset)
        q, F = statics.balanced(self.forces, *solved.first_guess(offset), FORCE_TOLERANCE)
        if self.flanks is None:
            return q, F, self.forces.stiffness(F)
        under = partial(self.flanks.under, errors[:, count:])
        search = ForceSearch(meshes_under=under, nominal=self.flanks.flanks.force, least=LEAST, tolerance=FORCE_CHANGE)
        F, q, k, _ = search.solve(statics, F)
        return q, F, k


@single_threaded_blas()
def sampled_train(scene: Scene, solved: SolvedTrain | None = None, responses: Sequence[str] = ()) -> SampledTrain:
    """Prepare a train for samples of ``[planetary.scatter]`` and ``[effects.manufacturing_errors]``.

    The train is solved first, unless ``solved`` is given. ``responses`` are names of those to evaluate.

    Raises
    ------
    InputError
        If the scene has neither table, has several loads, or has errors that do not belong to a flank; also if a
        response is not defined for trains.
    """
    for name in responses:
        if not is_of_train(name):
            raise InputError("responses", name, f"is for one mesh: a train has {', '.join(USUAL_OF_TRAIN)}, …")
    if not scene.has_random_errors:
        allowed = "is needed by robust, such as pin_tangential = 20.0; or give effects.manufacturing_errors"
        raise InputError("planetary.scatter", "missing", allowed)
    if scene.loads:
        raise InputError("loads", f"{len(scene.loads)} loads", "not supported by robust for trains: give one [load]")
    planetary = scene.planetary
    scatter = None if planetary is None else planetary.keys.scatter
    if of_flanks := scene.effect("manufacturing_errors") is not None:
        check_flanks(scene)
    names = variables(scatter, planetary.keys.names) if planetary is not None and scatter is not None else {}
    if scatter is not None and not names:
        raise InputError("planetary.scatter", "no error", "must have at least one, e.g. pin_tangential = 20.0")
    solved = solved or solve_train(scene)
    most = float(len(solved.meshes) if planetary is None else planetary.keys.number)
    forces = curves(solved, most)
    flanks = FlankErrors.of(solved, levels(most), forces.approach) if of_flanks else None
    return SampledTrain(scene=scene, solved=solved, forces=forces, scatter=scatter, of_members=names, flanks=flanks)
