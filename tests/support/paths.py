"""Folders of the repository that tests read."""

from pathlib import Path

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
DATA = ROOT / "tests" / "data"
# the smallest study of the examples
STUDY = EXAMPLES / "optimise_small.toml"
