"""Figures of traffic of a run, from what is in its folder."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.results.by_place.analysis_times import WHOLE_RUN, AnalysisTimes, on_clock
from odscen.results.by_place.control_delay import vehicle_passages
from odscen.results.by_place.facilities import (
    FacilityData,
    heavy_share,
    highway_density,
    movement_facilities,
    passage_sums,
)
from odscen.results.by_place.group_figures import group_sums
from odscen.results.by_place.lane_places import LanePlaces
from odscen.results.by_place.queues import queue_lengths
from odscen.results.by_place.station_figures import station_figures
from odscen.results.by_place.traffic import traffic_figures
from odscen.results.measures.figure import RunData
from odscen.results.measures.signal_use import signal_use, write_signal_use
from odscen.results.measures.traffic_files import figures_json, write_stations, write_tables
from odscen.results.records.light_programs import programs_from_json
from odscen.results.records.run_records import Plan
from odscen.sumo.folder import layout
from odscen.sumo.folder.recorded import (
    read_conflicts,
    read_lanes,
    read_light_states,
    read_trips,
    read_visits,
    trajectory_files,
)
from odscen.sumo.outputs.net_facts import read_net_facts

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    import polars as pl

    from odscen.results.by_place.traffic import TrafficFigures
    from odscen.results.measures.summary import ActorOutcome
    from odscen.results.records.light_programs import LightProgram


def read_figures(
    run: Path, *, end: float, meso: bool = False, times: AnalysisTimes = WHOLE_RUN
) -> TrafficFigures | None:
    """Figures by place and time of a run that lasted ``end`` seconds.

    Parameters
    ----------
    meso
        Whether it was mesoscopic: no vehicle is stopped in its trajectories, so that there are no
        queues.
    times
        What is analysed of it.

    Returns
    -------
    ``None`` if nothing was measured on lanes, or no vehicle was there.

    Raises
    ------
    InputError
        If the places of lanes cannot be read, or times do not fit what was measured.
    """
    import polars as pl

    lanes = read_lanes(run)
    file = run / layout.LANE_PLACES_FILE
    if lanes is None or not file.is_file():
        return None
    places = LanePlaces.from_json(file.read_text(encoding="utf-8", errors="replace"))
    files = trajectory_files(run)
    rows = pl.scan_parquet(files) if files and not meso else None
    clock = times.clock(lanes, end=end)
    return traffic_figures(
        lanes,
        places,
        end=end,
        queues=None if rows is None else queue_lengths(rows, places, clock),
        facilities=_facilities(run, on_clock(lanes, clock), places, rows, clock),
        times=times,
    )


def _facilities(
    run: Path,
    lanes: pl.DataFrame,
    places: LanePlaces,
    rows: pl.LazyFrame | None,
    clock: pl.DataFrame,
) -> FacilityData | None:
    """Kinds of facilities, control delay and density; ``None`` without the run's SUMO files."""
    facts = read_net_facts(run)
    if facts is None:
        return None
    movements = movement_facilities(places, facts)
    passed = None if rows is None else vehicle_passages(rows, places, facts)
    groups = group_of = None
    if rows is not None and passed is not None:
        programs, states = _lights(run)
        groups, group_of = group_sums(
            rows, passed, places, facts, clock, programs=programs, states=states
        )
    by_junction, by_movement = (
        (None, None) if passed is None else passage_sums(passed, movements, clock)
    )
    heavy = None if rows is None else heavy_share(rows, facts, clock)
    density = highway_density(lanes, places, facts, heavy)
    return FacilityData(movements, by_junction, by_movement, density, groups, group_of)


def _lights(run: Path) -> tuple[tuple[LightProgram, ...], pl.DataFrame | None]:
    """Programs of lights and what they showed; none if the map has no lights."""
    states, file = read_light_states(run), run / layout.LIGHTS_FILE
    if states is None or not file.is_file():
        return (), None
    return programs_from_json(file.read_text(encoding="utf-8", errors="replace")), states


def read_run_data(
    run: Path,
    outcomes: Sequence[ActorOutcome],
    *,
    end: float,
    meso: bool = False,
    times: AnalysisTimes = WHOLE_RUN,
) -> RunData:
    """Read all that the figures of a run of ``end`` seconds are computed from.

    With a warm-up, these are the road users who were to depart after it, and what lanes, conflicts
    and stops had from then on; signals are of the whole run.

    Raises
    ------
    InputError
        If the places of lanes cannot be read, or times do not fit what was measured.
    """
    first = times.warm_up
    return RunData(
        outcomes=[one for one in outcomes if one.depart >= first],
        traffic=read_figures(run, end=end, meso=meso, times=times),
        trips=_since(read_trips(run), "depart", first),
        conflicts=_since(read_conflicts(run), "begin", first),
        end=end,
        signals=read_signal_use(run, end=end, meso=meso),
        visits=read_visits(run),
        stations=None if meso else _stations(run, end=end, times=times),
    )


def _stations(run: Path, *, end: float, times: AnalysisTimes) -> pl.DataFrame | None:
    """What the stations of the study counted; ``None`` if there are none, or no trajectories."""
    import polars as pl

    file = run / layout.PLAN_FILE
    files, lanes = trajectory_files(run), read_lanes(run)
    if not (file.is_file() and files) or lanes is None:
        return None
    stations = Plan.from_json(file.read_text(encoding="utf-8", errors="replace")).stations
    facts = read_net_facts(run) if stations else None
    if facts is None:
        return None
    clock = times.clock(lanes, end=end)
    found = station_figures(pl.scan_parquet(files), stations, facts, clock)
    return None if found is None else times.analysed(found)


def _since(table: pl.DataFrame | None, column: str, first: float) -> pl.DataFrame | None:
    return table if table is None or not first else table.filter(table[column] >= first)


def read_signal_use(run: Path, *, end: float, meso: bool = False) -> pl.DataFrame | None:
    """How signal groups were used in a run that lasted ``end`` seconds.

    Returns
    -------
    See :func:`odscen.results.measures.signal_use.signal_use`; ``None`` if the map has no lights.

    Raises
    ------
    InputError
        If the programs of lights cannot be read.
    """
    import polars as pl

    programs, states = _lights(run)
    if states is None:
        return None
    files = trajectory_files(run)
    rows = pl.scan_parquet(files) if files and not meso else None
    places = run / layout.LANE_PLACES_FILE
    ways = (
        LanePlaces.from_json(places.read_text(encoding="utf-8", errors="replace")).ways
        if places.is_file()
        else None
    )
    return signal_use(programs, states, end=end, rows=rows, ways=ways)


def write_figures(run: Path, data: RunData) -> None:
    """Write ``figures.json`` and the tables of a run; neither if nothing was measured on lanes."""
    if data.signals is not None:
        write_signal_use(data.signals, run / layout.FIGURES_FOLDER)
    if data.stations is not None:
        write_stations(data.stations, run / layout.FIGURES_FOLDER)
    if data.traffic is None:
        return
    text = figures_json(data, data.traffic)
    (run / layout.FIGURES_FILE).write_text(text, encoding="utf-8")
    write_tables(data.traffic, run / layout.FIGURES_FOLDER)
