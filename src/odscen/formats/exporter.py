"""What an exporter is: one entry with a name, a label and a function.

Modules of exporters are imported to list their names, so they import what is heavy when they are
called.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

    import polars as pl

    from odscen.opendrive.road_model import OpenDrive
    from odscen.records.run_plan import PlannedActor
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.simulators.assets import Assets
    from odscen.sumo.realize.sumo_map import SumoMap


@dataclass(frozen=True, slots=True, eq=False)
class WhatHappened:
    """What happened in a run.

    Attributes
    ----------
    users
        Everybody who was planned, with size and height of the ground at departure.
    rows
        Trajectories of body centres, see :meth:`~odscen.runs.finished_run.Run.trajectories`.
    states
        What lights showed, see :func:`~odscen.runs.recorded.read_light_states`.
    until
        When the simulation ended, s.
    step
        Between two records, s.
    """

    users: tuple[PlannedActor, ...]
    rows: pl.DataFrame
    states: pl.DataFrame | None
    until: float
    step: float


@dataclass(frozen=True, slots=True, eq=False)
class ExportSource:
    """A scenario to be exported.

    Attributes
    ----------
    name
        Of the scenario's file, without its ending.
    scenario
        The document.
    sumo_map
        Lane graph, pedestrian graph and SUMO network of its map, with the table between them.
    map_file
        The map, as it was added.
    net
        The map's SUMO network file.
    assets
        Size of models and parameters of weather.
    options
        What the format lets one choose, by name.
    happened
        Of a run that is exported instead of the scenario.
    roads
        The map itself, for formats that ask for it.
    """

    name: str
    scenario: Scenario
    sumo_map: SumoMap
    map_file: Path
    net: Path
    assets: Assets
    options: Mapping[str, str] = field(default_factory=dict)
    happened: WhatHappened | None = None
    roads: OpenDrive | None = None


ExportFiles = Mapping[str, "str | bytes | Path"]
"""By name: the content of a file, or a file that is copied."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Exporter:
    """A format that scenarios can be written in.

    Attributes
    ----------
    name
        What ``odscen export --to`` calls it.
    label
        What it is, in the help.
    files
        Makes the files; ``None`` for a format of runs only.
    checked
        Whether the scenario must be free of errors.
    options
        Names of what can be chosen.
    runs
        Makes the files of what happened in a run, if the format can say that.
    needs_roads
        Whether it is given the map itself.
    """

    name: str
    label: str
    files: Callable[[ExportSource], ExportFiles] | None = None
    checked: bool = True
    options: tuple[str, ...] = ()
    runs: Callable[[ExportSource], ExportFiles] | None = None
    needs_roads: bool = False
