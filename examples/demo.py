"""A first look: single pairs, a robust gear and a small optimisation, from input to numbers, netCDF files and plots."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gearbench.cli.summary import pair_line, print_table, result_rows
from gearbench.doctor import is_first_run
from gearbench.library.garambois2017 import case, gear
from gearbench.plotting import BLUE, draw_robust, draw_simulation, new_figure, write_figure
from gearbench.results.netcdf import save
from gearbench.robustness.run import robust
from gearbench.simulation import simulate
from studies.s06_paper_fronts.search import study

if TYPE_CHECKING:
    import xarray as xr


def main(folder: Path) -> None:
    """Run the demonstration and leave its files in ``folder``."""
    written = []
    if is_first_run():
        tell("first run: the solver is compiled, once after an installation; half a minute")
    for name, scene in (("case1", case(1)), ("sc", gear("SC").scene())):
        target = folder / name
        target.mkdir(parents=True, exist_ok=True)
        tell(f"simulating {name}")
        dataset = simulate(scene)
        print_table(pair_line(scene), result_rows(dataset))
        (target / "scene.toml").write_text(scene.to_toml(), encoding="utf-8")
        written += [save(dataset, target / f"{name}.nc"), *draw_simulation(dataset, target)]
    scene = gear("55").scene(errors=True)
    target = folder / "gear55_robust"
    target.mkdir(parents=True, exist_ok=True)
    tell("1000 error samples of gear 55")
    dataset = robust(scene, samples=1000)
    print_table(f"{pair_line(scene)}, 1000 error samples", result_rows(dataset))
    written += [save(dataset, target / "gear55_robust.nc"), *draw_robust(dataset, target)]
    written += optimised(folder / "optimisation")
    print(f"\nwrote, below {folder}:")
    for path in written:
        print(f"  {path.relative_to(folder)}")


def tell(line: str) -> None:
    """Say at once what is happening."""
    print(line, file=sys.stderr, flush=True)


def optimised(target: Path) -> list[Path]:
    """A small search for quiet gears of the paper's reverse gear, cut by its third tool, with few error samples."""
    from gearbench import optimise
    from gearbench.optimisation.listing import markdown_text
    from gearbench.optimisation.select import open_designs, select
    from gearbench.optimisation.study import Algorithm, Robustness

    target.mkdir(parents=True, exist_ok=True)
    small = replace(study(3), algorithm=Algorithm(population=40, generations=15), robustness=Robustness(samples=64))
    described = target / "study.toml"
    described.write_text(small.to_toml(), encoding="utf-8")
    tell("a search over 15 generations of 40 gears: about a minute")
    dataset = optimise(small)
    path = save(dataset, target / "front.nc")
    print_front(dataset)
    listed = target / "front.md"
    listed.write_text(markdown_text(select(open_designs(path)), top=20), encoding="utf-8")
    return [described, path, listed, draw_front(dataset, target / "front.png")]


def front(dataset: xr.Dataset) -> xr.Dataset:
    """The designs that no other dominates, by their m_k."""
    found = dataset.isel(design=np.flatnonzero(dataset["on_front"].values))
    return found.isel(design=np.argsort(found["objective"].values[:, 0], kind="stable"))


def print_front(dataset: xr.Dataset) -> None:
    """A short table: what was searched, and six gears from one end of the front to the other."""
    found = front(dataset)
    title = (
        f"\nsmall optimisation: {dataset.sizes['design']} gears evaluated in {dataset.attrs['wall_time_s']:.0f} s, "
        f"{int(dataset['feasible'].sum())} feasible, {found.sizes['design']} on the front"
    )
    numbers = np.unique(np.linspace(0, found.sizes["design"] - 1, 6).round().astype(int))
    rows = []
    for number in numbers:
        gear_found = found.isel(design=number)
        k, ste = gear_found["objective"].values
        name = f"z {int(gear_found['teeth'])}, β {float(gear_found['helix_angle']):g}°"
        crowning, relief = (float(gear_found[v]) for v in ("crowning", "relief"))
        rows.append((f"{name}, crowning {crowning:g} µm, tip relief {relief:g} µm", f"{k:.2f} / {ste:.3f}", "% / µm"))
    print_table(f"{title}\nm_k / m_ste, mean RMS of mesh stiffness and transmission error over the error samples", rows)


def draw_front(dataset: xr.Dataset, path: Path) -> Path:
    """Picture of all feasible gears and their front."""
    feasible = dataset["objective"].values[dataset["feasible"].values == 1]
    best = front(dataset)["objective"].values
    figure, ((axis,),) = new_figure(1, 1, (8.0, 5.2))
    axis.plot(*feasible.T, "o", color="0.75", ms=4, label=f"{len(feasible)} feasible gears")
    axis.step(*best.T, where="post", color=BLUE, lw=1)
    axis.plot(*best.T, "o", color=BLUE, ms=6, label=f"front, {len(best)} gears")
    axis.set(xlabel="m$_k$, mean RMS of mesh stiffness [%]", ylabel="m$_{ste}$, mean RMS of transmission error [µm]")
    axis.set_ylim(bottom=0)
    axis.grid(alpha=0.3)
    axis.legend(loc="upper right", frameon=False)
    axis.set_title(
        f"Transmission error down from {best[0, 1]:.2f} to {best[-1, 1]:.2f} µm: "
        f"stiffness fluctuation up from {best[0, 0]:.1f} to {best[-1, 0]:.1f} %"
    )
    return write_figure(figure, path)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out/demo"))
