"""Exchange with other programs: gear pairs from REXS and results back into it."""

from pathlib import Path

#: Ends of names: XML, JSON and packed (REXS 1.5, file formats).
PLAIN = (".rexs", ".rexs.xml")
JSON = (".rexsj", ".rexs.json")
PACKED = (".rexsz", ".rexs.zip")


def is_rexs(path: str | Path) -> bool:
    """Whether the name of a file says that it is REXS."""
    return str(path).lower().endswith((*PLAIN, *JSON, *PACKED))
