"""Figure 4 of the paper, and its claims on accuracy, deflection shapes and time, against our finite elements."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gearbench.effects.hertz import Hertz
from gearbench.effects.tooth_bending import ToothBending
from gearbench.library.garambois2017 import case
from gearbench.scene import Scene
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
PAPER, SOLID = "plate paper", "solid 4 5 5"
COLOURS = {PAPER: ("#D55E00", "--"), SOLID: ("#0072B2", "-.")}


def models(*, quick: bool = False) -> dict[str, ToothBending]:
    """Fast models by name: the paper's plate, every convention of it, and the solid."""
    found = {PAPER: ToothBending(basis="paper"), SOLID: ToothBending(model="solid", order=(4, 5, 5))}
    if quick:
        return found
    for basis, order in (("paper", None), ("3 3", (3, 3)), ("5 5", (5, 5))):
        for fillet in (False, True):
            for load in ("full", "component"):
                name = f"plate {basis}{' fillet' * fillet}{' component' * (load == 'component')}"
                plate = ToothBending(basis="paper" if order is None else None, order=order, fillet=fillet, load=load)
                found.setdefault(name, plate)
    return found | {"solid 5 8 8": ToothBending(model="solid", order=(5, 8, 8))}


def scene(number: int, model: ToothBending, name: str) -> Scene:
    """Case 1 or 2 of the paper with a fast model."""
    return replace(case(number), name=f"case {number}, {name}", effects=(model, Hertz(law="weber_banaschek")))


def compute(*, quick: bool = False) -> xr.Dataset:
    """Every model on both cases (quick: the first) against finite elements."""
    cases = (1,) if quick else (1, 2)
    wanted = [(number, name, model) for number in cases for name, model in models(quick=quick).items()]
    dataset = validate([scene(number, model, name) for number, name, model in wanted])
    labels = {"case": [number for number, _, _ in wanted], "tooth": [name for _, name, _ in wanted]}
    return dataset.assign_coords({name: ("scene", values) for name, values in labels.items()})


def of_model(dataset: xr.Dataset, number: int, name: str) -> xr.Dataset:
    """The comparison of one model on one case."""
    hit = (dataset["case"].values == number) & (dataset["tooth"].values == name)
    return of_scene(dataset, int(np.flatnonzero(hit)[0]))


def cases_of(dataset: xr.Dataset) -> list[int]:
    """Numbers of the cases computed."""
    return sorted(set(dataset["case"].values.tolist()))


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
        solid, plate = of_model(dataset, number, SOLID), of_model(dataset, number, PAPER)
        worst = float(np.abs(errors(solid)).max())
        found.append((f"case {number}: solid within {worst:.1f} % of finite elements", worst < CLAIM))
        mac = float(solid["line_mac_mean"].min())
        found.append((f"case {number}: solid, MAC {mac:.3f} under contact lines", mac >= CLAIMED_MAC))
        for label, one in (("plate", plate), ("solid", solid)):
            seconds = float(one["compliance_seconds"][0])
            found.append((f"case {number}: {label} compliance in {1e3 * seconds:.1f} ms", seconds < CLAIMED_FAST))
        nearer = float(np.abs(errors(solid)).max() / np.abs(errors(plate)).max())
        found.append((f"case {number}: the solid's worst error is {nearer:.2f} of the paper's plate", nearer < 1))
    return found


# -- figures ----------------------------------------------------------------------------------------------------------
def figures(dataset: xr.Dataset, folder: Path) -> None:
    """Figure 4, errors of all models, and a table of claims and conventions."""
    for number in cases_of(dataset):
        _figure_4(dataset, number, folder / f"figure4_case{number}.png")
    _all_errors(dataset, folder / "errors.png")
    (folder / "report.md").write_text(_report(dataset), encoding="utf-8")


def _figure_4(dataset: xr.Dataset, number: int, path: Path) -> None:
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

    cases, names = cases_of(dataset), names_of(dataset)
    size = (5.6 * len(cases) + 1.5, 1.8 + 0.34 * len(names))
    figure, axes = plt.subplots(1, len(cases), figsize=size, sharey=True, squeeze=False, layout="constrained")
    within = np.ones(len(names), dtype=bool)
    markers = dict(zip(ERRORS, (("o", "#0072B2"), ("s", "#56B4E9"), ("^", "#D55E00"), ("D", "#E69F00")), strict=True))
    for axis, number in zip(axes[0], cases, strict=True):
        values = np.array([errors(of_model(dataset, number, name)) for name in names])
        within &= np.abs(values).max(axis=1) < CLAIM
        for i, (label, (marker, colour)) in enumerate(markers.items()):
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


# -- report -----------------------------------------------------------------------------------------------------------
def _report(dataset: xr.Dataset) -> str:
    lines = ["# Validation of Garambois et al. 2017 against finite elements", ""]
    for number in cases_of(dataset):
        lines += _claims(dataset, number)
    lines += _conventions(dataset)
    return "\n".join(lines) + "\n"


def _claims(dataset: xr.Dataset, number: int) -> list[str]:
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
    cases, names = cases_of(dataset), names_of(dataset)
    head = " | ".join(f"{label}, case {number}" for number in cases for label in ERRORS)
    lines = ["## Which convention of the plate comes nearest", "", f"| model | {head} | worst |"]
    lines.append("|---" * (2 + len(cases) * len(ERRORS)) + "|")
    table = {name: np.concatenate([errors(of_model(dataset, n, name)) for n in cases]) for name in names}
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
