"""Work–precision curves: error and cost at the levels of one setting; the reference is the limit of the setting."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from gearbench.accuracy.measure import MEASURED, relative_errors
from gearbench.accuracy.measure import measured as numbers
from gearbench.accuracy.settings import Setting, label
from gearbench.contact.smooth import clear_compliance_cache
from gearbench.effects.teeth import clear_tooth_cache
from gearbench.effects.tooth_bending import tooth_bending
from gearbench.effort.clock import Cost, apart, measured, most_megabytes, timed, unseen
from gearbench.lazy import xr
from gearbench.results.quantities import QUANTITIES
from gearbench.scene import Scene
from gearbench.solution import solve_scene
from gearbench.trains.solve import solve_train

#: An error is used for the observed order if it exceeds CLEAR times its error bar, and ROUNDING.
CLEAR, ROUNDING = 4.0, 1e-12


@dataclass(frozen=True, kw_only=True)
class Point:
    """One level of a setting.

    Parameters
    ----------
    label, size
        Level as text, and the number n of the convergence law error ~ n^−p.
    errors
        Relative errors of the four numbers of ``gearbench.accuracy.measure``, (4,).
    cost
        Cost of one run.
    """

    label: str
    size: float
    errors: NDArray
    cost: Cost


@dataclass(frozen=True, kw_only=True)
class WorkPrecision:
    """Work–precision curve of one setting on one scene.

    Parameters
    ----------
    setting, expected
        Name of the setting, and its expected order of convergence as text.
    points
        Levels of the setting, coarse to fine.
    bar
        Relative uncertainty of the reference, (4,).
    """

    setting: str
    expected: str
    points: tuple[Point, ...]
    bar: NDArray

    @property
    def errors(self) -> NDArray:
        """Relative errors, (level, 4)."""
        return np.array([point.errors for point in self.points])

    def column(self, name: str) -> NDArray:
        """Attribute of all points, or of their costs, by name, (level,)."""
        return np.array([getattr(p if hasattr(p, name) else p.cost, name) for p in self.points])

    @property
    def order(self) -> NDArray:
        """Observed order of convergence of the four numbers, (4,); see ``observed_order``."""
        sizes = self.column("size")
        return np.array([observed_order(sizes, e, bar) for e, bar in zip(self.errors.T, self.bar, strict=True)])


def observed_order(sizes: NDArray, errors: NDArray, bar: float, points: int = 6) -> float:
    """Order p of error ~ size^−p, fitted to the last ``points`` levels with an error clear of its bar.

    NaN if there are fewer than two such levels.
    """
    clear = np.flatnonzero((errors > CLEAR * bar) & (errors > ROUNDING))[-points:]
    if len(clear) < 2:
        return float("nan")
    return float(-np.polyfit(np.log(sizes[clear]), np.log(errors[clear]), 1)[0])


def values_of(scene: Scene) -> NDArray:
    """Compute the four numbers of a pair, or of a whole train, (4,); see ``accuracy.measure``."""
    return numbers(solve_train(scene).cycles[0] if scene.coupled else solve_scene(scene).cycle)


def setting_curve(scene: Scene, setting: Setting, repeats: int) -> WorkPrecision:
    """Measure error and cost at the levels of ``setting``; ``setting.finest`` gives the reference and its error bar."""
    before, exact = (values_of(finest) for finest in setting.finest(scene))
    points = []
    for level in setting.tried(scene):
        values, cost = run(setting.with_level(scene, level), repeats, prepares=setting.prepares)
        point = Point(label=label(level), size=setting.size(level), errors=relative_errors(values, exact), cost=cost)
        points.append(point)
    return WorkPrecision(
        setting=setting.name, expected=setting.order, points=tuple(points), bar=relative_errors(before, exact)
    )


def run(scene: Scene, repeats: int, *, prepares: bool = False) -> tuple[NDArray, Cost]:
    """Compute the four numbers of ``scene``, (4,), and the cost of a run.

    With ``prepares``, every run computes the teeth anew; else they are known.
    """
    values = values_of(scene)
    if prepares and tooth_bending(scene.effects_by_name, "finite_elements"):
        return values, Cost(**apart(finite_element_run, scene))  # in this process they would come from the disk
    fresh = iter([unseen(scene, i + 1) if prepares else scene for i in range(repeats + 1)])

    def once() -> None:
        if prepares:
            clear_tooth_cache()  # cached teeth of high order would also fill the memory
            clear_compliance_cache()
        values_of(next(fresh))

    return values, measured(once, repeats)


def finite_element_run(scene: Scene) -> dict[str, float]:
    """Cost of a run in a new process; the memory of the libraries is subtracted."""
    import skfem  # noqa: F401  # loaded first, so that loading is not part of the run

    from fem_reference.environment import import_gmsh

    import_gmsh()
    before = most_megabytes()
    _, cost = timed(lambda: values_of(scene))
    return asdict(cost) | {"megabytes": most_megabytes() - before}


def as_dataset(curves: Sequence[WorkPrecision]) -> xr.Dataset:
    """Dataset of curves with one row per level; see ``workprecision.cost``."""

    def rows(name: str) -> NDArray:
        return np.concatenate([c.column(name) for c in curves])

    lengths = [len(c.points) for c in curves]
    table: dict[str, tuple] = {
        "error": (("setting", "quantity"), np.concatenate([c.errors for c in curves])),
        "error_bar": (("setting", "quantity"), np.repeat([c.bar for c in curves], lengths, axis=0)),
        **{name: ("setting", rows(name)) for name in ("seconds", "processor_seconds", "megabytes")},
        "observed_order": (("knob", "quantity"), np.array([c.order for c in curves])),
    }
    names = {"error": "setting_error", "error_bar": "setting_error_bar"}
    return xr.Dataset(
        {name: (*given, QUANTITIES[names.get(name, name)].attrs) for name, given in table.items()},
        coords={
            "setting_knob": ("setting", np.repeat([c.setting for c in curves], lengths)),
            "level": ("setting", rows("label")),
            "size": ("setting", rows("size")),
            "knob": [c.setting for c in curves],
            "expected_order": ("knob", [c.expected for c in curves]),
            "quantity": list(MEASURED),
        },
    )
