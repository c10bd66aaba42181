"""Work–precision curves: error and cost at the levels of one setting; the reference is the limit of the setting."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields

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
class WorkPrecision:
    """Work–precision curve of one setting on one scene.

    Parameters
    ----------
    setting, expected
        Name of the setting, and its expected order of convergence as text.
    labels, sizes
        Levels from coarse to fine, as texts and as the numbers n of the convergence law error ~ n^−p.
    runs
        Relative errors of the four numbers of ``gearbench.accuracy.measure``, (4,), and cost of one run, at each level.
    bar
        Relative uncertainty of the reference, (4,).
    """

    setting: str
    expected: str
    labels: Sequence[str]
    sizes: Sequence[float]
    runs: Sequence[tuple[NDArray, Cost]]
    bar: NDArray

    @property
    def errors(self) -> NDArray:
        """Relative errors, (level, 4)."""
        return np.array([errors for errors, _ in self.runs])

    @property
    def order(self) -> NDArray:
        """Observed order of convergence of the four numbers, (4,); see ``observed_order``."""
        sizes = np.array(self.sizes)
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
    levels = setting.tried(scene)
    runs = (run(setting.with_level(scene, level), repeats, prepares=setting.prepares) for level in levels)
    return WorkPrecision(
        setting=setting.name,
        expected=setting.order,
        labels=[label(level) for level in levels],
        sizes=[setting.size(level) for level in levels],
        runs=[(relative_errors(values, exact), cost) for values, cost in runs],
        bar=relative_errors(before, exact),
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
    lengths = [len(c.runs) for c in curves]
    costs = [cost for c in curves for _, cost in c.runs]
    table: dict[str, tuple] = {
        "error": (("setting", "quantity"), np.concatenate([c.errors for c in curves])),
        "error_bar": (("setting", "quantity"), np.repeat([c.bar for c in curves], lengths, axis=0)),
        **{key.name: ("setting", [getattr(cost, key.name) for cost in costs]) for key in fields(Cost)},
        "observed_order": (("knob", "quantity"), np.array([c.order for c in curves])),
    }
    names = {"error": "setting_error", "error_bar": "setting_error_bar"}
    return xr.Dataset(
        {name: (*given, QUANTITIES[names.get(name, name)].attrs) for name, given in table.items()},
        coords={
            "setting_knob": ("setting", np.repeat([c.setting for c in curves], lengths)),
            "level": ("setting", [text for c in curves for text in c.labels]),
            "size": ("setting", [size for c in curves for size in c.sizes]),
            "knob": [c.setting for c in curves],
            "expected_order": ("knob", [c.expected for c in curves]),
            "quantity": list(MEASURED),
        },
    )
