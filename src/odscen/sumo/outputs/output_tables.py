"""What SUMO writes while it runs, put into a folder and made into the tables that we keep.

The configuration names all of it, so that plain ``sumo -c`` records the same beside it.

SUMO's log of stops as tables: visits of stops that have ended, and stays in parking places.

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

SUMO's tripinfo as a table, one row for each vehicle and person who set out.

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

SUMO's lane data as a table of what happened on each lane in each interval, in SI units.

=================================== ==============================================================
column                              meaning
=================================== ==============================================================
begin, end                          interval, s
edge, lane                          SUMO's ids
seconds                             time that vehicles spent, vehicle-seconds
distance                            that they drove, m
entered, left                       vehicles that came from and went to another edge
departed, arrived                   vehicles whose trips began and ended here
waiting                             of ``seconds``, those in which they were stopped (below 0.1 m/s)
time_loss                           of ``seconds``, those lost by driving below the desired speed
co2, co, hc, nox, pmx, fuel         g, if emissions were recorded
electricity                         Wh, if emissions were recorded
=================================== ==============================================================

A vehicle is where its front is. SUMO itself counts a vehicle on every lane that a part of its body
is on, so that its seconds add up to more than there were: by a sixth in a town of short lanes.
SUMO also gives, per lane, travel time and distance of the fronts, from which

    seconds   = traveltime * distance / length
    time_loss = seconds - distance * (sampled - timeLoss) / (speed * sampled)
    waiting   = waitingTime - of_rears, where, of the rears whose fronts are further on,
    of_rears  = (sampled - seconds) - (speed * sampled - distance) * (sampled - waitingTime)
                / (speed * sampled)

with ``sampled`` for its seconds. The second is exact if all who were on the lane wished to drive
equally fast; where it was held against the trips, the sum was less than 2 % below theirs. The third
is exact if rears that move are as fast as all who move; held against every step, the sum was less
than 2 % below.
"""

from __future__ import annotations

import os
from functools import cache
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

from odscen.base.errors import SimulationError
from odscen.figures.by_place.lane_parts import part_sums
from odscen.figures.by_place.lane_places import LanePlaces
from odscen.figures.by_place.traffic_sums import INTERVAL
from odscen.figures.measures.summary import Trip, actor_outcomes, actors_text, outcome_row
from odscen.records.run_events import event_line, events_text
from odscen.records.run_plan import begin_area
from odscen.runs.layout import (
    ACTORS_FILE,
    EMISSIONS_FILE,
    EVENTS_FILE,
    LANE_PLACES_FILE,
    LANE_SEGMENTS_FILE,
    LANES_FILE,
    POSITIONS_FILE,
    STAYS_FILE,
    STOPINFO_FILE,
    TRAJECTORIES_FILE,
    TRIPINFO_FILE,
    TRIPS_FILE,
    VISITS_FILE,
)
from odscen.runs.parts import tidy_part
from odscen.runs.xml_rows import elements
from odscen.sumo.outputs.conflict_files import tidy_conflicts
from odscen.sumo.outputs.signal_log import tidy_signals
from odscen.sumo.realize.measure_files import EMISSIONS

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
    from pathlib import Path

    import polars as pl

    from odscen.records.run_events import Event
    from odscen.records.run_plan import Plan


# -------------------------------- SUMO's lane data as a table of what happened on each lane in each
_MOST_TRAVEL_TIME = 99_999.0
"""Seconds; SUMO gives 100,000 at most, and then not what it was; none where all were stopped."""
_COUNTS = ("entered", "left", "departed", "arrived")


def lane_table(
    lanes: Path,
    emissions: Path | None,
    lengths: Mapping[str, Mapping[str, float]],
    present: Mapping[str, int] | None = None,
) -> pl.DataFrame:
    """Read what SUMO has written.

    Parameters
    ----------
    lanes, emissions
        SUMO's Parquet files; ``None`` if emissions were not recorded.
    lengths
        Of lanes for vehicles, m, by edge. SUMO's mesoscopic model measures edges: what it gives
        of one is given to the first of these lanes.
    present
        How many vehicles were on each lane when a saved state was loaded. SUMO counts them as
        having entered.

    Returns
    -------
    Sorted by ``begin`` and ``lane``; without rows if no vehicle was there.
    """
    import polars as pl

    by_lane = {lane: length for lanes in lengths.values() for lane, length in lanes.items()}
    own = pl.LazyFrame(
        {"lane": list(by_lane), "length": list(by_lane.values())},
        schema={"lane": pl.String, "length": pl.Float64},
    )
    # SUMO leads teleported vehicles over the first lane of an edge, be it a sidewalk.
    rows = _rename_columns(lanes, lengths).join(own, on="lane")
    entered: tuple[pl.Expr, ...] = ()
    if emissions is not None:
        measured = _rename_columns(emissions, lengths).select("begin", "lane", *_emission_columns())
        rows = rows.join(measured, on=["begin", "lane"], how="left")
    if present:
        here = pl.LazyFrame({"lane": list(present.keys()), "present": list(present.values())})
        first = pl.col("begin") == pl.col("begin").min()
        there = pl.when(first).then("present").otherwise(0).fill_null(0)
        rows = rows.join(here, on="lane", how="left").with_columns(present=there)
        entered = ((pl.col("entered") - pl.col("present")).clip(0),)
    seconds, time_loss, waiting, kept = _measure_columns(emissions=emissions is not None)
    return (
        rows.with_columns(seconds)
        .with_columns(time_loss, waiting, *entered)
        .select(kept)
        .sort("begin", "lane")
        # To plan so small a query, and to wake threads for it, takes longer than to do it.
        .collect(engine="in-memory", optimizations=pl.QueryOptFlags.none())
    )


@cache
def _measure_columns(*, emissions: bool) -> tuple[pl.Expr, pl.Expr, pl.Expr, tuple[pl.Expr, ...]]:
    """Seconds; with them, time loss and waiting; then all columns. Made once for all runs."""
    import polars as pl

    col = pl.col
    sampled, moved = col("sampledSeconds"), col("speed") * col("sampledSeconds")
    # Where hardly a vehicle moved there is no travel time, and SUMO's density has an upper bound;
    # all were stopped for the whole interval then, a whole number of vehicles.
    at_least = col("density") * col("length") / 1000.0
    still = pl.when(col("entered") + col("left") + col("departed") + col("arrived") == 0)
    standing = still.then((at_least - 1e-3).ceil()).otherwise(at_least)
    standing *= col("end") - col("begin")
    fronts = (
        pl.when(col("traveltime").fill_null(_MOST_TRAVEL_TIME) >= _MOST_TRAVEL_TIME)
        .then(pl.min_horizontal(sampled, standing))
        .otherwise(col("traveltime") * col("distance") / col("length"))
    )
    loss = pl.when(moved > 0.0).then(
        col("seconds") - col("distance") * (sampled - col("timeLoss")) / moved
    )
    waited = col("waitingTime")
    rears = (
        pl.when(moved > 0.0)
        .then(sampled - col("seconds") - (moved - col("distance")) * (sampled - waited) / moved)
        .otherwise(sampled - col("seconds"))
    )
    seconds = fronts.fill_null(0.0).alias("seconds")
    time_loss = loss.otherwise(col("timeLoss")).fill_null(0.0).clip(0.0, col("seconds"))
    waiting = (waited - rears.clip(0.0, waited)).fill_null(0.0).clip(0.0, col("seconds"))
    emitted = (col(name.lower()).fill_null(0.0) for name in EMISSIONS) if emissions else ()
    kept = (
        *map(col, ("begin", "end", "edge", "lane", "seconds", "distance")),
        *(col(name).cast(pl.Int64) for name in _COUNTS),
        *map(col, ("waiting", "time_loss")),
        *emitted,
    )
    return seconds, time_loss.alias("time_loss"), waiting.alias("waiting"), kept


def _rename_columns(file: Path, lengths: Mapping[str, Mapping[str, float]]) -> pl.LazyFrame:
    """Rows of a file of lane data; columns lose their prefix, times become numbers."""
    import polars as pl

    rows = pl.read_parquet(file)
    if "edge_id" not in rows.columns:  # no vehicle was there, and SUMO had no columns to write
        return _empty_measures()
    renamed = {name: name.removeprefix("lane_").removeprefix("edge_") for name in rows.columns}
    renamed |= {"edge_id": "edge", "lane_id": "lane"}
    lazy = rows.lazy()
    if "lane_id" not in rows.columns:
        lazy = lazy.with_columns(
            lane_id=pl.col("edge_id").replace_strict(
                {edge: next(iter(own)) for edge, own in lengths.items()},
                default=None,
                return_dtype=pl.String,
            )
        )
    return lazy.rename(renamed, strict=False).with_columns(
        begin=pl.col("interval_begin").cast(pl.Float64),
        end=pl.col("interval_end").cast(pl.Float64),
    )


def _empty_measures() -> pl.LazyFrame:
    import polars as pl

    from odscen.sumo.realize.measure_files import LANE_ATTRIBUTES

    numbers = ("begin", "end", *LANE_ATTRIBUTES, *(f"{name}_abs" for name in EMISSIONS))
    texts = ("edge", "lane")
    return pl.LazyFrame(
        schema={**dict.fromkeys(numbers, pl.Float64), **dict.fromkeys(texts, pl.String)}
    )


@cache
def _emission_columns() -> tuple[pl.Expr, ...]:
    return tuple(map(_convert_units, EMISSIONS))


def _convert_units(name: str) -> pl.Expr:
    import polars as pl

    factor = 1.0 if name == "electricity" else 1e-3
    return (pl.col(f"{name}_abs") * factor).alias(name.lower())


# -------------------------- SUMO's tripinfo as a table, one row for each vehicle and person who set
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
    depart, arrival = float(value("depart")), _read_known_number(value("arrival"))
    duration = float(value("duration"))
    if car is not None:
        depart, arrival, duration = _time_between_stays(trip, car, depart, arrival, duration)
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


def _time_between_stays(
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
    arrival = None if walk is None else _read_known_number(walk.get("arrival"))
    source = person if walk is None else walk
    return (
        person.get("id"),
        True,
        float(person.get("depart")),
        arrival,
        _read_known_number(source.get("duration")),
        None if walk is None else _read_known_number(walk.get("routeLength")),
        float(person.get("waitingTime")),
        None,
        None if arrival is None else float(person.get("timeLoss")),
    )


def _read_known_number(text: str) -> float | None:
    """SUMO writes -1 for what is not known."""
    value = float(text)
    return None if value < 0.0 else value


# -------------------------------------------------------------------- SUMO's log of stops as tables
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
            persons = [
                int(row.get(name, "0"))
                for name in ("initialPersons", "loadedPersons", "unloadedPersons")
            ]
            came = float(row.get("started", ""))
            rows.append((row.get("id"), row.get("busStop"), came, left, scheduled, *persons))
    schema = {
        "actor": pl.String,
        "stop": pl.String,
        "arrival": pl.Float64,
        "departure": pl.Float64,
        "scheduled": pl.Float64,
        "on_board": pl.Int64,
        "boarded": pl.Int64,
        "alighted": pl.Int64,
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


# ----------------------- what SUMO writes while it runs, put into a folder and made into the tables
_TRIP_COLUMNS = ("id", "time_loss", "waiting_time", "waiting_count")
_SMALL = 32 << 20
"""Bytes."""


def outputs_to(folder: Path, sumo: Path) -> list[str]:
    """Arguments by which everything that SUMO writes goes to ``folder``, under its own name.

    Parameters
    ----------
    sumo
        Folder of the configuration, which names of outputs are relative to.
    """
    return ["--output-prefix", f"{os.path.relpath(folder, sumo)}/"]


def tidy_outputs(
    folder: Path,
    lengths: Mapping[str, Mapping[str, float]],
    plan: Plan,
    *,
    present: Mapping[str, int],
    parked: Collection[str] = (),
    last: bool,
) -> dict[str, Trip]:
    """Replace SUMO's lane data, emissions, tripinfo and stops by our tables.

    Parameters
    ----------
    lengths, present
        As of :func:`odscen.sumo.outputs.output_tables.lane_table`.
    plan
        Says who parks.
    parked
        Those who have ended their trips parked before this slice, and were still there.
    last
        Whether the run has ended, so that trips without an arrival are trips.

    Returns
    -------
    dict
        What the table of trips says of each actor.

    Raises
    ------
    SimulationError
        If SUMO has not written them to their end.
    """
    from lxml import etree
    from polars.exceptions import PolarsError

    lanes, emissions = folder / LANES_FILE, folder / EMISSIONS_FILE
    tripinfo = folder / TRIPINFO_FILE
    try:
        if lanes.is_file():
            rows = lane_table(lanes, emissions if emissions.is_file() else None, lengths, present)
            lanes.unlink()
            if rows.height:
                rows.write_parquet(lanes)
            emissions.unlink(missing_ok=True)
        stays = _tidy_stops(folder, plan, last=last)
        if tripinfo.is_file():
            trips = trip_table(
                tripinfo, parked=_find_parked_cars(plan, stays, parked), unfinished=last
            )
            if trips.height:
                trips.write_parquet(folder / TRIPS_FILE)
            tripinfo.unlink()
            return _trips_of(trips)
    except (etree.XMLSyntaxError, PolarsError) as error:
        raise _torn_file_error(error) from error
    return {}


def make_tables(
    folder: Path, plan: Plan, lengths: Mapping[str, Mapping[str, float]]
) -> dict[str, Trip]:
    """Make all that SUMO has written of a run in one piece into the tables that we keep.

    Parameters
    ----------
    lengths
        As of :func:`tidy_outputs`.

    Returns
    -------
    dict
        What was measured on the trip of each actor.

    Raises
    ------
    SimulationError
        If SUMO has not written it to its end.
    """
    tidy_part(folder / TRAJECTORIES_FILE)
    trips = tidy_outputs(folder, lengths, plan, present={}, last=True)
    tidy_positions(folder, folder)
    tidy_conflicts(folder, plan)
    tidy_signals(folder)
    return trips


def make_results(
    folder: Path,
    plan: Plan,
    events: Sequence[Event],
    lengths: Mapping[str, Mapping[str, float]],
) -> None:
    """Make all that a run in one piece leaves: tables, ``events.json`` and ``actors.json``.

    Parameters and errors as of :func:`make_tables`.
    """
    outcomes = actor_outcomes(plan, events, make_tables(folder, plan, lengths))
    write_results(folder, map(event_line, events), map(outcome_row, outcomes))


def tidy_positions(folder: Path, run: Path) -> None:
    """Replace positions of a run without trajectories by what was driven on parts of lanes.

    Parameters
    ----------
    folder
        Where SUMO has written, and its lane data has been made a table.
    run
        Has the places of lanes.

    Raises
    ------
    SimulationError
        If SUMO has not written them to their end.
    """
    import polars as pl

    positions, lanes = folder / POSITIONS_FILE, folder / LANES_FILE
    if not positions.is_file():
        return
    tidy_part(positions)
    places = run / LANE_PLACES_FILE
    if positions.is_file() and lanes.is_file() and places.is_file():
        try:
            sums = part_sums(
                pl.scan_parquet(positions),
                LanePlaces.from_json(places.read_text(encoding="utf-8")),
                pl.read_parquet(lanes, columns=list(INTERVAL)).unique().sort("begin"),
            )
        except pl.exceptions.PolarsError as error:
            raise _torn_file_error(error) from error
        if sums is not None and sums.height:
            sums.write_parquet(folder / LANE_SEGMENTS_FILE)
    positions.unlink(missing_ok=True)


def are_small(folder: Path) -> bool:
    """Whether what SUMO has written takes longer to get ready for than to make into tables."""
    return sum(file.stat().st_size for file in folder.iterdir() if file.is_file()) <= _SMALL


def _tidy_stops(folder: Path, plan: Plan, *, last: bool) -> pl.DataFrame | None:
    """Replace SUMO's log of stops by tables; returns stays in parking places if trips park."""
    stopinfo = folder / STOPINFO_FILE
    if not stopinfo.is_file():
        return None
    visits, stays = stop_table(stopinfo), None
    if visits.height or not plan.parking:
        visits.write_parquet(folder / VISITS_FILE)
    if plan.parking:
        stays = stay_table(stopinfo, (parking.id for parking in plan.parking), unfinished=last)
        stays.write_parquet(folder / STAYS_FILE)
    stopinfo.unlink()
    return stays


def _find_parked_cars(
    plan: Plan, stays: pl.DataFrame | None, before: Collection[str]
) -> dict[str, ParkedCar]:
    """Cars whose trips begin or end parked, with what is known of their stays."""
    if stays is None:
        return {}
    known = {
        (actor, begins): Stay(came, left) for actor, _, begins, came, left in stays.iter_rows()
    }
    return {
        actor.id: ParkedCar(
            known.get((actor.id, True)), known.get((actor.id, False)), actor.id in before
        )
        for actor in plan.actors
        if actor.begins_in is not None or actor.ends_in is not None
    }


def trips_in(file: Path) -> dict[str, Trip]:
    """What a table of trips says of each actor; empty if there is none."""
    import polars as pl

    if not file.is_file():
        return {}
    return _trips_of(pl.read_parquet(file, columns=list(_TRIP_COLUMNS)))


def _trips_of(table: pl.DataFrame) -> dict[str, Trip]:
    rows = zip(*(table[name].to_list() for name in _TRIP_COLUMNS), strict=True)
    return {name: Trip(*values) for name, *values in rows}


def _torn_file_error(error: Exception) -> SimulationError:
    msg = f"SUMO has not written its measurements to the end; the disk may be full: {error}"
    return SimulationError(msg)


def write_results(run: Path, events: Iterable[str], actors: Iterable[str]) -> None:
    """Write ``events.json`` and ``actors.json`` from their rows."""
    with (run / EVENTS_FILE).open("w", encoding="utf-8") as out:
        out.writelines(events_text(events))
    with (run / ACTORS_FILE).open("w", encoding="utf-8") as out:
        out.writelines(actors_text(actors))
