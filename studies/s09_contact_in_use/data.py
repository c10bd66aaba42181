"""Data of the study: mesh cycles of 24 pairs by contact finite elements of finite width and by models on lines."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gearbench.effects.crowning import Crowning
from gearbench.effects.gear_body import GearBody
from gearbench.effects.hertz import Hertz
from gearbench.effects.off_line_contact import OffLineContact
from gearbench.effects.tip_relief import TipRelief
from gearbench.effects.tooth_bending import ToothBending
from gearbench.lazy import xr
from gearbench.results.cycle import MeshCycle
from gearbench.results.responses import described
from gearbench.scene import Load, Resolution, Scene
from gearbench.scene_file import parse_scene, read_scene
from gearbench.validation.contact import model_cycle
from gearbench.validation.reference import reference_scene
from studies.report import kept
from studies.s05_tooth_models.pairs import draw, in_use
from studies.s08_contact.data import scene as spur_scene

PHASES = 8
SEED = 2409
#: Relative accuracy of the finite elements on lines.
ACCURACY = 0.002
#: Minimum number of segments on a contact line for models on lines.
SEGMENTS = 60
#: Models on lines: fast model, fast model with contact off the line, finite elements with contact off the line.
MODELS = ("fast", "fast_off_line", "lines_off_line")
OUTPUTS = ("transmission_error", "mesh_stiffness")
_GEARS = Path(__file__).parents[2] / "examples" / "gears"
#: Real-world pair → share of its nominal torque.
KNOWN = {
    "fine_pitch": 1.0, "fzg_c": 0.3, "hcr_spur": 1.0, "nasa_28": 1.0, "osu_50": 0.5, "rim_17_43": 2.0, "ross_62": 2.0,
    "thin_rim": 1.0, "e_drive_input": 1.0, "e_drive_output": 0.3, "large_wheel": 1.0, "nrel_5mw_stage3": 2.0,
}  # fmt: skip
#: Numbers of random spur and helical pairs, and shares of the nominal torque, used in turn.
DRAWN, PARTS = (3, 7), (1.0, 0.1, 2.0, 0.5)


def scenes() -> list[Scene]:
    """Scenes of all pairs, with names."""
    plain = spur_scene("spur")
    high = replace(
        plain.pair, centre_distance=80.0, face_width=25.0,
        pinion=replace(plain.pair.pinion, teeth=30, addendum=1.3, dedendum=1.6),
        wheel=replace(plain.pair.wheel, teeth=50, addendum=1.3, dedendum=1.6),
    )  # fmt: skip
    found = [plain, replace(plain, name="hcr_30_50", pair=high, load=Load(torque=400.0))]
    for name, part in KNOWN.items():
        read = read_scene(_GEARS / f"{name}.toml").without("off_line_contact")
        found.append(replace(read, name=name, load=Load(torque=part * read.load.torque)))
    return found + list(_drawn())


def _drawn() -> Iterator[Scene]:
    """Yield random pairs of gears in use, with ``DRAWN`` spur and helical ones; every second has relief and crowning.

    Pairs are skipped if both tips meet the fillets of the mate. Such gears jam; models on lines end at the form
    circles, so they only warn of this.
    """
    left = dict(zip((False, True), DRAWN, strict=True))
    count = 0
    for each in draw(in_use, SEED):
        helical = bool(each.pair.helix_angle)
        if not left[helical]:
            continue
        count += 1
        if all(each.pair.meshing.has_interference):
            continue
        left[helical] -= 1
        m = each.pair.normal_module
        # the relief is about the deflection of the teeth under nominal load: 7 µm per 100 N/mm
        depth = float(f"{7e-2 * each.load.torque * 2e3 / (m * each.pair.pinion.teeth * each.pair.face_width):.2g}")
        gaps = (TipRelief(amount=depth, length=round(0.5 * m, 2)), Crowning(amount=depth / 2)) if count % 2 == 0 else ()
        yield replace(
            each, name=f"drawn_{count}", effects=(ToothBending(model="solid"), GearBody(), Hertz(), *gaps),
            load=Load(torque=PARTS[(count - 1) % 4] * each.load.torque),
        )  # fmt: skip
        if not any(left.values()):
            return


def scene(number: int = 0) -> Scene:
    """Scene of the pair with this number."""
    return scenes()[number]


def compute(*, quick: bool = False, folder: Path | None = None) -> xr.Dataset:
    """Compute the curves of all pairs; contact finite elements are kept in ``folder``, so that a run can continue."""
    if quick:
        return collected([with_models(contact_curve(spur_scene("spur"), 2))])
    rows = [
        kept(folder and folder / f"{number:02d}.nc", partial(contact_curve, each, PHASES))
        for number, each in enumerate(scenes())
    ]
    return collected([with_models(row) for row in rows])


def contact_curve(scene: Scene, phases: int) -> xr.Dataset:
    """Compute a pair by contact finite elements, (position,)."""
    from fem_reference.contact.cycle import contact_cycle
    from fem_reference.contact.laying import Fineness
    from fem_reference.contact.spatial import SpatialSettings

    exact = contact_cycle(scene, phases, settings=SpatialSettings(fineness=Fineness().coarser()))
    variables = {
        **{name: (("position",), exact[name].values) for name in OUTPUTS},
        "transmission_error_uncertainty": ((), float(exact.transmission_error_uncertainty)),
        "seconds": ((), float(exact.attrs["wall_time_s"])),
    }
    coords = {"mesh_phase": ("position", exact.mesh_phase.values)}
    return xr.Dataset(described(variables), coords=described(coords)).assign(scene=scene.to_toml())


def with_models(row: xr.Dataset) -> xr.Dataset:
    """Add the curves of the models to a pair, (model, position)."""
    from fem_reference.contact.cycle import halfway

    scene = parse_scene(tomllib.loads(str(row["scene"].values)))
    curves = [curve(scene, model, halfway(row, scene.pair)) for model in MODELS]
    grid = ("model", "position")
    variables = {f"model_{name}": (grid, [getattr(cycle, name) for cycle in curves]) for name in OUTPUTS}
    bare = row.drop_dims("model", errors="ignore")
    return bare.assign(described(variables)).assign_coords(model=list(MODELS))


def collected(rows: list[xr.Dataset]) -> xr.Dataset:
    """Join all pairs along ``design``."""
    # encodings of rows read from disk hold a text length: without this, longer scenes would be cut off
    return xr.concat(rows, "design", coords="minimal", compat="override").drop_encoding()


def curve(scene: Scene, model: str, phases: NDArray) -> MeshCycle:
    """Compute the mesh cycle of a model of ``MODELS`` at mesh phases, (position,)."""
    found = replace(scene, resolution=Resolution(positions=len(phases), segments=SEGMENTS))
    if model.endswith("off_line"):
        found = replace(found, effects=(*scene.effects, OffLineContact()))
    if model.startswith("lines"):
        found = reference_scene(found, ACCURACY)
    return model_cycle(found, phases)


def residual(dataset: xr.Dataset) -> xr.DataArray:
    """RMS over the cycle of the errors of the models, over the mean STE of contact finite elements [%]."""
    exact = dataset.transmission_error
    off = dataset.model_transmission_error - exact
    return 100 * np.sqrt((off**2).mean("position")) / exact.mean("position")
