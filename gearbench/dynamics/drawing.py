"""File, title and legend of a figure of a response."""

from __future__ import annotations

import tomllib
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np

from gearbench.files import replacing

if TYPE_CHECKING:
    import xarray as xr

#: Maximum letters of a name in a title, and of a line of it; letters of a label from which a legend has two columns
#: instead of three.
NAME, WIDTH, LONG = 40, 95, 36


def write(draw: Any, one: xr.Dataset, path: Path) -> None:
    """Write the figure that ``draw`` makes; the title names the scene, the mesh and the finding that it returns."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8, 5.2), layout="constrained")
    FigureCanvasAgg(figure)
    found = draw(figure, one)
    scene = tomllib.loads(one.attrs.get("scene", "")).get("name", "")
    names = [scene, f"mesh {one['mesh'].item()}" if "mesh" in one.coords and not one["mesh"].ndim else ""]
    title = ": ".join(filter(None, [", ".join(name[:NAME] for name in names if name), found]))
    # names may contain characters that no font has
    title = "".join(letter if letter.isprintable() or letter == "\n" else "?" for letter in title)
    # matplotlib's own wrapping would read $ as mathematics
    title = "\n".join(fill(line, WIDTH) for line in title.splitlines())
    figure.suptitle(title, fontsize="medium", parse_math=False)
    with replacing(path) as part:
        figure.savefig(part, dpi=120, format="png")


def legend(figure: Any, lines: list, **more: Any) -> None:
    """Place a legend below the axes, where it covers nothing."""
    labels = [str(line.get_label()) for line in lines]
    figure.legend(
        lines,
        labels,
        loc="outside lower center",
        ncols=2 if max(map(len, labels)) > LONG else 3,
        fontsize="small",
        **more,
    )


def peak(values: Any, speeds: Any) -> tuple[float, float]:
    """Largest value, NaN ignored, and the speed at which it occurs."""
    known = np.nan_to_num(np.asarray(values, dtype=float), nan=-np.inf)
    at = int(known.argmax())
    return float(known[at]), float(speeds[at])
