"""``gearbench relieve``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from gearbench.cli.options import (
    Json,
    Output,
    Plots,
    Quiet,
    SceneFile,
    Verbose,
    plot_folder,
    progress_line,
    say,
    to_file,
)
from gearbench.cli.sweep import Torques

Export = Annotated[Path | None, to_file("OUT.toml", "Write the scene with the chosen relief.", "--export")]


def relieve(
    scene: SceneFile,
    torque: Torques = None,
    export: Export = None,
    output: Output = None,
    plots: Plots = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
    json: Json = False,
) -> None:
    """Tip relief and crowning of SCENE with the least transmission error over a range of torques.

    Example: gearbench relieve examples/gears/nasa_28.toml --torque 20:100:20 --export relieved.toml --plots plots
    """
    from gearbench.errors import naming
    from gearbench.files import write_text
    from gearbench.results.netcdf import save
    from gearbench.results.origin import scene_of
    from gearbench.scene_file import read_scene
    from gearbench.sweeps.ranges import parse_range
    from gearbench.sweeps.relieve import draw_relief
    from gearbench.sweeps.relieve import relieve as run

    loaded = read_scene(scene)
    torques = None if torque is None else parse_range("torque", torque)
    folder = plot_folder(plots)
    with progress_line(quiet=quiet, json=json) as tell, naming(scene):
        dataset = run(loaded, torques, progress=lambda done, of: tell(f"{done} of {of} designs"))
    written = [save(dataset, output)] if output is not None else []
    if export is not None:
        written.append(write_text(export, scene_of(dataset).to_toml()))
    written += draw_relief(dataset, folder) if folder is not None else []
    chosen, name = dataset.sel(design="chosen"), dataset.attrs["minimised"]
    values = {key: float(chosen[key][0]) for key in ("tip_relief_amount", "tip_relief_length", "crowning_amount")}
    worst = {design: float(dataset[name].sel(design=design).max()) for design in ("as given", "chosen")}
    pressure = {design: float(dataset["flank_pressure_max"].sel(design=design).max()) for design in worst}
    if json:
        from gearbench.cli.summary import print_mapping

        print_mapping({**values, "minimised": name, "largest": worst, "pressure": pressure, "files": written})
    elif not quiet:
        amount, length, crowning = values.values()
        relief = f"{amount:.1f} µm over {length:.2f} mm from the tip of both gears" if amount > 0 else "none"
        say(f"tip relief {relief}, crowning {crowning:.1f} µm")
        metric, low, high = dataset[name].attrs["long_name"], *(float(dataset["torque"][i]) for i in (0, -1))
        numbers = ", ".join(f"{design} {value:.3g} µm" for design, value in worst.items())
        say(f"largest {metric} from {low:g} to {high:g} N·m: {numbers}")
        numbers = ", ".join(f"{design} {value:.0f} MPa" for design, value in pressure.items())
        say(f"largest contact pressure, which is not minimised: {numbers}")
        if dataset.attrs["minimised"] == "transmission_error_peak_to_peak":
            say(
                "note: chosen for perfect gears; with [effects.manufacturing_errors] the mean over samples is minimised"
            )
        for path in written:
            say(f"wrote {path}")
