"""``gearbench plan``."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gearbench.cli.options import AccuracyText, with_accuracy
from gearbench.cli.output import answer
from gearbench.cli.rexs import LoadCase, StageName, Torque, load_any
from gearbench.cli.table import print_columns

if TYPE_CHECKING:
    from gearbench.effort.plan import Plan
    from gearbench.scene import Scene

Planned = Annotated[Path, typer.Argument(metavar="SCENE|STUDY", help="Scene, REXS or study file.", show_default=False)]


def plan(
    scene: Planned,
    stage: StageName = None,
    torque: Torque = None,
    load_case: LoadCase = None,
    accuracy: AccuracyText = None,
) -> None:
    """Show the computations of SCENE, their sizes and memory; for a study, those of one evaluation.

    Example: gearbench plan examples/case1.toml
    """
    from gearbench.effort.plan import plan as plan_of

    if _is_study(scene):
        _plan_study(scene)
        return
    loaded, _ = load_any(scene, stage, torque, load_case)
    loaded = with_accuracy(loaded, accuracy)
    made = plan_of(loaded)
    lines = []
    for command, megabytes in made.megabytes.items():
        lines += [f"{command}: {megabytes:.1f} MB of memory", *_refusal(megabytes, command)]
    data = {"name": loaded.name, "scene_sha256": loaded.digest, **asdict(made)}
    answer(data, lines, lambda: _print(loaded, made))


def _is_study(path: Path) -> bool:
    from gearbench.exchange import is_rexs
    from gearbench.schema import read_toml

    return not is_rexs(path) and "objectives" in read_toml(path)


def _plan_study(path: Path) -> None:
    from gearbench.cli.summary import duration
    from gearbench.effort.plan import study_plan
    from gearbench.optimisation.study_file import read_study

    study = read_study(path)
    made = study_plan(study)
    lines = (
        f"{study.name or 'study'}: {made.designs} designs at most, {made.samples} error samples each",
        f"one evaluation takes {duration(made.design_seconds)} here",
        f"all take {duration(made.seconds)} at most, {made.threads} side by side, and {made.megabytes:.1f} MB",
        *_refusal(made.megabytes, "optimise"),
    )
    answer({"name": study.name, "study_sha256": study.digest, **asdict(made)}, lines)


def _print(scene: Scene, made: Plan) -> None:
    from gearbench.cli.summary import pair_line

    rows = [(part.name, part.does, part.size) for part in made.parts]
    print_columns(pair_line(scene), ("part", "does", "size"), rows, left=(0, 1, 2))


def _refusal(megabytes: float, command: str) -> list[str]:
    from gearbench.budget import SMALL, memory_limit, shown

    if 1e6 * megabytes <= max(memory_limit(), SMALL):
        return []
    return [f"this is more than the {shown(memory_limit())} of memory that are allowed: {command} refuses it"]
