"""What every solution of a contact problem holds, and the same pair with the wheel driving."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gearbench.contact.problem import ContactSolution
from gearbench.geometry.pair import Pair
from gearbench.scene import Load, Scene
from tests.support.gears import swapped


def assert_solved(s: ContactSolution, what: object = "", residual: float = 1e-9, steps: int = 40) -> None:
    """Finite, P ≥ 0, k > 0, residuals and Newton steps below a limit."""
    for values in (s.force, s.approach, s.stiffness):
        assert np.all(np.isfinite(values)), what
    assert s.force.min() >= 0, what
    assert s.stiffness.min() > 0, what
    assert s.equilibrium.max() <= residual, what
    assert s.complementarity.max() <= residual, what
    assert s.iterations.max() <= steps, what


def wheel_drives(scene: Scene) -> tuple[Scene, float]:
    """The scene seen from the wheel, and the rigid offset [mm] by which its δ is less.

    Helix slopes are zero at the other end of the face. Raises ValueError at a limit of the input, where rounding
    decides whether the pair is refused.
    """
    pair, effects, offset = scene.pair, [], 0.0
    for effect in scene.effects:
        if effect.name == "helix_slope":
            offset += 1e-3 * (effect.pinion + effect.wheel)
            effect = replace(effect, pinion=-effect.wheel, wheel=-effect.pinion)
        effects.append(effect)
    torque = scene.load.torque * pair.wheel.teeth / pair.pinion.teeth
    return replace(scene, pair=swapped(pair), effects=tuple(effects), load=Load(torque=torque)), offset


def mirrored(pair: Pair, phases: NDArray) -> NDArray:
    """Phase of the swapped pair at which the same lines touch, seen from the other end of path and face.

    u′ = T₁T₂ − u, y′ = b − y and u = u_A + (τ + k) p_bt + y tan β_b give τ′ ≡ ε_α − ε_β − τ.
    """
    return (pair.meshing.transverse_contact_ratio - pair.meshing.overlap_ratio - phases) % 1.0
