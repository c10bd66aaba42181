"""The documentation: ``make docs`` builds it strictly, and without anything from the network, into out/site."""

from __future__ import annotations

import csv
import re
from itertools import groupby
from pathlib import Path
from typing import Any

from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml
from pygments.lexers.special import TextLexer
from sphinx.application import Sphinx

from gearbench import __version__

project = "gearbench"
author = "gearbench developers"
release = version = __version__
project_copyright = author

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
exclude_patterns = ["__pycache__"]
#: Every reference to a public name must lead somewhere; internal types in signatures are printed without a link.
nitpicky = True
nitpick_ignore_regex = [(r"py:.*", r"(?!gearbench\.(?:\w+|(?:plot|plugin)\.\w+)$).*")]

myst_enable_extensions = ["attrs_inline", "dollarmath", "colon_fence", "fieldlist"]
myst_heading_anchors = 3

napoleon_google_docstring = False
napoleon_use_rtype = False
autodoc_member_order = "bysource"
autodoc_class_signature = "mixed"
autodoc_typehints_format = "short"
autodoc_default_options = {"members": True, "show-inheritance": True}
add_module_names = False
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 100

html_math_renderer = "mathml"
html_theme = "furo"
html_title = f"gearbench {release}"
html_static_path = ["_static"]
html_css_files = ["tables.css"]
html_copy_source = False
html_show_sphinx = False
html_theme_options = {"navigation_with_keys": True}


def setup(app: Sphinx) -> None:
    """Tables of CSV files are shown as they are or on a page; formulas as MathML, which browsers draw by themselves."""
    app.connect("source-read", _show_tables)
    app.add_lexer("csv", TextLexer)
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))


def _show_tables(app: Sphinx, page: str, source: list[str]) -> None:
    """Show the CSV file that a line ``{sections of FILE}`` names.

    Each value of its first column is a section, with a table of the columns that are not empty.
    """

    def sections(line: re.Match[str]) -> str:
        path = Path(app.srcdir) / line[1]
        app.env.note_dependency(path, docname=page)
        with path.open(encoding="utf-8", newline="") as file:
            head, *rows = csv.reader(file)
        return "\n".join(_section(name, [head, *found]) for name, found in groupby(rows, key=lambda row: row[0]))

    source[0] = re.sub(r"(?m)^\{sections of (\S+)\}\n", sections, source[0])


def _section(name: str, rows: list[list[str]]) -> str:
    columns = [column for column in list(zip(*rows, strict=True))[1:] if any(column[1:])]
    head, *body = zip(*columns, strict=True)
    cells = ([re.sub(r"([|*])", r"\\\1", cell) for cell in row] for row in (head, ["---"] * len(head), *body))
    return f"## {name}\n\n" + "".join(f"| {' | '.join(row)} |\n" for row in cells)


def _inline(writer: Any, node: nodes.math) -> None:
    writer.body.append(_mathml(node.astext()))
    raise nodes.SkipNode


def _block(writer: Any, node: nodes.math_block) -> None:
    label = node.get("label") or ""
    number = f'<span class="eqno">({label})</span>' if label else ""
    anchor = f' id="equation-{label}"' if label else ""
    writer.body.append(f'<div class="math"{anchor}>{_mathml(node.astext(), as_block=True)}{number}</div>')
    raise nodes.SkipNode


def _mathml(tex: str, **options: Any) -> str:
    """MathML of a formula, with the thin spaces around names of functions that browsers leave out."""
    space = '<mspace width="0.17em"/>'
    found = tex2mathml(tex, **options)
    return re.sub(r"(<mi[^>]*>\w{2,}</mi>)\s*<mo>&ApplyFunction;</mo>", rf"{space}\1{space}", found)
