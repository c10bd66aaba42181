"""Data of the study: Table 2 of Garambois et al. 2017 under all tried conventions of manufacturing errors."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearbench.effects.manufacturing_errors import PRESETS, ErrorKind, ManufacturingErrors, Tolerance
from gearbench.lazy import xr
from gearbench.library.garambois2017 import gear, table_2
from gearbench.robustness.montecarlo import Responses, prepare_scene, respond
from gearbench.scene import Resolution, Scene
from gearbench.threads import default_threads

#: Statistics of the table in the order of its columns, and their units.
UNITS = {"m_k": "%", "m_ste": "µm", "sigma_k": "%", "max_k": "%", "sigma_ste": "µm", "max_ste": "µm"}
COLUMNS = tuple(UNITS)
BASE = PRESETS["garambois2017"]
#: Errors of BASE that belong to the tooth flanks, not to the axes.
OF_TEETH = tuple(n for n in ("profile_slope", "profile_form", "helix_slope", "helix_form") if getattr(BASE, n))


def scene(name: str = "SC", errors: ManufacturingErrors = BASE, resolution: Resolution | None = None) -> Scene:
    """Scene of a gear of the table with the given errors."""
    plain = gear(name).scene(resolution=resolution)
    return replace(plain, effects=(*plain.effects, errors))


def product_conventions() -> Iterator[tuple[str, ManufacturingErrors]]:
    """Yield the grid of conventions: distribution × use of profile tolerances × profile coordinate × misalignment."""
    tolerances: dict[str, tuple[Tolerance, Tolerance]] = {
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
    """Yield variants of the adopted convention that differ in one respect."""

    def kinds(*names: str, **change: Any) -> dict[str, ErrorKind]:
        return {name: replace(getattr(BASE, name), **change) for name in names}

    changes: dict[str, dict[str, Any]] = {
        "adopted": {},
        "edition 2013": {"edition": "2013"},
        "tolerances rounded": {"rounded": True},
        "profile: involute": {"profile_range": "involute"},
        "profile: whole tooth": {"profile_range": "tooth"},
        "hollow instead of barrel": kinds("profile_form", sign=-1),
        "forms two-sided": kinds("profile_form", "helix_form", distribution="normal_two_sided"),
        "no profile slope": {"profile_slope": None},
        "no profile form": {"profile_form": None},
        "no helix form": {"helix_form": None},
        "no parallelism": {"inclination": None, "deviation": None},
        "one gear only": kinds(*OF_TEETH, gear="pinion"),
        "each tooth its own": kinds(*OF_TEETH, drawn="tooth"),
    }
    for name, change in changes.items():
        yield name, replace(BASE, **change), Resolution()
    for count in (16, 32, 64):
        yield f"{count} uniform positions", BASE, Resolution(positions=count)
    for count in (5, 31):
        yield f"{count} segments", BASE, Resolution(segments=count)


def evaluate(errors: ManufacturingErrors, resolution: Resolution, samples: int) -> NDArray:
    """Compute the statistics of every row, (gear, column), with scrambled Sobol samples of seed 0."""
    results = []
    for row in table_2():
        problem = prepare_scene(scene(row.gear, errors, resolution))
        answer, _ = respond(problem, problem.draw(samples, 0, "sobol"), default_threads())
        results.append(statistics(answer))
    return np.array(results)


def statistics(answer: Responses) -> tuple[float, ...]:
    """Statistics of a gear in the order of ``COLUMNS``."""
    k, ste = answer["mesh_stiffness_rms"], answer["transmission_error_rms"]
    return tuple(map(float, (k.mean(), ste.mean(), k.std(ddof=1), k.max(), ste.std(ddof=1), ste.max())))


def paper() -> NDArray:
    """Printed values of the paper, (gear, column)."""
    return np.array([[getattr(row, column) for column in COLUMNS] for row in table_2()])


def compute(*, quick: bool = False) -> xr.Dataset:
    """Compute all conventions on all rows, and the adopted one with 1000 samples."""
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
