"""Mesh orders of error samples and of hunting cycles: without errors those of ``simulate``."""

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gearbench import hunting_cycle, read_scene, robust, simulate
from gearbench.effects.manufacturing_errors import ErrorKind, ManufacturingErrors
from gearbench.effects.off_line_contact import OffLineContact
from gearbench.effects.tip_relief import TipRelief
from gearbench.effects.waviness import Wave, Waviness
from gearbench.scene import Resolution, Scene

EXAMPLES = Path(__file__).parents[2] / "examples"
#: Examples of pairs: each mesh of a train has effects of its own, and a hunting cycle is of one mesh.
FILES = sorted(
    path
    for path in (*EXAMPLES.glob("*.toml"), *(EXAMPLES / "gears").glob("*.toml"))
    if "pair" in tomllib.loads(path.read_text(encoding="utf-8"))
)
CURVES = ("transmission_error", "mesh_stiffness")
ORDERS = range(1, 11)
VARIANTS = ("neither", "relief", "off the line", "both")


def made(path: Path, variant: str, resolution: Resolution) -> Scene:
    scene = read_scene(path)
    kept = [e for e in scene.effects if e.name not in ("tip_relief", "off_line_contact", "manufacturing_errors")]
    m = scene.pair.normal_module
    if variant in ("relief", "both"):
        kept.append(TipRelief(amount=4.0 * m, length=0.4 * m))
    if variant in ("off the line", "both"):
        kept.append(OffLineContact())
    return replace(scene, effects=tuple(kept), resolution=resolution)


def of_samples(scene: Scene) -> dict[str, np.ndarray]:
    """Amplitudes (order,) of a sample whose errors are a millionth of a micrometre."""
    errors = ManufacturingErrors(helix_slope=ErrorKind(distribution="uniform_two_sided", amplitude=1e-6))
    names = [f"{curve}_amplitude_{n}" for curve in CURVES for n in ORDERS]
    found = robust(replace(scene, effects=(*scene.effects, errors)), samples=2, responses=names, threads=1)
    return {c: np.array([float(found[f"{c}_amplitude_{n}"][0]) for n in ORDERS]) for c in CURVES}


def of_hunting(scene: Scene) -> dict[str, np.ndarray]:
    """Amplitudes (order,) of two gears whose waves are a millionth of a micrometre high."""
    wave = Waviness(pinion=(Wave(order=1, amplitude=1e-6),))
    found = hunting_cycle(replace(scene, effects=(*scene.effects, wave)), orders=10.0)
    found = found.sel(mesh_order=list(ORDERS), method="nearest")
    return {c: found[f"{c}_order_amplitude"].values for c in CURVES}


def assert_same_orders(path: Path, variant: str, found, fine: Resolution, share: float) -> None:
    """Amplitudes differ by no more than the noise floor, or a ``share`` of peak-to-peak: cells are no patches."""
    expected = simulate(made(path, variant, Resolution()))
    amplitudes = found(made(path, variant, fine))
    for curve in CURVES:
        floor = expected[f"{curve}_amplitude_noise_floor"].values
        allowed = np.maximum(floor, share * float(expected[f"{curve}_peak_to_peak"]))
        miss = np.abs(amplitudes[curve] - expected[f"{curve}_amplitude"].values) / allowed
        assert miss.max() < 1, f"{curve}: order {miss.argmax() + 1} by {miss.max():.1f} of what is allowed"


@pytest.mark.parametrize("found", [of_samples, of_hunting])
@pytest.mark.parametrize("variant", VARIANTS)
def test_orders_without_errors_are_those_of_simulate(found, variant):
    # 2.5 %: cells and panels of the default settings; panels across the end of the cycle were off by a hundred times it
    assert_same_orders(EXAMPLES / "gears" / "hcr_spur.toml", variant, found, Resolution(), 0.025)


@pytest.mark.slow
@pytest.mark.parametrize("found", [of_samples, of_hunting])
@pytest.mark.parametrize("variant", ["relief", "both"])
@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_orders_of_all_examples_without_errors_are_those_of_simulate(path, variant, found):
    if found is of_hunting and read_scene(path).has_shafts:
        pytest.skip("is not supported by hunting: remove the shafts")
    # load transfers within panels of reliefs that the load does not move miss most: osu_50, 2.7 % of the stiffness
    assert_same_orders(path, variant, found, Resolution(gauss_points=24, segments=60), 0.03)
