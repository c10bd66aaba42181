"""Figure 4 of the paper, and its claims on accuracy, deflection shapes and time, against our finite elements."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gearbench.effects.gear_body import GearBody
from gearbench.effects.hertz import Hertz
from gearbench.effects.tooth_bending import ToothBending
from gearbench.library.garambois2017 import case
from gearbench.scene import Scene
from gearbench.simulation import simulate
from gearbench.validation.comparison import validate
from gearbench.validation.dataset import of_scene, side
from gearbench.validation.figures import percent

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

QUESTION = "Does the paper's 9-unknown plate come within 10 % of finite elements, 1000 times faster, as claimed?"

#: What the paper claims: relative error [%] of mean and peak-to-peak of STE and stiffness, in odd cases; MAC; time [s].
CLAIM, ODD_CASES, CLAIMED_MAC = 10.0, 25.0, 0.95
CLAIMED_FAST, CLAIMED_FE, CLAIMED_GAIN = 1.0, 1000.0, 1000.0

ERRORS = {
    "mean STE": "transmission_error_mean_error",
    "p-p STE": "transmission_error_peak_to_peak_error",
    "mean k": "mesh_stiffness_mean_error",
    "p-p k": "mesh_stiffness_peak_to_peak_error",
}
#: How far below the root circle a reference with a piece of the gear body is held [normal modules].
DEPTHS = (0.0, 0.5, 1.0, 2.0)
PAPER, SOLID, FINE = "plate paper", "solid 4 5 5", "solid 5 8 12"
MARKERS = (("o", "#0072B2"), ("s", "#56B4E9"), ("^", "#D55E00"), ("D", "#E69F00"))
COLOURS = {PAPER: ("#D55E00", "--"), SOLID: ("#0072B2", "-.")}


def cases(*, quick: bool = False) -> dict[str, Scene]:
    """The validation pairs, by name.

    Of case 2 the paper prints no profile shifts: equal ones, which undercut the pinion, and none on the pinion.
    """
    if quick:
        return {"1": case(1)}
    pair = case(2).pair
    total = sum(gear.profile_shift for gear in pair.gears)
    members = {name: replace(getattr(pair, name), profile_shift=x) for name, x in (("pinion", 0.0), ("wheel", total))}
    return {"1": case(1), "2": case(2), "2, x1 = 0": replace(case(2), pair=replace(pair, **members))}


def models(*, quick: bool = False) -> dict[str, ToothBending]:
    """Fast models by name: the paper's plate, every convention of it, and solids."""
    found = {
        PAPER: ToothBending(basis="paper"),
        SOLID: ToothBending(model="solid", order=(4, 5, 5)),
        FINE: ToothBending(model="solid", order=(5, 8, 12)),
    }
    if quick:
        return found
    for basis, order in (("paper", None), ("3 3", (3, 3)), ("5 5", (5, 5))):
        for fillet in (False, True):
            for load in ("full", "component"):
                name = f"plate {basis}{' fillet' * fillet}{' component' * (load == 'component')}"
                plate = ToothBending(basis="paper" if order is None else None, order=order, fillet=fillet, load=load)
                found.setdefault(name, plate)
    return found | {"solid 4 5 10": ToothBending(model="solid", order=(4, 5, 10))}


def on_body(scene: Scene, depth: float) -> Scene:
    """Finite elements in place of the teeth, held ``depth`` modules below the root circle; 0: at the root."""
    law = Hertz(law="weber_banaschek")
    if depth == 0:
        return replace(scene, effects=(ToothBending(model="finite_elements"), law))
    pair, below = scene.pair, depth * scene.pair.normal_module
    bores = [2 * (gear.root_radius - below) for gear in pair.gears]
    pinion, wheel = replace(pair.pinion, bore_diameter=bores[0]), replace(pair.wheel, bore_diameter=bores[1])
    effects = (ToothBending(model="finite_elements", accuracy=0.02), GearBody(), law)
    return replace(scene, pair=replace(pair, pinion=pinion, wheel=wheel), effects=effects)


def body_errors(scene: Scene, depths: tuple[float, ...]) -> np.ndarray:
    """Errors of the paper's plate [%] against finite elements held that deep below the root, (depth, error)."""
    names = [name.removesuffix("_error") for name in ERRORS.values()]
    plate = simulate(scene, outputs=names)
    found = [simulate(on_body(scene, depth), outputs=names) for depth in depths]
    return np.array([[100 * float(plate[name] / each[name] - 1) for name in names] for each in found])


def compute(*, quick: bool = False) -> xr.Dataset:
    """Every model on every pair (quick: case 1) against finite elements."""
    wanted = [
        (number, tooth, replace(scene, name=f"case {number}, {tooth}", effects=(model, Hertz(law="weber_banaschek"))))
        for number, scene in cases(quick=quick).items()
        for tooth, model in models(quick=quick).items()
    ]
    dataset = validate([scene for _, _, scene in wanted])
    labels = {"case": [number for number, _, _ in wanted], "tooth": [tooth for _, tooth, _ in wanted]}
    dataset = dataset.assign_coords({name: ("scene", values) for name, values in labels.items()})
    depths = DEPTHS[:1] if quick else DEPTHS
    pairs = {number: scene for number, scene in cases(quick=quick).items() if number in ("1", "2")}
    of_body = np.array([body_errors(scene, depths) for scene in pairs.values()])
    body = (("pair_name", "depth", "quantity"), of_body, {"units": "%", "long_name": "error of the paper's plate"})
    return dataset.assign(body_error=body).assign_coords(
        pair_name=list(pairs), quantity=list(ERRORS), depth=("depth", list(depths), {"units": "modules"})
    )


def of_model(dataset: xr.Dataset, number: str, name: str) -> xr.Dataset:
    """The comparison of one model on one case."""
    hit = (dataset["case"].values == number) & (dataset["tooth"].values == name)
    return of_scene(dataset, int(np.flatnonzero(hit)[0]))


def cases_of(dataset: xr.Dataset) -> list[str]:
    """Names of the pairs, in the order they were computed."""
    return list(dict.fromkeys(dataset["case"].values.tolist()))


def names_of(dataset: xr.Dataset) -> list[str]:
    """Names of the models, in the order they were computed."""
    return list(dict.fromkeys(dataset["tooth"].values.tolist()))


def errors(one: xr.Dataset) -> np.ndarray:
    """Relative errors of ``ERRORS`` [%]."""
    return np.array([float(one[name]) for name in ERRORS.values()])


def checks(dataset: xr.Dataset) -> list[tuple[str, bool]]:
    """What holds of the fast models; where the paper's own claims stand is in the report."""
    found = []
    for number in cases_of(dataset):
        plate, solid, fine = (of_model(dataset, number, name) for name in (PAPER, SOLID, FINE))
        for label, worst in (
            (f"{FINE}, means and peak-to-peaks", np.abs(errors(fine)).max()),
            (f"{SOLID}, means", np.abs(errors(solid)[::2]).max()),
        ):
            found.append((f"case {number}: {label} within {worst:.1f} % of finite elements", bool(worst < CLAIM)))
        mac = float(solid["line_mac_mean"].min())
        found.append((f"case {number}: {SOLID}, MAC {mac:.3f} under contact lines", mac >= CLAIMED_MAC))
        seconds = float(plate["compliance_seconds"][0])
        found.append((f"case {number}: {PAPER}, compliance in {1e3 * seconds:.1f} ms", seconds < CLAIMED_FAST))
        nearer = float(np.abs(errors(solid)).max() / np.abs(errors(plate)).max())
        found.append((f"case {number}: worst error of {SOLID} {nearer:.2f} of that of {PAPER}", nearer < 1))
    return found


# -- figures ----------------------------------------------------------------------------------------------------------
def figures(dataset: xr.Dataset, folder: Path) -> None:
    """Figure 4, errors of all models, and a table of claims and conventions."""
    for number in cases_of(dataset):
        _figure_4(dataset, number, folder / f"figure4_{slug(number)}.png")
    _all_errors(dataset, folder / "errors.png")
    _body(dataset, folder / "body.png")
    (folder / "report.md").write_text(_report(dataset), encoding="utf-8")


def slug(number: str) -> str:
    """Name of a pair as a part of a file's name."""
    return "case_" + "".join(c if c.isalnum() else "_" for c in number.replace(", ", " ").replace(" = ", " "))


def _figure_4(dataset: xr.Dataset, number: str, path: Path) -> None:
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(2, 1, figsize=(7.5, 6.4), sharex=True, layout="constrained")
    found = {name: of_model(dataset, number, name) for name in (PAPER, SOLID)}
    for axis, name in zip(axes, ("transmission_error", "mesh_stiffness"), strict=True):
        _curve(axis, side(found[PAPER], "reference"), name, color="black", lw=2.4, label="finite elements")
        for label, one in found.items():
            colour, line = COLOURS[label]
            _curve(axis, side(one, "fast"), name, color=colour, ls=line, lw=1.7, label=label)
        attrs = dataset[name].attrs
        means = ", ".join(f"{label} {percent(float(one[f'{name}_mean_error']))}" for label, one in found.items())
        axis.set_title(f"case {number}, mean {attrs['symbol']} against finite elements: {means}", fontsize=10)
        axis.set(ylabel=f"{attrs['symbol']} [{attrs['units']}]", xlim=(0, 2))
        axis.set_ylim(bottom=0)
    axes[1].set_xlabel("mesh phase τ [mesh periods]")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, frameon=False)
    figure.savefig(path, dpi=150)
    plt.close(figure)


def _curve(axis: Axes, dataset: xr.Dataset, name: str, **style) -> None:
    from gearbench.cycle import panels

    parts = panels(dataset, name)
    x = np.concatenate([phase + period for period in (0, 1) for phase, _ in parts])
    axis.plot(x, np.concatenate([values for _, values in parts] * 2), **style)


def _all_errors(dataset: xr.Dataset, path: Path) -> None:
    import matplotlib.pyplot as plt

    numbers, names = cases_of(dataset), names_of(dataset)
    size = (5.0 * len(numbers) + 1.5, 1.8 + 0.34 * len(names))
    figure, axes = plt.subplots(1, len(numbers), figsize=size, sharey=True, squeeze=False, layout="constrained")
    within = np.ones(len(names), dtype=bool)
    for axis, number in zip(axes[0], numbers, strict=True):
        values = np.array([errors(of_model(dataset, number, name)) for name in names])
        within &= np.abs(values).max(axis=1) < CLAIM
        for i, (label, (marker, colour)) in enumerate(zip(ERRORS, MARKERS, strict=True)):
            axis.plot(values[:, i], range(len(names)), marker, color=colour, label=label, ms=6)
        axis.axvspan(-CLAIM, CLAIM, color="0.9", zorder=0)
        axis.axvline(0, color="0.4", lw=0.8)
        axis.set_xscale("symlog", linthresh=CLAIM)
        axis.set_xlim(min(-30, 1.3 * values.min()), max(30, 1.3 * values.max()))
        ticks = [-30, -10, 0, 10, 30, 100]
        axis.set_xticks(ticks, [f"{tick:+d}" if tick else "0" for tick in ticks])
        axis.set_xlabel("error against finite elements [%]")
        best = names[int(np.argmin(np.abs(values).max(axis=1)))]
        least = np.abs(values).max(axis=1).min()
        axis.set_title(f"case {number}: {best} comes nearest, {least:.1f} % at most", fontsize=10)
    axes[0, 0].set_yticks(range(len(names)), names)
    axes[0, 0].invert_yaxis()
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False)
    holds = ", ".join(np.array(names)[within]) or "no model"
    figure.suptitle(f"Within the claimed {CLAIM:g} % (grey) everywhere: {holds}", fontsize=12)
    figure.savefig(path, dpi=150)
    plt.close(figure)


def _body(dataset: xr.Dataset, path: Path) -> None:
    import matplotlib.pyplot as plt

    numbers, depth = list(dataset["pair_name"].values), dataset["depth"].values
    size = (4.6 * len(numbers) + 0.6, 4.4)
    figure, axes = plt.subplots(1, len(numbers), figsize=size, sharey=True, squeeze=False, layout="constrained")
    for axis, number in zip(axes[0], numbers, strict=True):
        values = dataset["body_error"].sel(pair_name=number).values
        for label, (marker, colour), column in zip(ERRORS, MARKERS, values.T, strict=True):
            axis.plot(depth, column, f"-{marker}", color=colour, label=label)
        axis.axhspan(-CLAIM, CLAIM, color="0.9", zorder=0)
        axis.axhline(0, color="0.4", lw=0.8)
        axis.set_yscale("symlog", linthresh=CLAIM)
        ticks = [-30, -10, 0, 10, 30, 100]
        axis.set_yticks(ticks, [f"{tick:+d}" if tick else "0" for tick in ticks])
        axis.set_xlabel("reference held below the root circle [modules]")
        least = int(np.argmin(np.abs(values[:, ::2]).max(axis=1)))
        means = np.abs(values[least, ::2]).max()
        axis.set_title(f"case {number}: means within {means:.1f} % at {depth[least]:g} modules", fontsize=10)
    axes[0, 0].set_ylabel("error of the paper's plate [%]")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False)
    figure.savefig(path, dpi=150)
    plt.close(figure)


# -- report -----------------------------------------------------------------------------------------------------------
def _report(dataset: xr.Dataset) -> str:
    lines = ["# Validation of Garambois et al. 2017 against finite elements", ""]
    for number in cases_of(dataset):
        lines += _claims(dataset, number)
    lines += [*_conventions(dataset), "", *_bodies(dataset)]
    return "\n".join(lines) + "\n"


def _claims(dataset: xr.Dataset, number: str) -> list[str]:
    plate, solid = (of_model(dataset, number, name) for name in (PAPER, SOLID))
    rows = [
        (f"{label}: error under {CLAIM:g} % (odd cases {ODD_CASES:g} %)", *(float(one[name]) for one in (plate, solid)))
        for label, name in ERRORS.items()
    ]
    lines = [
        f"## Case {number}: the paper's claims",
        "",
        f"| claim | {PAPER} | | {SOLID} | |",
        "|---|---|---|---|---|",
    ]
    for text, *values in rows:
        cells = " | ".join(f"{percent(v)} | {_verdict(abs(v) < CLAIM, abs(v) < ODD_CASES)}" for v in values)
        lines.append(f"| {text} | {cells} |")
    for text, name in (("contact line, mean", "line_mac_mean"), ("contact line, worst", "line_mac_worst"),
                       ("point load, mean", "mac_mean"), ("point load, worst", "mac_worst")):  # fmt: skip
        values = [float(one[name].min()) for one in (plate, solid)]
        cells = " | ".join(f"{v:.3f} | {_verdict(v >= CLAIMED_MAC)}" for v in values)
        lines.append(f"| MAC {CLAIMED_MAC:g} ({text}, lesser gear) | {cells} |")
    fast = [float(one["compliance_seconds"][0]) for one in (plate, solid)]
    slow = float(plate["compliance_seconds"][1])
    cells = " | ".join(f"{1e3 * v:.1f} ms | {_verdict(v < CLAIMED_FAST)}" for v in fast)
    lines.append(f"| compliance in less than {CLAIMED_FAST:g} s | {cells} |")
    cells = " | ".join(f"{slow / v:.0f} | {_verdict(slow / v >= CLAIMED_GAIN)}" for v in fast)
    lines.append(f"| {CLAIMED_GAIN:g} times faster than finite elements | {cells} |")
    error = 100 * float(plate["reference_error"].max())
    unknowns = " and ".join(f"{n:.0f}" for n in plate["reference_unknowns"].values)
    return [
        *lines,
        "",
        f"Finite elements: {slow:.1f} s for both gears (the paper: more than {CLAIMED_FE:g} s), estimated error of the",
        f"compliance {error:.1f} %, {unknowns} unknowns, {plate.attrs['reference_element']}, solved by",
        f"{plate.attrs['reference_solver']}.",
        "",
    ]


def _verdict(holds: bool, nearly: bool = False) -> str:
    return "holds" if holds else "only as an odd case" if nearly else "does not hold"


def _conventions(dataset: xr.Dataset) -> list[str]:
    numbers, names = cases_of(dataset), names_of(dataset)
    head = " | ".join(f"{label}, case {number}" for number in numbers for label in ERRORS)
    lines = ["## Which convention of the plate comes nearest", "", f"| model | {head} | worst |"]
    lines.append("|---" * (2 + len(numbers) * len(ERRORS)) + "|")
    table = {name: np.concatenate([errors(of_model(dataset, n, name)) for n in numbers]) for name in names}
    for name in sorted(table, key=lambda each: np.abs(table[each]).max()):
        cells = " | ".join(percent(v) for v in table[name])
        lines.append(f"| {name} | {cells} | {np.abs(table[name]).max():.1f} % |")
    lines += [
        "",
        "fillet: thickness with the generated fillet. component: only the part of the load normal to the mid-plane of",
        "the tooth bends it. All with the same contact law (Weber–Banaschek) and rigid bodies. The finite elements",
        "are clamped along the root circle; their deflection is that of the flank less the compression that the",
        "contact law counts.",
    ]
    return lines


def _bodies(dataset: xr.Dataset) -> list[str]:
    lines = [
        "## A reference with a piece of the gear body",
        "",
        "The paper does not print where its finite elements are held. The paper's plate against finite elements that",
        "are held the given number of modules below the root circle, all teeth on one body:",
        "",
        f"| case | modules below the root | {' | '.join(ERRORS)} |",
        "|---" * (2 + len(ERRORS)) + "|",
    ]
    for number in dataset["pair_name"].values:
        for depth in dataset["depth"].values:
            values = dataset["body_error"].sel(pair_name=number, depth=depth).values
            lines.append(f"| {number} | {depth:g} | {' | '.join(percent(float(v)) for v in values)} |")
    return lines
