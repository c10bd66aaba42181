"""``gearbench response``."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gearbench.cli.options import Output, Plots, Threads, plot_folder, saved, to_file
from gearbench.cli.output import answer
from gearbench.cli.rexs import AnyFile, LoadCase, StageName, Torque, load_any
from gearbench.errors import InputError, naming
from gearbench.lazy import xr

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from gearbench.scene import Scene

Speed = Annotated[
    str,
    typer.Option(
        "--speed", metavar="A:B[:N]", help="Speed of the pinion or sun [1/min], or N speeds (200) from A to B."
    ),
]
Harmonics = Annotated[int, typer.Option(metavar="H", help="Number of harmonics of the mesh frequency.")]
Sound = Annotated[Path | None, to_file("OUT.wav", "Write a run-up of 10 s as sound.", "--sound")]
SoundAt = Annotated[str | None, typer.Option(metavar="NAME", help="Bearing or point of the housing to listen at.")]
FullScale = Annotated[
    float | None,
    typer.Option(
        metavar="N", help="Signal at full scale of the sound, to compare variants; by default from its peak.", min=1e-9
    ),
]
Nonlinear = Annotated[bool, typer.Option("--nonlinear", help="Follow loss of contact, for rising and falling speed.")]


Revolution = Annotated[
    bool, typer.Option("--revolution", help="Compute whole revolutions: sidebands of pitch errors and waviness.")
]
Samples = Annotated[int | None, typer.Option(metavar="N", help="Number of samples of the manufacturing errors.")]
Housing = Annotated[
    Path | None,
    typer.Option("--housing", metavar="H.nc", help="Transfer functions of a housing."),
]
Seed = Annotated[int, typer.Option(metavar="S", help="Seed of the samples.")]


def response(
    scene: AnyFile,
    speed: Speed,
    output: Output = None,
    plots: Plots = None,
    harmonics: Harmonics = 10,
    nonlinear: Nonlinear = False,
    revolution: Revolution = False,
    samples: Samples = None,
    seed: Seed = 0,
    threads: Threads = None,
    housing: Housing = None,
    sound: Sound = None,
    sound_at: SoundAt = None,
    full_scale: FullScale = None,
    stage: StageName = None,
    torque: Torque = None,
    load_case: LoadCase = None,
) -> None:
    """Dynamic transmission error, mesh and bearing forces of SCENE (with [system] or [planetary]) over speed.

    Example: gearbench response examples/shafts.toml --speed 500:6000 -o response.nc --plots plots
    """
    from gearbench.cli import summary
    from gearbench.dynamics.housing import housing_response, read_housing

    speeds = parse_speeds(speed)
    for option, value in (("--sound-at", sound_at), ("--full-scale", full_scale)):
        if sound is None and value is not None:
            raise InputError(option, value, "needs --sound OUT.wav")
    loaded, remarks = _load(scene, stage, torque, load_case)
    folder = plot_folder(plots)
    transfer = None if housing is None else read_housing(housing)
    run = _kind(nonlinear=nonlinear, revolution=revolution, samples=samples, seed=seed, threads=threads)
    with naming(scene):
        dataset = run(loaded, speed=speeds, harmonics=harmonics)
    if transfer is not None:
        with naming(housing):
            dataset = housing_response(dataset, transfer)
    written = saved(dataset, output)
    if folder is not None:
        from gearbench.dynamics.figures import draw_response

        written += draw_response(dataset, folder)
    notes = [*remarks, *filter(None, dataset.attrs.get("notes", "").split("\n"))]
    if sound is not None:
        from gearbench.dynamics.sound import write_run_up

        file, scale = write_run_up(dataset, sound, sound_at=sound_at, full_scale=full_scale)
        written.append(file)
        unit = dataset["housing_amplitude"].attrs["units"] if sound_at in dataset.get("point", ()) else "N"
        notes.append(f"full scale of the sound is {scale:.4g} {unit}: for a variant, --full-scale {scale:.4g}")
    answer(
        summary.as_json(loaded, dataset, files=written, notes=notes),
        [*summary.warnings(dataset), *(f"note: {note}" for note in notes)],
        lambda: summary.print_table(summary.pair_line(loaded), list(_rows(dataset))),
    )


def _kind(
    *, nonlinear: bool, revolution: bool, samples: int | None, seed: int, threads: int | None
) -> Callable[..., xr.Dataset]:
    """Choose the analysis that the options ask for."""
    asked = [
        name
        for name, is_chosen in (
            ("--nonlinear", nonlinear),
            ("--revolution", revolution),
            ("--samples", samples is not None),
        )
        if is_chosen
    ]
    if len(asked) > 1:
        raise InputError(asked[1], "given", f"conflicts with {asked[0]}: give one of the two")
    if nonlinear:
        from gearbench.dynamics.nonlinear import nonlinear_response

        return nonlinear_response
    if revolution:
        from gearbench.dynamics.revolution import revolution_response

        return revolution_response
    if samples is not None:
        from gearbench.dynamics.scatter import robust_response

        return partial(robust_response, samples=samples, seed=seed, threads=threads)
    from gearbench.dynamics.analysis import response

    return response


def _load(path: Path, stage: str | None, torque: float | None, load_case: int | None) -> tuple[Scene, tuple[str, ...]]:
    """Read the scene of a file, with its shafts if it is a REXS file, and notes."""
    from gearbench.exchange import is_rexs
    from gearbench.exchange.rexs_document import read_document

    if not is_rexs(path):
        return load_any(path, stage, torque, load_case)
    from gearbench.exchange.rexs_system import system_scene

    return system_scene(read_document(path), stage, torque=torque, load_case=load_case)


def parse_speeds(text: str) -> NDArray:
    """Read speeds from "3000", "500:6000" (200 speeds) or "500:6000:50".

    Raises
    ------
    InputError
        If the text has another form.
    """
    import numpy as np

    try:
        parts = [float(part) for part in text.split(":")]
        count = int(parts[2]) if len(parts) == 3 else 200
        if len(parts) > 3 or (len(parts) == 3 and count != parts[2]) or not all(np.isfinite(parts)):
            raise ValueError
    except (ValueError, OverflowError):
        raise InputError("--speed", text, "must be a speed, A:B, or A:B:N with N speeds [1/min]") from None
    if len(parts) == 1:
        return np.array(parts)
    if not (0 < parts[0] < parts[1] and 2 <= count <= 100_000):
        raise InputError("--speed", text, "must rise from above 0, with 2 to 100 000 speeds")
    return np.linspace(parts[0], parts[1], count)


def _train_rows(dataset: xr.Dataset) -> Iterator[tuple[str, str, str]]:
    """Rows of the printed table for a train: largest values, and their speeds."""
    import numpy as np

    rms = (dataset["bearing_force_amplitude"] ** 2).sum(["mesh", "direction", "harmonic"], skipna=False) ** 0.5 / 2**0.5
    most = {str(name): float(rms.sel(bearing=name).max()) for name in rms["bearing"].values}
    pins = sorted((name for name in most if name.startswith("planet ")), key=lambda name: most[name])
    least = 1e-6 * max(most.values())  # forces that cancel leave rounding
    shown = [name for name, force in most.items() if force > least and name not in pins[:-1]]  # show one pin for all
    curves = [
        ("largest force of a mesh over that where all paths share alike, K_γ K_v", dataset["mesh_load_factor"], "1"),
        ("RMS of the transmission error of the train", dataset["train_dynamic_transmission_error_rms"], "µm"),
        *((f"RMS of the force on the bearing of {name}", rms.sel(bearing=name), "N") for name in shown),
    ]
    for text, curve, unit in curves:
        if not np.isnan(curve).all():
            curve = curve.max("sweep") if "sweep" in curve.dims else curve
            index = int(np.nanargmax(curve.values))
            yield f"{text}, at {float(dataset['speed'][index]):.5g} 1/min", f"{float(curve[index]):.4g}", unit
    kinds, frequency = dataset["mode_kind"].values, dataset["natural_frequency"].values
    for kind in dict.fromkeys(kinds):
        of_kind = frequency[kinds == kind]
        yield f"{kind} modes, the first {min(len(of_kind), 6)}", " ".join(f"{f:.0f}" for f in of_kind[:6]), "Hz"


def _rows(dataset: xr.Dataset) -> Iterator[tuple[str, str, str]]:
    """Rows of the printed table."""
    import numpy as np

    from gearbench.cli.summary import duration
    from gearbench.dynamics.nonlinear import SWEEPS

    if "percentile" in dataset.dims:
        high = dataset["mesh_force_percentile"].sel(percentile=95.0)
        index = int(np.argmax(high.values))
        yield "95 % of the samples: largest RMS of the mesh force", f"{float(high[index]):.4g}", "N"
        yield "  at a speed of", f"{float(dataset['speed'][index]):.5g}", "1/min"
        for name, text in (("mean", "mean"), ("std", "standard deviation"), ("max", "largest")):
            yield f"RMS over all speeds, {text} of the samples", f"{float(dataset[f'mesh_force_{name}']):.4g}", "N"
    if "mode_kind" in dataset:
        yield from _train_rows(dataset)
    for mesh in dataset["mesh"].values if "mesh" in dataset.dims and "mode_kind" not in dataset else []:
        one = dataset.sel(mesh=mesh)
        for sweep in one["sweep"].values if "sweep" in one.dims else [None]:
            of_sweep = one if sweep is None else one.sel(sweep=sweep)
            factor = of_sweep["dynamic_factor"].values
            if np.isnan(factor).all():
                continue
            index = int(np.nanargmax(factor))
            of = "" if sweep is None else f", {SWEEPS[sweep]}"
            yield f"mesh {mesh}: largest dynamic factor{of}", f"{factor[index]:.3f}", "1"
            yield "  at a speed of", f"{float(dataset['speed'][index]):.5g}", "1/min"
            yield "  RMS of the mesh force there", f"{float(of_sweep['mesh_force_rms'][index]):.4g}", "N"
    value, unit = duration(dataset.attrs["wall_time_s"]).split()
    yield "computing time", value, unit
