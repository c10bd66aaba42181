"""Choice of tip relief and crowning for a range of torques."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearbench.effects.crowning import Crowning
from gearbench.effects.manufacturing_errors import ManufacturingErrors
from gearbench.effects.tip_relief import TipRelief
from gearbench.errors import InputError
from gearbench.lazy import xr
from gearbench.plotting import BLUE, GREEN, GREY, as_label, new_figure, write_figure
from gearbench.results.origin import scene_of
from gearbench.results.provenance import provenance
from gearbench.scene import Scene
from gearbench.sweeps.run import sweep

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Default torques relative to that of the scene.
TORQUES = (0.25, 0.5, 0.75, 1.0, 1.25)
#: Initial grid of the search, as fractions of the largest amount, length and crowning.
GRID = ((0.0, 0.2, 0.4, 0.7), (0.35, 0.65, 1.0), (0.0, 0.15, 0.5))
#: Evaluations of the Nelder–Mead method after the grid.
STEPS = 50
#: Longest relief relative to the tooth height.
LONGEST = 0.45
#: Error samples at each torque, if the scene has random errors.
SAMPLES = 64
#: Chosen amounts are multiples of ``STEP_AMOUNT`` [µm], the chosen length of ``STEP_LENGTH`` [mm].
STEP_AMOUNT, STEP_LENGTH = 0.1, 0.01

_DESIGNS = ("as given", "chosen", "best evaluated at each torque")


def relieve(
    scene: Scene,
    torque: Sequence[float] | NDArray | None = None,
    *,
    progress: Callable[[int, int], None] = lambda done, of: None,
) -> xr.Dataset:
    """Find the tip relief (equal on both gears) and crowning with the least transmission error over a torque range.

    The search minimises the largest peak-to-peak STE among the torques. If the scene has random manufacturing errors,
    it minimises the largest mean, over error samples, of the RMS of STE. A grid over amount, length and crowning is
    refined by the Nelder–Mead method.

    Parameters
    ----------
    scene
        Scene to relieve. The shape of its tip relief is kept; the amounts of tip relief and crowning are replaced.
    torque
        Positive torques on the pinion [N·m]; by default 0.25 to 1.25 times that of the scene.
    progress
        Called with the number of evaluations done and the largest possible number.

    Returns
    -------
    Dataset over ``design`` ("as given", "chosen", "best evaluated at each torque") and ``torque``: the minimised
    quantity, ``tip_relief_amount`` µm, ``tip_relief_length`` mm, ``crowning_amount`` µm, and, for the first two
    designs, ``flank_pressure_max`` MPa, which is not minimised. The attribute ``scene`` is the chosen scene. A search
    at a single torque finds a better design for this torque than the best one evaluated here.

    Raises
    ------
    InputError
        If a torque is not positive, or the scene cannot be simulated.
    """
    from scipy.optimize import minimize

    start = time.perf_counter()
    torques = np.unique(
        np.asarray(torque if torque is not None else scene.load.torque * np.array(TORQUES), dtype=float)
    )
    if not (torques > 0).all():
        raise InputError("torque", float(torques[0]), "must be positive: the drive flanks are relieved")
    search = _ReliefSearch(scene=replace(scene.one_pair, loads=()), torques=torques)
    given = search.metric(search.scene)
    sizes = search.largest_values()
    total = int(np.prod([len(each) for each in GRID])) + STEPS

    def largest(shares: NDArray) -> float:
        progress(min(len(search.values), total), total)
        return float(search.at(np.clip(shares, 0.0, 1.0) * sizes).max())

    grid = [np.array(point) for point in np.array(np.meshgrid(*GRID)).reshape(3, -1).T]
    best = grid[int(np.argmin([largest(point) for point in grid]))]
    options = {
        "maxfev": STEPS,
        "xatol": 5e-3,
        "fatol": 0.0,
        # from the best point towards the inside of the unit cube
        "initial_simplex": best + 0.1 * np.vstack([np.zeros(3), np.diag(np.where(best > 0.5, -1.0, 1.0))]),
    }
    best = np.clip(minimize(largest, best, method="Nelder-Mead", options=options).x, 0.0, 1.0) * sizes
    chosen = np.round(best / search.steps) * search.steps
    search.at(chosen)
    progress(total, total)

    points, values = np.array(search.points), np.array(search.values)
    nearest = int(np.flatnonzero((np.abs(points - chosen) < 1e-12).all(axis=1))[-1])
    each = values.argmin(axis=0)
    # NaN for the scene as given, whose amounts may differ between the gears
    unknown = np.full((3, len(torques)), np.nan)
    grid_dims = ("design", "torque")
    variables: dict[str, tuple] = {
        search.name: (grid_dims, np.stack([given, values[nearest], values[each, np.arange(len(torques))]]))
    }
    for i, name in enumerate(("tip_relief_amount", "tip_relief_length", "crowning_amount")):
        column = unknown.copy()
        column[1:] = np.stack([np.full(len(torques), points[nearest, i]), points[each, i]])
        variables[name] = (grid_dims, column, {"units": "mm" if name.endswith("length") else "µm"})
    pressure = [search.pressure(each) for each in (search.scene, search.scene_with(points[nearest]))]
    variables["flank_pressure_max"] = (grid_dims, np.stack([*pressure, unknown[0]]), {"units": "MPa"})
    coords = {"design": list(_DESIGNS), "torque": ("torque", torques, {"units": "N·m", "symbol": "T"})}
    relieved = search.scene_with(points[nearest])
    attrs = provenance(relieved, wall_time=time.perf_counter() - start)
    dataset = xr.Dataset(variables, coords, {**attrs, "minimised": search.name, "evaluations": len(values)})
    dataset[search.name].attrs = {"units": "µm", **search.attrs}
    return dataset


@dataclass(kw_only=True)
class _ReliefSearch:
    """Designs evaluated so far: points (amount, length, crowning) and their metric at each torque."""

    scene: Scene
    torques: NDArray
    points: list[NDArray] = field(default_factory=list)
    values: list[NDArray] = field(default_factory=list)
    steps: NDArray = field(default_factory=lambda: np.array([STEP_AMOUNT, STEP_LENGTH, STEP_AMOUNT]))
    attrs: dict[str, str] = field(default_factory=dict)

    @property
    def samples(self) -> int:
        """Error samples at each torque."""
        return SAMPLES if self.scene.effect(ManufacturingErrors.name) is not None else 0

    @property
    def name(self) -> str:
        """Name of the minimised metric."""
        return "transmission_error_rms_mean" if self.samples else "transmission_error_peak_to_peak"

    def largest_values(self) -> NDArray:
        """Upper limits (3,) of amount [µm], length [mm] and crowning [µm], from the mean STE and the tooth height."""
        mean = sweep(self.scene, torque=[self.torques[-1]], outputs=("transmission_error_mean",))
        deflection = float(mean["transmission_error_mean"].max())
        height = min(gear.tooth_height for gear in self.scene.pair.gears)
        return np.array([1.5 * deflection, LONGEST * height, deflection])

    def scene_with(self, point: NDArray) -> Scene:
        """The scene with the tip relief and crowning of ``point`` (amount, length, crowning)."""
        amount, length, crowning = (float(f"{value:.10g}") for value in point)
        before = self.scene.effect(TipRelief.name)
        shape = before.shape if isinstance(before, TipRelief) else "linear"
        kept = [effect for effect in self.scene.effects if effect.name not in (TipRelief.name, Crowning.name)]
        if amount > 0 and length > 0:
            kept.append(TipRelief(amount=amount, length=length, shape=shape))
        if crowning > 0:
            kept.append(Crowning(amount=crowning))
        return replace(self.scene, effects=tuple(kept))

    def at(self, point: NDArray) -> NDArray:
        """Metric of ``point`` at each torque; point and metric are recorded."""
        self.points.append(np.asarray(point, dtype=float))
        self.values.append(self.metric(self.scene_with(point)))
        return self.values[-1]

    def pressure(self, scene: Scene) -> NDArray:
        """Largest contact pressure of a scene at each torque [MPa]."""
        name = "flank_pressure_max"
        return sweep(scene, torque=self.torques, outputs=(name,))[name].values

    def metric(self, scene: Scene) -> NDArray:
        """Metric of a scene at each torque [µm]."""
        output = self.name.removesuffix("_mean")
        swept = sweep(scene, torque=self.torques, outputs=(output,), samples=self.samples)[self.name]
        self.attrs = {key: str(swept.attrs[key]) for key in ("symbol", "long_name")}
        return swept.values


def draw_relief(dataset: xr.Dataset, folder: Path) -> list[Path]:
    """Write the figure of a choice: its gain over the torque, and the best amounts at each torque."""
    name, scene = dataset.attrs["minimised"], scene_of(dataset)
    figure, ((gain, choice),) = new_figure(1, 2, (11.0, 4.4))
    _gain(dataset, gain)
    _choice(dataset, choice)
    given, chosen = (float(dataset[name].sel(design=each).max()) for each in _DESIGNS[:2])
    quantity = "RMS" if name.endswith("rms_mean") else "peak-to-peak"
    finding = f"largest {quantity} STE over the torques {chosen:.3g} µm instead of {given:.3g} µm"
    figure.suptitle(f"{as_label(scene.name or 'scene')}: {finding}")
    return [write_figure(figure, folder / "relief_over_torque.png")]


def _gain(dataset: xr.Dataset, axes: Axes) -> None:
    values = dataset[dataset.attrs["minimised"]]
    for design, colour, line in zip(_DESIGNS, (GREY, BLUE, GREEN), ("--", "-", ":"), strict=True):
        axes.plot(dataset["torque"], values.sel(design=design), marker=".", ls=line, color=colour, label=design)
    axes.set(xlabel="torque on the pinion [N·m]", ylabel=f"{values.attrs['symbol']} [µm]", ylim=(0, None))
    axes.legend(frameon=False)


def _choice(dataset: xr.Dataset, axes: Axes) -> None:
    """Draw the amounts over the torque; the chosen amounts are lines."""
    chosen, best = (dataset.sel(design=design) for design in _DESIGNS[1:])
    for variable, label, colour in (("tip_relief_amount", "tip relief", BLUE), ("crowning_amount", "crowning", GREEN)):
        value = float(chosen[variable][0])
        axes.axhline(value, color=colour, lw=1.6, label=f"{label}, chosen: {value:.1f} µm")
        axes.plot(dataset["torque"], best[variable], "o", color=colour, label=f"{label}, best evaluated at each torque")
    axes.set(xlabel="torque on the pinion [N·m]", ylabel="amount [µm]")
    axes.set_ylim(bottom=-0.03 * axes.get_ylim()[1])  # a line at 0 stays visible above the frame
    if float(chosen["tip_relief_amount"][0]) > 0:
        length = float(chosen["tip_relief_length"][0])
        axes.set_title(f"chosen length of the tip relief {length:.2f} mm", fontsize=10)
    axes.legend(frameon=False, fontsize=8)
