"""``gearbench sweep`` as a user meets it."""

import json

import pytest
import xarray as xr

from gearbench.errors import GearbenchError
from gearbench.sweeps import figures
from gearbench.sweeps import run as sweep_run
from tests.support.paths import EXAMPLES

SCENE = EXAMPLES / "case2.toml"


def test_a_load_range_is_printed_written_and_drawn(run, tmp_path):
    target, plots = tmp_path / "loads.nc", tmp_path / "plots"
    code, out, err = run("sweep", SCENE, "--torque", "100:300:100", "-o", target, "--plots", plots)
    assert (code, err) == (0, "")
    assert [line.split()[0] for line in out.splitlines() if line.strip()[:1].isdigit()] == ["100", "200", "300"]
    with xr.open_dataset(target, engine="h5netcdf") as dataset:
        assert dataset["torque"].values.tolist() == [100.0, 200.0, 300.0]
        assert dataset["transmission_error"].dims == ("torque", "position")
        assert dataset["transmission_error_mean"].attrs["units"] == "µm"
        assert "load.torque" in dataset.attrs["swept"]
    assert {path.name for path in plots.iterdir()} == {
        "harris_map.png", "orders_over_torque.png", "peak_to_peak_over_torque.png",
    }  # fmt: skip


def test_two_keys_as_json(run):
    code, out, _ = run("sweep", SCENE, "--torque", "50,100", "--set", "pair.pinion.addendum=1.1,1.15", "--json")
    assert code == 0
    assert json.loads(out)["points"] == {"load.torque": 2, "pair.pinion.addendum": 2}


def test_the_columns_of_two_keys_of_one_effect_are_told_apart(run, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    keys = ("--set", "effects.tip_relief.amount=2,4", "--set", "effects.tip_relief.length=0.2,0.3")
    code, out, _ = run("sweep", SCENE, "--torque", "50,100", *keys)
    assert code == 0
    assert "…" not in out
    assert out.count("tip relief") == 2
    assert len(out[: out.index("50")].split("amount")) == len(out[: out.index("50")].split("length")) == 2


def test_steps_of_a_torque_pass_over_zero(run):
    code, out, _ = run("sweep", SCENE, "--torque=-100:100:50", "--json")
    assert code == 0
    assert json.loads(out)["points"] == {"load.torque": 4}


def test_plots_of_two_keys_say_at_which_value_they_are(run, tmp_path, monkeypatch):
    titles = []
    monkeypatch.setattr(figures, "write_figure", lambda figure, path: titles.append(texts(figure)) or path)
    code, _, _ = run("sweep", SCENE, "--torque", "50,100", "--set", "effects.crowning.amount=2,8", "--plots", tmp_path)
    assert code == 0
    harris, peaks, orders = titles
    assert "crowning.amount = 2 µm" in harris
    assert "crowning.amount = 2 µm" in orders
    assert {"crowning.amount = 2 µm", "crowning.amount = 8 µm"} <= peaks


def texts(figure) -> set[str]:
    """Lines of all titles and legends of a figure."""
    axes = figure.axes
    found = [each.get_title() for each in axes] + [text.get_text() for each in figure.legends for text in each.texts]
    return {line for text in (*found, figure.get_suptitle()) for line in text.split("\n")}


def test_a_sweep_that_fails_says_that_its_file_holds_a_part(run, tmp_path, monkeypatch):
    target, solve, calls = tmp_path / "part.nc", sweep_run.solve_group, []

    def failing(*given):
        calls.append(given)
        if len(calls) > 1:
            raise GearbenchError("the contact problem is not solved")
        return solve(*given)

    monkeypatch.setattr(sweep_run, "solve_group", failing)
    monkeypatch.setattr(sweep_run, "KEEP_LEAST", 0.0)
    code, _, err = run("sweep", SCENE, "--set", "effects.crowning.amount=2,8", "-o", target)
    assert code == 1
    assert f"{target} holds the points done before the fault" in err
    with xr.open_dataset(target, engine="h5netcdf") as dataset:
        assert dataset["transmission_error_mean"].notnull().values.tolist() == [True, False]
        assert dataset.attrs["complete"] == 0


@pytest.mark.parametrize(
    ("options", "line"),
    [
        (["--torque", "20:300"], "torque = 20:300: must be FIRST:LAST:STEP"),
        (["--set", "crowning"], "set = crowning: must be KEY=RANGE"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(refused, options, line):
    assert line in refused("sweep", SCENE, *options)
