"""Exchange with other programs: read gears from REXS files, and write results back."""

from pathlib import Path

#: Endings of file names: XML, JSON and packed (REXS 1.5, file formats).
PLAIN = (".rexs", ".rexs.xml")
JSON = (".rexsj", ".rexs.json")
PACKED = (".rexsz", ".rexs.zip")


def is_rexs(path: str | Path) -> bool:
    """Whether a file is REXS, by its name."""
    return str(path).lower().endswith((*PLAIN, *JSON, *PACKED))
