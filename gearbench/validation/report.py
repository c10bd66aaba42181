"""Report of a validation: one self-contained HTML file with its pictures."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from importlib.resources import files
from pathlib import Path
from string import Template

import numpy as np

from gearbench.files import make_folder, write_text
from gearbench.html import head, picture, table
from gearbench.lazy import xr
from gearbench.results.netcdf import save
from gearbench.validation import figures
from gearbench.validation.dataset import of_scene
from gearbench.validation.figures import duration
from gearbench.validation.judge import NEGLIGIBLE, TIMES
from gearbench.validation.mac import RESPONSES
from gearbench.validation.mesh_picture import mesh_figure

REPORT, DATASET = "report.html", "validation.nc"
_ERRORS = {
    "mean STE": "transmission_error_mean",
    "peak-to-peak STE": "transmission_error_peak_to_peak",
    "mean stiffness": "mesh_stiffness_mean",
    "peak-to-peak stiffness": "mesh_stiffness_peak_to_peak",
}


def write(dataset: xr.Dataset, folder: str | Path) -> list[Path]:
    """Write report and Dataset of a validation into ``folder``.

    Raises
    ------
    InputError
        If the folder cannot be made or written.
    OSError
        If the disk is full or fails; existing files stay untouched.
    """
    folder = make_folder("output", folder)
    text = render(dataset)  # before anything is written
    saved = save(dataset, folder / DATASET)
    return [write_text(folder / REPORT, text), saved]


def render(dataset: xr.Dataset) -> str:
    """Render the report as HTML text."""
    scenes = [of_scene(dataset, i) for i in range(dataset.sizes["scene"])]
    names = [str(name) for name in dataset["scene"].values]
    title = f"Validation against finite elements: {', '.join(names)}"
    many = f"{len(scenes)} scene{'s' * (len(scenes) > 1)}"
    return Template(files("gearbench.validation").joinpath("report.html").read_text(encoding="utf-8")).substitute(
        head=head(title),
        title=escape(title),
        intro=escape(f"{many}, {duration(dataset.attrs['wall_time_s'])} in all, {dataset.attrs['created']}."),
        overview=_overview(names, scenes),
        scenes="\n".join(_section(i, name, scene) for i, (name, scene) in enumerate(zip(names, scenes, strict=True))),
        method=_method(dataset),
    )


def finding(one: xr.Dataset) -> str:
    """Findings of the comparison of a scene as sentences; ± is the uncertainty of the reference."""
    errors = ", ".join(f"{label} {_error(one, f'{name}_error')}" for label, name in _ERRORS.items())
    fast, slow = one["compliance_seconds"].values
    worst, mean, line = (float(one[name].min()) for name in ("mac_worst", "mac_mean", "line_mac_mean"))
    if "mesh_load_factor" in one:
        sharing = 100 * float(one["load_share_error_max"])
        errors += f", K_γ {_error(one, 'mesh_load_factor_error')}, load sharing within {sharing:.2g} % of an even share"
    return (
        f"Against finite elements: {errors}; deflection shapes agree to MAC {mean:.3f} under a point load "
        f"({worst:.3f} at worst), {line:.3f} under a contact line. Compliance in {duration(fast)} instead of "
        f"{duration(slow)}, a factor of {slow / fast:.0f}.{_unsettled(one)}"
    )


def _error(one: xr.Dataset, name: str) -> str:
    """Format a difference [%] and its error bar, with the digits that the bar allows."""
    value, bar = float(one[name]), float(one[f"{name}_bar"])
    if not np.isfinite(value):
        return "undefined"
    digits = int(np.clip(np.ceil(-np.log10(max(bar, 1e-9))), 1, 3))
    return f"{value:+.{digits}f} ± {bar:.1g} %".replace("-", "−")


def _unsettled(one: xr.Dataset) -> str:
    """Sentence on differences that the reference cannot judge, and why it is not more accurate; "" if it can."""
    if int(one["reference_settled"]):
        return ""
    coarse = [
        label
        for label, name in _ERRORS.items()
        if TIMES * float(one[f"{name}_error_bar"]) > max(abs(float(one[f"{name}_error"])), NEGLIGIBLE)
    ]
    why = one.attrs["reference_reason"] or "give a smaller --accuracy, or none"
    return f" The reference is less than five times better than the difference of {', '.join(coarse)}: {why}."


def _overview(names: Sequence[str], scenes: Sequence[xr.Dataset]) -> str:
    rows = []
    for i, (name, one) in enumerate(zip(names, scenes, strict=True)):
        fast, slow = one["compliance_seconds"].values
        numbers = [_error(one, f"{variable}_error") for variable in _ERRORS.values()]
        mac = f"{float(one['mac_worst'].min()):.3f} / {float(one['mac_mean'].mean()):.3f}"
        rows.append([f'<a href="#scene-{i}">{escape(name)}</a>', *numbers, mac, f"{slow / fast:.0f}"])
    return table(["scene", *_ERRORS, "MAC worst / mean", "compliance: times faster"], rows)


def _section(i: int, name: str, one: xr.Dataset) -> str:
    shared = "Share of the load that one tooth pair carries while it passes through the mesh."
    if "load_sharing" in one:
        shared = "Force of each mesh over that where all paths share alike: lines finite elements, dashes fast model."
    drawn = {
        "Static transmission error and mesh stiffness over two mesh periods.": figures.cycle_figure(one),
        "Amplitudes of the harmonics of the mesh frequency.": figures.harmonics_figure(one),
        shared: figures.load_share_figure(one),
        "For each position of a unit load: agreement of the deflection shape over the flank, and its size.": (
            figures.mac_figure(one)
        ),
        "Wall times. Simulation: all mesh phases, the teeth being known.": figures.time_figure(one),
        "Finite elements of the section; the reference is extrapolated from its last two levels.": mesh_figure(one),
    }
    pictures = "\n".join(picture(figure, caption) for caption, figure in drawn.items())
    return "\n".join(
        [
            f'<section id="scene-{i}"><h2>{escape(name)}</h2>',
            f'<p class="finding">{escape(finding(one))}</p>',
            "<h3>Differences over the mesh cycle</h3>",
            _cycle_table(one),
            "<h3>Teeth</h3>",
            _tooth_table(one),
            pictures,
            "<h3>Times</h3>",
            _time_table(one),
            _texts(one),
            "</section>",
        ]
    )


def _cycle_table(one: xr.Dataset) -> str:
    rows = []
    for label, name in _ERRORS.items():
        rows.append([label, *_both(one[name], one[f"{name}_bar"]), _error(one, f"{name}_error")])
    for word, name in (("STE", "transmission_error"), ("stiffness", "mesh_stiffness")):
        known = f"{name}_amplitude"
        for n in range(one.sizes["harmonic"]):
            of_harmonic = one.isel(harmonic=n)
            error = f"{_error(of_harmonic, f'{known}_error')} of the fundamental"
            rows.append([f"harmonic {n + 1} of {word}", *_both(of_harmonic[known], of_harmonic[f"{known}_bar"]), error])
    for label, part in (("largest", "max"), ("RMS", "rms")):
        difference, bar = (100 * float(one[f"load_share_error_{part}{end}"]) for end in ("", "_bar"))
        of = "an even share" if "mesh_load_factor" in one else "the load"
        rows.append([f"{label} difference in load sharing", "", "", f"{difference:.1f} ± {bar:.2g} % of {of}"])
    if (name := "mesh_load_factor") in one:
        rows.append(["K_γ", *_both(one[name], one[f"{name}_bar"]), _error(one, f"{name}_error")])
    return table(["", "fast model", "finite elements", "difference"], rows)


def _both(values: xr.DataArray, bar: xr.DataArray) -> tuple[str, str]:
    """Format the values of both models, with the error bar of the reference."""
    fast, reference = values.values
    units = values.attrs["units"]
    return f"{fast:.4g} {units}", f"{reference:.4g} ± {float(bar[1]):.2g} {units}"


def _tooth_table(one: xr.Dataset) -> str:
    labels = {
        "MAC under one point load, worst": ("mac_worst", ".3f"),
        "MAC under one point load, mean": ("mac_mean", ".3f"),
        "MAC under a contact line, worst": ("line_mac_worst", ".3f"),
        "MAC under a contact line, mean": ("line_mac_mean", ".3f"),
        "compliance / that of the reference": ("compliance_ratio", ".3f"),
        "estimated error of the reference": ("reference_error", ".1e"),
        "unknowns of the finest level": ("reference_unknowns", ".0f"),
        "levels refined over": ("reference_meshes", ".0f"),
    }
    rows = []
    for label, (name, form) in labels.items():
        bars = one[f"{name}_bar"].values if f"{name}_bar" in one else None
        cells = [f"{v:{form}}" + ("" if bars is None else f" ± {bars[k]:.1g}") for k, v in enumerate(one[name].values)]
        rows.append([label, *cells])
    return table(["", *map(str, one["gear"].values)], rows)


def _time_table(one: xr.Dataset) -> str:
    rows = [
        [label, *(duration(float(v)) for v in one[name].values)]
        for label, name in (
            ("smooth compliance, pair not seen before", "compliance_seconds"),
            ("simulation, teeth known", "simulation_seconds"),
        )
    ]
    rows.append(["first simulation in this process", duration(float(one["first_call_seconds"])), ""])
    kept = bool(one["reference_cached"].values.any())
    source = "earlier, stored with the kept result" if kept else "in this run, nothing was kept"
    return table(["", "fast model", "finite elements"], rows) + f"<p>Finite elements measured {source}.</p>"


def _texts(one: xr.Dataset) -> str:
    attrs = one.attrs
    facts = {
        "model of the gear bodies": attrs["support"],
        "versions": attrs["versions"],
        "revision": attrs["git_revision"],
        "host": attrs["host"],
        "finite elements": (
            f"{attrs['reference_element']}, solved by {attrs['reference_solver']}; {attrs['reference_versions']}"
        ),
        "SHA-256 of the scene": attrs["scene_sha256"],
    }
    items = "".join(f"<tr><th>{escape(key)}</th><td>{escape(str(value))}</td></tr>" for key, value in facts.items())
    blocks = "".join(
        f"<details><summary>{title}</summary><pre>{escape(attrs[key])}</pre></details>"
        for title, key in (("Scene", "scene"), ("Reference", "reference_scene"))
    )
    return f"<h3>Provenance</h3><table><tbody>{items}</tbody></table>{blocks}"


def _method(dataset: xr.Dataset) -> str:
    heights, positions = (dataset.sizes[name] for name in ("load_height", "load_face"))
    paragraphs = (
        "Reference: the same pair, load, gaps, contact law and mesh phases; every compliance but the contact law is "
        "replaced by that of three-dimensional finite elements, a clamped tooth or, where the scene models the gear "
        "body, the whole gear on its bore. The compression near the contact is counted once, by the contact law.",
        "Differences are (fast − reference) / reference, those of harmonics over the fundamental of the reference. "
        "± is how far a number moves where the finest level of the finite elements alone takes the place of the value "
        "extrapolated from the last two: the error of the reference. Unless an accuracy is given, it is raised until "
        f"that is a fifth of each difference of STE and stiffness, or of {NEGLIGIBLE:g} %.",
        "Peak-to-peak values include both sides of each jump. Load sharing: difference of the share of a tooth pair "
        "while it is in contact.",
        f"MAC = (aᵀb)² / ((aᵀa)(bᵀb)) of the deflections a, b of one flank, in the middle of {RESPONSES[0]} × "
        f"{RESPONSES[1]} equal cells of its active part, under a unit load: at each of "
        f"{heights} × {positions} positions, or spread evenly over each contact line of the mesh cycle (the mean "
        "weighted with its length).",
        "Planetary sets and parallel paths: all gears on finite elements, which also couple the meshes of a gear; "
        "curves are those of the set, on the base circle of the first gear.",
        "Times are wall times on this computer: medians of repeats after warm-up for the fast model; for the finite "
        "elements assembly and solution of all levels, all gears.",
    )
    return "\n".join(f"<p>{escape(text)}</p>" for text in paragraphs)
