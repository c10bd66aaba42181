"""Random errors of the flanks of a train. A flank has the same error in all its meshes.

A planet has two independent flanks, one for the sun and one for the ring. Sun and ring bring the same flank errors to
all planets. Errors drawn per tooth are independent in each mesh, because other teeth are in contact there.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.batch import Batch, chunks, solve_one_chunk
from gearbench.contact.equilibrium import MeshAt
from gearbench.effects.distributions import DISTRIBUTIONS
from gearbench.effects.expansion import Expansion
from gearbench.effects.manufacturing_errors import ErrorMode
from gearbench.errors import InputError
from gearbench.geometry.names import GEARS
from gearbench.results.solved import Solved
from gearbench.robustness.montecarlo import prepare_batch, require_errors
from gearbench.scene import Scene
from gearbench.trains.solve import SolvedTrain

#: Errors that do not belong to one flank. For a planetary set they are given in ``planetary.scatter``.
ELSEWHERE = ("inclination", "deviation", "run_out", "wobble", "varied", "centre_distance", "tooth_thickness")


@dataclass(frozen=True, kw_only=True, eq=False)
class TrainFlanks:
    """Meshes of a train, prepared for many samples of flank gaps.

    Parameters
    ----------
    batches
        Each mesh prepared for the batch solver, without gaps of samples.
    force, cos_b
        Force F_bt for which the batches are prepared [N], and cos β_b, (mesh,).
    share
        Load levels relative to ``force``, (level,).
    cell_correction
        Discretisation error of the batch solver without gaps of samples: the approach that it lacks at each level,
        (mesh, position, level) [mm].
    """

    batches: tuple[Batch, ...]
    force: NDArray
    cos_b: NDArray
    share: NDArray
    cell_correction: NDArray

    @classmethod
    def of(
        cls, solved: SolvedTrain, share: NDArray, approach: NDArray, prepare: Callable[[Solved, MeshAt], Batch]
    ) -> TrainFlanks:
        """Prepare the batch of each mesh with ``prepare``; equal meshes share one batch.

        ``approach`` (mesh, position, level) [mm] is the accurate approach at the load levels ``share`` (level,).
        """
        prepared, by_contact = [], {}
        for mesh, contact, accurate in zip(solved.meshes.values(), solved.contacts, approach, strict=True):
            if id(contact) not in by_contact:
                batch = prepare(mesh, contact)
                load = np.tile(share, (len(accurate), 1))
                cells, _ = _solve(batch, np.zeros((len(share), batch.modes.shape[1])), load)
                by_contact[id(contact)] = batch, accurate - cells / contact.cos_b
            prepared.append(by_contact[id(contact)])
        batches, cell_correction = zip(*prepared, strict=True)
        force, cos_b = (np.array([getattr(mesh, name) for mesh in solved.contacts]) for name in ("nominal", "cos_b"))
        return cls(batches=batches, force=force, cos_b=cos_b, share=share, cell_correction=np.array(cell_correction))

    def under(self, amounts: Sequence[NDArray], force: NDArray) -> tuple[NDArray, NDArray]:
        """Approach [mm] and ∂F_bt/∂δ [N/mm], (sample, position, mesh), under forces F_bt (sample, position, mesh) [N].

        ``amounts``: amplitudes of the gap modes of each mesh, (sample, mode). Forces below the lowest level of
        ``share`` are raised to that level.
        """
        answers, level = [], np.log(self.share)
        for m, batch in enumerate(self.batches):
            load = np.maximum(force[..., m].T / self.force[m], self.share[0])
            approach, k = _solve(batch, amounts[m], load)
            correction = [np.interp(np.log(L), level, c) for L, c in zip(load, self.cell_correction[m], strict=True)]
            cos_b = self.cos_b[m]
            answers.append(((approach / cos_b + correction).T, k.T * cos_b**2))
        approach, k = (np.stack(arrays, axis=-1) for arrays in zip(*answers, strict=True))
        return approach, k


def _solve(batch: Batch, amounts: NDArray, load: NDArray) -> tuple[NDArray, NDArray]:
    """Approach δ_n [mm] and stiffness [N/mm] normal to the flank, (position, sample), for samples of a chunk.

    ``amounts`` (sample, mode) are amplitudes of the gap modes, ``load`` (position, sample) the forces over the force of
    the batch. There may be fewer samples than a full chunk.
    """
    count = len(amounts)
    filled = next(chunks(amounts))
    solution = solve_one_chunk(batch, filled, np.pad(load, ((0, 0), (0, len(filled) - count)), mode="edge"))
    return solution.approach[:, :count], solution.stiffness[:, :count]


@dataclass(frozen=True, kw_only=True, eq=False)
class FlankErrors:
    """Random errors of the flanks of a train.

    Parameters
    ----------
    errors
        Name → random variable.
    columns, expansions
        For each mesh: the indices of its random variables in ``errors``, and the expansion of their gap.
    flanks
        The meshes, prepared at the mean errors.
    """

    errors: Mapping[str, ErrorMode]
    columns: tuple[tuple[int, ...], ...]
    expansions: tuple[Expansion, ...]
    flanks: TrainFlanks

    @classmethod
    def of(cls, solved: SolvedTrain, share: NDArray, approach: NDArray) -> FlankErrors:
        """Collect the random flank errors of a train; ``share`` and ``approach`` as for ``TrainFlanks.of``.

        Raises
        ------
        InputError
            If the scene has no ``effects.manufacturing_errors``.
        """
        drive = {mesh.scene.gear_names[0] for mesh in solved.meshes.values()}
        both = drive & {mesh.scene.gear_names[1] for mesh in solved.meshes.values()}
        errors: dict[str, ErrorMode] = {}
        named = [_named(mesh.scene, name, both) for name, mesh in solved.meshes.items()]
        for of_mesh in named:
            errors |= of_mesh
        order, expansions = {name: i for i, name in enumerate(errors)}, {}

        def prepare(mesh: Solved, contact: MeshAt) -> Batch:
            batch, expansions[id(contact)] = prepare_batch(mesh.scene, mesh.lines, contact.problem)
            return batch

        return cls(
            errors=errors,
            columns=tuple(tuple(order[name] for name in of_mesh) for of_mesh in named),
            flanks=TrainFlanks.of(solved, share, approach, prepare),
            expansions=tuple(expansions[id(contact)] for contact in solved.contacts),
        )

    def draw(self, unit: NDArray) -> NDArray:
        """Errors (sample, error) [µm] for points ``unit`` (sample, error) of the unit cube."""
        laws = [(mode.amplitude, DISTRIBUTIONS[mode.distribution]) for mode in self.errors.values()]
        drawn = [f * law.quantile(unit[:, i]) for i, (f, law) in enumerate(laws)]
        return np.stack(drawn, axis=-1)

    def under(self, errors: NDArray, force: NDArray) -> tuple[NDArray, NDArray]:
        """Approach and stiffness with ``errors`` (sample, error) under ``force``; shapes as in ``TrainFlanks``."""
        meshes = zip(self.expansions, self.columns, strict=True)
        amounts = [expansion.amounts(errors[:, list(columns)]) for expansion, columns in meshes]
        return self.flanks.under(amounts, force)


def _named(scene: Scene, mesh: str, both: set[str]) -> dict[str, ErrorMode]:
    """Random variables of a mesh, named by kind of error and flank.

    ``both``: gears that drive in one mesh and are driven in another; their names tell the two flanks apart.
    """
    errors = {}
    for mode in require_errors(scene).error_modes(scene.pair):
        side = next(i for i, name in enumerate(GEARS) if f"_{name}" in mode.name)
        kind, _, tooth = mode.name.partition(f"_{GEARS[side]}")
        gear = scene.gear_names[side]
        flank = f", {('driving', 'driven')[side]} flank" if gear in both else ""
        of_tooth = f", {tooth[1:]} of {mesh}" if tooth else ""
        errors[f"{kind} {gear}{flank}{of_tooth}"] = mode
    return errors


def check_flanks(scene: Scene) -> None:
    """Refuse random errors that do not belong to a flank.

    Raises
    ------
    InputError
        For the first of these errors.
    """
    given = require_errors(scene)
    errors = given.convention()
    for name in ELSEWHERE:
        if getattr(errors, name):
            key = "preset" if given.preset is not None else name
            value = f'"{given.preset}"' if given.preset is not None else "given"
            allowed = f"{name} is for one mesh: a train takes errors of profiles, helices and pitches here"
            raise InputError(f"effects.manufacturing_errors.{key}", value, f"{allowed}, others in planetary.scatter")
