"""The notebook of the examples in a real kernel, and what notebooks show of results."""

import pytest
import xarray as xr

from gearbench.library.garambois2017 import gear
from gearbench.notebook import dataset_html
from gearbench.simulation import simulate
from tests.support.paths import ROOT

NOTEBOOK = ROOT / "examples" / "first_steps.ipynb"


@pytest.mark.slow
def test_the_notebook_runs_in_a_kernel_and_shows_what_it_says(monkeypatch):
    monkeypatch.delenv("MPLBACKEND", raising=False)  # a kernel draws into its cells unless told otherwise
    pytest.importorskip("ipykernel")
    nbclient, nbformat = pytest.importorskip("nbclient"), pytest.importorskip("nbformat")
    notebook = nbformat.read(NOTEBOOK, 4)
    assert all(not cell.get("outputs") for cell in notebook.cells)  # stored without results
    client = nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(NOTEBOOK.parent)}})
    client.execute()
    outputs = [cell.outputs for cell in notebook.cells if cell.cell_type == "code"]
    kinds = [{kind for out in found for kind in out.get("data", {})} for found in outputs]
    assert sum("image/png" in found for found in kinds) == 4
    assert not [out for found in outputs for out in found if out.output_type in {"error", "stream"}]
    scene, result = (next(o.data["text/html"] for o in outputs[i] if "text/html" in o.data) for i in (0, 1))
    assert "e_drive_input" in scene
    assert '<div class="gearbench">' in result  # without a word of the reader
    assert "transmission_error_amplitude_noise_floor" in result


def test_datasets_of_others_are_left_as_they_are():
    dataset = simulate(gear("SC").scene())
    assert dataset_html(dataset).startswith('<div class="gearbench">')
    assert 'class="gearbench"' not in dataset_html(dataset.drop_attrs())


@pytest.mark.slow
def test_no_name_is_cut_in_a_browser(tmp_path):
    from tests.browser.chromium import chromium, missing

    if reason := missing():
        pytest.skip(reason)
    cut = "return [...document.querySelectorAll('.xr-var-name')].filter((e) => e.scrollWidth > e.clientWidth).length"
    dataset = simulate(gear("SC").scene())
    with xr.set_options(display_expand_data_vars=True):
        before = dataset._repr_html_()
    with chromium(tmp_path, offline=True) as driver:
        found = []
        for name, text in (("as_it_was", before), ("in_full", dataset_html(dataset))):
            page = tmp_path / f"{name}.html"
            page.write_text(f"<!doctype html><meta charset=utf-8>{text}", encoding="utf-8")
            driver.get(page.as_uri())
            found.append(driver.execute_script(cut))
        assert found[0] > 0
        assert found[1] == 0
