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

    from odscen.scenario.document.scenario_document import Scenario
    from odscen.sumo.realize.sumo_map import SumoMap
    from odscen.workspace.asset_catalogue import Assets


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
    """

    name: str
    scenario: Scenario
    sumo_map: SumoMap
    map_file: Path
    net: Path
    assets: Assets
    options: Mapping[str, str] = field(default_factory=dict)


ExportFiles = Mapping[str, "str | Path"]
"""By name: the text of a file, or a file that is copied."""


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
        Makes the files.
    checked
        Whether the scenario must be free of errors.
    options
        Names of what can be chosen.
    """

    name: str
    label: str
    files: Callable[[ExportSource], ExportFiles]
    checked: bool = True
    options: tuple[str, ...] = ()
