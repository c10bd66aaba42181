"""Options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

SceneFile = Annotated[Path, typer.Argument(metavar="SCENE", help="Scene file (TOML).", show_default=False)]
Output = Annotated[
    Path | None, typer.Option("--output", "-o", metavar="OUT.nc", help="Write the Dataset to this netCDF file.")
]
Plots = Annotated[Path | None, typer.Option("--plots", metavar="DIR", help="Draw PNG plots into this folder.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")]
Json = Annotated[bool, typer.Option("--json", help="Print a machine-readable summary instead of a table.")]


def plot_folder(folder: Path | None) -> Path | None:
    """Make the folder for plots; refuse, before anything is computed, one that cannot be made.

    Raises
    ------
    InputError
        If ``folder`` is a file or cannot be made.
    """
    from gearbench.errors import InputError

    if folder is None:
        return None
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError("plots", str(folder), f"must be a folder ({error.strerror})") from None
    return folder
