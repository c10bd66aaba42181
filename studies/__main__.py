"""Run the studies: ``python -m studies list | run NAME… | figures NAME…``."""

from __future__ import annotations

import sys
from importlib import import_module
from inspect import signature
from pathlib import Path
from pkgutil import iter_modules
from types import ModuleType
from typing import Annotated

import typer

import studies
from gearbench.lazy import xr
from gearbench.results.netcdf import open_result, save

app = typer.Typer(no_args_is_help=True, add_completion=False, help=__doc__)
Output = Annotated[Path, typer.Option("--output", "-o", help="Folder for Datasets, figures and reports.")]
Names = Annotated[list[str], typer.Argument(help="Names of studies, e.g. s01_table2, or 'all'.")]
DEFAULT_OUTPUT = Path("out/studies")


def modules(names: list[str]) -> list[ModuleType]:
    """Study modules by name; exits with code 2 if one does not exist."""
    known = sorted(m.name for m in iter_modules(studies.__path__) if m.ispkg)
    wanted = known if names == ["all"] else names
    for name in wanted:
        if name not in known:
            print(f"studies: NAME = {name}: allowed: {', '.join(known)}, all", file=sys.stderr)
            raise typer.Exit(2)
    return [import_module(f"studies.{name}") for name in wanted]


def short(module: ModuleType) -> str:
    """Name of a study."""
    return module.__name__.rsplit(".", 1)[-1]


def compute(module: ModuleType, quick: bool, folder: Path) -> xr.Dataset:
    """Compute the Dataset of a study; a study that can be interrupted keeps finished parts in ``folder``."""
    kept = {"folder": folder} if "folder" in signature(module.compute).parameters else {}
    return module.compute(quick=quick, **kept)


@app.command("list")
def show() -> None:
    """List the studies and the question each one answers."""
    for module in modules(["all"]):
        print(f"{short(module):24} {module.QUESTION}")


@app.command()
def run(names: Names, output: Output = DEFAULT_OUTPUT, quick: bool = False) -> None:
    """Compute studies, store their Datasets, draw their figures, and run their checks."""
    failed = False
    for module in modules(names):
        folder = output / short(module)
        folder.mkdir(parents=True, exist_ok=True)
        dataset = compute(module, quick, folder)
        save(dataset, folder / f"{short(module)}.nc")
        module.figures(dataset, folder)
        for text, holds in module.checks(dataset):
            print(f"{'holds' if holds else 'FAILS'}  {text}")
            failed |= not holds
        print(f"{short(module)}: {folder}")
    raise typer.Exit(1 if failed else 0)


@app.command()
def figures(names: Names, output: Output = DEFAULT_OUTPUT) -> None:
    """Draw the figures of studies again from their stored Datasets."""
    for module in modules(names):
        folder = output / short(module)
        module.figures(open_result(folder / f"{short(module)}.nc"), folder)
        print(f"{short(module)}: {folder}")


if __name__ == "__main__":
    app()
