"""SUMO's log of stops as a table, one row for each visit of a stop that has ended.

=========== ======================================================================
column      meaning
=========== ======================================================================
actor       id of the vehicle
stop        id of the stop
arrival     s when it stood
departure   s when it drove on
scheduled   s of the scheduled departure; null without a timetable
=========== ======================================================================
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.sumo.outputs.xml_rows import elements

if TYPE_CHECKING:
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
