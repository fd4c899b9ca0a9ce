"""SUMO's tripinfo as a table, one row for each vehicle and person who set out.

=================== ==================================================================
column              meaning
=================== ==================================================================
id                  of the actor
person              whether it walks
depart, arrival     s; arrival null if it had not arrived when the run ended
duration            of the trip, s; so far if it had not arrived
route_length        m; so far if it had not arrived, null for a person who had not
waiting_time        s that it was stopped (below 0.1 m/s)
waiting_count       how many times it came to a halt; null for persons
time_loss           s lost by driving (walking) below the speed it wished for; null for a
                    person who had not arrived
=================== ==================================================================

XML, because SUMO 1.28 ends with an error when it is to write vehicles and persons as Parquet.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from odscen.sumo.outputs.xml_rows import elements

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    import polars as pl


def trip_table(tripinfo: Path, *, unfinished: bool) -> pl.DataFrame:
    """Read SUMO's tripinfo file; in order of arrival, then of ids, the unfinished last.

    Parameters
    ----------
    unfinished
        Whether those who have not arrived are trips too: not at a boundary between slices, where
        SUMO writes all who are on the road.

    Raises
    ------
    lxml.etree.XMLSyntaxError
        If the file does not go on to its end.
    """
    import polars as pl

    schema = {
        "id": pl.String,
        "person": pl.Boolean,
        "depart": pl.Float64,
        "arrival": pl.Float64,
        "duration": pl.Float64,
        "route_length": pl.Float64,
        "waiting_time": pl.Float64,
        "waiting_count": pl.Int64,
        "time_loss": pl.Float64,
    }
    rows = [row for row in _rows(tripinfo) if unfinished or row[3] is not None]
    table = pl.DataFrame(rows, schema=schema, orient="row")
    return table.sort("arrival", "depart", "id", nulls_last=True)


def _rows(tripinfo: Path) -> Iterator[tuple[Any, ...]]:
    for element in elements(tripinfo, "tripinfo", "personinfo"):
        yield _walk(element) if element.tag == "personinfo" else _drive(element)


def _drive(trip: Any) -> tuple[Any, ...]:
    value = trip.get
    return (
        value("id"),
        False,
        float(value("depart")),
        _known(value("arrival")),
        float(value("duration")),
        float(value("routeLength")),
        float(value("waitingTime")),
        int(value("waitingCount")),
        float(value("timeLoss")),
    )


def _walk(person: Any) -> tuple[Any, ...]:
    """Of a person with one walk, as all of ours."""
    walk = person.find("walk")
    arrival = None if walk is None else _known(walk.get("arrival"))
    source = person if walk is None else walk
    return (
        person.get("id"),
        True,
        float(person.get("depart")),
        arrival,
        _known(source.get("duration")),
        None if walk is None else _known(walk.get("routeLength")),
        float(person.get("waitingTime")),
        None,
        None if arrival is None else float(person.get("timeLoss")),
    )


def _known(text: str) -> float | None:
    """SUMO writes -1 for what is not known."""
    value = float(text)
    return None if value < 0.0 else value
