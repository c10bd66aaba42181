"""``gearbench response``: files, messages, speeds; sound that has the orders it says."""

import numpy as np
import pytest
import xarray as xr
from scipy.io import wavfile

from gearbench.cli.response import parse_speeds
from gearbench.dynamics.analysis import response
from gearbench.dynamics.revolution import revolution_response
from gearbench.dynamics.sound import RATE, run_up, write_run_up
from gearbench.errors import InputError
from tests.support.systems import shafts, spur_scene


@pytest.mark.slow
def test_response_writes_dataset_plots_and_sound(run, tmp_path):
    support = {"radial_stiffness": 200.0, "axial_stiffness": 100.0}
    ends = {"bearings": [{"position": 0.0, **support}, {"position": 200.0, **support}]}
    (tmp_path / "s.toml").write_text(spur_scene(shafts(ends), segments=10, gauss_points=6).to_toml())
    out, wav, plots = tmp_path / "r.nc", tmp_path / "r.wav", tmp_path / "plots"
    words = ("--speed", "500:3000:8", "-o", out, "--plots", plots, "--sound", wav)
    code, printed, err = run("response", tmp_path / "s.toml", *words)
    assert (code, err) == (0, "")
    assert "largest dynamic factor" in printed
    data = xr.load_dataset(out, engine="h5netcdf")
    assert dict(data.sizes)["speed"] == 8
    assert {path.name for path in plots.iterdir()} == {
        "modes.gif",
        "modes.png",
        *(f"{name}_pair.png" for name in ("force", "orders", "campbell", "waterfall", "bearings")),
    }
    rate, samples = wavfile.read(wav)
    assert rate == RATE
    assert len(samples) == 10 * RATE
    assert np.abs(samples).max() == pytest.approx(0.9 * 32767, abs=1)


@pytest.mark.parametrize(
    ("speed", "line"),
    [
        ("fast", "--speed = fast: must be a speed, A:B, or A:B:N"),
        ("3000:500", "--speed = 3000:500: must rise"),
        ("0", "speed = 0: must be positive"),
    ],
)
def test_speeds_that_cannot_be_are_one_line(refused, tmp_path, speed, line):
    (tmp_path / "s.toml").write_text(spur_scene({}).to_toml())
    assert line in refused("response", tmp_path / "s.toml", "--speed", speed)


@pytest.mark.parametrize(
    ("change", "line"),
    [
        (
            "[system]\ndampin_ratio = 1\n",
            "system.dampin_ratio = unknown key: did you mean damping_ratio? allowed: damping_ratio",
        ),
        (
            '[[system.shafts]]\nname = "a"\nsections = [{ length = 10.0, diamter = 3.0 }]\n',
            "system.shafts.0.sections.0.diamter = unknown key: did you mean diameter? allowed: length, diameter",
        ),
        ('[[system.shafts]]\nname = "a"\nsections = [{ length = 10.0, diameter = 3.0 }]\n', "pinion on 0 shafts"),
    ],
)  # fmt: skip
def test_faults_of_a_system_name_their_key(run, tmp_path, change, line):
    path = tmp_path / "s.toml"
    path.write_text(spur_scene().to_toml() + change)
    code, _, err = run("response", path, "--speed", "1000")
    assert code == 2
    assert line in err


def test_parse_speeds():
    assert list(parse_speeds("100:200:3")) == [100.0, 150.0, 200.0]
    assert len(parse_speeds("100:200")) == 200
    with pytest.raises(InputError):
        parse_speeds("1:2:3:4")


@pytest.mark.slow
def test_run_up_sounds_at_the_mesh_frequency():
    """Over a narrow range of speed the strongest line of the spectrum is an order of the mesh frequency."""
    data = response(spur_scene({}), speed=[2400.0, 2400.5], harmonics=2)
    signal = run_up(data, 2.0)
    spectrum = np.abs(np.fft.rfft(signal * np.hanning(len(signal))))
    peak = spectrum.argmax() / 2.0
    orders = 2400.25 / 60 * 25 * np.array([1, 2])
    assert np.abs(peak - orders).min() < 1.0


def test_run_up_needs_a_range_and_a_known_bearing():
    one = response(spur_scene({}), speed=1000.0, harmonics=2)
    with pytest.raises(InputError, match="two speeds"):
        run_up(one)
    two = response(spur_scene({}), speed=[1000.0, 1100.0], harmonics=2)
    with pytest.raises(InputError, match="sound_at = left"):
        run_up(two, sound_at="left")


@pytest.mark.slow
def test_sounds_on_a_common_scale_and_of_side_bands(tmp_path):
    """Twice the full scale is half as loud; a revolution sounds at orders between those of the mesh."""
    speeds = [2400.0, 2400.5]
    data = response(spur_scene({}), speed=speeds, harmonics=2)
    _, scale = write_run_up(data, tmp_path / "one.wav")
    write_run_up(data, tmp_path / "two.wav", full_scale=2 * scale)
    one, two = (wavfile.read(tmp_path / f"{name}.wav")[1].astype(float) for name in ("one", "two"))
    assert np.abs(one - 2 * two).max() <= 2
    assert np.abs(run_up(data)).max() == pytest.approx(0.9 * scale)
    error = np.cos(2 * np.pi * np.arange(400) / 400)  # once a revolution
    turning = revolution_response(spur_scene({}), speed=speeds, harmonics=2, error=error)
    signal = run_up(turning, 2.0)
    spectrum = np.abs(np.fft.rfft(signal * np.hanning(len(signal))))
    beside = round(2.0 * 2400.25 / 60 * 26)  # the band above the first order
    assert spectrum[beside - 2 : beside + 3].max() > 10 * np.median(spectrum[beside - 40 : beside + 40])
