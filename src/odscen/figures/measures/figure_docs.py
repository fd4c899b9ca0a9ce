"""The registry as the tables of the documentation."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.base.markup import markdown_table
from odscen.figures.measures.figure import Better, Figure
from odscen.figures.measures.registry import RUN_FIGURES
from odscen.figures.measures.table_columns import COLUMNS

if TYPE_CHECKING:
    from collections.abc import Sequence

_BETTER = {Better.LOWER: "lower", Better.HIGHER: "higher", Better.NEITHER: ""}


def run_figure_table() -> str:
    """Figures of a run: names, units, what they are, who says so and what a suite allows."""
    heads = ("name", "unit", "what it is", "source", "better", "tolerance")
    return markdown_table(heads, (_figure_row(figure) for figure in RUN_FIGURES))


def column_table() -> str:
    """Columns of the tables by place and time."""
    heads = ("column", "unit", "meaning")
    return markdown_table(
        heads, ((f"`{column.name}`", column.unit, column.definition) for column in COLUMNS)
    )


def between_markers(text: str, name: str, content: str) -> str:
    """``text`` with ``content`` between ``<!-- name -->`` and ``<!-- end of name -->``.

    Raises
    ------
    ValueError
        If the text does not have them.
    """
    begin, end = f"<!-- {name} -->\n", f"<!-- end of {name} -->"
    before, _, rest = text.partition(begin)
    _, marker, after = rest.partition(end)
    if not marker:
        raise ValueError(f"there are no markers {name!r}")
    return f"{before}{begin}{content}{end}{after}"


def _figure_row(figure: Figure) -> Sequence[str]:
    tolerance = "none" if figure.tolerance == "0" else figure.tolerance
    what = f"**{figure.label}**: {figure.definition}"
    better = _BETTER[figure.better]
    return (f"`{figure.name}`", figure.unit, what, figure.source, better, tolerance)
