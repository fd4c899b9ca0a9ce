"""What an exporter is: one entry with a name, a label and a function.

Modules of exporters are imported to list their names, so they import what is heavy when they are
called.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.catalog.assets import Assets
    from odscen.scenario.document import Scenario
    from odscen.sumo.sumo_map import SumoMap


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
    net
        The map's SUMO network file.
    assets
        Size of models and parameters of weather.
    """

    name: str
    scenario: Scenario
    sumo_map: SumoMap
    net: Path
    assets: Assets


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
    """

    name: str
    label: str
    files: Callable[[ExportSource], ExportFiles]
    checked: bool = True
