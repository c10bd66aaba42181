"""Loss of contact in planetary sets and parallel paths: harmonic balance with forces that follow the motion.

``nonlinear.nonlinear_response`` calls it for such trains. The linear balance (D5) takes forces and stiffnesses of the
meshes at their quasi-static motion. Here it is solved again and again, each time with forces and stiffnesses at the
motion of the previous solution: Newton's method for the orders of the motion. Numbers such as (D5) and (M4) are
equations of docs/theory.md.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearbench.budget import require_each, speed_memory
from gearbench.contact.equilibrium import Statics
from gearbench.contact.phases import uniform_phases
from gearbench.dynamics.analysis import (
    GROWTH_TOLERANCE,
    modal_variables,
    response_dataset,
    spans,
    speed_variables,
    stiffness_over_time,
)
from gearbench.dynamics.balance import Excitation, solve
from gearbench.dynamics.model import Variables
from gearbench.dynamics.size import bearings
from gearbench.dynamics.stability import multipliers
from gearbench.dynamics.steady import Steady
from gearbench.dynamics.train_model import TrainModel, train_model
from gearbench.results.cycle import Phases
from gearbench.scene import Scene
from gearbench.trains.scatter import Curves, curves
from gearbench.trains.solve import check_train

if TYPE_CHECKING:
    import xarray as xr

#: Number of phases in a period of the mesh with the shortest period: for each order, and the minimum.
PHASES_PER_ORDER, LEAST_PHASES = 8, 128
#: Labels of the sweeps, and their names in texts.
SWEEPS = {"up": "rising speed", "down": "falling speed"}
#: A note is written if the RMS forces of the two sweeps differ by more than this share of the mean force.
APART = 0.01
#: Change of the motion in a step, relative to its largest order, at which it is in balance; maximum number of steps.
SETTLED, STEPS = 1e-9, 40
#: Maximum number of times that a step in speed is halved.
HALVINGS = 4
#: Largest force of a mesh, relative to equal sharing, up to which its contact is solved; its curve is linear above.
LARGEST_FORCE = 6.0
#: In ``NonlinearTrain.contact``: maximum number of steps, and residual relative to the largest approach.
LOCAL_STEPS, LOCAL_RESIDUAL = 40, 1e-12


@dataclass(frozen=True, kw_only=True, eq=False)
class NonlinearTrain:
    """A train whose mesh forces follow the motion.

    Parameters
    ----------
    model
        The linear model, at uniform phases.
    curves
        Force of each mesh over approach and phase.
    harmonics
        Number of orders of each mesh frequency.
    """

    model: TrainModel
    curves: Curves
    harmonics: int

    @cached_property
    def quasi_static(self) -> Excitation:
        """Excitation at the quasi-static motion, with its constant loads."""
        # one group holds all meshes, which repeat with a common cycle (``TrainModel.groups``)
        return self.model.excitation(self.model.groups[0], self.harmonics)

    @cached_property
    def _statics(self) -> Statics:
        """Coupling of the meshes; ``offset`` is the part of their approach that does not depend on the forces."""
        return self.model.solved.statics(np.zeros(len(self.model.names)))  # no additional offset

    @cached_property
    def _wave(self) -> NDArray:
        """Matrix (position, order); the real part of its product with the orders of a motion is the motion."""
        phases = self.model.solved.phases
        wave = np.exp(2j * np.pi * np.outer(phases.phase / phases.length, self.quasi_static.orders))
        wave[:, 1:] *= 2.0
        return wave

    def contact(self, x: NDArray) -> tuple[NDArray, NDArray]:
        """Force F [N] and slope ∂F/∂δ [N/mm] of each mesh (position, mesh), at their approaches x [mm].

        x is (position, mesh). If no elastic gear body couples the meshes, the ``curves`` give F at x. If gear bodies do
        (M4), their deflection (C + D) F is a part of the approach. The curves give F at the rest d = x − (C + D) F,
        which Newton's method finds. C is the compliance between the meshes. D is compliance taken out of the curve of
        each mesh and added here (``Statics.shifted``), so that C + D has no negative eigenvalue. The slope of a mesh
        contains D, but not C, which the model adds (``TrainModel.excitation_by``).
        """
        statics = self._statics
        x = x + statics.offset
        if statics.between is None:
            F, k = self._on_curves(x)
            return F, np.where(F > 0, k, 0.0)
        D = np.broadcast_to(statics.shifted, x.shape)
        C = statics.between + D[..., None] * np.eye(x.shape[1])
        d, allowed = x - (C @ self.model.solved.balance.force[..., None])[..., 0], LOCAL_RESIDUAL * np.abs(x).max()
        F, k = self._on_curves(d)
        for _ in range(LOCAL_STEPS):
            residual = x - d - (C @ F[..., None])[..., 0]
            if np.abs(residual).max() <= allowed:
                break
            d = d + np.linalg.solve(np.eye(x.shape[1]) + C * k[:, None], residual[..., None])[..., 0]
            F, k = self._on_curves(d)
        return F, np.where(F > 0, k / (1 + D * k), 0.0)

    def _on_curves(self, approach: NDArray) -> tuple[NDArray, NDArray]:
        """Force [N] and slope [N/mm] of the curves at the approach [mm], all (position, mesh)."""
        F, k = self.curves(approach[None])
        return F[0], k[0]

    def excitation(self, motion: NDArray) -> tuple[Excitation, NDArray]:
        """Excitation about a motion with the orders ``motion`` (mesh, order), and its mesh forces (position, mesh)."""
        model, x = self.model, np.real(self._wave @ motion.T)
        F, k = self.contact(x)
        return model.excitation_by(model.groups[0], self.harmonics, x, F, k), F

    def settle(self, h: NDArray, motion: NDArray) -> tuple[NDArray, Excitation, NDArray] | None:
        """Newton's method from ``motion``: motion in balance, excitation and forces there; None if it fails.

        ``h`` (1, order, mesh, mesh) is the receptance at the speed. A step larger than the one before is halved.
        """
        mean, before = self.model.stiffness, math.inf
        for _ in range(STEPS):
            excitation, F = self.excitation(motion)
            (balanced,), _ = solve(excitation, h, mean, self.quasi_static)
            step = balanced - motion
            change = float(np.abs(step).max() / np.abs(motion).max())
            if change <= SETTLED:
                return motion, excitation, F
            motion = motion + (step if change < before else step / 2)
            before = change
        return None

    def reach(
        self, speed: float, start: tuple[float, NDArray], halvings: int = HALVINGS
    ) -> tuple[NDArray, Excitation, NDArray] | None:
        """``settle`` at a speed, from the ``start`` (another speed and its motion); a step that fails is halved."""
        previous, motion = start
        h = self.model.receptances(self.model.groups[0], np.array([speed]), self.harmonics)
        settled = self.settle(h, motion)
        if settled is not None or halvings == 0 or speed == previous:
            return settled
        middle = (previous + speed) / 2
        at_middle = self.reach(middle, start, halvings - 1)
        return None if at_middle is None else self.reach(speed, (middle, at_middle[0]), halvings - 1)

    def growth(self, excitation: Excitation, speed: float) -> float:
        """Largest Floquet multiplier of small motions about the motion that gives this ``excitation``."""
        model, (group,) = self.model, self.model.groups
        omega, stiffness = model.omega(group, np.array([speed])), stiffness_over_time(excitation)
        return float(multipliers(model.modes, np.arange(len(model.names)), omega, stiffness[None])[0])

    def over(self, speeds: NDArray, sequence: NDArray) -> Variables:
        """Variables over ``speeds``, in the ``sequence`` of their indices.

        The search at each speed starts from the motion at the previous speed. If it finds no motion or an unstable one,
        it starts again from the quasi-static motion. Unstable motions become NaN in ``speed_variables``.
        """
        model, (group,), motion = self.model, self.model.groups, self.quasi_static.motion
        orders, count = self.quasi_static.orders, len(self.model.names)
        equivalent = np.zeros((len(speeds), count, len(orders)), dtype=complex)
        touching = np.zeros((len(speeds), count), dtype=bool)
        stability, static, mean = np.full((len(speeds), count), np.nan), self.quasi_static, model.stiffness
        previous_speed = float(speeds[sequence[0]])
        for s in sequence:
            speed, chosen = float(speeds[s]), None
            for start in (previous_speed, motion), (speed, static.motion):
                if (settled := self.reach(speed, start)) is None:
                    continue
                chosen, stability[s] = settled, self.growth(settled[1], speed)
                if stability[s, 0] <= 1 + GROWTH_TOLERANCE:
                    break
            previous_speed = speed
            if chosen is None:
                equivalent[s], motion = np.nan, static.motion
                continue
            motion, excitation, F = chosen
            equivalent[s] = excitation.force - mean @ motion
            # without the constant part that is in equilibrium with the load
            equivalent[s, :, 0] -= static.force[:, 0] - mean @ static.motion[:, 0]
            touching[s] = (F > 0).all(axis=0)
        steady = Steady(
            index=orders[:, None],
            omega=model.omega(group, speeds)[:, None] * orders,
            equivalent_force=equivalent,
            residual=np.zeros(len(speeds)),
        )
        variables = speed_variables(model, speeds, self.harmonics, (steady, stability))
        return variables | {"contact_kept": (("speed", "mesh"), touching)}


def nonlinear_train_response(scene: Scene, speeds: NDArray, harmonics: int) -> xr.Dataset:
    """Response of a ``coupled`` scene with loss of contact, as the speed rises and as it falls.

    Only motions that repeat with the mesh cycle are sought. Where such a motion is unstable, or none is found, the
    response is NaN.

    Raises
    ------
    InputError, ConvergenceError
        As ``response``.
    """
    start, scene = time.perf_counter(), scene.single_load
    periods = tuple(check_train(scene).train.periods.values())
    phase, weight = uniform_phases(max(LEAST_PHASES, PHASES_PER_ORDER * harmonics) * max(periods))
    phases = Phases(phase=periods[0] * phase, weight=weight, size=None, length=periods[0])
    model = train_model(scene, phases)
    orders = len(model.groups[0].orders(harmonics))
    speed_bytes = speed_memory(orders, len(model.names), bearings(scene))
    require_each(speed_bytes, len(SWEEPS) * len(speeds), "speed", f"{harmonics} orders")
    train = NonlinearTrain(model=model, curves=curves(model.solved, LARGEST_FORCE), harmonics=harmonics)
    order = np.argsort(speeds, kind="stable")
    up, down = (train.over(speeds, direction) for direction in (order, order[::-1]))
    variables: Variables = {
        name: (("sweep", *dims), np.stack([values, down[name][1]])) if dims[:1] == ("speed",) else (dims, values)
        for name, (dims, values) in up.items()
    }
    variables |= modal_variables(model, speeds, harmonics)
    lines = [*model.remarks(speeds, harmonics), *_remarks(model, speeds, variables)]
    labels = {"sweep": list(SWEEPS), "harmonic": model.harmonics(harmonics)}
    return response_dataset(model, speeds, variables, lines, start, **labels)


def _remarks(model: TrainModel, speeds: NDArray, variables: Variables) -> list[str]:
    """Notes for the reader of the sweeps, one line each."""
    lines = ["back flanks: their contact is left out; subharmonic motions are not searched for"]
    names = "contact_kept", "floquet_multiplier", "mesh_force_rms"
    kept, growth, rms = (variables[name][1] for name in names)
    for sweep, is_kept, grows, force in zip(SWEEPS.values(), kept, growth, rms, strict=True):
        missing, unstable = np.isnan(force).all(axis=1), (grows > 1 + GROWTH_TOLERANCE).any(axis=1)
        for where, text in (
            (unstable, "the motion that repeats with the mesh cycle is unstable"),
            (missing & ~unstable, "no motion that repeats with the mesh cycle was found"),
        ):
            lines += [f"{sweep}: {text} at {spans(speeds, where)} 1/min"] if where.any() else []
        for name, parted in zip(model.names, (~is_kept & ~missing[:, None]).T, strict=True):
            lines += [f"{sweep}: flanks of {name} separate at {spans(speeds, parted)} 1/min"] if parted.any() else []
    return lines + note_differing_sweeps(speeds, rms, model.force)


def note_differing_sweeps(speeds: NDArray, rms: NDArray, mean: NDArray) -> list[str]:
    """Note on the speeds at which rising and falling speed give different responses, if there are any.

    ``rms`` is that of the mesh forces (sweep, speed, mesh) [N], ``mean`` their mean (mesh,) [N].
    """
    differ = (np.abs(rms[0] - rms[1]) > APART * mean).any(axis=1)
    text = f"rising and falling speed give different responses at {spans(speeds, differ)} 1/min"
    return [text] if differ.any() else []
