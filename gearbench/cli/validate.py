"""``gearbench validate``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gearbench.cli.options import Json, Memory, Quiet, Verbose, progress_lines, say, share

if TYPE_CHECKING:
    import xarray as xr

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
    memory: Memory = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
) -> None:
    """Compare each SCENE with finite elements: a report and a Dataset of errors, shapes and times.

    Example: gearbench validate examples/case1.toml examples/case2.toml -o validation
    """
    from gearbench.errors import InputError
    from gearbench.files import make_folder
    from gearbench.scene_file import read_scene
    from gearbench.validation.comparison import check
    from gearbench.validation.comparison import validate as run
    from gearbench.validation.report import write

    if contact:
        _contact(scenes, output, phases, quiet=quiet, json=json)
        return
    requested_accuracy = None if accuracy is None else share(accuracy)
    if requested_accuracy is not None and not 1e-4 <= requested_accuracy <= 0.1:
        raise InputError("accuracy", accuracy, "must lie between 0.01% and 10%")
    loaded = [read_scene(path) for path in scenes]
    for path, scene in zip(scenes, loaded, strict=True):
        check(scene, str(path))
    folder = make_folder("output", output)
    report = progress_lines(quiet=quiet, json=json)
    dataset = run(loaded, requested_accuracy, lambda line: report(f"{line} …"))
    written = write(dataset, folder)
    if json:
        _print_json(dataset, written)
    elif not quiet:
        _print_findings(dataset)
        for path in written:
            say(f"wrote {path}")


def _contact(paths: list[Path], output: Path, phases: int, *, quiet: bool, json: bool) -> None:
    """Compare the fast model with finite elements on lines and with contact finite elements."""
    from gearbench.cli.summary import print_mapping
    from gearbench.files import make_folder
    from gearbench.scene_file import read_scene
    from gearbench.validation.contact import check, compare_contact, findings, write

    loaded = [read_scene(path) for path in paths]
    for path, scene in zip(paths, loaded, strict=True):
        check(scene, str(path))
    folder = make_folder("output", output)
    report = progress_lines(quiet=quiet, json=json)
    comparisons = []
    for path, scene in zip(paths, loaded, strict=True):
        name = scene.name or path.stem
        comparisons.append(compare_contact(scene, phases, lambda part, name=name: report(f"{name}: {part} …")))
    written = write(comparisons, folder)
    if json:
        print_mapping({"findings": [findings(comparison) for comparison in comparisons], "files": written})
    elif not quiet:
        for dataset, path in zip(comparisons, paths, strict=True):
            for line in findings(dataset):
                print(f"{dataset.attrs['name'] or path.stem}: {line}")
        for path in written:
            print(f"wrote {path}")


def _print_findings(dataset: xr.Dataset) -> None:
    from gearbench.validation.dataset import of_scene
    from gearbench.validation.report import finding

    for i, name in enumerate(dataset["scene"].values):
        say(f"{name}. {finding(of_scene(dataset, i))}")


def _print_json(dataset: xr.Dataset, written: list[Path]) -> None:
    from gearbench.cli.summary import print_mapping

    scenes = []
    for i, name in enumerate(dataset["scene"].values):
        one = dataset.isel(scene=i)
        numbers = {str(key): float(v) for key, v in one.data_vars.items() if v.ndim == 0 and v.dtype.kind == "f"}
        scenes.append({"name": str(name), "scene_sha256": str(one["scene_sha256"].item()), **numbers})
    print_mapping({"wall_time_s": dataset.attrs["wall_time_s"], "scenes": scenes, "files": written})
