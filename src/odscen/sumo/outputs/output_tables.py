"""What SUMO writes while it runs, put into a folder and made into the tables that we keep.

The configuration names all of it, so that plain ``sumo -c`` records the same beside it.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from odscen.base.errors import SimulationError
from odscen.figures.by_place.lane_parts import part_sums
from odscen.figures.by_place.lane_places import LanePlaces
from odscen.figures.by_place.traffic_sums import INTERVAL
from odscen.figures.measures.summary import Trip, actor_outcomes, actors_text, outcome_row
from odscen.records.run_events import event_line, events_text
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
from odscen.sumo.outputs.conflict_files import tidy_conflicts
from odscen.sumo.outputs.lane_measures import lane_table
from odscen.sumo.outputs.signal_log import tidy_signals
from odscen.sumo.outputs.stop_table import stay_table, stop_table
from odscen.sumo.outputs.trip_table import ParkedCar, Stay, trip_table

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Mapping, Sequence
    from pathlib import Path

    import polars as pl

    from odscen.records.run_events import Event
    from odscen.records.run_plan import Plan


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
        As of :func:`odscen.sumo.outputs.lane_measures.lane_table`.
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
            found = part_sums(
                pl.scan_parquet(positions),
                LanePlaces.from_json(places.read_text(encoding="utf-8")),
                pl.read_parquet(lanes, columns=list(INTERVAL)).unique().sort("begin"),
            )
        except pl.exceptions.PolarsError as error:
            raise _torn_file_error(error) from error
        if found is not None and found.height:
            found.write_parquet(folder / LANE_SEGMENTS_FILE)
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
