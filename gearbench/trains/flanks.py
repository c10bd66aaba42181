"""Random errors of the flanks of a train: each flank has its own, and brings them to every mesh that it is in.

A planet's flanks at sun and ring are two; sun and ring bring the same errors to all planets. Errors drawn per tooth are
of the teeth that a mesh has in contact: each mesh its own.
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

#: Errors that do not lie on one flank; where those of a set are given instead.
ELSEWHERE = ("inclination", "deviation", "run_out", "wobble", "varied", "centre_distance", "tooth_thickness")


@dataclass(frozen=True, kw_only=True, eq=False)
class Flanks:
    """Meshes of a train prepared for many gaps of their flanks.

    Parameters
    ----------
    batches
        Each mesh without these gaps.
    force, cos_b
        F_bt that the batches are for [N], and cos β_b, (mesh,).
    share
        Forces over these at which it is known what a batch misses, (level,).
    missed
        Approach that it misses there without the gaps, (mesh, position, level) [mm].
    """

    batches: tuple[Batch, ...]
    force: NDArray
    cos_b: NDArray
    share: NDArray
    missed: NDArray

    @classmethod
    def of(
        cls, solved: SolvedTrain, share: NDArray, approach: NDArray, prepare: Callable[[Solved, MeshAt], Batch]
    ) -> Flanks:
        """Flanks from the batches of ``prepare``; equal meshes share one batch.

        The meshes have the ``approach`` (mesh, position, level) [mm] under ``share`` (level,) of the force of each.
        """
        found, known = [], {}
        for mesh, contact, own in zip(solved.meshes.values(), solved.contacts, approach, strict=True):
            if id(contact) not in known:
                batch = prepare(mesh, contact)
                load = np.tile(share, (len(own), 1))
                cells, _ = _answer(batch, np.zeros((len(share), batch.modes.shape[1])), load)
                known[id(contact)] = batch, own - cells / contact.cos_b
            found.append(known[id(contact)])
        batches, missed = zip(*found, strict=True)
        force, cos_b = (np.array([getattr(mesh, name) for mesh in solved.contacts]) for name in ("nominal", "cos_b"))
        return cls(batches=batches, force=force, cos_b=cos_b, share=share, missed=np.array(missed))

    def answer(self, amounts: Sequence[NDArray], force: NDArray) -> tuple[NDArray, NDArray]:
        """Approach [mm] and ∂F_bt/∂δ [N/mm] of a chunk of samples under F_bt (sample, position, mesh) [N].

        ``amounts`` (sample, mode) of the gaps of each mesh. Smaller forces than the least of ``share`` are answered as
        that one.
        """
        answers, level = [], np.log(self.share)
        for m, batch in enumerate(self.batches):
            load = np.maximum(force[..., m].T / self.force[m], self.share[0])
            approach, k = _answer(batch, amounts[m], load)
            more = [np.interp(np.log(own), level, at) for own, at in zip(load, self.missed[m], strict=True)]
            cos_b = self.cos_b[m]
            answers.append(((approach / cos_b + more).T, k.T * cos_b**2))
        approach, k = (np.stack(each, axis=-1) for each in zip(*answers, strict=True))
        return approach, k


def _answer(batch: Batch, amounts: NDArray, load: NDArray) -> tuple[NDArray, NDArray]:
    """δ_n and its stiffness, (position, sample), of a chunk that need not be full."""
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
        Random variables by their names.
    columns, expansions
        Which of them each mesh has, in the order of its own, and their gaps.
    flanks
        The meshes at the mean errors.
    """

    errors: Mapping[str, ErrorMode]
    columns: tuple[tuple[int, ...], ...]
    expansions: tuple[Expansion, ...]
    flanks: Flanks

    @classmethod
    def of(cls, solved: SolvedTrain, share: NDArray, approach: NDArray) -> FlankErrors:
        """Errors of a train, see ``Flanks.of``.

        Raises
        ------
        InputError
            If errors are asked for that do not lie on a flank.
        """
        drive = {mesh.scene.gear_names[0] for mesh in solved.meshes.values()}
        both = drive & {mesh.scene.gear_names[1] for mesh in solved.meshes.values()}
        errors: dict[str, ErrorMode] = {}
        named = [_named(mesh.scene, name, both) for name, mesh in solved.meshes.items()]
        for own in named:
            errors |= own
        order, expansions = {name: i for i, name in enumerate(errors)}, {}

        def prepare(mesh: Solved, contact: MeshAt) -> Batch:
            batch, expansions[id(contact)] = prepare_batch(mesh.scene, mesh.lines, contact.problem)
            return batch

        return cls(
            errors=errors,
            columns=tuple(tuple(order[name] for name in own) for own in named),
            flanks=Flanks.of(solved, share, approach, prepare),
            expansions=tuple(expansions[id(contact)] for contact in solved.contacts),
        )

    def draw(self, unit: NDArray) -> NDArray:
        """Errors of points of the unit cube, (sample, error) [µm]."""
        laws = [(mode.amplitude, DISTRIBUTIONS[mode.distribution]) for mode in self.errors.values()]
        drawn = [f * law.quantile(unit[:, i]) for i, (f, law) in enumerate(laws)]
        return np.stack(drawn, axis=-1)

    def answer(self, errors: NDArray, force: NDArray) -> tuple[NDArray, NDArray]:
        """Approach and stiffness under the ``errors`` (sample, error), see ``Flanks.answer``."""
        own = zip(self.expansions, self.columns, strict=True)
        return self.flanks.answer([each.amounts(errors[:, list(columns)]) for each, columns in own], force)


def _named(scene: Scene, mesh: str, both: set[str]) -> dict[str, ErrorMode]:
    """Random variables of a mesh, by kind of error and flank; ``both``: gears that drive and are driven."""
    found = {}
    for mode in require_errors(scene).error_modes(scene.pair):
        side = next(i for i, each in enumerate(GEARS) if f"_{each}" in mode.name)
        kind, _, tooth = mode.name.partition(f"_{GEARS[side]}")
        gear = scene.gear_names[side]
        flank = f", {('driving', 'driven')[side]} flank" if gear in both else ""
        at = f", {tooth[1:]} of {mesh}" if tooth else ""
        found[f"{kind} {gear}{flank}{at}"] = mode
    return found


def check_flanks(scene: Scene) -> None:
    """Refuse random errors that are not of flanks.

    Raises
    ------
    InputError
        Naming the first.
    """
    given = require_errors(scene)
    errors = given.convention()
    for name in ELSEWHERE:
        if getattr(errors, name):
            key = "preset" if given.preset is not None else name
            value = f'"{given.preset}"' if given.preset is not None else "given"
            allowed = f"{name} is for one mesh: a train takes errors of profiles and helices here"
            raise InputError(f"effects.manufacturing_errors.{key}", value, f"{allowed}, others in planetary.scatter")
