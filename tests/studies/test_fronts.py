"""The study of the paper's fronts: its studies hold the paper's gears, its measures are right, its runs go on."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from numpy.testing import assert_allclose, assert_array_equal

from gearbench.errors import GearbenchError, InputError
from gearbench.library.garambois2017 import gear, table_2
from gearbench.optimisation.constraints import constrained, judge
from gearbench.optimisation.derived import unit_contact_addendum
from gearbench.optimisation.problem import scene_of
from gearbench.optimisation.study import Algorithm, Robustness
from gearbench.results.netcdf import open_result, save
from studies.s06_paper_fronts import checks, compute, figures
from studies.s06_paper_fronts import findings as compare
from studies.s06_paper_fronts import search as searching
from studies.s06_paper_fronts.data import macro_and_micro
from studies.s06_paper_fronts.findings import front
from studies.s06_paper_fronts.search import MODULE, TEETH, TOOLS, study


# -- the searches ------------------------------------------------------------------------------------------------------
def design_of(tool: int, **wanted: float) -> tuple[int, ...]:
    """Codes of the design with these values; the first value of every other variable."""
    found = []
    for variable in study(tool).variables:
        assert variable.grid is not None
        value = wanted.get(variable.name, variable.grid[0])
        found.append(int(np.argmin([abs(float(v) - value) for v in variable.grid])))
    return tuple(found)


def test_full_size_is_the_papers():
    for tool in TOOLS:
        given = study(tool)
        assert (given.algorithm.population, given.algorithm.generations, given.robustness.samples) == (100, 200, 1000)
        assert given.base["effects"]["manufacturing_errors"] == {"preset": "garambois2017"}
        assert given.constraints["total_contact_ratio"].min == 1.1
        assert given.constraints["specific_sliding"].max == 2.5


@pytest.mark.parametrize(("tool", "name"), [(1, "1"), (2, "14"), (3, "55")])
def test_gears_of_table_2_are_in_the_grid(tool, name):
    row = gear(name)
    pair = row.scene().pair
    lowest = unit_contact_addendum(pair)
    relief = row.tip_relief * row.tip_relief_length > 0
    design = design_of(
        tool,
        teeth=row.teeth,
        helix_angle=row.helix_angle,
        addendum_fraction=(row.addendum - lowest) / (1 - lowest),
        crowning=row.crowning,
        relief=row.tip_relief if relief else 0.0,
        relief_fraction=row.tip_relief_length / pair.gears[0].tooth_height if relief else 0.0,
    )
    scene = scene_of(study(tool), design)
    assert scene.pair.normal_module == row.module
    shape = macro_and_micro(scene)
    # the table is printed to three decimals
    assert_allclose(shape["profile_shift"], row.profile_shift, atol=6e-4)
    assert_allclose(shape["addendum"], row.addendum, atol=6e-4)
    assert shape["crowning"] == row.crowning
    assert shape["tip_relief"] == (row.tip_relief if relief else 0)
    # the length follows from a tooth height that is rounded with the addendum
    assert_allclose(shape["relief_length"], row.tip_relief_length if relief else 0, atol=1.1e-3)
    assert scene.effect("manufacturing_errors") == row.scene(errors=True).effect("manufacturing_errors")


@pytest.mark.parametrize("tool", TOOLS)
def test_the_range_of_teeth_leaves_no_gear_out(tool):
    """Just outside the range no macro-geometry keeps the limits of contact ratio and sliding; at its ends one does."""
    given = study(tool)
    limits = {name: given.constraints[name] for name in ("total_contact_ratio", "specific_sliding")}
    low, high = TEETH[tool]

    def works(teeth: int) -> bool:
        tables = given.to_mapping()
        tables["variables"]["teeth"] |= {"min": teeth, "max": teeth}
        one = searching.parse_study(tables)
        for helix in range(6):
            for addendum in range(0, 21, 2):
                try:
                    scene = scene_of(one, (0, helix, addendum, 0, 0, 0))
                except (InputError, GearbenchError):
                    continue
                if judge(constrained(scene, limits), limits)[0] == 0:
                    return True
        return False

    assert [works(z) for z in (low - 1, low, high, high + 1)] == [False, True, True, False]
    assert {row.teeth for row in table_2() if row.module == MODULE[tool] and row.gear != "SC"} <= set(
        range(low, high + 1)
    )


# -- measures ----------------------------------------------------------------------------------------------------------
FRONT = np.array([[1.0, 4.0], [2.0, 2.0], [4.0, 1.0]])


def test_coverage_counts_what_is_equalled_or_dominated():
    rows = np.array([[1.0, 4.0], [3.0, 3.0], [0.9, 4.0], [2.0, 1.9]])
    assert compare.coverage(FRONT, rows) == 0.5
    assert compare.coverage(rows, FRONT) == pytest.approx(2 / 3)  # (1, 4) and (2, 2), not (4, 1)


@pytest.mark.parametrize(
    ("point", "lead", "distance"),
    [
        ([1.8, 1.8], 0.1, 1 / 9),  # beats (2, 2) by 10 % in both; (2, 2) must become 2/1.8 better
        ([2.0, 2.0], 0.0, 0.0),
        ([1.0, 1.8], 0.1, 1.0),  # beats (2, 2) by 50 and 10 %; the nearest, (2, 2), has twice its first objective
        ([4.0, 4.0], -1.0, -0.5),  # twice as bad as (2, 2)
        ([8.0, 4.0], -3.0, -0.5),  # four times as bad as (2, 2) in the first, twice in the second
    ],
)
def test_lead_and_distance(point, lead, distance):
    # quotients of numbers of a few digits: rounding only
    assert_allclose(compare.lead(np.array(point), FRONT), lead, atol=1e-15)
    assert_allclose(compare.distance(np.array(point), FRONT), distance, atol=1e-15)


def test_shares_of_the_common_box():
    # reference point (4.4, 4.4): three rectangles, and a square of half its side
    ours, theirs = compare.shares(FRONT, np.array([[2.2, 2.2]]))
    area = (4.4 - 1) * 0.4 + (4.4 - 2) * (4 - 2) + (4.4 - 4) * (2 - 1)
    assert_allclose([ours, theirs], [area / 4.4**2, 0.25], rtol=1e-14)


def test_the_wide_front_holds_what_is_nearly_optimal():
    F = np.array([[2.0, 2.0], [2.19, 2.19], [2.21, 2.0], [1.0, 4.5], [4.3, 1.05], [1.5, 3.0]])
    # within 1.1 of (2, 2), (2, 2), none, none, (4, 1), none: (1.5, 3) is a third worse than (2, 2) in the second
    assert_array_equal(compare.wide(F, FRONT), [True, True, False, False, True, False])


@pytest.fixture(scope="module")
def dataset(tmp_path_factory) -> xr.Dataset:
    with pytest.MonkeyPatch.context() as patch:
        size = (Algorithm(population=8, generations=3, seed=1), Robustness(samples=8))
        patch.setattr(searching, "QUICK", size)
        path = save(compute(quick=True), tmp_path_factory.mktemp("fronts") / "fronts.nc")
    return open_result(path)


@pytest.mark.slow
def test_figures_and_tables_come_from_the_dataset(dataset, tmp_path):
    figures(dataset, tmp_path)
    drawn = {path.stem for path in tmp_path.glob("*.png")}
    assert {f"figure_{number}" for number in (5, 8, 9, 10)} <= {"_".join(name.split("_")[:2]) for name in drawn}
    table = (tmp_path / "table_2.md").read_text(encoding="utf-8")
    for row in table_2():
        assert f"| {row.gear} |" in table
    listed = (tmp_path / "fronts.csv").read_text(encoding="utf-8").splitlines()
    assert len(listed) == 1 + int(dataset["in_wide_front"].sum())


@pytest.mark.slow
def test_a_row_that_beats_a_front_is_found(dataset):
    for tool, share, holds in ((1, 0.03, False), (2, 0.01, True)):
        F = front(dataset, tool)
        far = dataset.copy(deep=True)
        rows = np.flatnonzero(far["row_tool"].values == tool)
        far["row_ours"].values[np.ix_(rows, (0, 1))] = 10 * F.max(axis=0)
        far["row_ours"].values[rows[1], :2] = (1 - share) * F[0]
        full = far.assign_attrs(quick=0)
        text, found = next(check for check in checks(full) if check[0].startswith(f"tool {tool}: row"))
        assert str(far["row"].values[rows[1]]) in text
        assert found is holds


@pytest.mark.slow
def test_what_the_quick_size_checks_holds():
    for text, holds in checks(compute(quick=True)):
        assert holds, text
