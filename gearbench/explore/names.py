"""Names of files and studies, shown letter by letter."""

from __future__ import annotations

import re

from gearbench.errors import plain

#: Between the two signs of a mark at which BokehJS begins or ends to set text as TeX, and with it any HTML in it.
_TEX = re.compile(r"(?<=\$)(?=\$)|(?<=\\)(?=[\[\]()])")
_WORD_JOINER = "\u2060"


def as_text(name: str) -> str:
    """A name that BokehJS shows letter by letter: its marks of TeX are taken apart by a sign without width."""
    return _TEX.sub(_WORD_JOINER, plain(name))
