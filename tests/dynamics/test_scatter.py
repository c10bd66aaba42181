"""Scatter of the mesh force: each sample is the response of its own scene; statistics; refusals."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest
from numpy.testing import assert_allclose

from gearbench.dynamics.analysis import response
from gearbench.dynamics.balance import Excitation, solve
from gearbench.dynamics.model import Model
from gearbench.dynamics.scatter import force_rms, pair_excitations, robust_response, sample_problem
from gearbench.dynamics.waves import rms
from gearbench.effects.base import GapEffect
from gearbench.effects.manufacturing_errors import ManufacturingErrors
from gearbench.errors import InputError
from tests.support.systems import shafts, spur_scene

ERRORS = {"hertz": {}, "tooth_bending": {"basis": "paper"}, "manufacturing_errors": {"preset": "garambois2017"}}
SPEEDS = np.array([800.0, 2500.0, 6000.0])


def scene(helix=0.0, gauss_points=6):
    return spur_scene({"damping_ratio": 0.05}, helix=helix, effects=ERRORS, segments=12, gauss_points=gauss_points)


def on_shafts(effects, seat=70.0, **resolution):
    """A pinion on soft bearings, and a wheel that can tilt too."""
    soft = {"radial_stiffness": 250.0, "axial_stiffness": 150.0}
    pinion = {
        "gears": [{"gear": "pinion", "position": seat}],
        "bearings": [{"position": p, **soft} for p in (20.0, 120.0)],
    }
    wheel = {
        "sections": [{"length": 100.0, "diameter": 60.0}],
        "bearings": [{"position": p, **soft} for p in (0.0, 100.0)],
    }
    return spur_scene(shafts(pinion, wheel, damping_ratio=0.05), helix=15.0, effects=effects, **resolution)


@pytest.mark.parametrize("one", [scene(), on_shafts(ERRORS, segments=12, gauss_points=6)], ids=["wheels", "shafts"])
def test_each_sample_is_solved_as_by_itself(one):
    """Samples are solved to a residual of 1e-4."""
    model = Model(scene=one)
    cycles = pair_excitations(model, 8, samples=130, seed=3, sampler="sobol", threads=1)
    assert [len(chunk.motion) for chunk in cycles] == [128, 2]
    found = force_rms(model, model.groups[0], cycles, SPEEDS)
    h = model.receptances(model.groups[0], SPEEDS, np.arange(9))
    for i in (0, 1, 77, 128, 129):
        sample = cycles[i // 128].part(slice(i % 128, i % 128 + 1))
        drive = Excitation(stiffness=sample.stiffness[0], motion=sample.motion[0], force=sample.force[0])
        _, force = solve(drive, h, model.stiffness)
        assert_allclose(found[:, i], rms(force)[:, 0], rtol=3e-3)


@dataclass(frozen=True, kw_only=True, eq=False)
class Drawn(GapEffect):
    """Gap of one sample of the errors."""

    errors: ManufacturingErrors
    amounts: tuple
    name: ClassVar[str] = "drawn"
    summary: ClassVar[str] = ""
    source: ClassVar[str] = ""
    __eq__, __hash__ = object.__eq__, object.__hash__

    def gap(self, lines):
        return self.errors.expansion(lines, {self.errors.name: self.errors}).modes @ np.array(self.amounts)


SEATS = [None, *(pytest.param(seat, marks=pytest.mark.slow) for seat in (70.0, 160.0))]


RELIEF = {"tip_relief": {"amount": 10.0, "length": 1.0}, "crowning": {"amount": 5.0}}


@pytest.mark.parametrize("relief", [pytest.param({}, marks=pytest.mark.slow), RELIEF], ids=["without", "with"])
@pytest.mark.parametrize("seat", SEATS, ids=["wheels", "straddled", "overhung"])
def test_samples_at_default_settings_are_their_own_scenes(relief, seat):
    """The mean over 16 samples of responses of one scene each; damping is the scene's own, not each sample's."""
    tables = ERRORS | {"tooth_bending": {"model": "plate", "order": [3, 3]}} | relief
    if seat is None:
        base = spur_scene({"damping_ratio": 0.05}, helix=15.0, effects=tables, segments=15)
    else:
        base = on_shafts(tables, seat, segments=15)
    model = Model(scene=base)
    problem = sample_problem(model)
    speeds, found = np.linspace(500, 8000, 40), []
    for amounts in problem.expansion.amounts(problem.draw(16, 0, "sobol")):
        drawn = Drawn(errors=problem.errors, amounts=tuple(amounts))
        data = response(replace(base, effects=(*base.effects, drawn)), speed=speeds)
        found.append(np.sqrt((data["mesh_force_rms"].values ** 2).mean()))
    cycles = pair_excitations(model, 10, samples=16, seed=0, sampler="sobol", threads=1)
    batch = np.sqrt((force_rms(model, model.groups[0], cycles, speeds) ** 2).mean(axis=0))
    assert_allclose(batch.mean(), np.mean(found), rtol=0.01 if relief and seat is None else 0.02)
    # mesh phases are those without errors: on shafts the forces of single samples are known less well
    assert_allclose(batch, found, rtol=0.05 if seat is None else 0.2)


def test_statistics_are_those_of_the_samples():
    model = Model(scene=scene())
    cycles = pair_excitations(model, 10, samples=64, seed=0, sampler="sobol", threads=2)
    values = np.array(force_rms(model, model.groups[0], cycles, SPEEDS))
    data = robust_response(scene(), speed=SPEEDS, samples=64)
    assert_allclose(data["mesh_force_percentile"].sel(percentile=50.0), np.median(values, axis=1), rtol=1e-9)
    assert_allclose(data["mesh_force_rms_std"], values.std(axis=1, ddof=1), rtol=1e-9)
    overall = np.sqrt((values**2).mean(axis=0))
    for name, number in (("mean", overall.mean()), ("std", overall.std(ddof=1)), ("max", overall.max())):
        assert_allclose(float(data[f"mesh_force_{name}"]), number, rtol=1e-9)


def test_scene_without_errors_is_refused():
    with pytest.raises(InputError, match="manufacturing_errors"):
        robust_response(spur_scene({}), speed=1000.0)
