"""``gearbench relieve``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from gearbench.cli.options import Output, Plots, SceneFile, plot_folder, saved, to_file
from gearbench.cli.output import answer, progress_line
from gearbench.cli.sweep import Torques
from gearbench.errors import naming

Export = Annotated[Path | None, to_file("OUT.toml", "Write the scene with the chosen relief.", "--export")]


def relieve(
    scene: SceneFile,
    torque: Torques = None,
    export: Export = None,
    output: Output = None,
    plots: Plots = None,
) -> None:
    """Tip relief and crowning of SCENE with the least transmission error over a range of torques.

    Example: gearbench relieve examples/gears/nasa_28.toml --torque 20:100:20 --export relieved.toml --plots plots
    """
    from gearbench.files import write_text
    from gearbench.results.origin import scene_of
    from gearbench.scene_file import read_scene
    from gearbench.sweeps.ranges import parse_range
    from gearbench.sweeps.relieve import draw_relief
    from gearbench.sweeps.relieve import relieve as run

    loaded = read_scene(scene)
    torques = None if torque is None else parse_range("torque", torque)
    folder = plot_folder(plots)
    with progress_line() as tell, naming(scene):
        dataset = run(loaded, torques, progress=lambda done, of: tell(f"{done} of {of} designs"))
    written = saved(dataset, output)
    if export is not None:
        written.append(write_text(export, scene_of(dataset).to_toml()))
    written += draw_relief(dataset, folder) if folder is not None else []
    chosen, name = dataset.sel(design="chosen"), dataset.attrs["minimised"]
    values = {key: float(chosen[key][0]) for key in ("tip_relief_amount", "tip_relief_length", "crowning_amount")}
    worst = {design: float(dataset[name].sel(design=design).max()) for design in ("as given", "chosen")}
    pressure = {design: float(dataset["flank_pressure_max"].sel(design=design).max()) for design in worst}
    amount, length, crowning = values.values()
    relief = f"{amount:.1f} µm over {length:.2f} mm from the tip of both gears" if amount > 0 else "none"
    metric, low, high = dataset[name].attrs["long_name"], *(float(dataset["torque"][i]) for i in (0, -1))
    errors = ", ".join(f"{design} {value:.3g} µm" for design, value in worst.items())
    pressures = ", ".join(f"{design} {value:.0f} MPa" for design, value in pressure.items())
    lines = [
        f"tip relief {relief}, crowning {crowning:.1f} µm",
        f"largest {metric} from {low:g} to {high:g} N·m: {errors}",
        f"largest contact pressure, which is not minimised: {pressures}",
    ]
    if name == "transmission_error_peak_to_peak":
        remedy = "with [effects.manufacturing_errors] the mean over samples is minimised"
        lines.append(f"note: chosen for perfect gears; {remedy}")
    answer({**values, "minimised": name, "largest": worst, "pressure": pressure, "files": written}, lines)
