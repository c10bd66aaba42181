"""A first look: the paper's pair 1 and its standard gear SC, from scene to numbers, netCDF files and plots."""

from __future__ import annotations

import sys
from pathlib import Path

from gearbench.cli.summary import pair_line, print_table, result_rows
from gearbench.library.garambois2017 import case, gear
from gearbench.plotting import draw_robust, draw_simulation
from gearbench.results import save
from gearbench.robustness.montecarlo import robust
from gearbench.simulation import simulate


def main(folder: Path) -> None:
    """Run the demonstration and leave its files in ``folder``."""
    written = []
    for name, scene in (("case1", case(1)), ("sc", gear("SC").scene())):
        target = folder / name
        target.mkdir(parents=True, exist_ok=True)
        dataset = simulate(scene)
        print_table(pair_line(scene), result_rows(dataset))
        (target / "scene.toml").write_text(scene.to_toml(), encoding="utf-8")
        written += [save(dataset, target / f"{name}.nc"), *draw_simulation(dataset, target)]
    scene = gear("55").scene(errors=True)
    target = folder / "gear55_robust"
    target.mkdir(parents=True, exist_ok=True)
    dataset = robust(scene, samples=1000)
    print_table(f"{pair_line(scene)}, 1000 error samples", result_rows(dataset))
    written += [save(dataset, target / "gear55_robust.nc"), *draw_robust(dataset, target)]
    print(f"\nwrote, below {folder}:")
    for path in written:
        print(f"  {path.relative_to(folder)}")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out/demo"))
