"""Work–precision of finite elements: types and meshes against one limit, measured in processes of their own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fem_reference.mesh_family import MOST_UNKNOWNS, mesh_cells, unknowns
from fem_reference.section import Body
from fem_reference.tooth_mesh import tooth_mesh
from gearbench.accuracy.knobs import with_resolution
from gearbench.cost.apart import apart
from gearbench.cost.finite_elements import LEVELS, Meshes, all_meshes, element_curves, with_blocks
from gearbench.cost.workprecision import Curve, FlankErrors, as_dataset
from gearbench.effects.fe_compliance import FeCompliance
from gearbench.errors import GearbenchError
from gearbench.library.garambois2017 import case
from gearbench.scene import Scene
from gearbench.simulation import cycle_values


def meshed(k: int, effect: FeCompliance) -> Scene:
    scene = with_resolution(case(k), segments=4, gauss_points=2)
    return replace(scene, effects=tuple(effect if e.name == "tooth_bending" else e for e in scene.effects))


@pytest.fixture(scope="module")
def curves() -> dict[str, Curve]:
    tried = Meshes(levels={"hex8": (2, 3), "hex20": (2, 3), "hex27": (2, 3)}, reference=(3, 4, 5), accuracies=(0.1,))
    return {found.knob: found for found in element_curves(meshed(1, FeCompliance()), tried)}


def test_finer_meshes_are_nearer_to_the_limit_and_cost_more(curves):
    for name in ("mesh, hex8", "mesh, hex20", "mesh, hex27"):
        found = curves[name]
        assert found.flank is not None
        assert found.labels == ("2", "3")
        assert np.all(np.diff(found.flank.errors) < 0)
        assert np.all(np.diff(found.flank.unknowns) > 0)
        assert np.all(np.diff(found.errors[:, 0]) < 0)
        assert np.all(found.megabytes > 0)
        assert np.all(found.seconds > 0)


def test_elements_keep_to_their_order(curves):
    linear, quadratic, full = (curves[f"mesh, {kind}"].flank.errors for kind in ("hex8", "hex20", "hex27"))
    # as many cells: quadratic elements bend with the tooth, linear ones do not; two meshes show no more of an order
    assert np.all(quadratic < 0.5 * linear)
    assert np.all(full < quadratic)
    assert 1 < curves["mesh, hex8"].flank_order < 2.5
    assert curves["mesh, hex20"].flank_order > 2


def test_the_accuracy_asked_of_the_mesh_is_kept(curves):
    found = curves["fe accuracy"]
    # 20-node hexahedra, Richardson's value of meshes 4 and 5 or finer
    assert found.flank.errors[0] <= 0.1 + found.flank.bar
    assert found.flank.unknowns[0] > curves["mesh, hex20"].flank.unknowns[-1]


def test_blocks_given_answer_as_the_effect_they_come_from():
    scene = meshed(2, FeCompliance(accuracy=0.1))
    blocks = [scene.effect("fe_compliance").flank(scene.pair, k).blocks for k in range(2)]
    assert_allclose(cycle_values(with_blocks(scene, blocks)), cycle_values(scene), rtol=1e-12)  # rounding
    # and they are what counts
    assert np.max(np.abs(cycle_values(with_blocks(scene, [2 * b for b in blocks])) / cycle_values(scene) - 1)) > 0.1


@pytest.mark.parametrize("k", [1, 2])
def test_all_meshes_end_below_the_unknowns_allowed(k):
    scene = meshed(k, FeCompliance())
    found = all_meshes(scene)
    bodies = [Body(gear=gear) for gear in scene.pair.gears]
    assert len(found.reference) == 3
    assert max(unknowns(body, mesh_cells(body, found.reference[-1])) for body in bodies) <= MOST_UNKNOWNS
    assert max(found.levels["hex20"]) < found.reference[-1]
    assert set(found.levels) == set(LEVELS)


def test_what_fails_in_a_process_of_its_own_is_one_line():
    with pytest.raises(GearbenchError, match=r"^in a process of its own: .*two hundred") as error:
        apart(_fails, case(1), "two hundred")
    assert "\n" not in str(error.value)


def _fails(_: Scene, word: str) -> None:
    raise ValueError(word)


@pytest.mark.parametrize("m", [5, 6])
def test_tetrahedra_beside_the_clamped_root_are_not_turned_inside_out(m):
    """Meshes that had one such element in the cusp of fillet and root circle, seen where matrices are integrated."""
    for gear in case(1).pair.gears:
        body = Body(gear=gear)
        assert tooth_mesh(body, mesh_cells(body, m), "tet10").quality > 0


def test_errors_of_flanks_are_rows_of_their_own(curves):
    plain = replace(curves["mesh, hex20"], knob="other", flank=None)
    dataset = as_dataset([plain, curves["mesh, hex20"]])
    assert np.isnan(dataset["compliance_error"].values[:2]).all()
    assert np.array_equal(dataset["compliance_error"].values[2:], curves["mesh, hex20"].flank.errors)
    assert np.isnan(dataset["compliance_order"].values).tolist() == [True, False]
    assert dataset["unknowns"].attrs["units"] == "1"
    assert "compliance_error" not in as_dataset([plain])


def test_the_page_names_the_cheapest_mesh_of_an_accuracy():
    from studies.performance_page import _elements
    from studies.s07_accuracy_cost import MESHED

    flank = FlankErrors(errors=np.array([0.2, 0.009, 0.002]), bar=1e-4, unknowns=np.array([1e3, 2e3, 4e3]))
    costs = {name: np.array([1.0, 2.0, 8.0]) for name in ("seconds", "processor_seconds", "megabytes")}
    made = Curve(
        knob="mesh, hex20",
        expected="2",
        labels=("2", "4", "8"),
        sizes=np.array([2.0, 4.0, 8.0]),
        errors=np.full((3, 4), 0.01),
        bar=np.zeros(4),
        flank=flank,
        **costs,
    )
    name = f"case 9, {MESHED}"
    dataset = as_dataset([made]).rename_dims(knob="curve").reset_index("knob").rename(knob="curve_knob")
    dataset = dataset.assign_coords(setting_scene=("setting", [name] * 3), curve_scene=("curve", [name]))
    text = _elements(dataset)
    assert "| case 9 | mesh, hex20 | 2 | 3.3 | 4: 2000, 2, 2 | 8: 4000, 8, 8 |" in text
    assert "0.01 %" in text
