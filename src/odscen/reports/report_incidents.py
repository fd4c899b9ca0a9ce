"""Incidents: the report's table, and numbered rings on its map."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.base.markup import Markup, element, join, number
from odscen.records.outcomes import IncidentKind, reason_label
from odscen.reports.page_templates import html_table, report_section

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.figures.measures.gridlock import Incident

SHOWN = 15
"""Rows and rings of each kind at most, the worst first."""


def incident_section(found: Sequence[Incident]) -> Markup | None:
    """Table of the incidents; ``None`` if there were none."""
    if not found:
        return None
    heads = ("No.", "Incident", "Reason", "Vehicles", "Since, s", "Until, s", "Place")
    shown = _shown(found)
    rows = [_row(index, one) for index, one in enumerate(shown, start=1)]
    more = None
    if len(found) > len(shown):
        more = element("p", f"{len(found) - len(shown):,} smaller ones are not listed here.")
    explained = (
        "each line is a place where vehicles were gridlocked, teleported (removed after they had "
        "waited too long, and put back further on) or not inserted; its number is on the map "
        "above. Jams come first, and first of all those that did not dissolve. The reason is what "
        "the first vehicle of the queue had ahead of it. A signal delay of minutes asks for "
        "another signal plan, a lane that does not continue for a look at the map, one that was "
        "not reached for longer turn lanes, a full start for less traffic there."
    )
    places = html_table(heads, rows)
    return report_section(
        "Gridlock and teleports", places, more, explained=explained, ident="incidents"
    )


def incident_rings(found: Sequence[Incident], dot: float) -> Markup | None:
    """Rings with the numbers of the table, in the map's centimetres."""
    radius = round(dot * 220)
    parts = []
    labelled: list[tuple[int, int]] = []
    for index, one in enumerate(_shown(found), start=1):
        if one.x is None or one.y is None:
            continue
        x, y = round(one.x * 100), round(-one.y * 100)
        title = element("title", f"{index}: {one.kind.label}, {reason_label(one.reason)}")
        ring = element("circle", cx=x, cy=y, r=radius, stroke_width=round(dot * 45))
        label = None
        if all(max(abs(x - a) / 3, abs(y - b)) > 2 * radius for a, b in labelled):
            labelled.append((x, y))
            label = element(
                "text", str(index), x=x + round(radius * 1.2), y=y, font_size=round(dot * 420)
            )
        parts.append(element("g", title, ring, label))
    return element("g", *parts, class_="incidents") if parts else None


def _shown(found: Sequence[Incident]) -> list[Incident]:
    """Return the worst of each kind, in the order given."""
    left = dict.fromkeys(IncidentKind, SHOWN)
    shown = []
    for one in found:
        left[one.kind] -= 1
        if left[one.kind] >= 0:
            shown.append(one)
    return shown


def _row(index: int, one: Incident) -> Markup:
    where = one.place or one.lane or ""
    if one.x is not None and one.y is not None:
        where = f"x {number(one.x, 0)} m, y {number(one.y, 0)} m ({where})"
    until = number(one.until, 0) if one.until is not None else "did not dissolve"
    if one.kind is IncidentKind.NOT_INSERTED:
        until = "not inserted"
    cells = (
        element("th", str(index), scope="row"),
        element("td", one.kind.label),
        element("td", reason_label(one.reason), class_="wrap"),
        element("td", number(one.count, 0), class_="n"),
        element("td", number(one.time, 0), class_="n"),
        element("td", until, class_="n"),
        element("td", where),
    )
    return element("tr", join(list(cells)))
