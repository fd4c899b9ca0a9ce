"""Demand as functions: what ``odscen demand`` and scripts call."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import polars as pl

from odscen import workflow
from odscen.errors import InputError, in_file
from odscen.scenario import demand_edits, edits
from odscen.scenario.profiles import DAY
from odscen.scenario.tables import read_counts, read_matrix, read_profile, read_zones
from odscen.sumo.fit import planned_fit, run_fit
from odscen.sumo.layout import SCENARIO_FILE, TRAJECTORIES_FILE
from odscen.sumo.town_day import TOWN_MIX, town_day

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.catalog.store import Workspace
    from odscen.scenario.document import Scenario
    from odscen.sumo.fit import Fit
    from odscen.sumo.town_day import Load
    from odscen.workflow import LoadedMap


def import_table(
    workspace: Workspace,
    scenario: Scenario,
    file: Path,
    *,
    kind: str,
    name: str | None = None,
    day: str | None = None,
    **fields: Any,
) -> Scenario:
    """Read a table into a scenario.

    Parameters
    ----------
    kind
        ``od``, ``counts``, ``profile`` or ``zones``.
    name
        Of the part of the demand; the kind's if not given. A matrix with times of its own becomes
        one part for each slice, numbered from 1 on.
    day
        Day profile of a matrix without times.
    fields
        Further fields of the part, such as ``mix``.

    Raises
    ------
    InputError
        If the file cannot be read or a value cannot be used; names file and line.
    ScenarioError
        If the scenario has no such places.
    """
    graph = _loaded(workspace, scenario).sumo.graph
    with in_file(str(file)):
        text, clock = _text(file), scenario.demand.clock
        if kind == "zones":
            for zone, segments in read_zones(text).items():
                scenario = demand_edits.set_zone(scenario, graph, zone=zone, segments=segments)
            return scenario
        if kind == "profile":
            shares = read_profile(text)
            return demand_edits.set_profile(
                scenario, graph, profile=name or "profile", shares=shares
            )
        if kind == "counts":
            rows = read_counts(text, clock=clock)
            return demand_edits.set_counts(
                scenario, graph, counts=name or "counts", rows=rows, **fields
            )
        slices = read_matrix(text, clock=clock)
        for number, (when, trips) in enumerate(slices.items(), start=1):
            whole = when is None and len(slices) == 1
            own: dict[str, Any] = {} if when is None else {"begin": when[0], "end": when[1]}
            scenario = demand_edits.set_matrix(
                scenario,
                graph,
                matrix=(name or "trips") + ("" if whole else f"-{number}"),
                trips=trips,
                profile=day,
                **own,
                **fields,
            )
        return scenario


def add_background(
    workspace: Workspace, scenario: Scenario, *, name: str, **fields: Any
) -> Scenario:
    """Add background traffic; ``fields`` are those of ``Background``, such as ``per_km``."""
    graph = _loaded(workspace, scenario).sumo.graph
    return demand_edits.set_background(scenario, graph, background=name, **fields)


def whole_day(
    workspace: Workspace,
    map_name: str,
    *,
    trips: float = 51_000.0,
    day: str = "weekday",
    seed: int = 0,
) -> tuple[Scenario, Load]:
    """Make 24 hours of traffic on a whole map, from midnight on; see :func:`town_day`."""
    loaded = workflow.load_map(workspace.map(map_name))
    graph = loaded.sumo.graph
    scenario = edits.new_scenario(graph, name=f"{day} on {map_name}", roi=graph.segments.ids)
    scenario = edits.set_seed(scenario, seed=seed)
    scenario = edits.set_simulation(scenario, duration=DAY)
    matrix, load = town_day(scenario, loaded.sumo, trips=trips, day=day)
    scenario = demand_edits.set_matrix(
        scenario, graph, matrix=day, trips=matrix, profile=day, mix=TOWN_MIX
    )
    return scenario, load


def fit(workspace: Workspace, what: Path) -> Fit:
    """Hold traffic against the counts of its scenario: as planned, or as a run had it.

    Parameters
    ----------
    what
        A scenario file, or the folder of a run.

    Raises
    ------
    InputError
        If the scenario has no counts, or the run no trajectories.
    """
    folder = what if what.is_dir() else None
    scenario = workflow.read_scenario(what if folder is None else folder / SCENARIO_FILE)
    if not scenario.demand.counts:
        msg = "the scenario has no counts; import some with: odscen demand import --counts"
        raise InputError(msg, file=str(what))
    loaded = _loaded(workspace, scenario)
    if folder is None:
        return planned_fit(scenario, loaded.sumo)
    trajectories = folder / TRAJECTORIES_FILE
    if not trajectories.is_file():
        msg = "the run has no trajectories to count in"
        raise InputError(msg, file=str(what))
    return run_fit(scenario, loaded.sumo, pl.scan_parquet(trajectories))


def _loaded(workspace: Workspace, scenario: Scenario) -> LoadedMap:
    return workflow.load_map(workspace.map_for(scenario.map.name, scenario.map.sha256))


def _text(file: Path) -> str:
    try:
        return file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(str(error)) from error
