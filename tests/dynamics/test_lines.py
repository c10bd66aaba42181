"""What cannot be answered is one clear line: bearings, rigid bodies, singular systems, instability, orders, speeds."""

import numpy as np
import pytest

from gearbench.dynamics.analysis import response
from gearbench.dynamics.modes import modes
from gearbench.dynamics.nonlinear import nonlinear_response
from gearbench.dynamics.revolution import revolution_response
from gearbench.dynamics.scatter import robust_response
from gearbench.errors import InputError
from gearbench.system.mechanics import Mechanics
from tests.support.systems import shafts, spur_scene, wheels

SUPPORT = {"radial_stiffness": 200.0, "axial_stiffness": 100.0}
ENDS = [{"position": p, **SUPPORT} for p in (0.0, 200.0)]
RADIAL = [{"position": p, "radial_stiffness": 200.0} for p in (0.0, 200.0)]


@pytest.mark.parametrize(
    ("bearings", "helix", "line"),
    [
        ([], 0.0, "free to move across"),
        ([{"position": 0.0, **SUPPORT}], 0.0, "free to move tilting about"),
        (RADIAL, 15.0, "free to move axially"),
        ([{"position": p, "radial_stiffness": 0.0} for p in (0.0, 200.0)], 0.0, "free to move across"),
    ],
)
def test_shaft_that_nothing_holds(bearings, helix, line):
    with pytest.raises(InputError, match=rf"system.shafts.input.bearings = {line}.*: must hold the shaft"):
        response(spur_scene(shafts({"bearings": bearings}), helix=helix), speed=1000.0)


def test_rigid_bodies_that_no_load_starts_do_not_disturb():
    """A spur pinion free to slide, shafts free to turn: bodies at rest, no resonance at 0 Hz."""
    data = response(spur_scene(shafts({"bearings": RADIAL, "coupling": None})), speed=[1.0, 1000.0], harmonics=3)
    assert np.isfinite(data["mesh_force_amplitude"]).all()
    assert float(data["natural_frequency"].min()) > 10.0
    assert float(data["mesh_force_rms"][0, 0]) < 1e-3 * float(data["mean_force"][0])


@pytest.mark.parametrize("run", [response, nonlinear_response, robust_response, revolution_response])
@pytest.mark.parametrize("harmonics", [0, 201, 2.5])
def test_orders_that_cannot_be(run, harmonics):
    with pytest.raises(InputError, match=rf"harmonics = {harmonics}: must be a whole number, 1 to 200"):
        run(spur_scene({}), speed=1000.0, harmonics=harmonics)


def test_undamped_mode_that_is_met():
    system = modes(wheels(1e-3), np.array([[4e5]]), 0.0)
    with pytest.raises(InputError, match=r"an order excites the undamped mode at 3183\.1 Hz"):
        system.mesh_receptance(system.frequency[-1:], np.array([0]))


def test_part_without_mass_is_named():
    system = Mechanics(
        mass=np.diag([1e-3, 0.0]),
        stiffness=np.zeros((2, 2)),
        damping=(np.zeros((0, 2)), np.zeros(0)),
        mesh=np.array([[-1.0, 1.0]]),
        rotation=np.array([[-1.0, 1.0]]),
        bearing=np.zeros((0, 3, 2)),
        bearing_names=(),
    )
    with pytest.raises(InputError, match="a part without mass: every shaft and gear must have inertia"):
        modes(system, np.array([[1e5]]), 0.05)


def test_instability_and_orders_beyond_are_noted():
    """Little damping at twice the natural frequency over the order: the values are missing, and the note says where."""
    scene = spur_scene(shafts({"bearings": ENDS}, damping_ratio=0.001))
    data = response(scene, speed=np.linspace(5000, 45000, 60))
    notes, grows = data.attrs["notes"], data["floquet_multiplier"].values > 1
    assert "mesh pair: parametric instability: no steady linear response at" in notes
    assert "flanks separate: the linear response does not hold" in notes
    assert grows.any()
    assert np.isnan(data["mesh_force_rms"].values[grows]).all()
    few = response(spur_scene({}), speed=[100.0, 200.0], harmonics=3)
    assert "only orders above 3, which are not computed, excite the mode at" in few.attrs["notes"]


@pytest.mark.slow
def test_scatter_says_where_samples_part():
    effects = {"hertz": {"law": "yang_sun"}, "manufacturing_errors": {"preset": "garambois2017"}}
    scene = spur_scene({"damping_ratio": 0.01}, effects=effects, segments=8, gauss_points=4)
    data = robust_response(scene, speed=[20000.0, 26000.0, 40000.0], samples=16)
    assert "flanks separate: the RMS of samples exceeds the mean force" in data.attrs["notes"]


@pytest.mark.parametrize(("relief", "told"), [({}, True), ({"tip_relief": {"amount": 8.0, "length": 1.0}}, False)])
def test_orders_left_out_are_told(relief, told):
    """Spur gears without relief have more than a tenth of their motion in orders 11 to 20."""
    effects = {"hertz": {}, "tooth_bending": {"model": "plate", "order": [3, 3]}} | relief
    scene = spur_scene({"damping_ratio": 0.05}, effects=effects, segments=12, gauss_points=4)
    assert ("orders above 10" in response(scene, speed=3000.0).attrs["notes"]) == told
