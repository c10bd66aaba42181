"""Work–precision of a scene: error against time for every knob, each against a converged reference of its own.

One knob is turned at a time; the others stay as the scene has them, also in the reference, which is the finest level of
the knob. The error bar of a reference is its difference to the level before it. Uniform positions are held against the
finest Gauss panels: both converge to the same integral.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearbench.accuracy.knobs import FE_ACCURACY, GAUSS_POINTS, KNOBS, POSITIONS, Knob, label
from gearbench.accuracy.measure import MEASURED, relative_errors
from gearbench.cost.measure import Run, measure
from gearbench.results.provenance import provenance
from gearbench.results.quantities import QUANTITIES
from gearbench.scene import Scene

if TYPE_CHECKING:
    import xarray as xr

    from gearbench.cost.finite_elements import Meshes

#: Repeats of every timed run.
REPEATS = 7
#: An error counts for the order observed where it is so many times its error bar, and above rounding.
CLEAR, ROUNDING = 4.0, 1e-12


@dataclass(frozen=True, kw_only=True)
class FlankErrors:
    """Finite elements: relative errors of the flank compliance (level,) with their error bar, numbers of unknowns."""

    errors: NDArray
    bar: float
    unknowns: NDArray


@dataclass(frozen=True, kw_only=True)
class Curve:
    """One knob on one scene: labels, sizes, errors (level, 4) with the error bar of the reference (4,), and runs."""

    knob: str
    expected: str
    labels: tuple[str, ...]
    sizes: NDArray
    errors: NDArray
    bar: NDArray
    seconds: NDArray
    processor_seconds: NDArray
    megabytes: NDArray
    flank: FlankErrors | None = None

    @property
    def order(self) -> NDArray:
        """Order observed of each number, (4,): slope of log error over log size over the last clear levels."""
        return np.array([observed_order(self.sizes, self.errors[:, i], self.bar[i]) for i in range(len(self.bar))])

    @property
    def flank_order(self) -> float:
        """Order observed of the flank compliance; NaN where it is not the knob's."""
        return math.nan if self.flank is None else observed_order(self.sizes, self.flank.errors, self.flank.bar)


def observed_order(sizes: NDArray, errors: NDArray, bar: float, points: int = 6) -> float:
    """Order p of error ~ size^−p over the last ``points`` levels whose error is clear of its bar; NaN below two."""
    clear = np.flatnonzero((errors > CLEAR * bar) & (errors > ROUNDING))[-points:]
    if len(clear) < 2:
        return float("nan")
    return float(-np.polyfit(np.log(sizes[clear]), np.log(errors[clear]), 1)[0])


def curve(scene: Scene, knob: Knob, repeats: int = REPEATS) -> Curve:
    """Error and cost of each level of ``knob`` but the two finest, which make the reference and its error bar."""
    from gearbench.simulation import cycle_values

    levels = knob.levels(scene)
    if knob is POSITIONS:
        finest = [GAUSS_POINTS.with_level(scene, level) for level in GAUSS_POINTS.levels(scene)[-2:]]
    else:
        finest = [knob.with_level(scene, level) for level in levels[-2:]]
        levels = levels[:-2]
    before, reference = (cycle_values(s) for s in finest)
    runs = [measure(knob.with_level(scene, level), repeats, prepares=knob.prepares) for level in levels]
    return curve_of(knob, levels, runs, reference, relative_errors(before, reference))


def curve_of(knob: Knob, levels: Sequence, runs: Sequence[Run], reference: NDArray, bar: NDArray) -> Curve:
    """Curve of runs at ``levels`` against ``reference`` (4,), which is uncertain by ``bar`` (4,)."""
    return Curve(
        knob=knob.name,
        expected=knob.order,
        labels=tuple(label(level) for level in levels),
        sizes=np.array([knob.size(level) for level in levels]),
        errors=np.array([relative_errors(run.values, reference) for run in runs]),
        bar=bar,
        seconds=np.array([run.seconds for run in runs]),
        processor_seconds=np.array([run.processor_seconds for run in runs]),
        megabytes=np.array([run.megabytes for run in runs]),
    )


def work_precision(scene: Scene, repeats: int = REPEATS, seeds: int = 8, meshes: Meshes | None = None) -> xr.Dataset:
    """Work–precision of all knobs that ``scene`` has.

    Parameters
    ----------
    scene
        Its resolution is what the other knobs are held at.
    repeats
        Timed runs of each setting; medians count.
    seeds
        Draws of the error samples, where the scene has random errors: their errors are RMS values over them.
    meshes
        What is tried of finite elements, where the scene has them; ``all_meshes`` by default.

    Returns
    -------
    Dataset over ``setting`` (one level of one knob) and ``quantity``: relative ``error`` and ``error_bar`` of its
    reference, ``seconds``, ``processor_seconds``, ``megabytes``; over ``knob`` and ``quantity``: ``observed_order``.
    Of finite elements also ``compliance_error``, its error bar and ``unknowns`` over ``setting``, ``compliance_order``
    over ``knob``; NaN for the other knobs.

    Raises
    ------
    InputError
        If the scene leaves its resolution to an accuracy.
    """
    start = time.perf_counter()
    curves = [curve(scene, knob, repeats) for knob in KNOBS if knob.applies(scene) and knob is not FE_ACCURACY]
    from gearbench.cost.newton import newton_curve

    solver = newton_curve(scene, repeats)
    curves += [solver] if solver is not None else []
    if FE_ACCURACY.applies(scene):
        from gearbench.cost.finite_elements import element_curves

        curves += element_curves(scene, meshes)
    if scene.effect("manufacturing_errors") is not None:
        from gearbench.cost.samples import sample_curves

        curves += sample_curves(scene, repeats=repeats, seeds=seeds)
    return as_dataset(curves).assign_attrs(provenance(scene, wall_time=time.perf_counter() - start))


def as_dataset(curves: Sequence[Curve]) -> xr.Dataset:
    """Dataset of curves, one row a level; see ``work_precision``."""
    import xarray as xr

    def rows(name: str) -> NDArray:
        return np.concatenate([getattr(c, name) for c in curves])

    table: dict[str, tuple] = {}
    if any(c.flank is not None for c in curves):
        table = {
            "compliance_error": ("setting", _flank_rows(curves, "errors")),
            "compliance_error_bar": ("setting", _flank_rows(curves, "bar")),
            "unknowns": ("setting", _flank_rows(curves, "unknowns")),
            "compliance_order": ("knob", np.array([c.flank_order for c in curves])),
        }
    bars = np.concatenate([np.broadcast_to(c.bar, c.errors.shape) for c in curves])
    table |= {
        "error": (("setting", "quantity"), rows("errors")),
        "error_bar": (("setting", "quantity"), bars),
        "seconds": ("setting", rows("seconds")),
        "processor_seconds": ("setting", rows("processor_seconds")),
        "megabytes": ("setting", rows("megabytes")),
        "observed_order": (("knob", "quantity"), np.array([c.order for c in curves])),
    }
    names = {"error": "setting_error", "error_bar": "setting_error_bar"}
    return xr.Dataset(
        {name: (*given, QUANTITIES[names.get(name, name)].attrs) for name, given in table.items()},
        coords={
            "setting_knob": ("setting", np.repeat([c.knob for c in curves], [len(c.labels) for c in curves])),
            "level": ("setting", np.concatenate([c.labels for c in curves])),
            "size": ("setting", rows("sizes")),
            "knob": [c.knob for c in curves],
            "expected_order": ("knob", [c.expected for c in curves]),
            "quantity": list(MEASURED),
        },
    )


def _flank_rows(curves: Sequence[Curve], name: str) -> NDArray:
    """A column of ``FlankErrors``, (setting,); NaN for knobs that leave the finite elements alone."""
    columns = [math.nan if c.flank is None else getattr(c.flank, name) for c in curves]
    return np.concatenate([np.broadcast_to(v, len(c.labels)) for v, c in zip(columns, curves, strict=True)])
