"""Pictures of the gallery: ``python -m docs.gallery`` runs the programs of examples/gallery."""

from __future__ import annotations

import os
import runpy
from pathlib import Path

ROOT = Path(__file__).parents[1]
PROGRAMS = ROOT / "examples" / "gallery"
PICTURES = ROOT / "docs" / "figures" / "gallery"


def draw(program: Path, folder: Path) -> Path:
    """Run a program in ``folder``; the picture that it leaves there, which bears its name."""
    import matplotlib as mpl
    from matplotlib import pyplot as plt

    mpl.use("agg")
    before = Path.cwd()
    os.chdir(folder)
    try:
        runpy.run_path(str(program), run_name="__main__")
    finally:
        os.chdir(before)
        plt.close("all")
    return folder / f"{program.stem}.png"


def main() -> None:
    """Draw all pictures anew."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    for program in sorted(PROGRAMS.glob("*.py")):
        print(draw(program, PICTURES).relative_to(ROOT))


if __name__ == "__main__":
    main()
