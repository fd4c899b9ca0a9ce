"""The log of SUMO's SSM device; :mod:`odscen.sumo.realize.sumocfg` says what it logs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.base.errors import SimulationError
from odscen.runs.xml_rows import elements

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from lxml import etree


_KINDS = {
    **dict.fromkeys((1, 2, 3, 18), "following"),
    **dict.fromkeys((4, 5, 6, 7, 8, 19), "merging"),
}
"""By SUMO's number of the encounter; the others are of routes that cross."""

_MEASURES = {"minTTC": "ttc", "maxDRAC": "drac", "PET": "pet"}


def logged_conflicts(
    file: Path, *, net_offset: tuple[float, float] = (0.0, 0.0)
) -> Iterator[dict[str, object]]:
    """Rows for :func:`odscen.figures.measures.conflicts.conflict_table` from the device's log.

    Parameters
    ----------
    net_offset
        What SUMO's network adds to OpenDRIVE coordinates, metres.

    Raises
    ------
    SimulationError
        If the log is not whole.
    """
    from lxml import etree

    try:
        for conflict in elements(file, "conflict"):
            yield _conflict_row(conflict, net_offset)
    except etree.XMLSyntaxError as error:
        raise SimulationError(f"{file.name} is not whole: {error}") from error


def _conflict_row(conflict: etree._Element, net_offset: tuple[float, float]) -> dict[str, object]:
    row: dict[str, object] = {
        "begin": float(conflict.get("begin", "nan")),
        "end": float(conflict.get("end", "nan")),
        "one": conflict.get("ego"),
        "other": conflict.get("foe"),
        "kind": "crossing",
        "x": None,
        "y": None,
    }
    placed = False
    for measure in conflict:
        name = _MEASURES.get(str(measure.tag))
        value = measure.get("value", "NA")
        if name is None:
            continue
        row[name] = None if value == "NA" else float(value)
        if value != "NA" and not placed:
            row["kind"] = _KINDS.get(int(measure.get("type", "9")), "crossing")
            # Bodies that overlap from the start have a value, and `NA` for a place.
            position = measure.get("position", "NA").split(",")
            if len(position) > 1:
                row["x"] = float(position[0]) - net_offset[0]
                row["y"] = float(position[1]) - net_offset[1]
            placed = True
    return row
