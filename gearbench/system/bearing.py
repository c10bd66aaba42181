"""Bearings of a shaft: constant stiffness, load–deflection curves, or rolling bearings by their dimensions."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from pydantic.dataclasses import dataclass

from gearbench.errors import InputError
from gearbench.schema import STRICT
from gearbench.system.body import BodyNode
from gearbench.system.rolling import Rolling

#: Conversion factors: N/µm to N/mm, N·m to N·mm.
PER_MICROMETRE, METRE = 1e3, 1e3
Stiffness = Annotated[float, Field(ge=0.0, le=1e12)]
PositiveValues = tuple[Annotated[float, Field(gt=0.0)], ...]


@dataclass(frozen=True, kw_only=True, config=STRICT)
class LoadDeflection:
    """Load over deflection, through the origin, the same in both directions; linear between the points and beyond.

    Parameters
    ----------
    deflection
        Deflections, ascending [µm].
    load
        Loads, ascending [N].
    """

    deflection: PositiveValues
    load: PositiveValues

    def __post_init__(self) -> None:
        if len(self.load) != len(self.deflection) or not self.load:
            raise InputError(
                "load", f"{len(self.load)} values", f"must be as many as deflections, {len(self.deflection)}"
            )
        for key in ("deflection", "load"):
            if np.any(np.diff(getattr(self, key)) <= 0):
                raise InputError(key, list(getattr(self, key)), "must ascend")

    def at(self, deflection: float) -> tuple[float, float]:
        """Load [N] at a ``deflection`` ≥ 0 [mm], and the slope of the curve [N/mm]."""
        x, F = np.array([0.0, *self.deflection]) / PER_MICROMETRE, np.array([0.0, *self.load])
        k = min(int(np.searchsorted(x, deflection, side="right")), len(x) - 1)
        slope = (F[k] - F[k - 1]) / (x[k] - x[k - 1])
        return float(F[k - 1] + slope * (deflection - x[k - 1])), float(slope)


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Bearing:
    """A bearing on the ground or a body: stiffness values, a matrix, curves, or a rolling bearing.

    Parameters
    ----------
    position
        Position on the shaft [mm].
    name
        Name in results; by default shaft and number.
    radial_stiffness, axial_stiffness
        Stiffness [N/µm].
    tilting_stiffness
        Stiffness about both transverse axes [N·m/mrad].
    matrix
        Symmetric 5 × 5 stiffness against (x, y, axial, tilt about x, tilt about y) [N/mm, N, N·mm].
    radial_curve, axial_curve
        Load over deflection.
    rolling
        Dimensions of a rolling bearing.
    damping
        Radial and axial viscous damping [N·s/m].
    on
        Node of a body that carries the outer ring; by default the ground.
    """

    position: Annotated[float, Field(ge=0.0, le=50000.0)]
    name: str = ""
    radial_stiffness: Stiffness | None = None
    axial_stiffness: Stiffness | None = None
    tilting_stiffness: Stiffness | None = None
    matrix: tuple[tuple[float, ...], ...] | None = None
    radial_curve: LoadDeflection | None = None
    axial_curve: LoadDeflection | None = None
    rolling: Rolling | None = None
    damping: Annotated[float, Field(ge=0.0)] = 0.0
    on: BodyNode | None = None

    def __post_init__(self) -> None:
        springs = any(k is not None for k in (self.radial_stiffness, self.axial_stiffness, self.tilting_stiffness))
        curves = self.radial_curve is not None or self.axial_curve is not None
        kinds = [
            name
            for name, given in (
                ("rolling", self.rolling is not None),
                ("matrix", self.matrix is not None),
                ("stiffness values or curves", springs or curves),
            )
            if given
        ]
        if len(kinds) != 1:
            given = " and ".join(kinds) or "nothing"
            raise InputError("rolling", f"{given} given", "give one of rolling, matrix, stiffness values or curves")
        for name in ("radial", "axial"):
            if getattr(self, f"{name}_stiffness") is not None and getattr(self, f"{name}_curve") is not None:
                raise InputError(f"{name}_curve", "given", f"conflicts with {name}_stiffness: give one of the two")
        if self.matrix is not None:
            K = self.matrix
            if len(K) != 5 or any(len(row) != 5 for row in K):
                raise InputError("matrix", f"{len(K)} rows", "must be 5 × 5: x, y, axial, tilt about x, tilt about y")
            values = np.array(K)
            if not np.allclose(values, values.T) or np.linalg.eigvalsh(values)[0] < -1e-9 * np.abs(values).max():
                raise InputError("matrix", "given", "must be symmetric, with no negative eigenvalue")

    @property
    def is_linear(self) -> bool:
        """Whether the stiffness is independent of the load."""
        return self.rolling is None and self.radial_curve is None and self.axial_curve is None

    def force(self, q: NDArray) -> tuple[NDArray, NDArray]:
        """Force F (5,) [N, N·mm] for the relative motion q = (u_x, u_y, u_z, φ_x, φ_y) of the rings, and ∂F/∂q."""
        if self.rolling is not None:
            return self.rolling.force(q)
        if self.matrix is not None:
            K = np.array(self.matrix, dtype=float)
            return K @ q, K
        radial, axial = PER_MICROMETRE * (self.radial_stiffness or 0.0), PER_MICROMETRE * (self.axial_stiffness or 0.0)
        # 1 N·m/mrad = 1e6 N·mm/rad
        tilt = 1e6 * (self.tilting_stiffness or 0.0)
        K = np.diag([radial, radial, axial, tilt, tilt])
        F = K @ q
        if self.radial_curve is not None:
            r = float(np.hypot(q[0], q[1]))
            load, slope = self.radial_curve.at(r)
            secant = load / r if r > 0 else slope
            e = q[:2] / r if r > 0 else np.array([1.0, 0.0])
            ee = np.outer(e, e)
            # slope of the curve along the displacement, load over deflection across it
            F[:2], K[:2, :2] = secant * q[:2], slope * ee + secant * (np.eye(2) - ee)
        if self.axial_curve is not None:
            load, slope = self.axial_curve.at(abs(float(q[2])))
            F[2], K[2, 2] = np.sign(q[2]) * load, slope
        return F, K
