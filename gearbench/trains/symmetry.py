"""Symmetry of a train: after a part of the mesh cycle each mesh is in the state in which another one began.

Equal planets that are evenly spaced and have no errors pass through the same contact one after another. It is solved
for the first part of the cycle only; the other parts follow.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.equilibrium import Balance, Statics
from gearbench.contact.problem import ContactSolution
from gearbench.geometry.train import Train
from gearbench.scene import Scene

#: Two states are equal if they differ by at most this: in places (relative to the largest), phases [mesh periods] and
#: coupling (relative).
EQUAL = 1e-9


def parts(train: Train, scenes: Sequence[Scene], phase: NDArray, statics: Statics) -> tuple[NDArray, NDArray]:
    """Find the symmetry of a train, by which a rotation about the input shaft makes the meshes change places.

    Return two arrays of mesh numbers. The first, (part, mesh), tells which mesh was in the same states during the first
    part of the cycle as this mesh is in this part; without symmetry there is one part. The second, (mesh,), holds the
    first of the meshes that are always in the same state as this mesh.

    Parameters
    ----------
    train
        The train, with the axes of planets fixed.
    scenes
        Scene of each mesh; scenes that compare equal have the same contact at the same phase.
    phase
        Mesh phase of each mesh at each position, (mesh, position).
    statics
        Coupling of the meshes.
    """
    count, positions = phase.shape
    shafts = [[train.shaft(gear) for gear in mesh.gears] for mesh in train.meshes]
    x, y = np.moveaxis(np.array([[train.places[shaft] for shaft in both] for both in shafts]), -1, 0)
    place = x + 1j * y - (x + 1j * y)[0, 0]
    kind = np.array([scenes.index(scene) for scene in scenes])
    for n in (n for n in range(count, 0, -1) if positions % n == 0):
        by_part = phase.reshape(count, n, -1)
        by_part = np.concatenate([by_part, by_part[:, :1]], axis=1)  # the cycle repeats
        for other in np.flatnonzero(kind == kind[0])[1:]:
            # a rotation that takes the first mesh to the place of the other one
            turned = place * (place[other, 1] / place[0, 1])
            distance = np.abs(turned[:, None] - place).max(axis=-1) / np.abs(place).max()
            takes_place = (kind[:, None] == kind) & (distance < EQUAL)
            order = takes_place.argmax(axis=1)
            if not (takes_place.sum(axis=1) == 1).all() or np.abs(by_part[:, 1:] - by_part[order, :-1]).max() > EQUAL:
                continue
            if _couples_alike(statics, order):
                orders = [np.arange(count)]
                for _ in range(count * n):
                    orders.append(order[orders[-1]])
                return np.array(orders[:n]), np.min(orders[::n], axis=0)
    return np.arange(count)[None], np.arange(count)


def _couples_alike(statics: Statics, order: NDArray) -> bool:
    """Whether the coupling remains the same if the meshes are taken in another ``order``.

    It is compared by the approach of the meshes, as springs of stiffness 1, under forces at the meshes and the load.
    """
    B, offset = statics.rows, statics.offset
    under = B @ np.linalg.solve(statics.stiffness + B.T @ B, np.column_stack([B.T, statics.force]))
    approach, load = under[:, :-1], under[:, -1]
    pairs = (approach[np.ix_(order, order)], approach), (load[order], load), (offset[order], offset)
    return all(np.abs(one - other).max() <= EQUAL * np.abs(other).max() for one, other in pairs)


def whole(first: Balance, parts: NDArray, statics: Statics) -> Balance:
    """Balance over the cycle from that of its ``first`` part, with ``parts`` and ``statics`` as in ``parts``."""
    if len(parts) == 1:
        return first

    def joined(values: NDArray) -> NDArray:
        """(position, mesh) of all parts."""
        return np.concatenate([values[:, order] for order in parts])

    coupling, B = first.statics, statics.rows
    force, approach = joined(first.force), joined(first.motion @ B.T)
    # motions q from the approaches B q: (K + k Bᵀ B) q = f − Bᵀ F + k Bᵀ (B q), for any k, best that of the meshes
    k = first.stiffness.max()
    right = statics.force + (k * approach - force) @ B
    motion = np.linalg.solve(statics.stiffness + k * B.T @ B, right[..., None])[..., 0]
    if coupling.between is not None:
        between = np.concatenate([coupling.between[:, order][:, :, order] for order in parts])
        coupling = replace(coupling, between=between, shifted=joined(np.asarray(coupling.shifted)))
    fields_of_parts = [[first.fields[m] for m in of_mesh] for of_mesh in parts.T]
    return replace(
        first,
        force=force,
        motion=motion,
        stiffness=joined(first.stiffness),
        solutions=tuple(_in_a_row([first.solutions[m] for m in of_mesh]) for of_mesh in parts.T),
        statics=coupling,
        fields=tuple(None if each[0] is None else np.concatenate(each) for each in fields_of_parts),
    )


def _in_a_row(solutions: Sequence[ContactSolution]) -> ContactSolution:
    """Join the solutions of the parts of a cycle, position after position."""
    names = [field.name for field in fields(ContactSolution) if field.name != "corrected"]
    arrays = {name: np.concatenate([getattr(one, name) for one in solutions]) for name in names}
    return ContactSolution(**arrays, corrected=sum(one.corrected for one in solutions))
