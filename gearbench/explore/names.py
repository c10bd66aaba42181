"""Names of files and studies as literal text, never as TeX or HTML."""

from __future__ import annotations

import re

from gearbench.errors import plain

#: Between the two signs of a mark at which BokehJS begins or ends to set text as TeX, and with it any HTML in it.
_TEX = re.compile(r"(?<=\$)(?=\$)|(?<=\\)(?=[\[\]()])")
_WORD_JOINER = "\u2060"


def as_text(name: str) -> str:
    """Name as literal text in BokehJS: a zero-width character separates TeX delimiters."""
    return _TEX.sub(_WORD_JOINER, plain(name))
