"""Pictures of the gallery: ``python -m docs.gallery`` runs the programs of examples/gallery."""

from __future__ import annotations

import os
import runpy
import shutil
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).parents[1]
PROGRAMS = ROOT / "examples" / "gallery"
PICTURES = ROOT / "docs" / "figures" / "gallery"


def draw(program: Path, folder: Path) -> Path:
    """Run a program in a folder of its own; the picture that it leaves, which bears its name, in ``folder``."""
    import matplotlib as mpl
    from matplotlib import pyplot as plt

    mpl.use("agg")
    before, picture = Path.cwd(), f"{program.stem}.png"
    with TemporaryDirectory() as own:
        os.chdir(own)
        try:
            runpy.run_path(str(program), run_name="__main__")
        finally:
            os.chdir(before)
            plt.close("all")
        return Path(shutil.copy(Path(own) / picture, folder / picture))


def main() -> None:
    """Draw all pictures anew."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    for program in sorted(PROGRAMS.glob("*.py")):
        print(draw(program, PICTURES).relative_to(ROOT))


if __name__ == "__main__":
    main()
