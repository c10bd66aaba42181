"""Rolling bearings from their inner or catalogue dimensions: loads on balls and rollers.

The inner ring moves by q = (u_x, u_y, u_z, φ_x, φ_y) relative to the outer ring. The force on it and its derivative
follow from the elastic energy of the contacts (W5), (W6). Source: ISO/TS 16281:2008.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from pydantic.dataclasses import dataclass

from gearbench.errors import InputError
from gearbench.schema import STRICT

Dimension = Annotated[float, Field(gt=0.0, le=5000.0)]
#: Number of laminae of a roller; the standard requires at least 30.
LAMINAE = 40
#: Stiffness of a line contact of steel, Q/δ^(10/9) over length^(8/9) [N/mm²].
LINE_CONTACT = 35948.0
#: Static capacity [N] of radial ball bearings divided by i Z D_w²: f_0 of ISO 76, from the middle of its table.
_BALL_CAPACITY = 13.5
#: Angle that the balls of a deep groove bearing fill during assembly [rad].
_FILLED = math.radians(186.0)
#: Largest number of balls or rollers of a bearing.
MOST_ELEMENTS = 500
#: Elastic constants of bearing steel in the standard: E [N/mm²] and ν.
YOUNGS_MODULUS, POISSON_RATIO = 207e3, 0.3


@dataclass(frozen=True, kw_only=True, config=STRICT)
class Rolling:
    """A rolling bearing; missing inner dimensions are estimated from the catalogue.

    Parameters
    ----------
    kind
        Kind of bearing.
    bore, outside, width
        d, D and B of the catalogue [mm].
    static_capacity
        C_0r of the catalogue [kN], for the number of balls.
    elements, element_diameter, pitch_diameter, roller_length
        Z, D_w, D_pw and effective length L_we [mm].
    contact_angle
        α_0 [°].
    carries
        Axial direction of the push that a bearing with contact angle carries: "forward" is towards greater positions.
    clearance
        Radial clearance s as mounted [µm]; negative: preload.
    preload
        Axial displacement of the outer ring against the load that it carries [µm].
    inner_conformity, outer_conformity
        Groove radii over the ball diameter.
    floating
        Whether the outer ring slides in the housing and carries no axial load.
    """

    kind: Literal["deep_groove_ball", "angular_contact_ball", "cylindrical_roller", "tapered_roller"]
    bore: Dimension | None = None
    outside: Dimension | None = None
    width: Dimension | None = None
    static_capacity: Annotated[float, Field(gt=0.0)] | None = None
    elements: Annotated[int, Field(ge=3, le=MOST_ELEMENTS)] | None = None
    element_diameter: Dimension | None = None
    pitch_diameter: Dimension | None = None
    roller_length: Dimension | None = None
    contact_angle: Annotated[float, Field(ge=0.0, le=60.0)] | None = None
    carries: Literal["forward", "backward"] = "forward"
    clearance: Annotated[float, Field(ge=-100.0, le=1000.0)] = 0.0
    preload: Annotated[float, Field(ge=0.0, le=1000.0)] = 0.0
    inner_conformity: Annotated[float, Field(gt=0.5, le=0.7)] = 0.52
    outer_conformity: Annotated[float, Field(gt=0.5, le=0.7)] = 0.53
    floating: bool = False

    def __post_init__(self) -> None:
        missing = self.element_diameter is None or self.pitch_diameter is None
        if missing and (self.bore is None or self.outside is None):
            allowed = "give element_diameter and pitch_diameter, or bore and outside"
            raise InputError("pitch_diameter", "missing", allowed)
        if self.bore is not None and self.outside is not None and self.bore >= self.outside:
            raise InputError("bore", self.bore, f"must be less than outside, {self.outside:g} mm")
        if not self.is_ball and self.roller_length is None and self.width is None:
            raise InputError("roller_length", "missing", "give roller_length, or the width of the bearing")
        if self.D_w >= self.D_pw:
            raise InputError("element_diameter", self.D_w, f"must be less than pitch_diameter, {self.D_pw:g} mm")
        if self.angled and self.alpha == 0:
            raise InputError("contact_angle", 0.0, f"must be above 0 for {self.kind}")
        most = 1e-3 * MOST_ELEMENTS * self._ball_capacity
        if self.is_ball and self.static_capacity is not None and self.static_capacity > most:
            allowed = f"must be at most {most:.4g} kN, of {MOST_ELEMENTS} balls of {self.D_w:.4g} mm"
            raise InputError("static_capacity", self.static_capacity, allowed)

    @property
    def is_ball(self) -> bool:
        """Whether the bearing has balls (point contacts)."""
        return self.kind.endswith("ball")

    @property
    def angled(self) -> bool:
        """Whether the bearing carries axial load in only one direction."""
        return self.kind in ("angular_contact_ball", "tapered_roller")

    @property
    def D_w(self) -> float:
        """Diameter of balls or rollers [mm]: given, or the usual fraction of D − d for the kind."""
        if self.element_diameter is not None:
            return self.element_diameter
        outside, bore = self._rings
        share = {"deep_groove_ball": 0.30, "angular_contact_ball": 0.30}.get(self.kind, 0.27)
        return share * (outside - bore)

    @property
    def D_pw(self) -> float:
        """Pitch diameter [mm]: given, or the mean of bore and outside diameter."""
        if self.pitch_diameter is not None:
            return self.pitch_diameter
        outside, bore = self._rings
        return (outside + bore) / 2

    @property
    def _rings(self) -> tuple[float, float]:
        """D and d [mm]; ``__post_init__`` requires both if an inner dimension is missing."""
        return self.outside or 0.0, self.bore or 0.0

    @property
    def alpha(self) -> float:
        """Nominal contact angle α_0 [rad]."""
        default = {"angular_contact_ball": 40.0, "tapered_roller": 14.0}.get(self.kind, 0.0)
        return math.radians(default if self.contact_angle is None else self.contact_angle)

    @property
    def Z(self) -> int:
        """Number of balls or rollers: given, or from the static capacity (balls), or from the usual gap of the cage.

        Deep groove bearings are filled with the inner ring eccentric, which limits the number of balls. Source: Harris,
        Rolling Bearing Analysis, ch. 1 (Conrad assembly).
        """
        if self.elements is not None:
            return self.elements
        gap = 1.5 if self.is_ball else 1.2
        most = int(math.pi * self.D_pw / (gap * self.D_w))
        if self.kind == "deep_groove_ball":
            most = round(1 + _FILLED / (2 * math.asin(self.D_w / self.D_pw)))
        if self.is_ball and self.static_capacity is not None:
            by_capacity = round(1e3 * self.static_capacity / self._ball_capacity)
            most = min(most, by_capacity) if self.kind == "deep_groove_ball" else by_capacity
        return max(3, most)

    @property
    def _ball_capacity(self) -> float:
        """Static capacity of one ball [N]."""
        return _BALL_CAPACITY * self.D_w**2 * math.cos(self.alpha)

    @property
    def L_we(self) -> float:
        """Effective roller length [mm]: given, or 0.7 of the bearing's width."""
        return self.roller_length if self.roller_length is not None else 0.7 * (self.width or 0.0)

    @property
    def points(self) -> int:
        """Number of contacts: balls, or rollers times laminae."""
        return self.Z if self.is_ball else self.Z * LAMINAE

    def force(self, q: NDArray) -> tuple[NDArray, NDArray]:
        """Force (5,) [N, N·mm] at the motion q (5,) [mm, rad] of the inner ring, and its derivative (5, 5)."""
        carries = np.array([1, 1, not self.floating, 1, 1], dtype=float)
        F, K = self._balls(carries * q) if self.is_ball else self._rollers(carries * q)
        return carries * F, carries[:, None] * K * carries

    def _around(self) -> tuple[NDArray, NDArray, NDArray]:
        """cos θ and sin θ of the elements (Z,), and rows (Z, 5) of the tilt φ_θ = φ_y cos θ − φ_x sin θ."""
        theta = 2 * math.pi * np.arange(self.Z) / self.Z
        c, s = np.cos(theta), np.sin(theta)
        turn = np.zeros((self.Z, 5))
        turn[:, 3], turn[:, 4] = -s, c
        return c, s, turn

    def _balls(self, q: NDArray) -> tuple[NDArray, NDArray]:
        """Force and derivative of a ball bearing (W5), as ``force``.

        A is the distance of the groove centres without load, R the radius of the inner ones, d (Z, 2) their radial and
        axial distance at each ball, which moves by B q.
        """
        sign = 1.0 if self.carries == "forward" else -1.0
        r_i, r_e = self.inner_conformity * self.D_w, self.outer_conformity * self.D_w
        A = r_i + r_e - self.D_w
        R = self.D_pw / 2 + (r_i - self.D_w / 2) * math.cos(self.alpha)
        c, s, turn = self._around()
        B = np.zeros((self.Z, 2, 5))
        B[:, 0, 0], B[:, 0, 1] = c, s
        B[:, 1] = -R * turn
        B[:, 1, 2] = 1.0
        start = [
            A * math.cos(self.alpha) - self.clearance / 2e3,
            sign * (A * math.sin(self.alpha) + self.preload / 1e3),
        ]
        d = B @ q + np.array(start)
        length = np.linalg.norm(d, axis=1)
        n, deep = d / length[:, None], np.maximum(length - A, 0.0)
        c_p = self.point_stiffness
        Q, slope = c_p * deep**1.5, 1.5 * c_p * np.sqrt(deep)
        nn = n[:, :, None] * n[:, None, :]
        inner = slope[:, None, None] * nn + (Q / length)[:, None, None] * (np.eye(2) - nn)
        force = np.einsum("z,zi,zia->a", Q, n, B)
        return force, np.einsum("zia,zij,zjb->ab", B, inner, B)

    def _rollers(self, q: NDArray) -> tuple[NDArray, NDArray]:
        """Force and derivative of a roller bearing (W6), as ``force``.

        x are the middles of the laminae along a roller, p_r and p_z their radial and axial places. ``rows``
        (Z, lamina, 5) are their approaches per unit of q.
        """
        sign = 1.0 if self.carries == "forward" else -1.0
        cos_a, sin_a = math.cos(self.alpha), sign * math.sin(self.alpha)
        c, s, turn = self._around()
        x = self.L_we * ((np.arange(LAMINAE) + 0.5) / LAMINAE - 0.5)
        p_r, p_z = (self.D_pw - self.D_w * cos_a) / 2 - x * sin_a, x * cos_a
        rows = np.zeros((self.Z, LAMINAE, 5))
        rows[..., 0], rows[..., 1], rows[..., 2] = cos_a * c[:, None], cos_a * s[:, None], sin_a
        rows += (cos_a * p_z - sin_a * p_r)[:, None] * turn[:, None, :]
        # logarithmic profile of the standard, on both raceways
        profile = 0.00035 * self.D_w * np.log(1 / (1 - (2 * x / self.L_we) ** 2))
        deep = rows @ q - self.clearance / 2e3 * cos_a + self.preload / 1e3 * abs(sin_a) - 2 * profile
        deep = np.maximum(deep, 0.0)
        c_s = LINE_CONTACT * self.L_we ** (8 / 9) / LAMINAE
        load, slope = c_s * deep ** (10 / 9), np.where(deep > 0, c_s * 10 / 9 * deep ** (1 / 9), 0.0)
        force = np.einsum("zk,zka->a", load, rows)
        return force, np.einsum("zka,zk,zkb->ab", rows, slope, rows)

    @property
    def point_stiffness(self) -> float:
        """Stiffness c_P of a ball between both raceways, Q = c_P δ^1.5 [N/mm^1.5] (W5)."""
        gamma = self.D_w * math.cos(self.alpha) / self.D_pw
        rings = ((gamma / (1 - gamma), self.inner_conformity), (-gamma / (1 + gamma), self.outer_conformity))
        return sum(hertz_point_stiffness(self.D_w, g, f) ** (-2 / 3) for g, f in rings) ** -1.5


@lru_cache
def hertz_point_stiffness(D_w: float, curving: float, conformity: float) -> float:
    """Stiffness Q/δ^1.5 of a ball in a groove with the radius D_w·conformity across and D_w/(2·curving) along it.

    Source: Hertz; Harris ch. 6.
    """
    from scipy.optimize import brentq
    from scipy.special import ellipe, ellipk

    groove = 1 / (2 * conformity)
    total = 2 / D_w * (2 + curving - groove)
    difference = (curving + groove) / (2 + curving - groove)

    def excess(kappa: float) -> float:
        m = 1 - kappa**-2
        K, E = ellipk(m), ellipe(m)
        return ((kappa**2 + 1) * E - 2 * K) / ((kappa**2 - 1) * E) - difference

    kappa: Any = brentq(excess, 1 + 1e-6, 1e4, xtol=1e-13)
    m = 1 - kappa**-2
    shift = 2 * ellipk(m) / math.pi * (math.pi / (2 * kappa**2 * ellipe(m))) ** (1 / 3)
    # δ = shift · (Σρ/2) · [3 Q · 2(1−ν²)/E / (2 Σρ)]^(2/3)
    return (shift * total / 2) ** -1.5 * total * YOUNGS_MODULUS / (3 * (1 - POISSON_RATIO**2))
