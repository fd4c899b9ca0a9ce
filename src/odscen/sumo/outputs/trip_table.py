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

Of a car that begins or ends its trip in a parking place, the trip is from leaving the one to
taking the other.

XML, because SUMO 1.28 ends with an error when it is to write vehicles and persons as Parquet.
"""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

from odscen.runs.xml_rows import elements

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

    import polars as pl


NOT_PARKED: Mapping[str, ParkedCar] = MappingProxyType({})


class Stay(NamedTuple):
    """When a car took a parking place and left it, s; ``left`` ``None`` if it is still there."""

    came: float
    left: float | None


class ParkedCar(NamedTuple):
    """A car whose trip begins or ends parked, with what is known of that.

    The stay at its beginning is not known if it was in an earlier slice; ``counted`` is set if the
    trip ended in an earlier slice and the stay after it, too.
    """

    first: Stay | None
    last: Stay | None
    counted: bool = False

    @property
    def left_out(self) -> bool:
        """Whether its trip is in another table, or it has not left where it begins."""
        waits = self.first is not None and self.first.left is None
        return waits or (self.counted and self.last is None)


def trip_table(
    tripinfo: Path, *, unfinished: bool, parked: Mapping[str, ParkedCar] = NOT_PARKED
) -> pl.DataFrame:
    """Read SUMO's tripinfo file; in order of arrival, then of ids, the unfinished last.

    Parameters
    ----------
    parked
        Cars whose trips begin or end parked, by id.
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
    rows = [row for row in logged_trips(tripinfo, parked) if unfinished or row[3] is not None]
    table = pl.DataFrame(rows, schema=schema, orient="row")
    return table.sort("arrival", "depart", "id", nulls_last=True)


def logged_trips(tripinfo: Path, parked: Mapping[str, ParkedCar]) -> Iterator[tuple[Any, ...]]:
    """Yield the rows of the table, columns in their order, as SUMO has logged them.

    Raises
    ------
    lxml.etree.XMLSyntaxError
        If the file does not go on to its end.
    """
    for element in elements(tripinfo, "tripinfo", "personinfo"):
        if element.tag == "personinfo":
            yield _walk_row(element)
            continue
        car = parked.get(element.get("id") or "")
        if car is None or not car.left_out:
            yield _drive_row(element, car)


def _drive_row(trip: Any, car: ParkedCar | None) -> tuple[Any, ...]:
    value = trip.get
    depart, arrival = float(value("depart")), _known_number(value("arrival"))
    duration = float(value("duration"))
    if car is not None:
        depart, arrival, duration = _between_stays(trip, car, depart, arrival, duration)
    return (
        value("id"),
        False,
        depart,
        arrival,
        duration,
        float(value("routeLength")),
        float(value("waitingTime")),
        int(value("waitingCount")),
        float(value("timeLoss")),
    )


def _between_stays(
    trip: Any, car: ParkedCar, depart: float, arrival: float | None, duration: float
) -> tuple[float, float | None, float]:
    """Departure, arrival and duration from leaving a parking place to taking one."""
    stopped = float(trip.get("stopTime"))
    over = depart + duration if arrival is None else arrival
    end = car.last
    if end is not None:
        stopped += 0.0 if end.left is None else over - end.left
        arrival = end.came
    driven = duration - stopped
    return round((over if end is None else end.came) - driven, 4), arrival, round(driven, 4)


def _walk_row(person: Any) -> tuple[Any, ...]:
    """Of a person with one walk, as all of ours."""
    walk = person.find("walk")
    arrival = None if walk is None else _known_number(walk.get("arrival"))
    source = person if walk is None else walk
    return (
        person.get("id"),
        True,
        float(person.get("depart")),
        arrival,
        _known_number(source.get("duration")),
        None if walk is None else _known_number(walk.get("routeLength")),
        float(person.get("waitingTime")),
        None,
        None if arrival is None else float(person.get("timeLoss")),
    )


def _known_number(text: str) -> float | None:
    """SUMO writes -1 for what is not known."""
    value = float(text)
    return None if value < 0.0 else value
