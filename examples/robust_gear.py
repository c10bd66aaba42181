"""Scatter under manufacturing errors: its size, its main cause, and the effect of crowning."""

from dataclasses import replace
from pathlib import Path

from gearbench import Crowning, read_scene, robust
from gearbench.plot import draw_robust

given = read_scene(Path(__file__).parent / "gear55_robust.toml")
scenes = {"as given": given, "crowned by 1 µm": replace(given, effects=(*given.effects, Crowning(amount=1.0)))}

for name, scene in scenes.items():
    result = robust(scene, samples=128, seed=1)
    ste = result["transmission_error_rms"]
    mean, scatter = float(result["transmission_error_rms_mean"]), float(result["transmission_error_rms_std"])
    leading = str(result["error_name"][int(result["transmission_error_rms_first_order"].argmax("error_name"))].item())
    print(f"{name}: RMS STE {mean:.3f} ± {scatter:.3f} {ste.units}, most of the scatter by {leading}")
    folder = Path(name.replace(" ", "_"))
    folder.mkdir(exist_ok=True)
    draw_robust(result, folder)
