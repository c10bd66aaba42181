"""Gear bodies loaded by several meshes of a train: a planet between sun and ring, a ring under all planets.

The load of one mesh deflects the teeth in the other meshes of the same gear, by (M4) of docs/theory.md. A side is a
gear in one of its meshes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.batch import on_threads
from gearbench.contact.bodies import Bodies, Link, Side
from gearbench.contact.equilibrium import MeshAt
from gearbench.effects.gear_body import GearBody
from gearbench.geometry.action import ContactLines
from gearbench.geometry.train import Train
from gearbench.scene import Scene
from gearbench.threads import default_threads


def yielding_bodies(
    train: Train, scenes: Mapping[str, Scene], contact_at: Mapping[str, tuple[ContactLines, MeshAt]], *, coast: bool
) -> Bodies | None:
    """Gear bodies loaded by several meshes; None if there is none, or no ``gear_body`` with coupled teeth.

    ``scenes`` and ``contact_at`` hold the scene, and contact lines and problem, of each mesh by name.
    """
    sides_of: dict[str, list[int]] = {}
    names: list[tuple[str, int]] = []
    for mesh in train.meshes:
        for index, gear in enumerate(mesh.gears if _body(scenes[mesh.name]) is not None else ()):
            sides_of.setdefault(gear, []).append(len(names))
            names.append((mesh.name, index))
    shared = [of_gear for of_gear in sides_of.values() if len(of_gear) > 1]
    if not shared:
        return None
    # meshes in phase share one contact problem, and with it their sides
    contact_of = {(name, index): (id(contact_at[name][1]), index) for name, index in names}
    first_of = {contact: side for side, contact in reversed(contact_of.items())}

    def side(name_and_index: tuple[str, int]) -> Side:
        name, index = name_and_index
        return _side(scenes[name], *contact_at[name], index)

    known = dict(zip(first_of, on_threads(side, first_of.values(), default_threads()), strict=True))
    numbers = {mesh.name: number for number, mesh in enumerate(train.meshes)}
    sides = tuple(replace(known[contact], mesh=numbers[name]) for (name, _), contact in contact_of.items())

    def link(one: int, other: int) -> Link:
        """Compliance between two sides of a gear, for the teeth that are in contact at both."""
        (first, i), (second, j) = names[one], names[other]
        scene, lines, others = scenes[first], contact_at[first][0], contact_at[second][0]
        body = _body(scene)
        assert body is not None
        gear = scene.pair.gears[i]
        blocks = body.between(scene.pair, i, scene.effects_by_name, coast=coast, across=i != j)
        ahead = [train.leading(name, train[name].gears[k], 0.0, coast=coast) for name, k in (names[one], names[other])]
        # pitches, in the sense of rotation, between the teeth of pair 0 at both meshes
        pitches = np.round(ahead[0] + lines.mesh_phase - ahead[1] - others.mesh_phase).astype(int)
        z, half = abs(gear.teeth), abs(gear.teeth) // 2
        groups = []
        for d in np.unique(pitches):
            teeth = d + lines.index[:, None] - others.index
            # a driven gear counts its teeth the other way round
            teeth = teeth if i == 0 else -teeth
            between = blocks[half + (teeth + half) % z - half].swapaxes(1, 2)
            groups.append((np.flatnonzero(pitches == d), between.reshape(math.prod(between.shape[:2]), -1)))
        return Link(sides=(one, other), groups=tuple(groups))

    # a gear that drives in one mesh and is driven in another is treated as driving: that side comes first
    pairs = [sorted(both, key=lambda s: names[s][1]) for of_gear in shared for both in combinations(of_gear, 2)]
    return Bodies(sides=sides, links=tuple(link(*both) for both in pairs))


def _body(scene: Scene) -> GearBody | None:
    """The ``gear_body`` effect of a mesh, if it couples the teeth."""
    body = scene.effect("gear_body")
    return body if isinstance(body, GearBody) and body.model == "ring" and body.coupled else None


def _side(scene: Scene, lines: ContactLines, contact: MeshAt, index: int) -> Side:
    """Flank polynomials of a gear, divided by the lever arm w of (T5), on the contact lines of its mesh."""
    cells = contact.problem.cells
    nodes_on_lines = lines if cells is None else cells.smooth_lines
    body = _body(scene)
    assert body is not None
    polynomials: NDArray = body.shapes(nodes_on_lines, index, scene.effects_by_name)
    polynomials /= np.expand_dims(nodes_on_lines.lever, -1)
    polynomials[~nodes_on_lines.active] = 0.0
    return Side(mesh=0, polynomials=polynomials, means=None if cells is None else cells.means)
