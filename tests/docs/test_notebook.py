"""The notebook of the examples in a real kernel."""

import pytest

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
    assert "transmission_error_amplitude_noise_floor" in result
