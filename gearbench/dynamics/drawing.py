"""File, title and legend of a figure of a response."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np

from gearbench.files import replacing
from gearbench.lazy import xr
from gearbench.plotting import as_label

#: Largest number of letters of a name in a title; longer names are cut.
NAME = 40
#: Number of columns of a legend → number of letters of the longest label that fits in them.
COLUMNS = {4: 20, 3: 36, 2: 100}
#: Number of frames of a moving figure, and time of a frame [ms].
FRAMES, MILLISECONDS = 12, 80


def write(draw: Any, data: xr.Dataset, path: Path) -> None:
    """Write the figure that ``draw`` makes, with a title, as a PNG file."""
    with replacing(path) as part:
        _titled(draw, data).savefig(part, dpi=120, format="png")


def write_moving(draw: Any, data: xr.Dataset, path: Path, still: str) -> None:
    """Write a mode shape as a GIF in which each line swings about the line ``still`` drawn last before it."""
    from PIL import Image

    figure, moving, base = _titled(draw, data), [], 0.0
    for line in (line for axes in figure.axes for line in axes.get_lines()):
        y = np.asarray(line.get_ydata())
        if line.get_label() == still:
            base = y
        else:
            moving.append((line, base, y - base))
    figure.canvas.draw()
    figure.set_layout_engine("none")
    frames = []
    for phase in np.arange(FRAMES) * 2 * np.pi / FRAMES:
        for line, middle, amplitude in moving:
            line.set_ydata(middle + np.cos(phase) * amplitude)
        figure.canvas.draw()
        frames.append(Image.fromarray(np.asarray(figure.canvas.buffer_rgba())).convert("P"))
    with replacing(path) as part:
        frames[0].save(part, format="gif", save_all=True, append_images=frames[1:], duration=MILLISECONDS, loop=0)


def _titled(draw: Any, data: xr.Dataset) -> Any:
    """Figure that ``draw`` makes; the title names the scene, the mesh and the finding that ``draw`` returns."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8, 5.2), layout="constrained")
    FigureCanvasAgg(figure)
    finding = draw(figure, data)
    scene = tomllib.loads(data.attrs.get("scene", "")).get("name", "")
    names = [scene, f"mesh {data['mesh'].item()}" if "mesh" in data.coords and not data["mesh"].ndim else ""]
    title = ": ".join(filter(None, [", ".join(name[:NAME] for name in names if name), finding]))
    figure.suptitle("\n".join(map(as_label, title.split("\n"))), fontsize="medium", wrap=True)
    return figure


def legend(figure: Any, lines: list, **more: Any) -> None:
    """Place a legend below the axes, where it covers nothing."""
    labels = [as_label(str(line.get_label())) for line in lines]
    longest = max(map(len, labels))
    figure.legend(
        lines,
        labels,
        loc="outside lower center",
        ncols=next((columns for columns, letters in COLUMNS.items() if longest <= letters), 1),
        fontsize="small",
        **more,
    )


def speed_label(data: xr.Dataset | xr.DataArray) -> str:
    """Label of an axis of speeds, which names the member whose speed it is."""
    speed = data["speed"].attrs
    return f"{speed['long_name']} [{speed['units']}]"


def rounded(value: float, digits: int = 3) -> str:
    """Write a number with the significant ``digits``, without an exponent."""
    return np.format_float_positional(float(f"{value:.{digits}g}"), trim="-")


def hertz(frequency: float) -> str:
    """Frequency with four digits, without an exponent."""
    return f"{rounded(frequency, 4)} Hz"


def peak(values: Any, speeds: Any) -> tuple[float, float]:
    """Largest value, NaN ignored, and the speed at which it occurs."""
    finite = np.nan_to_num(np.asarray(values, dtype=float), nan=-np.inf)
    index = int(finite.argmax())
    return float(finite[index]), float(speeds[index])
