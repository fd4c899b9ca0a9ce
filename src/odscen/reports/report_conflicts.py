"""Traffic conflicts (surrogate safety measures): the report's figures, and the worst ones."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from odscen.base.markup import Markup, element, number
from odscen.figures.measures.conflicts import (
    SERIOUS_DRAC,
    SERIOUS_PET,
    SERIOUS_TTC,
    is_serious,
)
from odscen.figures.measures.figure import ReportSection, RunData
from odscen.figures.measures.registry import figure_values
from odscen.reports.page_templates import html_table, report_section
from odscen.reports.report_figures import card_grid, figure_cards

if TYPE_CHECKING:
    import polars as pl

SHOWN = 15
"""Rows of the table at most."""

KINDS = {
    "following": "following",
    "merging": "merging",
    "crossing": "crossing",
    "walking": "with a pedestrian",
}


def conflict_section(conflicts: pl.DataFrame) -> Markup:
    """Cards, the number of each kind, and the worst conflicts.

    Parameters
    ----------
    conflicts
        As :func:`~odscen.figures.measures.conflicts.conflict_table` gives them.
    """
    values = {**figure_values(RunData(conflicts=conflicts)), "conflicts": conflicts.height}
    if not (conflicts["kind"] == "walking").any():
        del values["pedestrian_min_pet"]
    cards = figure_cards(ReportSection.CONFLICTS, values)
    explained = (
        "the time to collision (TTC) is what is left until two collide if both continue as they "
        "do; the post-encroachment time (PET) is from when the first leaves a spot until the other "
        "is there; DRAC is the deceleration that avoids a crash. A conflict is "
        f"serious if these are below {SERIOUS_TTC:g} s and {SERIOUS_PET:g} s, or if more than "
        f"{SERIOUS_DRAC:g} m/s\u00b2 of deceleration is needed. Where they gather, look "
        "at sight, speed and right of way. A simulator's drivers see everything and hardly "
        "err, so compare two variants rather than take these numbers for accidents."
    )
    table = _worst(conflicts) if conflicts.height else element("p", "There were no conflicts.")
    return report_section(
        "Traffic conflicts", card_grid(cards), table, explained=explained, ident="conflicts"
    )


def _worst(conflicts: pl.DataFrame) -> Markup:
    import polars as pl

    share = pl.max_horizontal(
        SERIOUS_TTC / pl.col("ttc").clip(0.01),
        SERIOUS_PET / pl.col("pet").clip(0.01),
        pl.col("drac") / SERIOUS_DRAC,
    )
    worst = conflicts.sort(share, descending=True, maintain_order=True).head(SHOWN)
    heads = (
        "Since, s", "Road user", "With", "Type", "TTC, s", "PET, s", "DRAC, m/s\u00b2",
        "At x, y, m",
    )  # fmt: skip
    grave = worst.select(is_serious()).to_series()
    rows = [
        _row(row, bad)
        for row, bad in zip(worst.iter_rows(named=True), grave.to_list(), strict=True)
    ]
    return html_table(heads, rows, label="The worst conflicts")


def _row(row: dict[str, Any], bad: bool) -> Markup:
    place = ""
    if row["x"] is not None:
        place = f"{row['x']:.0f}, {row['y']:.0f}"
    kind = KINDS.get(row["kind"], row["kind"])
    return element(
        "tr",
        element("th", number(row["begin"], 1), scope="row"),
        element("td", row["one"]),
        element("td", row["other"]),
        element("td", kind, class_="bad" if bad else None),
        *(
            element("td", "" if row[name] is None else f"{row[name]:.2f}", class_="n")
            for name in ("ttc", "pet", "drac")
        ),
        element("td", place),
    )
