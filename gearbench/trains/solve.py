"""Trains whose meshes form one contact problem: parallel paths, floating gears, flexible pins.

Numbers such as (M2) are equations of docs/theory.md.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.assemble import assemble, with_field
from gearbench.contact.batch import on_threads
from gearbench.contact.coarse_solution import scene_lines
from gearbench.contact.equilibrium import LEAST, SEPARATED_STIFFNESS, Balance, MeshAt, Statics, balance
from gearbench.contact.panels import CLOSE, LONGEST, panel_starts
from gearbench.contact.phases import gauss_phases, uniform_phases
from gearbench.contact.problem import part_of
from gearbench.contact.solver import Guess
from gearbench.contact.transitions import CLOSER, GAUSS_POINTS, transitions
from gearbench.effects.base import GapEffect
from gearbench.errors import InputError
from gearbench.geometry.action import ContactLines
from gearbench.geometry.linkage import Linkage
from gearbench.geometry.names import GEARS
from gearbench.geometry.train import Train
from gearbench.hunting.cycles import tooth_to_tooth_effects, with_equal_teeth
from gearbench.results.cycle import HARMONICS, MICROMETRES, MeshCycle, Phases
from gearbench.results.solved import Solved
from gearbench.results.train_cycle import TrainCycle
from gearbench.scene import Load, Resolution, Scene
from gearbench.schema import changed
from gearbench.threads import default_threads, single_threaded_blas
from gearbench.trains import symmetry
from gearbench.trains.bodies import yielding_bodies

#: Contact lines off the line of action are built for an assumed load. They are rebuilt if the load of a mesh exceeds
#: the assumed load by more than this factor.
HEAVIER = 1.2
#: Largest number of times that contact lines are rebuilt.
ROUNDS = 4
#: Number of Gauss points on a panel of helical trains whose meshes split each other's panels into at least ``PIECES``
#: pieces on average. On such short panels amplitudes of helical meshes are accurate to 1e-3 of the largest.
POINTS_ON_PIECES, PIECES = 3, 3


@dataclass(frozen=True, kw_only=True, eq=False)
class SolvedTrain:
    """A train solved over one cycle of its mesh frequency.

    Parameters
    ----------
    scene
        Gears, meshes, load.
    linkage
        Kinematic and static coupling of the meshes.
    phases
        Phases of the first mesh.
    meshes
        Name of a mesh → its contact under the mesh force at each position.
    contacts
        Contact problem of each mesh at its phases.
    coupling
        Equations that couple the meshes, including the compliance of the gear bodies.
    balance
        Mesh forces and motions in equilibrium.
    even
        Force of each mesh if all paths share the load equally, (mesh,) [N].
    """

    scene: Scene
    linkage: Linkage
    phases: Phases
    meshes: Mapping[str, Solved]
    contacts: tuple[MeshAt, ...]
    coupling: Statics
    balance: Balance
    even: NDArray

    def statics(self, more: NDArray) -> Statics:
        """Coupling of the meshes for samples: the offset g minus ``spread``, plus ``more`` (…, mesh) [mm]."""
        return replace(self.coupling, offset=self.coupling.offset - self.spread + more)

    def first_guess(self, more: NDArray) -> tuple[NDArray, NDArray]:
        """Motions and forces (sample, position, …) from which Newton's method starts, by the tangents of the solution.

        ``more`` (…, mesh) is the offset of the samples, as for ``statics``.
        """
        coupling, k = self.coupling, self.balance.stiffness
        k = np.maximum(k, SEPARATED_STIFFNESS * k.max())
        W, B = coupling.tangent(k), coupling.rows
        change = -(np.linalg.solve(coupling.matrix(k), B.T @ W) @ more[..., None])[..., 0]
        force = self.balance.force + (W @ (change @ B.T + more)[..., None])[..., 0]
        return self.balance.motion + change, force

    @cached_property
    def spread(self) -> NDArray | float:
        """Approach by body compliance (M4) beyond C F, its mean over the loads, (position, mesh) [mm].

        Samples use this value unchanged, as if they had the load distribution of this solution.
        """
        coupling, F = self.coupling, self.balance.force
        if coupling.between is None:
            return 0.0
        F = np.maximum(F, LEAST * np.array([mesh.nominal for mesh in self.contacts]))
        contacts = zip(self.contacts, F.T, self.balance.fields, strict=True)
        both = [[m.under(f, Guess.empty(m.problem), e)[0] for e in (field, None)] for m, f, field in contacts]
        by_bodies = [with_bodies - without_bodies for with_bodies, without_bodies in both]
        return np.stack(by_bodies, axis=1) - (coupling.between @ F[..., None])[..., 0]

    @cached_property
    def cycle(self) -> TrainCycle:
        """Forces, motions and input stiffness over the mesh cycle."""
        return TrainCycle(
            linkage=self.linkage,
            phases=self.phases,
            force=self.balance.force,
            even=self.even,
            motion=self.balance.motion,
            input_stiffness=self.input_stiffness,
        )

    @cached_property
    def input_stiffness(self) -> NDArray:
        """Torque on the input shaft per unit of its rotation, (position,) [N·mm/rad]."""
        matrix = self.coupling.matrix(self.balance.stiffness)
        return 1 / np.linalg.pinv(matrix, hermitian=True)[:, self.linkage.input, self.linkage.input]

    @property
    def stiffness(self) -> NDArray:
        """Stiffness of the train on the base circle of the first gear, (position,) [N/µm]."""
        return self.input_stiffness / (MICROMETRES * self.linkage.train.meshes[0].pair.gears[0].base_radius ** 2)

    @property
    def cycles(self) -> list[MeshCycle]:
        """Transmission error and stiffness of the train, then of each mesh."""
        error = self.cycle.transmission_error
        of_train = MeshCycle(phases=self.phases, transmission_error=error, mesh_stiffness=self.stiffness)
        return [of_train, *(mesh.cycle for mesh in self.meshes.values())]

    @property
    def change(self) -> NDArray:
        """Change of the transmission error when the ends of the contact patches were last refined, (position,) [µm]."""
        by_mesh = zip(self.meshes.values(), self.contacts, strict=True)
        change = [(m.solution.approach - m.solution.coarse_approach) / contact.cos_b for m, contact in by_mesh]
        k = self.balance.stiffness
        load = self.linkage.rows.T @ self.coupling.tangent(k) @ np.stack(change, axis=1)[..., None]
        motion = (np.linalg.pinv(self.coupling.matrix(k), hermitian=True) @ load)[..., 0]
        return replace(self.cycle, motion=motion).transmission_error

    @property
    def ratios(self) -> NDArray:
        """Rotation error of each member relative to that of the input, if the other ends are held, (member,) [–].

        Members between the ends have 0.
        """
        rates = self.linkage.rates
        ratios = {name: abs(rates[name]) for name in self.linkage.ends}
        if self.linkage.carrier is not None:  # θ_s − θ_c = i (θ_r − θ_c)
            ratio = rates[self.linkage.ends[1]]
            ratios[self.linkage.carrier] = abs(ratio / (1 - ratio))
        return np.array([ratios.get(name, 0.0) for name in self.linkage.bodies])


def check_train(scene: Scene) -> Linkage:
    """Coupling of the meshes of a train that can be solved as one contact problem; others are refused.

    Raises
    ------
    InputError
        If the tooth numbers or the coupling do not fit, or teeth differ and meshes have different frequencies.
    """
    train = scene.geometry
    for mesh_scene in scene.meshes.values() if max(train.periods.values()) > 1 else ():
        if tooth_effects := tooth_to_tooth_effects(mesh_scene):
            allowed = "differs from tooth to tooth, and needs a train whose meshes have one frequency"
            raise InputError(f"effects.{tooth_effects[0].name}", "given", allowed)
    assert scene.train is not None
    planetary = scene.train.planetary
    try:
        train.check_assembly(coast=scene.load.coast)
    except InputError as error:
        if planetary is None:
            raise
        allowed = f"{error.value} {error.allowed}; {planetary.fitting}"
        raise InputError("planetary.positions", planetary.keys.positions, allowed) from None
    linkage = scene.train.linkage(train, coast=scene.load.coast)
    try:
        linkage.check()
    except InputError as error:
        if planetary is None:
            raise
        allowed = f"nothing holds {error.value}, neither meshes nor a stiffness"
        raise InputError("planetary.floating", list(planetary.keys.floating), allowed) from None
    return linkage


def mesh_scenes(scene: Scene) -> dict[str, Scene]:
    """Scene of each mesh by name; its effects count the teeth of a gear as the first mesh of the gear does."""
    scenes, begun = {}, scene.geometry.begun(coast=scene.load.coast)
    for name, mesh_scene in scene.meshes.items():
        flanks = {}
        for key in ("effects", "coast"):
            effects = getattr(mesh_scene, key)
            later = (e.later(mesh_scene.pair, begun[name]) if isinstance(e, GapEffect) else e for e in effects)
            flanks[key] = tuple(later)
        same = all(flanks[key] == getattr(mesh_scene, key) for key in flanks)
        scenes[name] = mesh_scene if same else changed(mesh_scene, **flanks)
    return scenes


@single_threaded_blas()
def solve_train(
    scene: Scene, *, alike: bool = False, meshes: Mapping[str, Scene] | None = None, phases: Phases | None = None
) -> SolvedTrain:
    """Solve the contact of all meshes of a ``coupled`` scene (M2).

    Parameters
    ----------
    alike
        Whether to ignore differences between the teeth of a gear.
    meshes
        Scene of each mesh by name, if it differs from ``scene.meshes``.
    phases
        Phases of the first mesh; by default they follow from the resolution of the scene and suit all meshes.

    Raises
    ------
    InputError, ConvergenceError
        Like ``simulate``.
    """
    linkage = check_train(scene)
    assert scene.train is not None
    coast = scene.load.coast
    train, scenes = scene.geometry, dict(meshes or (scene.meshes if alike else mesh_scenes(scene)))
    if phases is None:
        equal = {name: with_equal_teeth(mesh_scene) for name, mesh_scene in scenes.items()} if alike else scenes
        phases = train_phases(equal, train, coast=coast)
    even = np.array([mesh_scene.F_bt for mesh_scene in scenes.values()])
    f = linkage.force(scene.load.torque)
    statics = Statics(rows=linkage.rows, stiffness=linkage.stiffness, force=f, offset=scene.train.offset(linkage))
    contact_at, balanced = _balanced(train, scenes, phases, statics, equal_teeth=alike)
    for _ in range(ROUNDS):
        heavy = balanced.force.max(axis=0) / [mesh.nominal for _, mesh in contact_at.values()]
        # off the line of action the contact lines extend with the load
        far = [mesh_scene.effect("off_line_contact") is not None for mesh_scene in scenes.values()]
        if not np.any(far & (heavy > HEAVIER)):
            break
        share = np.where(heavy > HEAVIER, heavy, 1.0)
        scenes = {name: _under(mesh_scene, by) for (name, mesh_scene), by in zip(scenes.items(), share, strict=True)}
        contact_at, balanced = _balanced(train, scenes, phases, statics, equal_teeth=alike)
    contact_of = {
        name: Solved(
            scene=scenes[name],
            lines=lines,
            weight=phases.weight,
            problem=mesh.problem if field is None else with_field(mesh.problem, field),
            solution=solution,
            at=phases,
        )
        for (name, (lines, mesh)), solution, field in zip(
            contact_at.items(), balanced.solutions, balanced.fields, strict=True
        )
    }
    contacts = tuple(mesh for _, mesh in contact_at.values())
    parts = {"meshes": contact_of, "contacts": contacts, "coupling": balanced.statics, "balance": balanced}
    return SolvedTrain(scene=scene, linkage=linkage, phases=phases, even=even, **parts)


def _balanced(
    train: Train, scenes: Mapping[str, Scene], phases: Phases, statics: Statics, *, equal_teeth: bool
) -> tuple[dict[str, tuple[ContactLines, MeshAt]], Balance]:
    """Contact lines and contact problem of each mesh by name, and the equilibrium of all meshes."""
    coast = next(iter(scenes.values())).load.coast
    shift, phase_of = train.phases(coast=coast), {}
    plain = {name: unnamed(scene) for name, scene in scenes.items()}
    for name, scene in plain.items():
        phase = phases.phase * train.periods[name] / phases.length + shift[name]
        phase_of[name] = phase if tooth_to_tooth_effects(scene) else phase % 1.0
    first_of = {scene: name for name, scene in reversed(plain.items())}

    def first_mesh(scene: Scene) -> list[tuple[ContactLines, MeshAt]]:
        return [_mesh(scene, phase_of[first_of[scene]], equal_teeth)]

    solved_before = dict(zip(first_of, on_threads(first_mesh, first_of, default_threads()), strict=True))
    contact_at = {}
    for name, scene in plain.items():
        others, phase = solved_before[scene], phase_of[name]
        reordered = next((found for other in others if (found := _reordered(other, phase)) is not None), None)
        contact_at[name] = reordered or _mesh(scene, phase, equal_teeth)
        others.append(contact_at[name])
    phases_of_meshes = np.array([lines.mesh_phase for lines, _ in contact_at.values()])
    parts, alike = symmetry.parts(train, list(plain.values()), phases_of_meshes, statics)
    first = contact_at
    if len(parts) > 1:
        positions = slice(len(phases.phase) // len(parts))  # of the first part of the cycle
        # meshes in phase share one contact problem
        known = {id(mesh): replace(mesh, problem=part_of(mesh.problem, positions)) for _, mesh in contact_at.values()}
        first = {name: (lines.part(positions), known[id(mesh)]) for name, (lines, mesh) in contact_at.items()}
    bodies = yielding_bodies(train, scenes, first, coast=coast)
    balanced = balance([mesh for _, mesh in first.values()], statics, bodies, alike.tolist())
    return contact_at, symmetry.whole(balanced, parts, statics)


def unnamed(scene: Scene) -> Scene:
    """The scene without its names, so that scenes of meshes with equal results compare equal."""
    return changed(scene, name="", gear_names=GEARS)


def _under(scene: Scene, share: float) -> Scene:
    """Return the scene under ``share`` times its torque."""
    return scene if share == 1.0 else changed(scene, load=Load(torque=share * scene.load.torque))


def train_phases(scenes: Mapping[str, Scene], train: Train, *, coast: bool) -> Phases:
    """Phases of the first mesh: Gauss points on panels between the contact changes of all meshes.

    ``scenes`` are those of the meshes by name; InputError if they ask for an accuracy.
    """
    first, *_ = scenes.values()
    shift, periods = train.phases(coast=coast), train.periods
    length, most = next(iter(periods.values())), max(periods.values())
    orders = {n * Fraction(count, length) for count in periods.values() for n in range(1, HARMONICS + 1)}
    length_and_orders = {
        "length": length,
        "orders": tuple(float(n) if n.denominator > 1 else int(n) for n in sorted(orders)),
    }
    resolution = first.resolution
    if resolution.accuracy is not None:
        raise InputError(
            "resolution.accuracy",
            resolution.accuracy,
            "of a train is for simulate, sweep and plan: for other commands give segments and gauss_points",
        )
    if resolution.positions is not None:
        phase, weight = uniform_phases(resolution.positions * most)
        return Phases(phase=length * phase, weight=weight, size=None, **length_and_orders)
    exact = (resolution.gauss_points or 0) > GAUSS_POINTS
    close = CLOSER if exact else CLOSE
    changes = []
    plain = {name: changed(unnamed(scene), resolution=Resolution()) for name, scene in scenes.items()}
    different = list(dict.fromkeys(plain.values()))
    found = on_threads(partial(transitions, exact=exact), different, default_threads())
    of_scene = dict(zip(different, found, strict=True))
    for name, scene in plain.items():
        shifted = ((transition, (transition.phase - shift[name]) % 1.0 % 1.0) for transition in of_scene[scene])
        # the same in every mesh period of the cycle
        changes += [
            transition._replace(phase=(phase + p) * most / periods[name] % most)
            for transition, phase in shifted
            for p in range(periods[name])
        ]
    helical = first.pair.meshing.overlap_ratio > 0
    longest = LONGEST if helical else 1.0
    ends = [end / most for end in panel_starts(changes, longest, close, most)]
    # panels that repeat as the meshes do: harmonics that cancel do so in the quadrature too
    parts = _repeats([(unnamed(scene), shift[name], periods[name]) for name, scene in scenes.items()])
    ends = [end + part / parts for part in range(parts) for end in ends if end < 1 / parts]
    own = max(len(panel_starts(of_scene[scene], longest, close)) * periods[name] for name, scene in plain.items())
    points = POINTS_ON_PIECES if helical and len(ends) >= PIECES * own else GAUSS_POINTS
    size = resolution.gauss_points or points
    phase, weight = gauss_phases(ends, size)
    return Phases(phase=length * phase, weight=weight, size=size, **length_and_orders)


def _repeats(meshes: list[tuple[Scene, float, int]]) -> int:
    """Largest n for which ``meshes``, scenes with phases and periods, are the same again after 1/n of the cycle."""

    def after(part: float) -> Counter:
        return Counter((scene, round(1e6 * (phase + part * periods)) % 10**6) for scene, phase, periods in meshes)

    return next(n for n in range(len(meshes), 0, -1) if after(1 / n) == after(0.0))


def _reordered(mesh: tuple[ContactLines, MeshAt], phase: NDArray) -> tuple[ContactLines, MeshAt] | None:
    """The mesh in the order of the phases ``phase``; None if these are not its own."""
    lines, contact = mesh
    if np.abs(lines.mesh_phase - phase).max() <= symmetry.EQUAL:
        return mesh
    order = np.empty(len(phase), dtype=int)
    order[np.argsort(phase)] = np.argsort(lines.mesh_phase)
    if np.abs(lines.mesh_phase[order] - phase).max() > symmetry.EQUAL:
        return None
    return lines.part(order), replace(contact, problem=part_of(contact.problem, order))


def _mesh(scene: Scene, phase: NDArray, alike: bool) -> tuple[ContactLines, MeshAt]:
    """Contact lines and problem of a mesh at its phases; if teeth differ, phases from 1 on belong to the next teeth."""
    lines = scene_lines(scene, phase)
    cos_b = float(np.cos(scene.pair.meshing.beta_b))
    problem = assemble(with_equal_teeth(scene) if alike else scene, lines)
    return lines, MeshAt(problem=problem, nominal=scene.F_bt, cos_b=cos_b)
