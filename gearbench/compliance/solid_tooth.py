"""Tooth of a gear as a three-dimensional solid, clamped at its root circle, by the Ritz method.

The load acts on the flank, along the line of action. ``measured_at`` chooses the displacement counted as deflection:

- "smooth": the displacement of the loaded flank less the compression that a contact law already counts
  (``gearbench.compliance.local``). With a law of the Weber–Banaschek kind the sum is the displacement of the flank.
- "mid": the displacement of the point where the line of action crosses the centre line, as in plate models; the
  resulting matrix is made symmetric.
- "flank": the displacement of the loaded flank itself. Under a point load it grows without bound with the order.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gearbench.budget import require, ritz_memory
from gearbench.compliance.bases import axis_functions, gauss, legendre_functions
from gearbench.compliance.flank import FlankCompliance
from gearbench.compliance.local import flank_functions, half_space_compression, waves_across
from gearbench.compliance.outline import roll_angles, tooth_outline
from gearbench.compliance.rooted import RootParts, root_parts
from gearbench.compliance.section import ToothSection
from gearbench.compliance.solid import Functionals, Solid
from gearbench.geometry.gear import Gear
from gearbench.threads import lazy

#: Eigenvalues of the compliance below this fraction of the largest count as rounding.
RANK_TOLERANCE = 1e-10
#: Polynomials along the axis that join a root to its body: ``ROOT_AXIS_ORDER``, and another one for every ``ROOT_STEP``
#: modules of face width, or every ``ROOT_STEP_WIDE`` if the face is wider than ``WIDE`` modules. Six alone make the
#: peak-to-peak STE of helical gears 20 modules wide a tenth too small. With steps of five modules, shapes of deflection
#: on wide gears reach only a MAC of 0.97.
ROOT_AXIS_ORDER, ROOT_STEP, ROOT_STEP_WIDE, WIDE = 6, 5.0, 3.0, 15.0


@dataclass(frozen=True, kw_only=True)
class SolidTooth:
    """A tooth loaded on its right flank; ``flank`` is its compliance.

    Parameters
    ----------
    gear
        The gear.
    E, nu
        Young's modulus [N/mm²] and Poisson's ratio.
    order
        Numbers of functions across the thickness, along the height, along the face width, of each displacement.
    measured_at
        Displacement counted as deflection: "smooth", "mid" or "flank", see the module.
    rooted
        Whether the tooth will be joined to a body. One system, with moving root, then serves for tooth and joint.
    heights
        Number of polynomials in R onto which loads and displacements are projected, by default min(5, order[1]);
        in y as many as the tooth has, but at most ``waves_across``.
    """

    gear: Gear
    E: float
    nu: float
    order: tuple[int, int, int] = (4, 5, 5)
    measured_at: Literal["smooth", "mid", "flank"] = "smooth"
    rooted: bool = False
    heights: int | None = None

    @lazy
    def solid(self) -> Solid:
        """The Ritz system of the tooth held at its root circle."""
        return self.build(free=False)

    def build(self, *, free: bool) -> Solid:
        """A new Ritz system, with held or moving root; not cached, because it takes megabytes at high order.

        Raises
        ------
        MemoryBudgetError
            If it exceeds the memory budget.
        """
        gear, (across, along, axis) = self.gear, self.order
        functions = 3 * across * (along + free)
        # right-hand sides of a class: loads of the flank, and half of the motions of the root
        sides = math.prod(self.flank_order) + free * 1.5 * across * self.root_axis_order
        need = ritz_memory(functions, sides, helical=bool(gear.beta))
        require(need, "effects.tooth_bending.order", list(self.order), "a lower order would fit")
        r_f = gear.root_radius
        section = ToothSection(
            height=gear.tooth_height,
            half_width=lambda x: (r_f + x) * gear.half_angle(r_f + x),
            root_radius=r_f,
            screw=math.tan(gear.beta) / gear.pitch_radius,
            order=(across, along),
            joint=gear.form_radius - r_f,
            free=free,
            outline=partial(tooth_outline, gear),
            root_half_width=r_f * gear.root_half_angle,
        )
        return Solid(section=section, width=gear.face_width, E=self.E, nu=self.nu, order=axis)

    @property
    def condition(self) -> float:
        """Largest condition number of the scaled blocks."""
        return self.solid.condition

    @property
    def flank_order(self) -> tuple[int, int]:
        """Numbers of polynomials in R and y."""
        return self.heights or min(5, self.order[1]), min(self.order[2], waves_across(self.gear))

    @property
    def root_axis_order(self) -> int:
        """Number of polynomials along the axis that join the root to a body."""
        width = self.gear.face_width / self.gear.normal_module
        return min(self.order[2], ROOT_AXIS_ORDER + int(width / (ROOT_STEP_WIDE if width > WIDE else ROOT_STEP)))

    @lazy
    def matrix(self) -> NDArray:
        """Compliance [mm/N] between the polynomials of the flank, (p·q, p·q), with all its eigenvalues (S5, L3)."""
        if self.rooted and self.measured_at == "smooth":
            clamped = self.root_parts(self.root_axis_order).held
            return clamped - half_space_compression(self.gear, self.E, self.nu, self.flank_order)
        solid = self.build(free=False)
        flank = self.flank_functionals(solid)
        if self.measured_at == "mid":
            middle = self._functionals(solid, self._middle_rows(solid))
            n = len(flank.rows) * len(flank.along)
            both = Functionals(rows=np.concatenate([flank.rows, middle.rows]), along=flank.along)
            mixed = solid.compliance(both)[:n, n:]
            return (mixed + mixed.T) / 2
        compliance = solid.compliance(flank)
        if self.measured_at == "flank":
            return compliance
        return compliance - half_space_compression(self.gear, self.E, self.nu, self.flank_order)

    def root_parts(self, count: int) -> RootParts:
        """Stiffness against motions of the root, ``count`` polynomials in z, and the flank with the root held."""
        if count not in self._root_parts:
            solid = self.build(free=True)
            self._root_parts[count] = root_parts(solid, self.flank_functionals(solid), count)
        return self._root_parts[count]

    @lazy
    def _root_parts(self) -> dict[int, RootParts]:
        return {}

    @lazy
    def flank(self) -> FlankCompliance:
        """Compliance of the flank of a driving gear."""
        return FlankCompliance(
            gear=self.gear,
            order=self.flank_order,
            blocks=self.matrix[None],
            rank_tolerance=RANK_TOLERANCE,
        )

    def flank_functionals(self, solid: Solid) -> Functionals:
        """Normal displacement of the flank weighted with its polynomials, of R and of y."""
        return self._functionals(solid, self._flank_rows(solid))

    def _functionals(self, solid: Solid, rows: NDArray) -> Functionals:
        """Functionals of all polynomials of the flank, from ``rows`` (p, 3, n_s, n_x) of the polynomials in R."""
        p, q = self.flank_order
        along = _axis_projection(q, solid.order) * math.sqrt(self.gear.face_width)
        return Functionals(rows=rows.reshape(p, -1), along=along)

    @lazy
    def _stations(self) -> tuple[NDArray, NDArray, NDArray]:
        """Roll angles t = tan α_R, radii, and polynomials of R times weights there."""
        gear, p = self.gear, self.flank_order[0]
        # R and α_R have a branch point on the base circle, in t they have none
        t, weight = gauss(self.order[1] + p + 12, *roll_angles(gear))
        R = gear.base_radius * np.sqrt(1 + t**2)
        weight = weight * gear.base_radius**2 * t / R
        return t, R, flank_functions(p, R, gear.form_radius, gear.tip_radius) * weight[:, None]

    def _flank_rows(self, solid: Solid) -> NDArray:
        """Functionals of the normal displacement of the flank s = 1; its profile is at the angle α_R to the radius."""
        t, R, functions = self._stations
        return self._rows(solid, R, functions, np.arctan(t), 1.0)

    def _middle_rows(self, solid: Solid) -> NDArray:
        """Functionals of the displacement along the same normal at its point of the centre line, R = r_b / cos γ."""
        _, R, functions = self._stations
        gamma = self.gear.load_angle(R)
        return self._rows(solid, self.gear.base_radius / np.cos(gamma), functions, gamma, 0.0)

    def _rows(self, solid: Solid, R: NDArray, functions: NDArray, angle: NDArray, s: float) -> NDArray:
        """∫ φ_a(R) n · u dR, (p, 3, n_s, n_x); n at ``angle`` to θ, inclined out of the section by β_b."""
        cos_b, sin_b = math.cos(self.gear.beta_b), math.sin(self.gear.beta_b)
        normal = np.stack([-np.cos(angle) * cos_b, -np.sin(angle) * cos_b, np.full(R.shape, sin_b)])
        values = solid.section.values(R - self.gear.root_radius, s)
        rows = functions.T @ (normal[:, :, None] * values.reshape(len(R), -1))
        return rows.swapaxes(0, 1).reshape(-1, 3, *values.shape[1:])


@lru_cache(maxsize=64)
def _axis_projection(count: int, order: int) -> NDArray:
    """∫ P̂_j h_k dη of the polynomials in y and the Ritz functions, (count, order)."""
    eta, weight = gauss(order + 2)
    along = (legendre_functions(count, eta) * weight[:, None]).T @ axis_functions(order, eta)[0]
    along[np.abs(along) <= 1e-14] = 0.0
    along.flags.writeable = False
    return along
