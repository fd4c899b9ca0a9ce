"""Figures of traffic of a run, from what is in its folder."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from odscen.base.stored_files import stored_document
from odscen.figures.by_place.analysis_times import WHOLE_RUN, AnalysisTimes, on_clock
from odscen.figures.by_place.control_delay import vehicle_passages
from odscen.figures.by_place.facilities import (
    FacilityData,
    has_highways,
    heavy_share,
    highway_density,
    movement_facilities,
    passage_sums,
)
from odscen.figures.by_place.group_figures import group_sums
from odscen.figures.by_place.lane_parts import lane_parts, part_sums, parts_on_clock
from odscen.figures.by_place.lane_places import LanePlaces
from odscen.figures.by_place.outside_queue import outside_waits, with_outside
from odscen.figures.by_place.parking_use import ParkingUse
from odscen.figures.by_place.queue_metres import positions
from odscen.figures.by_place.queues import queue_lengths
from odscen.figures.by_place.station_figures import station_figures
from odscen.figures.by_place.traffic import traffic_figures
from odscen.figures.by_place.traffic_sums import summable
from odscen.figures.measures.figure import RunData
from odscen.figures.measures.motion import RoadLanes, check_motion, write_motion
from odscen.figures.measures.signal_use import signal_use, write_signal_use
from odscen.figures.measures.traffic_files import figures_json, write_stations, write_tables
from odscen.records.light_programs import programs_from_json
from odscen.records.replay import body_centres
from odscen.records.row_text import VERSION
from odscen.records.run_events import events_from_json
from odscen.records.run_plan import PLAN_FORMAT, Plan, PlannedStation
from odscen.runs import layout
from odscen.runs.net_facts import read_net_facts
from odscen.runs.recorded import (
    read_conflicts,
    read_lane_segments,
    read_lanes,
    read_light_states,
    read_stays,
    read_trajectories,
    read_trips,
    read_visits,
    scan_trajectories,
)

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    import polars as pl

    from odscen.figures.by_place.facilities import NetFacts
    from odscen.figures.by_place.traffic import TrafficFigures
    from odscen.figures.measures.summary import ActorOutcome
    from odscen.records.light_programs import LightProgram


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
    return _measure_traffic(_Records(run, meso=meso), end=end, times=times)


class _Records:
    """What is in the folder of a run; each thing is read once, when it is first asked for."""

    def __init__(self, run: Path, *, meso: bool) -> None:
        self.run = run
        self.meso = meso

    @cached_property
    def lanes(self) -> pl.DataFrame | None:
        return read_lanes(self.run)

    @cached_property
    def places(self) -> LanePlaces | None:
        file = self.run / layout.LANE_PLACES_FILE
        if not file.is_file():
            return None
        return LanePlaces.from_json(file.read_text(encoding="utf-8", errors="replace"))

    @cached_property
    def trajectories(self) -> pl.LazyFrame | None:
        return scan_trajectories(self.run)

    @property
    def rows(self) -> pl.LazyFrame | None:
        """Trajectories in which vehicles are stopped: not those of a mesoscopic run."""
        return None if self.meso else self.trajectories

    @cached_property
    def facts(self) -> NetFacts | None:
        return read_net_facts(self.run)

    @cached_property
    def lights(self) -> tuple[tuple[LightProgram, ...], pl.DataFrame | None]:
        """Programs of lights and what they showed; none if the map has no lights."""
        states, file = read_light_states(self.run), self.run / layout.LIGHTS_FILE
        if states is None or not file.is_file():
            return (), None
        return programs_from_json(file.read_text(encoding="utf-8", errors="replace")), states


def read_parts(run: Path, *, end: float, meso: bool = False) -> pl.DataFrame | None:
    """Read what was driven on parts of lanes, over the intervals that lanes were measured over.

    Returns
    -------
    As :func:`odscen.figures.by_place.lane_parts.part_sums`; ``None`` if it is not known.

    Raises
    ------
    InputError
        If the places of lanes cannot be read.
    """
    records = _Records(run, meso=meso)
    if records.lanes is None or records.places is None:
        return None
    return _part_sums(records, records.places, WHOLE_RUN.clock(records.lanes, end=end))


def _part_sums(records: _Records, places: LanePlaces, clock: pl.DataFrame) -> pl.DataFrame | None:
    """Parts of lanes from what the run has summed up itself, or from its trajectories."""
    measured = read_lane_segments(records.run)
    if measured is not None:
        return parts_on_clock(measured, clock)
    rows, facts = records.rows, records.facts
    if rows is None:
        return None
    if facts is None:
        return part_sums(rows, places, clock)
    return part_sums(
        rows,
        places,
        clock,
        positions=lambda some: positions(some, facts),
        drivers=facts.drivers,
    )


def read_lane_figures(
    run: Path, *, end: float, meso: bool = False, times: AnalysisTimes = WHOLE_RUN
) -> TrafficFigures | None:
    """Figures by place as of :func:`read_figures`, without queues, control delay and lane groups.

    Raises
    ------
    InputError
        If the places of lanes cannot be read, or times do not fit what was measured.
    """
    records = _Records(run, meso=meso)
    measured = _measure_lanes(records, end=end, times=times)
    if measured is None:
        return None
    places, clock, lanes, parts = measured
    return traffic_figures(lanes, places, end=end, times=times, clock=clock, parts=parts)


def _measure_lanes(
    records: _Records, *, end: float, times: AnalysisTimes
) -> tuple[LanePlaces, pl.DataFrame, pl.DataFrame, pl.DataFrame] | None:
    """Places of lanes, intervals, what lanes had in them, and parts of lanes."""
    lanes, places = records.lanes, records.places
    if lanes is None or places is None:
        return None
    clock = times.clock(lanes, end=end)
    lanes = on_clock(lanes, clock)
    parts = lane_parts(summable(lanes), places, _part_sums(records, places, clock))
    return places, clock, lanes, parts


def _measure_traffic(
    records: _Records, *, end: float, times: AnalysisTimes
) -> TrafficFigures | None:
    measured, rows = _measure_lanes(records, end=end, times=times), records.rows
    if measured is None:
        return None
    places, clock, lanes, parts = measured
    return traffic_figures(
        lanes,
        places,
        end=end,
        queues=None if rows is None else queue_lengths(rows, places, clock, since=times.warm_up),
        facilities=_measure_facilities(records, parts, places, clock, times, end=end),
        times=times,
        clock=clock,
        parts=parts,
    )


def _measure_facilities(
    records: _Records,
    parts: pl.DataFrame,
    places: LanePlaces,
    clock: pl.DataFrame,
    times: AnalysisTimes,
    *,
    end: float,
) -> FacilityData | None:
    """Kinds of facilities, control delay and density; ``None`` without the run's SUMO files."""
    facts, rows = records.facts, records.rows
    if facts is None:
        return None
    movements = movement_facilities(places, facts)
    passed = None if rows is None else vehicle_passages(rows, places, facts)
    groups = group_of = waits = None
    if rows is not None and passed is not None:
        trips = read_trips(records.run)
        if trips is not None:
            waits = outside_waits(facts.drivers, trips, places, facts, end=end)
        programs, states = records.lights
        groups, group_of = group_sums(
            rows,
            passed,
            places,
            facts,
            clock,
            programs=programs,
            states=states,
            waits=waits,
            since=times.warm_up,
        )
        if waits is not None:
            passed = with_outside(passed, waits)
    by_junction, by_movement = (
        (None, None) if passed is None else passage_sums(passed, movements, clock)
    )
    graded = rows is not None and has_highways(places, facts)
    heavy = heavy_share(rows, facts, clock) if rows is not None and graded else None
    density = highway_density(parts, places, facts, heavy)
    return FacilityData(movements, by_junction, by_movement, density, groups, group_of)


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
    first, records = times.warm_up, _Records(run, meso=meso)
    return RunData(
        outcomes=[outcome for outcome in outcomes if outcome.depart >= first],
        traffic=_measure_traffic(records, end=end, times=times),
        trips=_rows_since(read_trips(run), "depart", first),
        conflicts=_rows_since(read_conflicts(run), "begin", first),
        end=end,
        signals=_signal_use(records, end=end),
        visits=read_visits(run),
        stations=None if meso else _measure_stations(records, end=end, times=times),
        parking=read_parking(run, begin=first, end=end),
        motion=None if meso else _rows_since(_measure_motion(records), "begin", first),
    )


def measure_motion(run: Path) -> pl.DataFrame | None:
    """Check the motion of all road users of a run, see :func:`check_motion`.

    Returns
    -------
    ``None`` if trajectories were not recorded, or too seldom.

    Raises
    ------
    InputError
        If the records cannot be read.
    """
    return _measure_motion(_Records(run, meso=False))


def _measure_motion(records: _Records) -> pl.DataFrame | None:
    run = records.run
    recorded = read_trajectories(run)
    if recorded is None or not (run / layout.PLAN_FILE).is_file():
        return None
    plan = Plan.from_json((run / layout.PLAN_FILE).read_text(encoding="utf-8", errors="replace"))
    events = (run / layout.EVENTS_FILE).read_text(encoding="utf-8", errors="replace")
    return check_motion(
        body_centres(recorded.rows, plan, by_centres=recorded.by_centres),
        plan,
        events_from_json(events),
        _road_lanes(records.facts, plan),
    )


def _road_lanes(facts: NetFacts | None, plan: Plan) -> RoadLanes | None:
    if facts is None:
        return None
    used = [lane for lane in facts.widths if len(facts.shapes.get(lane, ())) > 1]
    return RoadLanes(
        edges=dict(zip(facts.limits["lane"], facts.limits["edge"], strict=True)),
        inside=facts.inside,
        names=used,
        lines=[facts.shapes[lane] - np.array(plan.net_offset) for lane in used],
        widths=[facts.widths[lane] for lane in used],
    )


def read_parking(run: Path, *, begin: float = 0.0, end: float) -> ParkingUse | None:
    """Read the use of parking areas from ``begin`` to ``end`` (s); ``None`` if no trip parks."""
    stays = read_stays(run)
    if stays is None:
        return None
    plan = Plan.from_json((run / layout.PLAN_FILE).read_text(encoding="utf-8", errors="replace"))
    return ParkingUse.of(stays, plan, begin=begin, end=end)


def _measure_stations(
    records: _Records, *, end: float, times: AnalysisTimes
) -> pl.DataFrame | None:
    """What the stations of the study counted; ``None`` if there are none, or no trajectories."""
    file = records.run / layout.PLAN_FILE
    rows, lanes = records.trajectories, records.lanes
    if not file.is_file() or rows is None or lanes is None:
        return None
    text = file.read_text(encoding="utf-8", errors="replace")
    with stored_document(
        text, form=PLAN_FORMAT, version=VERSION, what="a plan of a run"
    ) as data:  # actor by actor it takes longer to read
        stations = tuple(map(PlannedStation.from_dict, data.get("stations", ())))
    facts = records.facts if stations else None
    if facts is None:
        return None
    found = station_figures(rows, stations, facts, times.clock(lanes, end=end))
    return None if found is None else times.analysed(found)


def _rows_since(table: pl.DataFrame | None, column: str, first: float) -> pl.DataFrame | None:
    return table if table is None or not first else table.filter(table[column] >= first)


def _signal_use(records: _Records, *, end: float) -> pl.DataFrame | None:
    """How signal groups were used; ``None`` if the map has no lights."""
    programs, states = records.lights
    if states is None:
        return None
    ways = None if records.places is None else records.places.ways
    return signal_use(programs, states, end=end, rows=records.rows, ways=ways)


def write_figures(run: Path, data: RunData) -> None:
    """Write ``figures.json`` and the tables of a run; neither if nothing was measured on lanes."""
    if data.signals is not None:
        write_signal_use(data.signals, run / layout.FIGURES_FOLDER)
    if data.motion is not None:
        write_motion(data.motion, run / layout.FIGURES_FOLDER)
    if data.stations is not None:
        write_stations(data.stations, run / layout.FIGURES_FOLDER)
    if data.traffic is None:
        return
    text = figures_json(data, data.traffic)
    (run / layout.FIGURES_FILE).write_text(text, encoding="utf-8")
    write_tables(data.traffic, run / layout.FIGURES_FOLDER)
