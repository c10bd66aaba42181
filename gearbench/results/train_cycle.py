"""Mesh cycle of a train whose meshes form one contact problem: its curves and metrics."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearbench.errors import InputError
from gearbench.results.cycle import HARMONICS, MICROMETRES, CycleCurve, Phases, coefficients, mean

if TYPE_CHECKING:
    from gearbench.geometry.linkage import Linkage


@dataclass(frozen=True, kw_only=True, eq=False)
class TrainCycle:
    """Forces and motions of a train over one mesh cycle, or over those of many samples at the same phases.

    Parameters
    ----------
    linkage
        Coupling of the meshes.
    phases
        Phases of the first mesh.
    force, even
        F_bt of the meshes, (…, position, mesh) [N], and the same with equal load sharing, (mesh,) [N].
    motion
        Free motions q, (…, position, motion) [mm; rad].
    input_stiffness
        Torque on the input per angle of the input, without errors, (position,) [N·mm/rad].
    """

    linkage: Linkage
    phases: Phases
    force: NDArray
    even: NDArray
    motion: NDArray
    input_stiffness: NDArray

    @property
    def sharing(self) -> NDArray:
        """Force of the meshes over that with equal load sharing, (…, position, mesh)."""
        return self.force / self.even

    @property
    def input_turn(self) -> NDArray:
        """Additional angle of the input, compared with rigid gears without errors, (…, position) [rad]."""
        return self.linkage.sense * self.motion[..., self.linkage.input]

    @property
    def transmission_error(self) -> NDArray:
        """Transmission error Δ on the base circle of the first driver, (…, position) [µm]."""
        return MICROMETRES * self.linkage.train.meshes[0].pair.gears[0].base_radius * self.input_turn

    def radial_force(self, member: str) -> NDArray:
        """Resultant radial mesh force on a member, x + iy, (…, position) [N]."""
        on = self.linkage.on_bodies(self.force)[..., self._body(member), :]
        return on[..., 0] + 1j * on[..., 1]

    def radial_motion(self, member: str) -> NDArray:
        """Radial motion of a member, x + iy, (…, position) [µm]; 0 if it cannot move."""
        displacement = self.motion @ self.linkage.moved[:, self._body(member)]
        return MICROMETRES * (displacement[..., 0] + 1j * displacement[..., 1])

    @property
    def carrier_torque(self) -> NDArray:
        """Fluctuating torque on the carrier if input and output turn uniformly, (…, position) [N·m].

        The static solution has a constant torque and a varying Δ. If the inertias are too large to follow Δ at the mesh
        frequency, the torque varies instead, by k (Δ̄ − Δ) to first order, with the stiffness k of the set without
        errors.
        """
        self._body("carrier")
        k, turn = self.input_stiffness * self.phases.weight, self.input_turn
        mean = (turn @ k / k.sum())[..., None]
        ratio = 1 + 1 / abs(self.linkage.rates[self.linkage.ends[1]])
        return 1e-3 * ratio * self.input_stiffness * (mean - turn)

    def _body(self, member: str) -> int:
        if member not in self.linkage.bodies:
            raise InputError("planetary", "missing", f"forces and torques on {member} are for planetary sets")
        return self.linkage.bodies.index(member)


#: Function of a cycle that returns a curve (…, position) or a number (…).
Curve = Callable[[TrainCycle], NDArray]


def _rms(curve: Curve, cycle: TrainCycle) -> NDArray:
    """RMS of the deviation from the mean; for a vector x + iy, of the length of the deviation."""
    values, weight = curve(cycle), cycle.phases.weight
    return np.sqrt(mean(np.abs(values - mean(values, weight)[..., None]) ** 2, weight))


def _amplitude(curve: Curve, n: int, cycle: TrainCycle) -> NDArray:
    """Amplitude of a harmonic; for a vector x + iy, the semi-major axis of the ellipse that the harmonic traces."""
    values = curve(cycle)
    forward, backward = (np.abs(coefficients(cycle.phases, x, n)[..., -1]) for x in (values, np.conj(values)))
    return forward + backward


#: Curve of a train → unit, symbol, meaning, and function of the cycle.
CURVES: Mapping[str, tuple[str, str, str, Curve]] = MappingProxyType(
    {
        "train_transmission_error": ("µm", "Δ", "transmission error of the train", lambda c: c.transmission_error),
        "sun_force": ("N", "F_s", "resultant of the mesh forces on the sun", lambda c: c.radial_force("sun")),
        "ring_force": ("N", "F_r", "resultant of the mesh forces on the ring", lambda c: c.radial_force("ring")),
        "sun_motion": ("µm", "u_s", "motion of the sun across its axis", lambda c: c.radial_motion("sun")),
        "carrier_torque": (
            "N·m",
            "T_c",
            "torque on the carrier where input and output turn uniformly",
            lambda c: c.carrier_torque,
        ),
    }
)


def _of_curves() -> Iterator[tuple[str, str, str, str, Curve]]:
    for name, (unit, symbol, words, curve) in CURVES.items():
        rms = partial(_rms, curve)
        yield f"{name}_rms", unit, f"RMS {symbol}", f"RMS of the fluctuation of the {words}", rms
        for n in range(1, HARMONICS + 1):
            size = partial(_amplitude, curve, n)
            yield f"{name}_amplitude_{n}", unit, f"|{symbol},{n}|", f"amplitude of harmonic {n} of the {words}", size


_Δ = "transmission error of the train"
#: Scalar metrics of a train: name, unit, symbol, meaning, and function of the cycle.
NUMBERS: tuple[tuple[str, str, str, str, Curve], ...] = (
    (
        "mesh_load_factor",
        "1",
        "K_γ",
        "largest force of a mesh over that where all paths share alike",
        lambda c: c.sharing.max(axis=(-2, -1)),
    ),
    ("mesh_load_greatest", "N", "max F_bt", "largest force of a mesh", lambda c: c.force.max(axis=(-2, -1))),
    (
        "train_transmission_error_mean",
        "µm",
        "mean Δ",
        f"mean {_Δ}",
        lambda c: mean(c.transmission_error, c.phases.weight),
    ),
    (
        "train_transmission_error_peak_to_peak",
        "µm",
        "PP Δ",
        f"peak-to-peak {_Δ}",
        lambda c: CycleCurve(phases=c.phases, values=c.transmission_error).peak_to_peak,
    ),
    *_of_curves(),
)
#: Default responses of ``simulate`` and ``robust``.
USUAL_OF_TRAIN = ("mesh_load_factor", *(f"train_transmission_error_{part}" for part in ("mean", "rms", "peak_to_peak")))
