"""A study file reduced in Python and searched; the gear with the smoothest stiffness is simulated."""

from pathlib import Path

from gearbench import design_scene, open_designs, open_result, optimise, parse_study, read_study, select, simulate

study = read_study(Path(__file__).parent / "optimise_pair.toml")
tables = study.to_mapping()
tables["algorithm"] |= {"population": 8, "generations": 2}
tables["robustness"] |= {"samples": 16}
front = optimise(parse_study(tables), directory="front")

best = select(open_designs("front"), rank={"mesh_stiffness_rms_mean": 1.0}).numbers[0]
scene = design_scene(front, int(best))
result = simulate(scene)
print(f"{front.sizes['design']} designs, {int(front['on_front'].sum())} on the front")
worst = float(result["mesh_stiffness_rms_load_max"])
print(f"design {best}: helix angle {scene.pair.helix_angle:g}°, RMS of k at most {worst:.2f} %")
assert open_result(Path("front") / "front.nc").sizes["design"] == front.sizes["design"]
