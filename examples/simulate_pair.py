"""A pair created and simulated in Python: transmission error, mesh stiffness and mesh orders, written to files."""

from dataclasses import replace
from pathlib import Path

from gearbench import (
    GearBody,
    Hertz,
    Load,
    Member,
    Pair,
    Scene,
    TipRelief,
    ToothBending,
    fourier,
    open_result,
    plan,
    save,
    simulate,
)

pair = Pair(
    normal_module=2.0,
    helix_angle=20.0,
    face_width=20.0,
    centre_distance=70.0,
    pinion=Member(teeth=25, bore_diameter=25.0),
    wheel=Member(teeth=40, bore_diameter=40.0),
)
plain = Scene(
    name="my pair",
    pair=pair,
    load=Load(torque=100.0),
    effects=(ToothBending(model="solid"), GearBody(), Hertz()),
)
relieved = replace(plain, name="with tip relief", effects=(*plain.effects, TipRelief(amount=10.0, length=0.8)))

for part in plan(plain).parts:
    print(f"{part.name}: {part.does}")
for scene in (plain, relieved):
    result = simulate(scene)
    ste, k = result["transmission_error"], result["mesh_stiffness_mean"]
    orders = ", ".join(f"{amplitude:.3f}" for amplitude in fourier(result, "transmission_error", orders=3))
    print(f"{scene.name}: mean k {float(k):.1f} {k.units}, orders 1 to 3 of the STE {orders} {ste.units}")

Path("my_pair.toml").write_text(relieved.to_toml(), encoding="utf-8")
assert open_result(save(result, "my_pair.nc")).identical(result)
