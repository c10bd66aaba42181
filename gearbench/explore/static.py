"""Page of stored designs as a single HTML file that needs no server and loads nothing from the network."""

from __future__ import annotations

import numpy as np
from bokeh.document import Document
from bokeh.embed import file_html
from bokeh.resources import INLINE
from numpy.typing import NDArray

from gearbench.errors import GearbenchError, InputError
from gearbench.explore.catalogue import Catalogue, fronts
from gearbench.explore.gear_data import Tables, tables
from gearbench.explore.look import script
from gearbench.explore.model import shown_results
from gearbench.explore.page import Page, knee

#: Default number of designs on the fronts whose figures are stored in the file.
PICTURES = 60


def html(catalogue: Catalogue, pictures: int = PICTURES) -> str:
    """Make the page as HTML text.

    It contains all designs, and the figures of up to ``pictures`` designs spread over the fronts. The other designs are
    shown with their stored values only.

    Raises
    ------
    GearbenchError
        If the design shown first cannot be computed.
    """
    first = knee(catalogue)
    shown: dict[str, Tables] = {}
    for design in _spread(catalogue, first, pictures):
        try:
            results = shown_results(catalogue.scene(design))
        except (GearbenchError, InputError, ArithmeticError) as error:
            if design == first:
                raise GearbenchError(f"{catalogue.name(first)} cannot be computed: {error}") from error
            continue  # a design that cannot be computed has no figures
        shown[str(design)] = tables(results)
    page = Page(catalogue, first, shown[str(first)])
    page.show_answers()
    names = {design: catalogue.name(int(design)) for design in shown}
    page.pick.js_on_change("data", script("show", pick=page.pick, answer=page.answer, names=names, pictures=shown))
    document = Document()
    page.put(document)
    return as_file(document)


def as_file(document: Document) -> str:
    """HTML text of a document that loads nothing from the network."""
    return file_html(
        document,
        INLINE,
        title=document.title,
        template=document.template,
        template_variables=document.template_variables,
    )


def _spread(catalogue: Catalogue, first: int, count: int) -> NDArray:
    """Choose up to ``count`` designs evenly along the fronts, and add ``first``."""
    designs = fronts(catalogue)
    if len(designs) > count:
        designs = designs[np.linspace(0, len(designs) - 1, count).round().astype(int)]
    return np.unique([*designs, first])
