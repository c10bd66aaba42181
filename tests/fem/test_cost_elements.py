"""Work–precision of finite elements: types and meshes against one limit, measured in processes of their own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fem_reference.mesh_family import MOST_UNKNOWNS, mesh_cells, unknowns
from fem_reference.section import Body
from fem_reference.tooth_mesh import tooth_mesh
from gearbench.accuracy.settings import with_resolution
from gearbench.effects.tooth_bending import ToothBending
from gearbench.effort.clock import Cost, apart
from gearbench.effort.curves import Point, WorkPrecision, as_dataset
from gearbench.effort.elements import ELEMENTS, Meshes, all_meshes, element_curves, with_blocks
from gearbench.errors import GearbenchError
from gearbench.library.garambois2017 import case
from gearbench.scene import Scene
from gearbench.solution import cycle_values
from gearbench.validation.reference import meshed_flanks


def meshed(k: int, effect: ToothBending) -> Scene:
    scene = with_resolution(case(k), segments=4, gauss_points=2)
    return replace(scene, effects=tuple(effect if e.name == "tooth_bending" else e for e in scene.effects))


@pytest.fixture(scope="module")
def curves() -> dict[str, WorkPrecision]:
    tried = Meshes(levels={"hex8": (2, 3), "hex20": (2, 3), "hex27": (2, 3)}, reference=(3, 4, 5), accuracies=(0.1,))
    return {found.setting: found for found in element_curves(meshed(1, ToothBending(model="finite_elements")), tried)}


@pytest.mark.slow
def test_finer_meshes_are_nearer_to_the_limit_and_cost_more(curves):
    for name in ("mesh, hex8", "mesh, hex20", "mesh, hex27"):
        found = curves[name]
        assert found.column("label").tolist() == ["2", "3"]
        assert np.all(np.diff(found.column("compliance_error")) < 0)
        assert np.all(np.diff(found.column("unknowns")) > 0)
        assert np.all(np.diff(found.errors[:, 0]) < 0)
        assert np.all(found.column("megabytes") > 0)
        assert np.all(found.column("seconds") > 0)


@pytest.mark.slow
def test_elements_keep_to_their_order(curves):
    linear, quadratic, full = (
        curves[f"mesh, {kind}"].column("compliance_error") for kind in ("hex8", "hex20", "hex27")
    )
    # as many cells: quadratic elements bend with the tooth, linear ones do not; two meshes show no more of an order
    assert np.all(quadratic < 0.5 * linear)
    assert np.all(full < quadratic)
    assert 1 < curves["mesh, hex8"].compliance_order < 2.5
    assert curves["mesh, hex20"].compliance_order > 2


@pytest.mark.slow
def test_the_accuracy_asked_of_the_mesh_is_kept(curves):
    found = curves["fe accuracy"]
    # 20-node hexahedra, Richardson's value of meshes 4 and 5 or finer
    assert found.points[0].compliance_error <= 0.1 + found.compliance_bar
    assert found.points[0].unknowns > curves["mesh, hex20"].points[-1].unknowns


def test_blocks_given_answer_as_the_effect_they_come_from():
    scene = meshed(2, ToothBending(model="finite_elements", accuracy=0.1))
    blocks = [flank.blocks for flank in meshed_flanks(scene)]
    assert_allclose(cycle_values(with_blocks(scene, blocks)), cycle_values(scene), rtol=1e-12)  # rounding
    # and they are what counts
    assert np.max(np.abs(cycle_values(with_blocks(scene, [2 * b for b in blocks])) / cycle_values(scene) - 1)) > 0.1


@pytest.mark.parametrize("k", [1, 2])
def test_all_meshes_end_below_the_unknowns_allowed(k):
    scene = meshed(k, ToothBending(model="finite_elements"))
    found = all_meshes(scene)
    bodies = [Body(gear=gear) for gear in scene.pair.gears]
    assert len(found.reference) == 3
    assert max(unknowns(body, mesh_cells(body, found.reference[-1])) for body in bodies) <= MOST_UNKNOWNS
    assert max(found.levels["hex20"]) < found.reference[-1]
    assert set(found.levels) == set(ELEMENTS)


def test_what_fails_in_a_process_of_its_own_is_one_line():
    with pytest.raises(GearbenchError, match=r"^timing in a process failed: .*two hundred") as error:
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
    nan = float("nan")
    points = [replace(p, compliance_error=nan, unknowns=nan) for p in curves["mesh, hex20"].points]
    plain = replace(curves["mesh, hex20"], setting="other", points=tuple(points), compliance_bar=nan)
    dataset = as_dataset([plain, curves["mesh, hex20"]])
    assert np.isnan(dataset["compliance_error"].values[:2]).all()
    assert np.array_equal(dataset["compliance_error"].values[2:], curves["mesh, hex20"].column("compliance_error"))
    assert np.isnan(dataset["compliance_order"].values).tolist() == [True, False]
    assert dataset["unknowns"].attrs["units"] == "1"
    assert "compliance_error" not in as_dataset([plain])


def test_the_table_has_the_cheapest_mesh_of_an_accuracy():
    from docs.performance import elements
    from studies.s07_accuracy_cost.data import MESHED

    rows = ((2, 0.2, 1e3, 1.0), (4, 0.009, 2e3, 2.0), (8, 0.002, 4e3, 8.0))
    points = [
        Point(
            label=str(m),
            size=m,
            errors=np.full(4, 0.01),
            cost=Cost(seconds=taken, processor_seconds=taken, megabytes=taken),
            compliance_error=error,
            unknowns=unknowns,
        )
        for m, error, unknowns, taken in rows
    ]
    made = WorkPrecision(
        setting="mesh, hex20", expected="2", points=tuple(points), bar=np.zeros(4), compliance_bar=1e-4
    )
    name = f"case 9, {MESHED}"
    dataset = as_dataset([made]).rename_dims(knob="curve").reset_index("knob").rename(knob="curve_knob")
    dataset = dataset.assign_coords(setting_scene=("setting", [name] * 3), curve_scene=("curve", [name]))
    row = (name, "mesh, hex20", "3.3", *("4", "2000", "2", "2"), *("8", "4000", "8", "8"))
    assert list(elements(dataset))[1:] == [row]
