"""Options and helpers that several commands share."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gearbench.cli.log import begin
from gearbench.errors import InputError
from gearbench.lazy import xr

if TYPE_CHECKING:
    from gearbench.scene import Scene


def target(path: Path | None) -> Path | None:
    """Refuse a file that cannot be written, before anything is computed."""
    from gearbench.files import check_target

    return None if path is None else check_target(path)


def _netcdf(path: Path | None) -> Path | None:
    """Refuse a file for a Dataset that cannot be written, or whose name has another ending."""
    if path is not None and path.suffix.lower() not in ("", ".nc", ".nc4"):
        raise InputError("output", str(path), "must end in .nc: results are written as netCDF")
    return target(path)


def to_file(metavar: str, text: str, *names: str) -> Any:
    """Make an option that names a file to write."""
    return typer.Option(*names, metavar=metavar, callback=target, help=text)


SceneFile = Annotated[Path, typer.Argument(metavar="SCENE", help="Scene file (TOML).", show_default=False)]
Stored = Annotated[
    Path, typer.Argument(metavar="DIR|FRONT.nc", help="Folder or front of an optimisation.", show_default=False)
]
Threads = Annotated[int | None, typer.Option(min=1, help="Number of threads; by default all processors.")]
Output = Annotated[
    Path | None,
    typer.Option("--output", "-o", metavar="OUT.nc", callback=_netcdf, help="Write the Dataset to this netCDF file."),
]
Plots = Annotated[Path | None, typer.Option("--plots", metavar="DIR", help="Draw PNG plots into this folder.")]
AccuracyText = Annotated[
    str | None,
    typer.Option("--accuracy", metavar="A", help="Choose the cheapest settings for this accuracy, e.g. 1% or 0.01."),
]


def _limit_memory(context: typer.Context, text: str | None) -> str | None:
    """Limit the memory of the command and of the processes that it starts."""
    from gearbench.budget import VARIABLE, parse_memory

    if text is not None:
        before = os.environ.get(VARIABLE)
        os.environ[VARIABLE] = f"{parse_memory(text):.0f}"
        context.call_on_close(
            lambda: os.environ.pop(VARIABLE) if before is None else os.environ.update({VARIABLE: before})
        )
    return text


_MEMORY = typer.Option(
    metavar="SIZE", callback=_limit_memory, help="Largest memory to use, e.g. 4GB; by default 70 % of the machine's."
)
_VERBOSE = typer.Option("--verbose", "-v", callback=begin, help="Log each step and its time on the error stream.")
_JSON = typer.Option("--json", help="Print a machine-readable summary instead of a table.")
#: Annotation and default of the options of every command, and of those of commands that compute.
COMMON: dict[str, dict[str, Any]] = {
    "quiet": {
        "annotation": Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")],
        "default": False,
    },
    "verbose": {"annotation": Annotated[bool, _VERBOSE], "default": False},
    "json": {"annotation": Annotated[bool, _JSON], "default": False},
}
MEMORY: dict[str, dict[str, Any]] = {"memory": {"annotation": Annotated[str | None, _MEMORY], "default": None}}


def saved(dataset: xr.Dataset, output: Path | None) -> list[Path]:
    """Write the Dataset if ``output`` is given; return the files written."""
    from gearbench.results.netcdf import save

    return [] if output is None else [save(dataset, output)]


def share(text: str) -> float:
    """Read a share such as "1%" or "0.01".

    Raises
    ------
    InputError
        If the text is not a number or percentage.
    """
    try:
        return float(text.removesuffix("%")) / (100 if text.endswith("%") else 1)
    except ValueError:
        raise InputError("accuracy", text, "must be a number such as 0.01 or 1%") from None


def with_accuracy(scene: Scene, text: str | None) -> Scene:
    """Return ``scene`` with the accuracy of the command line, "1%" or "0.01"; unchanged if none is given.

    Raises
    ------
    InputError
        If the text is not a number or percentage, or the scene gives a resolution itself.
    """
    from gearbench.scene import Resolution
    from gearbench.schema import read

    if text is None:
        return scene
    value = share(text)
    if replace(scene.resolution, accuracy=None) != Resolution():
        raise InputError("accuracy", text, "conflicts with the scene's [resolution]: give one of the two")
    return replace(scene, resolution=read(Resolution, {"accuracy": value}))


def plot_folder(folder: Path | None) -> Path | None:
    """Make the folder for plots; refuse one that cannot be made, before anything is computed."""
    from gearbench.files import make_folder

    return None if folder is None else make_folder("plots", folder)
