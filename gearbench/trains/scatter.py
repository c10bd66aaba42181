"""Load sharing and transmission error of a train over random errors of its members and of their flanks.

Errors of pins, planets and run-outs move the flanks as wholes: the contact of each mesh stays what it is, force over
approach and phase, and is tabled once. A sample is then the balance (M2) of a few motions. Errors of flanks change the
contact: from the forces that the table leads to, the search of ``gearbench.contact.equilibrium`` goes on with the
contact of all samples side by side.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.batch import chunks, on_threads
from gearbench.contact.equilibrium import PARTED, Forces, MeshAt, Statics
from gearbench.contact.problem import part_of
from gearbench.contact.solver import Guess
from gearbench.effects.distributions import DISTRIBUTIONS
from gearbench.errors import InputError
from gearbench.geometry.planetary import DEVIATIONS, PlanetaryScatter
from gearbench.results.cycle import HARMONICS, coefficients
from gearbench.results.provenance import provenance
from gearbench.results.responses import described, is_of_train, response
from gearbench.results.train_cycle import USUAL_OF_TRAIN, TrainCycle
from gearbench.robustness.sampling import Sampler, unit_samples
from gearbench.robustness.sensitivity import sensitivities
from gearbench.robustness.statistics import summarise
from gearbench.robustness.tightening import FINER
from gearbench.scene import Scene
from gearbench.threads import default_threads, single_threaded_blas
from gearbench.trains.flanks import FlankErrors, check_flanks
from gearbench.trains.solve import SolvedTrain, solve_train

if TYPE_CHECKING:
    import xarray as xr

#: Levels of the tabled force, the least of them over the force of even sharing, and samples that are solved together.
LEVELS, LEAST, CHUNK = 32, 1e-3, 50
#: Change of a force over the greatest at which samples with errors of flanks are solved.
TOUCHED = 1e-5
#: Imbalance over the load at which a sample is solved.
SETTLED = 1e-9
#: Responses that get statistics and shares.
STUDIED = ("mesh_load_factor", "train_transmission_error_rms")


@dataclass(frozen=True, kw_only=True)
class Curves:
    """F(δ) of all meshes at all positions, cubic between levels with the slopes of the contact; 0 where flanks part.

    Parameters
    ----------
    approach, force, slope
        (mesh, position, level) [mm, N, N/mm].
    statics
        Coupling of the meshes: the compliance that it lends them is not in F(δ).
    """

    approach: NDArray
    force: NDArray
    slope: NDArray
    statics: Statics

    @cached_property
    def _own(self) -> tuple[NDArray, NDArray]:
        """Approach and slope without the compliance that is lent."""
        lent = np.expand_dims(np.transpose(self.statics.lent), -1)
        return self.approach - lent * self.force, self.statics.stiffer(self.slope.T).T

    def __call__(self, x: NDArray) -> tuple[NDArray, NDArray]:
        """Force and stiffness at x (sample, position, mesh)."""
        x = np.moveaxis(x, -1, 0)
        approach, slope = self._own
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
        parted = f <= 0
        return np.moveaxis(np.where(parted, 0.0, f), 0, -1), np.moveaxis(
            np.where(parted, PARTED * self.slope.max(), k), 0, -1
        )


def levels(most: float) -> NDArray:
    """Forces of a table over that of even sharing."""
    return np.geomspace(LEAST, most, LEVELS)


def curves(solved: SolvedTrain, most: float) -> Curves:
    """Tables up to ``most`` times the force of even sharing."""
    shares = levels(most)
    found = []
    for mesh in solved.contacts:
        count = len(mesh.problem.gap)
        problem = part_of(mesh.problem, np.tile(np.arange(count), LEVELS))
        force = np.repeat(shares, count) * mesh.nominal
        whole = MeshAt(problem=problem, nominal=mesh.nominal, cos_b=mesh.cos_b)
        approach, slope, _ = whole.answer(force, Guess.nothing(problem))
        found.append([each.reshape(LEVELS, count).T for each in (approach, force, slope)])
    approach, force, slope = (np.stack(each) for each in zip(*found, strict=True))
    return Curves(approach=approach, force=force, slope=slope, statics=solved.own)


def variables(scatter: PlanetaryScatter, planets: tuple[str, ...]) -> dict[str, float]:
    """Names of the random variables and their amplitudes [µm]; a run-out has its angle beside it [periods]."""
    found = {}
    for key in DEVIATIONS:
        if (f := getattr(scatter, key)) is not None:
            found |= {f"{key} {name}": f for name in planets}
    for key, names in (("sun", ("sun",)), ("ring", ("ring",)), ("carrier", ("carrier",)), ("planet", planets)):
        if (f := getattr(scatter, f"{key}_run_out")) is not None:
            for name in names:
                found |= {f"run_out {name}": f, f"angle {name}": 1.0}
    return found


def offsets(solved: SolvedTrain, names: dict[str, float], errors: NDArray) -> NDArray:
    """Approach that errors (sample, variable) add to each mesh, (sample, mesh) [mm]."""
    assert solved.scene.train is not None
    short, found = solved.scene.train.planetary, np.zeros((len(errors), len(solved.even)))
    if short is None:
        return found
    modes, columns = short.modes(solved.linkage), dict(zip(names, errors.T, strict=False))
    for name, amount in columns.items():
        kind, _, body = name.partition(" ")
        if kind == "run_out":
            angle = 2 * np.pi * columns[f"angle {body}"]
            x, y = modes[f"{body} x"], modes[f"{body} y"]
            found += amount[:, None] / 2 * (np.cos(angle)[:, None] * x + np.sin(angle)[:, None] * y)
        elif kind != "angle":
            found += amount[:, None] * modes[name]
    return found


def draw(scatter: PlanetaryScatter, names: dict[str, float], unit: NDArray) -> NDArray:
    """Errors of points of the unit cube, (sample, variable)."""
    law = DISTRIBUTIONS[scatter.distribution]
    found = np.empty(unit.shape)
    for column, (name, f) in enumerate(names.items()):
        one_sided = name.startswith(("run_out", "angle"))
        found[:, column] = f * (unit[:, column] if one_sided else law.quantile(unit[:, column]))
    return found


@dataclass(frozen=True, kw_only=True, eq=False)
class SampledTrain:
    """A train ready for samples of its errors.

    Parameters
    ----------
    solved
        The train at the errors that the scene has.
    forces
        Contact of its meshes, tabled.
    scatter, names
        Errors of the members, where there are any: the table, and ``variables`` of it.
    flanks
        Errors of the flanks, where there are any.
    """

    solved: SolvedTrain
    forces: Curves
    scatter: PlanetaryScatter | None
    names: dict[str, float]
    flanks: FlankErrors | None

    @property
    def error_names(self) -> tuple[str, ...]:
        """Names of the errors of a sample."""
        return (*self.names, *(() if self.flanks is None else self.flanks.errors))

    def draw(self, unit: NDArray) -> NDArray:
        """Errors of points of the unit cube, (sample, error)."""
        count = len(self.names)
        parts = [] if self.scatter is None else [draw(self.scatter, self.names, unit[:, :count])]
        parts += [] if self.flanks is None else [self.flanks.draw(unit[:, count:])]
        return np.hstack(parts)

    def cycles(
        self, errors: NDArray, threads: int = 1, progress: Callable[[int], None] = lambda _: None
    ) -> Iterator[TrainCycle]:
        """Mesh cycles under ``errors`` (sample, error), some samples at a time; the last ones may be too many."""
        parts = chunks(errors) if self.flanks else (errors[i : i + CHUNK] for i in range(0, len(errors), CHUNK))
        done = 0
        for cycle in on_threads(self._cycle, parts, threads):
            yield cycle
            done += len(cycle.force)
            progress(min(done, len(errors)))

    def respond(
        self,
        errors: NDArray,
        names: Sequence[str],
        threads: int = 1,
        progress: Callable[[int], None] = lambda _: None,
    ) -> dict[str, NDArray]:
        """Responses ``names`` to ``errors`` (sample, error), (sample,) each; and ``load_sharing_greatest``."""
        found = [
            {name: response(name).reduce(cycle) for name in names}
            | {"load_sharing_greatest": cycle.sharing.max(axis=1)}
            | {"train_transmission_error_amplitude": 2 * np.abs(coefficients(cycle.phases, cycle.transmission_error))}
            for cycle in self.cycles(errors, threads, progress)
        ]
        return {name: np.concatenate([each[name] for each in found])[: len(errors)] for name in found[0]}

    def _cycle(self, errors: NDArray) -> TrainCycle:
        solved, count = self.solved, len(self.names)
        statics = solved.statics(offsets(solved, self.names, errors)[:, None])
        q, F = statics.balanced(self.forces, solved.begun(len(errors)), SETTLED)
        if self.flanks is not None:
            answer = partial(self.flanks.answer, errors[:, count:])
            own = Forces(answer=answer, nominal=self.flanks.flanks.force, least=LEAST, settled=TOUCHED)
            F, q, _, _ = own.found(statics, F, q)
        return replace(solved.cycle, force=F, motion=q)


def sampled_train(scene: Scene, solved: SolvedTrain | None = None) -> SampledTrain:
    """A train ready for samples of ``[planetary.scatter]`` and ``[effects.manufacturing_errors]``.

    It is solved here, unless ``solved`` is given.

    Raises
    ------
    InputError
        If the scene has neither, or errors that are not of flanks.
    """
    short = None if scene.train is None else scene.train.planetary
    scatter, of_flanks = None if short is None else short.keys.scatter, scene.effect("manufacturing_errors") is not None
    if scatter is None and not of_flanks:
        allowed = "robustness of a train needs it, or effects.manufacturing_errors: pin_tangential = 20.0, say"
        raise InputError("planetary.scatter", "missing", allowed)
    if scene.loads:
        raise InputError("loads", f"{len(scene.loads)} loads", "are not for robust of a train: give one [load]")
    if of_flanks:
        check_flanks(scene)
    names = variables(scatter, short.keys.names) if short is not None and scatter is not None else {}
    if scatter is not None and not names:
        raise InputError("planetary.scatter", "no error", "must have at least one, e.g. pin_tangential = 20.0")
    solved = solved or solve_train(scene)
    most = float(len(solved.meshes) if short is None else short.keys.number)
    forces = curves(solved, most)
    flanks = FlankErrors.of(solved, levels(most), forces.approach) if of_flanks else None
    return SampledTrain(solved=solved, forces=forces, scatter=scatter, names=names, flanks=flanks)


@single_threaded_blas()
def robust_train(
    scene: Scene,
    *,
    samples: int,
    seed: int = 0,
    sampler: Sampler = "sobol",
    threads: int | None = None,
    responses: Sequence[str] = (),
    progress: Callable[[int], None] = lambda _: None,
) -> xr.Dataset:
    """Dataset of a train over samples of its errors; ``responses`` are more than ``USUAL_OF_TRAIN``.

    Raises
    ------
    InputError
        As ``sampled_train``; if a response is none of trains.
    ConvergenceError
        If a sample is not solved.
    """
    import xarray as xr

    start = time.perf_counter()
    for name in responses:
        if not is_of_train(name):
            raise InputError("responses", name, f"is for one mesh: a train has {', '.join(USUAL_OF_TRAIN)}, …")
    train = sampled_train(scene)
    errors = train.draw(unit_samples(sampler, samples, len(train.error_names), seed))
    names = tuple(dict.fromkeys((*USUAL_OF_TRAIN, *responses)))
    found = train.respond(errors, names, threads or default_threads(), progress)
    attrs = provenance(scene, wall_time=time.perf_counter() - start, seed=seed)
    attrs |= {"sampler": sampler, "samples": samples, "complete": 1}
    columns = _columns(found, errors, sampler, tuple(dict.fromkeys((*STUDIED, *responses))))
    coords = {"error_name": np.array(train.error_names), "mesh": np.array(list(train.solved.meshes))}
    coords["harmonic"] = np.arange(1, HARMONICS + 1)
    return xr.Dataset(described(columns, "NaN where the samples are too few to tell"), coords=coords, attrs=attrs)


def _columns(found: dict[str, NDArray], errors: NDArray, sampler: Sampler, studied: Sequence[str]) -> dict[str, tuple]:
    """Variables of the Dataset: the samples, statistics of those ``studied``, and the share of each error in them."""
    columns: dict[str, tuple] = {
        name: (("sample", "harmonic" if name.endswith("amplitude") else "mesh")[: values.ndim], values)
        for name, values in found.items()
    } | {"error": (("sample", "error_name"), errors)}
    if len(errors) < 2:
        return columns
    for name in studied:
        for statistic, (value, standard_error) in summarise(found[name], sampler).items():
            columns[f"{name}_{statistic}"] = (), value
            columns[f"{name}_{statistic}_standard_error"] = (), standard_error
    for name, each in zip(studied, sensitivities(errors, [found[name] for name in studied], FINER), strict=True):
        for part in ("first_order", "total", "tightened"):
            value, uncertainty = getattr(each, part)
            columns[f"{name}_{part}"] = "error_name", value
            columns[f"{name}_{part}_standard_error"] = "error_name", uncertainty
    return columns
