"""Curves over a mesh cycle: means, values between the transitions, peak-to-peak values, harmonics.

Transitions are mesh phases at which contact changes. Between two transitions, the values at Gauss points determine a
polynomial on a panel; means, extremes and harmonics follow from these polynomials. Values at uniform phases are used
as they are.

Harmonics: x(τ) = c_0 + Σ Re(2 c_n e^{2πi n τ}), n = 1, 2, …, with c_n = ∫₀¹ x(τ) e^{−2πi n τ} dτ. The amplitude is
2|c_n| in the unit of x, the phase arg c_n in (−π, π]: x(τ) = c_0 + Σ 2|c_n| cos(2π n τ + arg c_n). A positive phase
means that the crest comes before τ = 0, where a tooth pair comes into contact.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from gearbench.geometry.quadrature import gauss, interpolation, legendre_transform
from gearbench.lazy import xr
from gearbench.scene import Scene

MICROMETRES = 1e3  # per mm
#: Number of harmonics in a Dataset.
HARMONICS = 10
#: PHASE_ACCURACY: accuracy of the phases at which curves jump [mesh cycles]. PATCH_ERROR: remaining error of a curve,
#: relative to its change when the ends of the contact patches were located for the last time. Both are measured on
#: gears in use.
PHASE_ACCURACY, PATCH_ERROR = 2e-4, 0.1
#: Largest distance of a Gauss point from its position on the panel [mesh cycles]: rounding only.
ON_PANEL = 1e-10
#: Least and greatest assumed ratio of a Legendre coefficient on a panel to the one before.
COEFFICIENT_RATIOS = (0.3, 0.95)
#: Truncation errors of a harmonic, measured on gears in use. HELICAL_ERROR: few functions along oblique contact lines,
#: relative to peak-to-peak, per module of face width. SPUR_ERROR: the same for spur pairs, relative to peak-to-peak.
#: TRUNCATION_ERROR: truncated compliance, for a harmonic of the stiffness, relative to the mean stiffness.
HELICAL_ERROR, SPUR_ERROR, TRUNCATION_ERROR = 8e-6, 2e-5, 4e-5
#: FINE_POINTS: number of points on a panel at which extremes are sought. If the coefficients that the polynomial of a
#: panel leaves out (``_left_out``) exceed the share STEEP_SHARE of the range of the curve, or the polynomial misses the
#: curve (``_missed``) by the share OFF, it is not trusted and the extremes are limited, see ``_within``.
FINE_POINTS, STEEP_SHARE, OFF = 201, 2e-2, 5e-2
#: Error of the mean over a panel whose polynomial misses a kink or a jump, over the last two coefficients. With five
#: Gauss points, a kink anywhere on the panel leaves 0.07 of the last coefficient in RMS, a jump 0.17; measured on
#: relieved spur pairs.
MISSED_KINK = 0.08


@dataclass(frozen=True, kw_only=True, eq=False)
class Phases:
    """Mesh phases at which the values of a cycle are known.

    Parameters
    ----------
    phase, weight
        Mesh phases in ascending order, and their weights in means over the cycle, with sum 1, (position,).
    size
        Number of Gauss points on every panel between two transitions; None for uniform phases.
    length
        Number of mesh periods in the cycle. It is 1 unless meshes of a train have different mesh frequencies.
    orders
        Orders of the harmonics in a Dataset, multiples of the mesh frequency.

    Raises
    ------
    ValueError
        If the phases are not the Gauss points of adjacent panels from 0 to ``length``.
    """

    phase: NDArray
    weight: NDArray
    size: int | None
    length: int = 1
    orders: tuple[float, ...] = tuple(range(1, HARMONICS + 1))

    def __post_init__(self) -> None:
        if self.size is None:
            return
        if len(self.phase) % self.size:
            raise ValueError(f"{len(self.phase)} phases cannot be split into panels of {self.size}")
        (begin, end), t = self.edges.T, gauss(self.size)[0]
        covered = np.abs(np.append(begin, self.length) - np.append(0.0, end)).max() < ON_PANEL
        nodes = (begin + end)[:, None] / 2 + (end - begin)[:, None] / 2 * t
        if not (covered and np.abs(nodes.ravel() - self.phase).max() < ON_PANEL):
            raise ValueError(f"phases are not the {self.size} Gauss points of each panel of a mesh cycle")

    @classmethod
    def of_dataset(cls, dataset: xr.Dataset) -> Phases:
        """Read the phases of a Dataset of ``simulate``."""
        phase, weight, start = (dataset[name].values for name in ("mesh_phase", "phase_weight", "panel_start"))
        size = None if np.isnan(start).any() else int(np.sum(start == start[0]))
        return cls(phase=phase, weight=weight, size=size, length=round(2 * float(weight @ phase)))

    @cached_property
    def edges(self) -> NDArray:
        """Begin and end of the Gauss panels, (panel, 2)."""
        assert self.size is not None, "uniform phases have no panels"
        x, t = self.phase.reshape(-1, self.size), gauss(self.size)[0]
        # a single point does not give the width of the panel, but its weight does
        half = (x[:, -1] - x[:, 0]) / (t[-1] - t[0]) if self.size > 1 else self.length * self.weight / 2
        return x.mean(axis=1)[:, None] + half[:, None] * np.array([-1.0, 1.0])

    @cached_property
    def widths(self) -> NDArray:
        """Widths of the Gauss panels, (panel,)."""
        begin, end = self.edges.T
        return end - begin

    @cached_property
    def bessel(self) -> NDArray:
        """j_k(πnw) for the orders n of a Dataset, the widths w and k = 0 … ``size``, (harmonic, panel, k)."""
        return _bessel(self, np.array(self.orders))

    @property
    def coordinates(self) -> dict[str, NDArray]:
        """Coordinates of a Dataset over ``position``, by name."""
        unknown = np.full((len(self.phase), 2), np.nan)
        start, end = (unknown if self.size is None else np.repeat(self.edges, self.size, axis=0)).T
        return {"mesh_phase": self.phase, "phase_weight": self.weight, "panel_start": start, "panel_end": end}


@dataclass(frozen=True, kw_only=True, eq=False)
class MeshCycle:
    """Static transmission error and mesh stiffness over one mesh cycle, or over many with the same phases.

    Parameters
    ----------
    phases
        Mesh phases of the values.
    transmission_error, mesh_stiffness
        δ [µm] and k [N/µm], (…, position).
    """

    phases: Phases
    transmission_error: NDArray
    mesh_stiffness: NDArray

    @classmethod
    def of(cls, scene: Scene, phases: Phases, approach: NDArray, stiffness: NDArray) -> MeshCycle:
        """Convert the normal approach δ_n [mm] and ∂F_n/∂δ_n [N/mm], (…, position).

        δ = δ_n / cos β_b; k = ∂F_bt/∂δ = ∂F_bn/∂δ_n · cos²β_b.
        """
        cos_b = math.cos(scene.pair.meshing.beta_b)
        δ, k = MICROMETRES / cos_b * approach, cos_b**2 / MICROMETRES * stiffness
        return cls(phases=phases, transmission_error=δ, mesh_stiffness=k)

    @cached_property
    def curves(self) -> Mapping[str, CycleCurve]:
        """Both curves by name."""
        both = {"transmission_error": self.transmission_error, "mesh_stiffness": self.mesh_stiffness}
        return {name: CycleCurve(phases=self.phases, values=values) for name, values in both.items()}


def mean(values: NDArray, weight: NDArray) -> NDArray:
    """Mean over the mesh cycle (last axis)."""
    return values @ weight


def fluctuation_rms(values: NDArray, weight: NDArray) -> NDArray:
    """RMS of the deviation from the mean over the mesh cycle (last axis)."""
    return np.sqrt(mean((values - mean(values, weight)[..., None]) ** 2, weight))


def relative_rms(values: NDArray, weight: NDArray) -> NDArray:
    """RMS of the relative deviation from the mean over the mesh cycle (last axis) [%]."""
    return 100 * fluctuation_rms(values, weight) / mean(values, weight)


def curves(phases: Phases, values: NDArray, points: int = 40) -> list[tuple[NDArray, NDArray]]:
    """Split values (position,) into curves (phase, value) between the jumps, with ``points`` on a Gauss panel."""
    if phases.size is None:
        return [(phases.phase, values)]
    t, (start, end) = np.linspace(0, 1, points)[:, None], phases.edges.T
    x, y = (start + t * (end - start)).T, _on_panels(phases, values, points)
    return list(zip(x, y, strict=True))


@dataclass(frozen=True, kw_only=True, eq=False)
class CycleCurve:
    """Peak-to-peak value and noise floors of a curve over the mesh cycle, or of many with the same phases.

    Parameters
    ----------
    phases
        Mesh phases of the values.
    values
        Values of the curve, (…, position).
    """

    phases: Phases
    values: NDArray

    @cached_property
    def peak_to_peak(self) -> NDArray:
        """Greatest minus least value over the cycle, with the limits on both sides of every transition, (…)."""
        if self.phases.size is None:
            return np.ptp(self.values, axis=-1)
        low, high = self._extremes
        return high.max(axis=-1) - low.min(axis=-1)

    def peak_to_peak_floor(self, floor: NDArray) -> NDArray:
        """Estimate the error of ``peak_to_peak`` (…), with the ``noise_floor`` (…, harmonic) of the curve.

        One part is the error of the extremes on panels whose polynomial misses the curve, see ``_missed``. It is at
        most the amount by which the samples on the panel and its neighbours turn back, because a monotonic curve has no
        extreme there. The other part is twice the root sum of squares of the harmonics' floors, which add up at an
        extreme. For uniform phases, unknown harmonics count as the greatest known one.
        """
        if self.phases.size is None:
            return 2 * math.sqrt(floor.shape[-1]) * np.fmax.reduce(floor, axis=-1)
        harmonic_floor = 2 * np.sqrt((floor**2).sum(axis=-1))
        (low, high), of_panel = self._extremes, self._of_panel
        neighbours = (np.arange(of_panel.shape[-2])[:, None] + np.array([-1, 0, 1])) % of_panel.shape[-2]
        around = of_panel[..., neighbours, :].reshape(*of_panel.shape[:-1], -1)
        top = high + np.minimum(self._missed, _reversal(around))
        bottom = np.minimum(self._missed, _reversal(-around)) - low
        return harmonic_floor + top.max(axis=-1) - high.max(axis=-1) + bottom.max(axis=-1) + low.min(axis=-1)

    def noise_floor(self, change: NDArray, *, located: float = PHASE_ACCURACY, least: NDArray | float = 0.0) -> NDArray:
        """Estimate the errors of the amplitudes of the orders of ``phases``, in the unit of the values.

        The result has the shape (…, harmonic). The estimate is the root sum of squares of five parts: a given minimum
        ``least`` (…); the truncated Legendre coefficients of the panels; kinks and jumps that the panels miss, see
        ``_missed``; the jumps between panels times the uncertainty ``located`` of their phases [mesh cycles]; and
        ``PATCH_ERROR`` times the harmonics of ``change`` (…, position), the change of the values when the ends of the
        contact patches were last located. For uniform phases, the highest quarter of the known harmonics replaces the
        second to fourth part.
        """
        phases = self.phases
        patches = np.hypot(PATCH_ERROR * 2 * np.abs(coefficients(phases, change)), np.asarray(least)[..., None])
        if phases.size is None:
            spectrum = 2 * np.abs(np.fft.rfft(self.values, axis=-1)) / len(phases.phase)
            return np.hypot(patches, spectrum[..., -max(1, spectrum.shape[-1] // 4) :].max(axis=-1)[..., None])
        tail = _truncation_error(phases, self._size_of_coefficients)
        jumps = 2 * located / phases.length * np.sqrt((self._jumps**2).sum(axis=-1))
        missed = phases.widths / phases.length * self._missed
        missed = 2 * MISSED_KINK * np.sqrt((missed**2).sum(axis=-1))
        return np.hypot(np.hypot(patches, tail), np.hypot(jumps, missed)[..., None])

    @cached_property
    def _of_panel(self) -> NDArray:
        """Values by panel, (…, panel, size)."""
        assert self.phases.size is not None
        return self.values.reshape(*self.values.shape[:-1], -1, self.phases.size)

    @cached_property
    def _size_of_coefficients(self) -> NDArray:
        """Absolute Legendre coefficients of the panels, (…, panel, size)."""
        return np.abs(self._of_panel @ legendre_transform(self._of_panel.shape[-1]).T)

    @cached_property
    def _jumps(self) -> NDArray:
        """Steps of the polynomials from the end of a panel to the beginning of the next, (…, panel)."""
        ends = self._of_panel @ _to_equidistant(self._of_panel.shape[-1], 2)
        return _of_next(ends[..., 0]) - ends[..., 1]

    @cached_property
    def _missed(self) -> NDArray:
        """Estimated distance of the curve from the polynomial of a panel, (…, panel).

        It is the smaller of two estimates: the sum of the last two coefficients (one of them vanishes if the curve is
        even or odd on the panel), and the jumps to both neighbours. If the curve itself jumps, the polynomials on both
        sides converge and the coefficients are small. If coefficients only fall slowly, the polynomials still meet and
        the jumps are small.
        """
        jump = np.abs(self._jumps)
        return np.minimum(self._size_of_coefficients[..., -2:].sum(axis=-1), jump + _of_previous(jump))

    @cached_property
    def _extremes(self) -> tuple[NDArray, NDArray]:
        """Least and greatest values on the panels, both (…, panel)."""
        of_panel, size = self._of_panel, self._of_panel.shape[-1]
        fine = of_panel @ _to_equidistant(size, FINE_POINTS)
        extent = np.ptp(self.values, axis=-1)[..., None]
        left_out = _left_out(self._size_of_coefficients)
        steep = (left_out > STEEP_SHARE * extent) | (self._missed > OFF * extent)
        if size > 4 and steep.any():
            low, high = _within(of_panel, fine, steep)
            fine = np.clip(fine, np.where(steep, low, -np.inf)[..., None], np.where(steep, high, np.inf)[..., None])
        return fine.min(axis=-1), fine.max(axis=-1)


def _of_next(values: NDArray) -> NDArray:
    """Values (…, panel) of the next panel; the first follows the last."""
    return np.concatenate([values[..., 1:], values[..., :1]], axis=-1)


def _of_previous(values: NDArray) -> NDArray:
    """Values (…, panel) of the previous panel."""
    return np.concatenate([values[..., -1:], values[..., :-1]], axis=-1)


def _reversal(values: NDArray) -> NDArray:
    """Greatest height of a value above both the least value before and the least value after it (last axis)."""
    before = np.minimum.accumulate(values, axis=-1)
    after = np.minimum.accumulate(values[..., ::-1], axis=-1)[..., ::-1]
    return (values - np.maximum(before, after)).max(axis=-1)


def _left_out(coefficient: NDArray) -> NDArray:
    """Estimated sum of the coefficients that the polynomial of a panel leaves out, (…, panel).

    From the absolute ``coefficient`` (…, panel, size). Coefficients fall on as from the second last to the last third,
    but at least by half.
    """
    count = max(2, coefficient.shape[-1] // 3)
    before, last = coefficient[..., -2 * count : -count].sum(axis=-1), coefficient[..., -count:].sum(axis=-1)
    ratio = np.divide(last, before, out=np.full_like(last, 0.5), where=2 * last < before)
    return last * ratio / (1 - ratio)


def _within(values: NDArray, fine: NDArray, steep: NDArray) -> tuple[NDArray, NDArray]:
    """Limits of a curve on panels where it is too steep for a polynomial, both (…, panel).

    The polynomials (``fine``) overshoot at the ends of such panels. The limits there are the end value of the
    neighbour or, if the neighbour is too ``steep`` as well, the less extreme of both end values. Between two samples
    the curve is a parabola, see ``_vertices``.
    """
    first, last = fine[..., 0], fine[..., -1]
    before, after = _of_previous(last), _of_next(first)
    both = steep & _of_previous(steep), steep & _of_next(steep)
    inside = np.concatenate([values, _vertices(values)], axis=-1)
    low, high = inside.min(axis=-1), inside.max(axis=-1)
    for extreme, other, doubt in ((first, before, both[0]), (last, after, both[1])):
        low = np.minimum(low, np.where(doubt, np.maximum(extreme, other), other))
        high = np.maximum(high, np.where(doubt, np.minimum(extreme, other), other))
    return low, high


def _vertices(values: NDArray) -> NDArray:
    """Extremes of a curve between two Gauss points from values (…, panel, size); the value at the first without one.

    A parabola joins two Gauss points. Its curvature is the smaller of those on both sides (through the Gauss point
    before and the one behind), and zero if their signs differ, so that it does not overshoot at steps.
    """
    t = gauss(values.shape[-1])[0]
    slope = np.diff(values, axis=-1) / np.diff(t)
    curvature = np.diff(slope, axis=-1) / (t[2:] - t[:-2])
    before, after = curvature[..., :-1], curvature[..., 1:]
    half = np.where(before * after > 0, np.where(np.abs(before) < np.abs(after), before, after), 0.0)
    begin, end, slope, step = values[..., 1:-2], values[..., 2:-1], slope[..., 1:-1], np.diff(t)[1:-1]
    turns = np.abs(slope) < np.abs(half) * step
    safe = np.where(turns, half, 1.0)
    return np.where(turns, (begin + end) / 2 - slope**2 / (4 * safe) - safe * step**2 / 4, begin)


def coefficients(phases: Phases, values: NDArray, orders: int | None = None) -> NDArray:
    """Complex Fourier coefficients c_n (module docstring) of the orders 1 … ``orders``, (…, harmonic).

    By default the orders are those of ``phases``. On Gauss panels the polynomials are integrated. Uniform phases give
    orders below half their number, and NaN above.
    """
    return values @ fourier_matrix(phases, orders).T


def _truncation_error(phases: Phases, coefficient: NDArray) -> NDArray:
    """Truncation error of the amplitudes, (…, harmonic), from the absolute ``coefficient`` (…, panel, size).

    The next coefficients a_p, a_{p+1}, … are assumed to fall by the ratio r of the last ones. At p Gauss points,
    P_{p+m} is aliased to P_{p−m}: on a panel of width w, it changes c_n by w a_{p+m} j_{p−m}(πnw).
    """
    a, size, width = coefficient, phases.size, phases.widths / phases.length
    assert size is not None
    before = a[..., -3:-1].max(axis=-1, initial=0.0)
    ratio = np.sqrt(np.divide(a[..., -1], before, out=np.ones_like(before), where=before > 0))
    r = np.clip(ratio, *COEFFICIENT_RATIOS)[..., None]
    m = np.arange(size + 1)
    aliased = np.abs(phases.bessel[..., ::-1])
    panels = np.einsum("...pm,npm->...np", r ** (m + 1), aliased) * (width * a[..., -1])[..., None, :]
    return 2 * np.sqrt((panels**2).sum(axis=-1))


def panels(dataset: xr.Dataset, name: str, points: int = 40) -> list[tuple[NDArray, NDArray]]:
    """Compute ``curves`` of a variable of a Dataset of ``simulate``, or of one point of a sweep."""
    (one,) = cycles(dataset, name)
    return curves(Phases.of_dataset(one), one[name].values, points)


def cycles(dataset: xr.Dataset, name: str) -> list[xr.Dataset]:
    """Split a variable over the mesh cycle by the points of a sweep, with their positions; one for a single scene."""
    outer = {str(dim): size for dim, size in dataset[name].sizes.items() if dim != "position"}
    phases = ("mesh_phase", "phase_weight", "panel_start", "panel_end")
    cycles_of_meshes = []
    for point in np.ndindex(*outer.values()):
        one = dataset[[name, *phases]].isel(dict(zip(outer, point, strict=True)))
        # positions that only other points have are stored with weight 0
        cycles_of_meshes.append(one.isel(position=np.flatnonzero(one["phase_weight"].values > 0)))
    return cycles_of_meshes


def fourier(dataset: xr.Dataset, name: str, orders: int = HARMONICS) -> NDArray:
    """Amplitudes of the orders 1 … ``orders`` of a variable over the mesh cycle, in its unit.

    The shape is (harmonic,) for a Dataset of ``simulate``, and (…, harmonic) with the swept keys first for ``sweep``.
    """
    outer = [size for dim, size in dataset[name].sizes.items() if dim != "position"]
    spectra = [coefficients(Phases.of_dataset(one), one[name].values, orders) for one in cycles(dataset, name)]
    return 2 * np.abs(np.array(spectra)).reshape(*outer, orders)


@lru_cache(maxsize=16)
def fourier_matrix(phases: Phases, orders: int | None) -> NDArray:
    """Matrix from values at the phases to complex Fourier ``coefficients``, (harmonic, position)."""
    return fourier_rows(phases, None if orders is None else np.arange(1, orders + 1))


def fourier_rows(phases: Phases, orders: NDArray | None = None) -> NDArray:
    """Matrix from values y to the mean of y e^{−2πinτ} over the cycle for any real orders n, (order, position).

    By default the orders are those of ``phases``.
    """
    n, x = np.array(phases.orders) if orders is None else np.asarray(orders), phases.phase
    if phases.size is None:
        wave = np.exp(-2j * np.pi * np.outer(n, x)) / len(x)
        return np.where(2 * phases.length * n[:, None] < len(x), wave, np.nan)
    bessel = phases.bessel if orders is None else _bessel(phases, n)
    # ∫ P_k(s) e^{−iωs} ds over [−1, 1] = 2 (−i)^k j_k(ω), ω = πnw on a panel of width w
    waves = 2 * (-1j) ** np.arange(phases.size) * bessel[..., :-1]
    middle = phases.edges.mean(axis=1)
    waves *= (phases.widths / 2 / phases.length * np.exp(-2j * np.pi * np.multiply.outer(n, middle)))[..., None]
    return (waves @ legendre_transform(phases.size)).reshape(len(n), -1)


def _bessel(phases: Phases, orders: NDArray) -> NDArray:
    """j_k(πnw) for any real ``orders`` n, see ``Phases.bessel``."""
    from scipy.special import spherical_jn

    assert phases.size is not None
    return spherical_jn(np.arange(phases.size + 1), math.pi * np.multiply.outer(orders, phases.widths)[..., None])


def _on_panels(phases: Phases, values: NDArray, points: int) -> NDArray:
    """Interpolate values (…, position) at equidistant points of the panels, ends included, (…, panel, point)."""
    assert phases.size is not None
    by_panel = values.reshape(*values.shape[:-1], -1, phases.size)
    return by_panel @ _to_equidistant(phases.size, points)


@lru_cache(maxsize=16)
def _to_equidistant(size: int, points: int) -> NDArray:
    """Matrix from values at the Gauss points of a panel to equidistant points, ends included, (size, point)."""
    return interpolation(size, np.linspace(-1, 1, points)).T
