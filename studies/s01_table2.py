"""The convention of manufacturing errors that reproduces Table 2 of Garambois et al. 2017, and how well it does.

The paper says that errors are random, of ISO class 6, linear and parabolic along profile and helix, plus parallelism
of the axes; it does not print how they are signed, anchored, distributed or shared. A small set of conventions is
tried on all known rows of the table, with nothing fitted; every one tried is in the Dataset and in the report.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gearbench.effects.manufacturing_errors import PRESETS, ErrorKind, ManufacturingErrors
from gearbench.library.garambois2017 import Row, table_2
from gearbench.robustness.montecarlo import Responses, default_threads, prepare_scene, respond
from gearbench.scene import Resolution, Scene

if TYPE_CHECKING:
    import xarray as xr

QUESTION = "Which convention of manufacturing errors reproduces Table 2 of the paper?"

COLUMNS = ("m_k", "m_ste", "sigma_k", "max_k", "sigma_ste", "max_ste")
UNITS = {"m_k": "%", "m_ste": "µm", "sigma_k": "%", "max_k": "%", "sigma_ste": "µm", "max_ste": "µm"}
LIMITS = {"m_k": 0.10, "m_ste": 0.15, "sigma_k": 0.30, "max_k": 0.30, "sigma_ste": 0.30, "max_ste": 0.30}

BASE = PRESETS["garambois2017"]


def scene(row: Row, errors: ManufacturingErrors = BASE, resolution: Resolution | None = None) -> Scene:
    """A row of the table with the given errors."""
    plain = row.scene(resolution=resolution)
    return replace(plain, effects=(*plain.effects, errors))


def product_conventions() -> Iterator[tuple[str, ManufacturingErrors]]:
    """The grid: distributions × which profile tolerance is which × profile coordinate × what misaligns the flanks."""
    tolerances = {
        "as named": ("profile_slope", "profile_form"),
        "exchanged": ("profile_form", "profile_slope"),
        "f_Hα for both": ("profile_slope", "profile_slope"),
    }
    misfits = {"helix slope": (True, False), "axes": (False, True), "helix slope + axes": (True, True)}
    slopes = ("uniform", "uniform_two_sided", "normal_two_sided")
    for along, slope, form, (which, (s, f)), (misfit, (helix, axes)) in product(
        ("roll", "radius"), slopes, ("uniform", "normal"), tolerances.items(), misfits.items()
    ):
        turn = ErrorKind(distribution="normal_two_sided" if slope == "uniform_two_sided" else slope)
        yield (
            f"{along}; slopes {slope}; forms {form}; profile tolerances {which}; misfit {misfit}",
            ManufacturingErrors(
                iso_class=6,
                edition="1995",
                along=along,
                profile_slope=ErrorKind(distribution=slope, tolerance=s),
                profile_form=ErrorKind(distribution=form, tolerance=f),
                helix_form=ErrorKind(distribution=form),
                helix_slope=turn if helix else None,
                inclination=turn if axes else None,
                deviation=turn if axes else None,
            ),
        )


def single_changes() -> Iterator[tuple[str, ManufacturingErrors, Resolution]]:
    """The adopted convention with one thing changed at a time."""

    def kinds(**change: Any) -> ManufacturingErrors:
        names = ("profile_slope", "profile_form", "helix_slope", "helix_form")
        given = {name: getattr(BASE, name) for name in names}
        return replace(BASE, **{name: replace(kind, **change) for name, kind in given.items() if kind is not None})

    default = Resolution()
    assert BASE.profile_form is not None
    assert BASE.profile_slope is not None
    assert BASE.helix_form is not None
    yield "adopted", BASE, default
    yield "edition 2013", replace(BASE, edition="2013"), default
    yield "tolerances rounded", replace(BASE, rounded=True), default
    yield "profile: involute", replace(BASE, profile_range="involute"), default
    yield "profile: whole tooth", replace(BASE, profile_range="tooth"), default
    yield "hollow instead of barrel", replace(BASE, profile_form=replace(BASE.profile_form, sign=-1)), default
    yield (
        "forms two-sided",
        replace(
            BASE,
            profile_form=replace(BASE.profile_form, distribution="normal_two_sided"),
            helix_form=replace(BASE.helix_form, distribution="normal_two_sided"),
        ),
        default,
    )
    yield "no profile slope", replace(BASE, profile_slope=None), default
    yield "no profile form", replace(BASE, profile_form=None), default
    yield "no helix form", replace(BASE, helix_form=None), default
    yield "no parallelism", replace(BASE, inclination=None, deviation=None), default
    yield "one gear only", kinds(gear="pinion"), default
    yield "each tooth its own", kinds(drawn="tooth"), default
    for count in (16, 32, 64):
        yield f"{count} uniform positions", BASE, Resolution(positions=count)
    for count in (5, 31):
        yield f"{count} segments", BASE, Resolution(segments=count)


def evaluate(errors: ManufacturingErrors, resolution: Resolution, samples: int) -> NDArray:
    """Statistics of every row, (gear, column), with scrambled Sobol samples of seed 0."""
    results = []
    for row in table_2():
        problem = prepare_scene(scene(row, errors, resolution))
        answer, _ = respond(problem, problem.draw(samples, 0, "sobol"), default_threads())
        results.append(statistics(answer))
    return np.array(results)


def statistics(answer: Responses) -> tuple[float, ...]:
    """In the order of ``COLUMNS``."""
    k, ste = answer["mesh_stiffness_rms"], answer["transmission_error_rms"]
    return tuple(map(float, (k.mean(), ste.mean(), k.std(ddof=1), k.max(), ste.std(ddof=1), ste.max())))


def paper() -> NDArray:
    """What the paper prints, (gear, column)."""
    return np.array([[getattr(row, column) for column in COLUMNS] for row in table_2()])


def compute(*, quick: bool = False) -> xr.Dataset:
    """Every convention tried on every row, and the adopted one with 1000 samples."""
    import xarray as xr

    tried = list(single_changes())
    tried += [(name, errors, Resolution()) for name, errors in ([] if quick else product_conventions())]
    values = [evaluate(errors, resolution, 64 if quick else 256) for _, errors, resolution in tried]
    gears = [row.gear for row in table_2()]
    return xr.Dataset(
        {
            "paper": (("gear", "column"), paper()),
            "ours": (("gear", "column"), evaluate(BASE, Resolution(), 256 if quick else 1000)),
            "tried": (("convention", "gear", "column"), np.array(values)),
        },
        coords={
            "gear": gears,
            "column": list(COLUMNS),
            "convention": [name for name, _, _ in tried],
            "error_free_m_ste": ("gear", error_free()),
        },
    )


def error_free() -> NDArray:
    """RMS of the STE of every row without errors [µm], (gear,)."""
    from gearbench.simulation import simulate

    name = "transmission_error_rms"
    return np.array([float(simulate(row.scene(), outputs=(name,))[name]) for row in table_2()])


def log_rms(ours: NDArray, theirs: NDArray) -> NDArray:
    """Log-RMS deviation of each column, over the gears."""
    return np.sqrt(np.mean(np.log(ours / theirs) ** 2, axis=-2))


def spearman(ours: NDArray, theirs: NDArray) -> tuple[float, float]:
    """Rank correlation of m_k and of m_ste."""
    from scipy.stats import spearmanr

    k, ste = (float(spearmanr(ours[:, i], theirs[:, i]).statistic) for i in (0, 1))
    return k, ste


def checks(dataset: xr.Dataset) -> list[tuple[str, bool]]:
    """What must hold of the adopted convention."""
    ours, theirs = dataset["ours"].values, dataset["paper"].values
    deviation = log_rms(ours, theirs)
    found = [
        (f"{c}: log-RMS deviation {d:.3f} ≤ {LIMITS[c]:.2f}", bool(d <= LIMITS[c]))
        for c, d in zip(COLUMNS, deviation, strict=True)
    ]
    for name, rho in zip(("m_k", "m_ste"), spearman(ours, theirs), strict=True):
        found.append((f"{name}: Spearman rank correlation {rho:.3f} ≥ 0.9", rho >= 0.9))
    return found


def figures(dataset: xr.Dataset, folder: Path) -> None:
    """Scatter plots of our values against the paper's, and the report with every convention tried."""
    _scatter(dataset, folder / "table2_scatter.png")
    _tried(dataset, folder / "table2_conventions.png")
    (folder / "table2.md").write_text(_report(dataset), encoding="utf-8")


def _scatter(dataset: xr.Dataset, path: Path) -> None:
    import matplotlib.pyplot as plt

    ours, theirs = dataset["ours"].values, dataset["paper"].values
    deviation = log_rms(ours, theirs)
    figure, axes = plt.subplots(2, 3, figsize=(11, 7), layout="constrained")
    for i, axis in enumerate(axes.flat):
        column = COLUMNS[i]
        low, high = (f(np.concatenate([ours[:, i], theirs[:, i]])) for f in (np.min, np.max))
        line = np.array([low * 0.85, high * 1.15])
        axis.fill_between(line, line / np.exp(LIMITS[column]), line * np.exp(LIMITS[column]), color="0.9", lw=0)
        axis.plot(line, line, color="0.4", lw=1)
        axis.plot(theirs[:, i], ours[:, i], "o", ms=5, color="#0072B2", mec="white", mew=0.5)
        axis.plot(theirs[0, i], ours[0, i], "s", ms=6, color="#D55E00", mec="white", mew=0.5, label="gear SC")
        axis.set(xscale="log", yscale="log", xlim=line, ylim=line, aspect="equal")
        symbol = column.replace("sigma", "σ").replace("max", "M").replace("_", " ")
        axis.set_xlabel(f"{symbol}, paper [{UNITS[column]}]")
        axis.set_ylabel(f"{symbol}, gearbench [{UNITS[column]}]")
        axis.set_title(f"{symbol}: log-RMS {deviation[i]:.3f} (limit {LIMITS[column]:.2f})", fontsize=10)
        _plain_ticks(axis)
    axes.flat[1].legend(loc="lower right", frameon=False)
    within = int(sum(d <= LIMITS[c] for c, d in zip(COLUMNS, deviation, strict=True)))
    figure.suptitle(f"Table 2 of the paper, 31 gears: {within} of 6 columns within their limits (grey: limit)")
    figure.savefig(path, dpi=150)
    plt.close(figure)


def _plain_ticks(axis: Any) -> None:
    from matplotlib.ticker import LogLocator, NullFormatter, ScalarFormatter

    for side in (axis.xaxis, axis.yaxis):
        side.set_major_locator(LogLocator(subs=(1, 2, 5)))
        side.set_major_formatter(ScalarFormatter())
        side.set_minor_formatter(NullFormatter())


def _tried(dataset: xr.Dataset, path: Path) -> None:
    import matplotlib.pyplot as plt

    deviation = log_rms(dataset["tried"].values, dataset["paper"].values)
    worst = np.max(deviation / np.array([LIMITS[c] for c in COLUMNS]), axis=1)
    order = np.argsort(worst)[:30]
    figure, axis = plt.subplots(figsize=(12, 8.5), layout="constrained")
    colours = dict(zip(COLUMNS, ("#0072B2", "#D55E00", "#56B4E9", "#009E73", "#E69F00", "#CC79A7"), strict=True))
    for i, column in enumerate(COLUMNS):
        label = column.replace("sigma", "σ").replace("max", "M").replace("_", " ")
        axis.plot(deviation[order, i] / LIMITS[column], range(len(order)), "o", color=colours[column], label=label)
    axis.axvline(1.0, color="0.4", lw=1)
    names = [str(dataset["convention"].values[i]).replace("_", "-") for i in order]
    axis.set_yticks(range(len(order)), names, fontsize=8)
    axis.invert_yaxis()
    axis.set_xlabel("log-RMS deviation over all gears / its limit [–]")
    count = int(np.sum(worst <= 1))
    figure.suptitle(f"{count} of {len(worst)} conventions keep all six columns within their limits (best 30 shown)")
    figure.legend(loc="outside lower center", ncols=6, frameon=False)
    figure.savefig(path, dpi=150)
    plt.close(figure)


def _report(dataset: xr.Dataset) -> str:
    ours, theirs = dataset["ours"].values, dataset["paper"].values
    deviation, (rho_k, rho_ste) = log_rms(ours, theirs), spearman(ours, theirs)
    names = " | ".join(COLUMNS)
    lines = [
        "# Table 2 of Garambois et al. 2017",
        "",
        f"Adopted convention, {len(ours)} gears; each cell: gearbench / paper.",
        "",
        f"| gear | {names} | error-free RMS STE [µm] |",
        "|---" * (len(COLUMNS) + 2) + "|",
    ]
    for i, gear in enumerate(dataset["gear"].values):
        cells = " | ".join(f"{o:.2f} / {t:.2f}" for o, t in zip(ours[i], theirs[i], strict=True))
        lines.append(f"| {gear} | {cells} | {float(dataset['error_free_m_ste'][i]):.2f} |")
    lines.append(f"| **log-RMS** | {' | '.join(f'{d:.3f}' for d in deviation)} | |")
    lines.append(f"| limit | {' | '.join(f'{LIMITS[c]:.2f}' for c in COLUMNS)} | |")
    without = log_rms(ours[1:], theirs[1:])
    lines += [
        f"| log-RMS without SC | {' | '.join(f'{d:.3f}' for d in without)} | |",
        "",
        f"Spearman rank correlation: m_k {rho_k:.3f}, m_ste {rho_ste:.3f}.",
        "",
        "Gear SC stands apart in one column only: the paper prints the error-free value of its STE there, next to a",
        "standard deviation and a maximum that belong to a mean half as large (everywhere else the maximum of the",
        "samples lies about three standard deviations above the mean; for SC it would be two). Every other gear agrees",
        "with one convention: straight errors of the profile two-sided, parabolic ones barrel-shaped, near their mean.",
        "",
        "## Every convention tried",
        "",
        f"| convention | {names} | worst / limit |",
        "|---" * (len(COLUMNS) + 2) + "|",
    ]
    tried = log_rms(dataset["tried"].values, theirs)
    worst = np.max(tried / np.array([LIMITS[c] for c in COLUMNS]), axis=1)
    for i in np.argsort(worst):
        cells = " | ".join(f"{d:.3f}" for d in tried[i])
        lines.append(f"| {dataset['convention'].values[i]} | {cells} | {worst[i]:.2f} |")
    return "\n".join(lines) + "\n"
