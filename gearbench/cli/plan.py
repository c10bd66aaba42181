"""``gearbench plan``."""

from __future__ import annotations

from gearbench.cli.options import Json, Memory, Quiet, SceneFile, Verbose


def plan(
    scene: SceneFile, memory: Memory = None, quiet: Quiet = False, verbose: Verbose = False, json: Json = False
) -> None:
    """Parts that will run for SCENE, and the cost of each.

    Example: gearbench plan examples/case1.toml
    """
    from dataclasses import asdict

    from gearbench.budget import SMALL, memory_limit, shown
    from gearbench.cli.summary import console, pair_line, print_mapping
    from gearbench.effort.plan import plan as plan_of
    from gearbench.scene_file import load_scene

    loaded = load_scene(scene)
    made = plan_of(loaded)
    if json:
        print_mapping({"name": loaded.name, "scene_sha256": loaded.digest, **asdict(made)})
        return
    if quiet:
        return
    from rich.table import Table

    out = console()
    table = Table(title=pair_line(loaded), title_justify="left", title_style="bold", box=None, pad_edge=False)
    for name in ("part", "does", "size", "time"):
        table.add_column(name, justify="right" if name == "time" else "left")
    for part in made.parts:
        table.add_row(part.name, part.does, part.size, f"{1e3 * part.seconds:.2f} ms" if part.seconds else "")
    out.print(table)
    out.print(f"simulate, predicted: {1e3 * made.seconds:.1f} ms, {made.megabytes:.1f} MB")
    if 1e6 * made.megabytes > max(memory_limit(), SMALL):
        out.print(f"this is more than the {shown(memory_limit())} of memory that are allowed: simulate refuses it")
    if made.robust_seconds:
        out.print(f"robust, predicted: {1e3 * made.robust_seconds:.1f} ms")
