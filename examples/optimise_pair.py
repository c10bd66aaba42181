"""A study file made smaller in Python, searched; the gear with the smoothest stiffness it found, simulated."""

from pathlib import Path

from gearbench import design_scene, load, load_study, open_designs, optimise, parse_study, select, simulate

study = load_study(Path(__file__).parent / "optimise_small.toml")
tables = study.to_mapping()
tables["algorithm"] |= {"population": 8, "generations": 2}
tables["robustness"] |= {"samples": 16}
front = optimise(parse_study(tables), directory="front")

best = select(open_designs("front"), rank={"mesh_stiffness_rms_mean": 1.0}).numbers[0]
scene = design_scene(front, int(best))
result = simulate(scene)
gear = scene.pair.gears[0]
print(f"{front.sizes['design']} designs, {int(front['on_front'].sum())} on the front")
print(f"design {best}: {gear.teeth} teeth, RMS of k {float(result['mesh_stiffness_rms']):.2f} %")
assert load(Path("front") / "front.nc").sizes["design"] == front.sizes["design"]
