"""SUMO's log of stops as tables: visits of stops that have ended, and stays in parking places.

Visits of stops:

=========== ======================================================================
column      meaning
=========== ======================================================================
actor       id of the vehicle
stop        id of the stop
arrival     s when it stood
departure   s when it drove on
scheduled   s of the scheduled departure; null without a timetable
=========== ======================================================================

Stays in parking places:

=========== ======================================================================
column      meaning
=========== ======================================================================
actor       id of the vehicle
area        id of the parking area
arrival     s when it took its place
begins      whether its trip began there
departure   s when it left it; null if it was still there when the run ended
=========== ======================================================================
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.records.run_plan import begin_area
from odscen.runs.xml_rows import elements

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    import polars as pl


def stop_table(stopinfo: Path) -> pl.DataFrame:
    """Read SUMO's stop-output; in order of departure, then of ids.

    Visits that had not ended when the run did are left out, and stops that are none of a line.

    Raises
    ------
    lxml.etree.XMLSyntaxError
        If the file does not go on to its end.
    """
    import polars as pl

    rows = []
    for row in elements(stopinfo, "stopinfo"):
        left, delay = float(row.get("ended", "-1")), row.get("delay")
        if row.get("busStop") and left >= 0.0:
            scheduled = None if delay is None else round(left - float(delay), 4)
            rows.append(
                (row.get("id"), row.get("busStop"), float(row.get("started", "")), left, scheduled)
            )
    schema = {
        "actor": pl.String,
        "stop": pl.String,
        "arrival": pl.Float64,
        "departure": pl.Float64,
        "scheduled": pl.Float64,
    }
    table = pl.DataFrame(rows, schema=schema, orient="row")
    return table.sort("departure", "actor", "stop")


def stay_table(stopinfo: Path, areas: Iterable[str], *, unfinished: bool) -> pl.DataFrame:
    """Read stays in parking places from SUMO's stop-output; in order of arrival, then of ids.

    Parameters
    ----------
    areas
        Ids of the parking areas of the plan.
    unfinished
        Whether the run has ended, so that who is parked stays: at a boundary between slices, where
        SUMO writes these too, the next one has them again.

    Raises
    ------
    lxml.etree.XMLSyntaxError
        If the file does not go on to its end.
    """
    import polars as pl

    known = {area: (area, False) for area in areas}
    known |= {begin_area(area): (area, True) for area in known}
    rows = []
    for row in elements(stopinfo, "stopinfo"):
        came, left = float(row.get("started", "-1")), float(row.get("ended", "-1"))
        if not row.get("parkingArea") or came < 0.0:
            continue
        if left >= 0.0 or unfinished:
            area, begins = known[str(row.get("parkingArea"))]
            rows.append((row.get("id"), area, begins, came, left if left >= 0.0 else None))
    schema = {
        "actor": pl.String,
        "area": pl.String,
        "begins": pl.Boolean,
        "arrival": pl.Float64,
        "departure": pl.Float64,
    }
    return pl.DataFrame(rows, schema=schema, orient="row").sort("arrival", "actor")
