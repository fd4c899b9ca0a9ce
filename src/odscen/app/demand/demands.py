"""Demand: read from tables, made up, and held against counts."""

from __future__ import annotations

import re
from contextlib import contextmanager
from itertools import count
from typing import TYPE_CHECKING, Any, Literal, get_args

import polars as pl

from odscen.app.maps import load_map, map_of
from odscen.app.scenarios import read_scenario
from odscen.base.errors import InputError, ScenarioError, in_file
from odscen.base.given_files import as_path, read_given_text
from odscen.base.stored_files import tables
from odscen.runs.deferred_figures import checked_summary
from odscen.runs.layout import REPORT_FILE, SCENARIO_FILE
from odscen.runs.recorded import trajectory_files
from odscen.scenario import edits
from odscen.scenario.checks.demand_checks import parking_problems
from odscen.scenario.demand.day_profiles import DAY
from odscen.scenario.demand.demand_tables import (
    COLUMNS,
    read_counts,
    read_inputs,
    read_matrix,
    read_profile,
    read_zones,
)
from odscen.scenario.demand.inflow import entries
from odscen.scenario.document.problems import refuse_errors
from odscen.scenario.edits.demand_edits import put_parts
from odscen.scenario.placing.region import Region
from odscen.sumo.calibrate.count_fit import planned_fit, run_fit
from odscen.sumo.calibrate.town_day import TOWN_MIX, town_day

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from odscen.app.maps import LoadedMap
    from odscen.base.given_files import GivenPath
    from odscen.lanegraph.graphs import MapGraph
    from odscen.maps.store import Workspace
    from odscen.scenario.demand.inflow import Entry
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.sumo.calibrate.count_fit import CountFits
    from odscen.sumo.calibrate.town_day import Load

TableKind = Literal["od", "inputs", "counts", "profile", "zones"]
"""What a table of demand has."""

MOST_TRIPS = 1e7
"""Of a day, as of a matrix of the document."""


def import_demand(
    workspace: Workspace,
    scenario: Scenario,
    file: GivenPath,
    *,
    kind: TableKind,
    name: str | None = None,
    day: str | None = None,
    **fields: Any,
) -> Scenario:
    """Read a table of demand into a scenario.

    Parameters
    ----------
    workspace
        Has the map.
    scenario
        The scenario; it is not changed.
    file
        CSV, with the columns that docs/demand.md names.
    kind
        ``od``, ``inputs``, ``counts``, ``profile`` or ``zones``.
    name
        Of the part of the demand; the kind's if not given. A matrix with times of its own becomes
        one part for each slice, and inputs one for each line, numbered from 1 on.
    day
        Day profile of a matrix without times.
    fields
        Further fields of the part, such as ``mix``.

    Returns
    -------
    Scenario
        With the table in its demand.

    Raises
    ------
    InputError
        If the file cannot be read or a value cannot be used; names file and line.
    ScenarioError
        If the scenario has no such places.
    """
    if kind not in get_args(TableKind):
        raise InputError(f"kind must be one of {', '.join(get_args(TableKind))}, not {kind!r}")
    loaded, file = map_of(workspace, scenario), as_path(file)
    text = read_given_text(file)
    with in_file(str(file)):
        return import_text(loaded, scenario, text, kind=kind, name=name, day=day, **fields)


def import_text(
    loaded: LoadedMap,
    scenario: Scenario,
    text: str,
    *,
    kind: str,
    name: str | None = None,
    day: str | None = None,
    **fields: Any,
) -> Scenario:
    """Read the text of a table into a scenario, all of it or nothing.

    Parameters as in :func:`import_demand`.

    Raises
    ------
    InputError
        If a value cannot be used; names line and column.
    """
    graph, clock = loaded.sumo.graph, scenario.demand.clock
    parts: dict[str, dict[str, Any]]
    if kind == "profile":
        own = name or "profile"
        return edits.set_profile(scenario, graph, profile=own, **read_profile(text)._asdict())
    if kind == "counts":
        counted, own = read_counts(text, clock=clock), name or "counts"
        with _name_lines_of_problems(scenario, kind, {own: counted.lines}):
            return edits.set_counts(scenario, graph, counts=own, rows=counted.values, **fields)
    if kind == "zones":
        zones = read_zones(text)
        with _name_lines_of_problems(
            scenario, kind, {zone: rows.lines for zone, rows in zones.items()}
        ):
            parts = {zone: {"segments": rows.values} for zone, rows in zones.items()}
            return put_parts(scenario, graph, "zones", parts)
    if kind == "inputs":
        inputs = {
            f"{name or 'input'}-{number}": row
            for number, row in enumerate(read_inputs(text, clock=clock), start=1)
        }
        parts = {
            own: {
                "segment": row.segment,
                "direction": row.direction,
                "begin": row.begin,
                "end": row.begin + row.interval * len(row.volumes),
                "interval": row.interval,
                "volumes": row.volumes,
                **fields,
            }
            for own, row in inputs.items()
        }
        with _name_lines_of_problems(
            scenario, kind, {own: (row.line,) for own, row in inputs.items()}
        ):
            return put_parts(scenario, graph, "inputs", parts)
    slices = read_matrix(text, clock=clock)
    whole = set(slices) == {None}
    named = {
        (name or "trips") + ("" if whole else f"-{number}"): (when, trips)
        for number, (when, trips) in enumerate(slices.items(), start=1)
    }
    parts = {
        own: {
            "trips": trips.values,
            "profile": day,
            **({} if when is None else {"begin": when[0], "end": when[1]}),
            **fields,
        }
        for own, (when, trips) in named.items()
    }
    with _name_lines_of_problems(
        scenario, kind, {own: trips.lines for own, (_, trips) in named.items()}
    ):
        return put_parts(scenario, graph, "matrices", parts)


def add_input(
    workspace: Workspace, scenario: Scenario, *, name: str | None, **fields: Any
) -> Scenario:
    """Add vehicles that drive in at the boundary; ``fields`` are those of ``VehicleInput``.

    Without a ``name`` they get a new one.
    """
    if name is None:
        taken = {part.id for _, part in scenario.demand.parts}
        name = next(input_id for n in count(1) if (input_id := f"input-{n}") not in taken)
    graph = map_of(workspace, scenario).sumo.graph
    return edits.set_input(scenario, graph, inflow=name, **fields)


def find_entries(scenario: Scenario, graph: MapGraph) -> tuple[Entry, ...]:
    """Where vehicles can drive into the region of a scenario."""
    return entries(Region.of(graph, scenario.roi))


def choose_parking(workspace: Workspace, scenario: Scenario, **fields: Any) -> Scenario:
    """Say which trips park; ``fields`` are those of ``TripParking``.

    Raises
    ------
    ScenarioError
        If the map, or the region, has no parking places.
    """
    sumo = map_of(workspace, scenario).sumo
    changed = edits.set_parking(scenario, **fields)
    region = Region.of(sumo.graph, scenario.roi)
    refuse_errors(parking_problems(changed, region, sumo.parking))
    return changed


def choose_routes(workspace: Workspace, scenario: Scenario, **fields: Any) -> Scenario:
    """Say how trips choose their routes; ``fields`` are those of ``RouteChoice``."""
    return edits.set_routes(scenario, map_of(workspace, scenario).sumo.graph, **fields)


def add_background(
    workspace: Workspace, scenario: Scenario, *, name: str, **fields: Any
) -> Scenario:
    """Add background traffic: trips between random places of the region.

    Parameters
    ----------
    workspace
        Has the map.
    scenario
        The scenario; it is not changed.
    name
        Of this part of the demand; one of that name is replaced.
    fields
        As ``demand.background`` of the document has them: ``trips`` in all or ``per_km`` of lane,
        ``begin`` and ``end`` (s), ``mix`` and others.

    Returns
    -------
    Scenario
        With the traffic in its demand.

    Raises
    ------
    ScenarioError
        If a field is not possible.
    """
    graph = map_of(workspace, scenario).sumo.graph
    return edits.set_background(scenario, graph, background=name, **fields)


def whole_day(
    workspace: Workspace,
    map_name: str,
    *,
    trips: float = 51_000.0,
    day: str = "weekday",
    seed: int = 0,
) -> tuple[Scenario, Load]:
    """Make 24 hours of traffic on a whole map, from midnight on, as much as its junctions carry.

    Parameters
    ----------
    workspace
        Has the map.
    map_name
        Its name.
    trips
        Of the day; fewer are made where the junctions do not carry them.
    day
        Day profile by which they depart.
    seed
        Of the scenario.

    Returns
    -------
    tuple of Scenario and Load
        The scenario, and how much it asks of the busiest approach to a junction.

    Raises
    ------
    NotFoundError
        If there is no such map.
    ScenarioError
        If the map is in several pieces.
    InputError
        If there is no such day, or no trips are possible, or so many.
    """
    loaded = load_map(workspace.map(map_name))
    scenario = edits.new_scenario(loaded.sumo.graph, name=f"{day} on {map_name}", seed=seed)
    return with_whole_day(loaded, scenario, trips=trips, day=day)


def with_whole_day(
    loaded: LoadedMap, scenario: Scenario, *, trips: float = 51_000.0, day: str = "weekday"
) -> tuple[Scenario, Load]:
    """Give a scenario 24 hours of traffic on its whole map, from midnight on.

    Its region becomes the whole map; road users that are there stay. A matrix of that name is
    replaced.

    Raises
    ------
    ScenarioError
        If the map is in several pieces.
    InputError
        If there is no such day, or no trips are possible, or so many.
    """
    if not 0.0 < trips <= MOST_TRIPS:
        raise InputError(f"trips must be above 0 and at most {MOST_TRIPS:g}, not {trips:g}")
    graph = loaded.sumo.graph
    empty = edits.new_scenario(
        graph, name=scenario.name, roi=graph.segments.ids, seed=scenario.seed
    )
    matrix, load = town_day(empty, loaded.sumo, trips=trips, day=day)
    roi = tuple(dict.fromkeys((*scenario.roi, *empty.roi)))
    scenario = scenario.model_copy(update={"roi": roi})
    scenario = edits.set_simulation(scenario, duration=DAY)
    scenario = edits.set_clock(scenario, clock=0.0)
    scenario = edits.set_matrix(
        scenario, graph, matrix=day, trips=matrix, profile=day, mix=TOWN_MIX, begin=0.0, end=DAY
    )
    return scenario, load


def fit_counts(workspace: Workspace, path: GivenPath) -> CountFits:
    """Hold traffic against the counts of its scenario: as planned, or as a run had it.

    Parameters
    ----------
    workspace
        Has the map.
    path
        A scenario file, or the folder of a run.

    Returns
    -------
    CountFits
        Each count with the vehicles that pass and its GEH.

    Raises
    ------
    InputError
        If the scenario has no counts, or the run no trajectories.
    DamagedError
        If a file of the run is not as it was written.
    """
    path = as_path(path)
    folder = path if path.is_dir() else None
    if folder is not None:
        checked_summary(folder, leave=(REPORT_FILE,))
    scenario = read_scenario(path if folder is None else folder / SCENARIO_FILE)
    if not scenario.demand.counts:
        raise InputError(
            "the scenario has no counts; import some with: odscen demand import --counts",
            file=str(path),
        )
    loaded = map_of(workspace, scenario)
    if folder is None:
        return planned_fit(scenario, loaded.sumo)
    trajectories = trajectory_files(folder)
    if not trajectories:
        raise InputError("the run has no trajectories to count in", file=str(path))
    with tables(str(folder)):
        return run_fit(scenario, loaded.sumo, pl.scan_parquet(trajectories))


_FIELDS = {
    "od": "matrices",
    "inputs": "inputs",
    "counts": "counts",
    "profile": "profiles",
    "zones": "zones",
}
"""Where in the document's demand the rows of a table come to stand, by its kind."""


@contextmanager
def _name_lines_of_problems(
    scenario: Scenario, kind: str, rows: Mapping[str, Sequence[int]]
) -> Iterator[None]:
    """Say of problems of the parts that are being read in which line and column they stand.

    ``rows`` are the lines of the rows of each part; an input has one.
    """
    parts = getattr(scenario.demand, _FIELDS[kind])
    places = {part.id: index for index, part in reversed([*enumerate(parts)])}
    new = count(len(parts))
    line_of = {places[name] if name in places else next(new): lines for name, lines in rows.items()}
    row = r"(?:\.\w+\[(?P<row>\d+)\](?:\[(?P<cell>\d+)\])?)?"
    place = re.compile(rf"demand\.{_FIELDS[kind]}\[(?P<part>\d+)\]{row}[^:]*: ")

    def with_line(problem: str) -> str:
        match = place.match(problem)
        if match is None or (lines := line_of.get(int(match["part"]))) is None:
            return problem
        return told(match, lines) + problem[match.end() :]

    def told(match: re.Match[str], lines: Sequence[int]) -> str:
        if kind == "inputs":
            return f"line {lines[0]}: "
        if match["row"] is None or not lines:
            return ""
        column = COLUMNS[kind][int(match["cell"] or 0)]
        exact = match["cell"] is not None or len(COLUMNS[kind]) == 1
        return f"line {lines[int(match['row'])]}{f', column {column!r}' if exact else ''}: "

    try:
        yield
    except ScenarioError as error:
        problems = [f"{error.element}: {error.problem}"] if error.element else error.problems
        found = [with_line(problem) for problem in problems]
        if found == list(problems):
            raise
        if len(found) == 1:
            others = error.problems if error.element else ()
            raise ScenarioError(found[0], problems=others) from error
        raise ScenarioError(f"{len(found)} problems", problems=found) from error
