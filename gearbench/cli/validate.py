"""``gearbench validate``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gearbench.cli.options import share
from gearbench.cli.output import answer, progress
from gearbench.errors import InputError
from gearbench.lazy import xr

if TYPE_CHECKING:
    from gearbench.scene import Scene

SceneFiles = Annotated[list[Path], typer.Argument(metavar="SCENE...", help="Scene files (TOML).", show_default=False)]
Folder = Annotated[
    Path, typer.Option("--output", "-o", metavar="DIR", help="Write report.html and validation.nc into this folder.")
]
Accuracy = Annotated[
    str | None,
    typer.Option(
        metavar="A",
        help="Relative error of the reference's compliance, e.g. 1%; by default a fifth of the models' differences.",
        show_default=False,
    ),
]

Contact = Annotated[
    bool,
    typer.Option(
        "--contact",
        help="Compare with contact finite elements instead (minutes a scene); writes contact.nc and contact.png.",
    ),
]
Phases = Annotated[int, typer.Option(min=4, max=200, help="Phases of the mesh cycle with --contact.")]


def validate(
    scenes: SceneFiles,
    output: Folder,
    accuracy: Accuracy = None,
    contact: Contact = False,
    phases: Phases = 20,
) -> None:
    """Compare each SCENE with finite elements: a report and a Dataset of errors, shapes and times.

    Example: gearbench validate examples/case1.toml examples/case2.toml -o validation
    """
    from gearbench.files import make_folder
    from gearbench.scene_file import read_scene
    from gearbench.validation.comparison import check
    from gearbench.validation.comparison import validate as run
    from gearbench.validation.dataset import of_scene
    from gearbench.validation.report import finding, write

    if contact:
        _contact(scenes, output, phases)
        return
    requested_accuracy = None if accuracy is None else share(accuracy)
    if requested_accuracy is not None and not 1e-4 <= requested_accuracy <= 0.1:
        raise InputError("accuracy", accuracy, "must lie between 0.01% and 10%")
    loaded = [read_scene(path) for path in scenes]
    for path, scene in zip(scenes, loaded, strict=True):
        check(scene, str(path))
    folder = make_folder("output", output)
    dataset = run(loaded, requested_accuracy, lambda line: progress(f"{line} …"))
    names = [str(name) for name in dataset["scene"].values]
    lines = [f"{name}. {finding(of_scene(dataset, i))}" for i, name in enumerate(names)]
    answer(_json(dataset) | {"files": write(dataset, folder)}, [*lines, *_cautions(loaded, names)])


def _contact(paths: list[Path], output: Path, phases: int) -> None:
    """Compare the fast model with finite elements on lines and with contact finite elements."""
    from gearbench.files import make_folder
    from gearbench.scene_file import read_scene
    from gearbench.validation.contact import check, compare_contact, findings, write

    loaded = [read_scene(path) for path in paths]
    for path, scene in zip(paths, loaded, strict=True):
        check(scene, str(path))
    folder = make_folder("output", output)
    found = []
    for path, scene in zip(paths, loaded, strict=True):
        name = scene.name or path.stem
        found.append(compare_contact(scene, phases, lambda part, name=name: progress(f"{name}: {part} …")))
    said = [findings(each) for each in found]
    names = [dataset.attrs["name"] or path.stem for dataset, path in zip(found, paths, strict=True)]
    lines = [f"{name}: {line}" for name, own in zip(names, said, strict=True) for line in own]
    answer({"findings": said, "files": write(found, folder)}, [*lines, *_cautions(loaded, names)])


def _cautions(scenes: list[Scene], names: list[str]) -> list[str]:
    """Warnings about the results of the fast models."""
    from gearbench.cli.summary import cautions
    from gearbench.simulation import simulate

    results = (
        (name, scene, simulate(scene, outputs=("flank_pressure_max",)))
        for name, scene in zip(names, scenes, strict=True)
    )
    return [f"warning: {name}: {line}" for name, scene, result in results for line in cautions(scene, result)]


def _json(dataset: xr.Dataset) -> dict[str, Any]:
    scenes = []
    for i, name in enumerate(dataset["scene"].values):
        one = dataset.isel(scene=i)
        numbers = {str(key): float(v) for key, v in one.data_vars.items() if v.ndim == 0 and v.dtype.kind == "f"}
        scenes.append({"name": str(name), "scene_sha256": str(one["scene_sha256"].item()), **numbers})
    return {"wall_time_s": dataset.attrs["wall_time_s"], "scenes": scenes}
