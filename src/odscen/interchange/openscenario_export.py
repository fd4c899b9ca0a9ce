"""OpenSCENARIO: actors and rules as entities and a storyboard, the map beside it."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from odscen.interchange.exporter import Exporter

if TYPE_CHECKING:
    from odscen.interchange.exporter import ExportFiles, ExportSource
    from odscen.interchange.openscenario.dialect import ExportNotes

_DATE = "2026-01-01T00:00:00"
"""Of the file's header: the same scenario gives the same file on any day."""
LATEST = "1.2"


def openscenario_files(source: ExportSource) -> ExportFiles:
    """A file of OpenSCENARIO, its map, and what could not be said.

    Raises
    ------
    InputError
        If the version cannot be written.
    """
    from lxml import etree

    from odscen.interchange.openscenario.dialect import Dialect, ExportNotes, xml
    from odscen.interchange.openscenario.xosc_entities import entity
    from odscen.interchange.openscenario.xosc_places import Places
    from odscen.interchange.openscenario.xosc_storyboard import Story
    from odscen.interchange.openscenario.xosc_weather import environment

    dialect, notes = Dialect.of(source.options.get("version", LATEST)), ExportNotes()
    scenario, places = source.scenario, Places(source)
    _note_traffic(source, notes)
    header = xml(
        "FileHeader",
        revMajor=1,
        revMinor=dialect.minor,
        date=_DATE,
        description=scenario.name,
        author="odscen",
    )
    weather = environment(_parameters(source), scenario.demand.clock, dialect)
    story = Story(scenario, places, dialect, notes, weather)
    map_name = f"{scenario.map.name}.xodr"
    root = xml(
        "OpenSCENARIO",
        header,
        xml("ParameterDeclarations"),
        xml("CatalogLocations"),
        xml("RoadNetwork", xml("LogicFile", filepath=map_name)),
        xml("Entities", *(entity(actor, places, dialect) for actor in scenario.actors)),
        story.storyboard(),
    )
    text = etree.tostring(root, pretty_print=True, xml_declaration=True, encoding="UTF-8")
    said = {"approximated": notes.rows(notes.approximated), "left_out": notes.rows(notes.left_out)}
    return {
        f"{source.name}.xosc": text.decode(),
        f"{source.name}.export.json": json.dumps(said, indent=2, ensure_ascii=False) + "\n",
        map_name: source.map_file,
    }


def _parameters(source: ExportSource) -> dict[str, float]:
    given = source.scenario.environment
    return {**(source.assets.weather(given.preset) or {}), **given.parameters}


def _note_traffic(source: ExportSource, notes: ExportNotes) -> None:
    """Say what only SUMO knows: drivers, traffic, signals and measures do not travel."""
    scenario = source.scenario
    given = {
        "flows": bool(scenario.flows),
        "demand": bool(scenario.demand.parts),
        "transit": bool(scenario.transit.lines),
        "measures": bool(scenario.measures),
        "signals": bool(scenario.signals.model_dump(exclude_defaults=True)),
    }
    for part, there in given.items():
        if there:
            notes.left_out.append((part, "OpenSCENARIO has no word for it"))
    for index, actor in enumerate(scenario.actors):
        if actor.initial_speed is None and actor.speed is None and not actor.ego:
            words = "SUMO drives it, OpenSCENARIO's default controller keeps its speed of 0"
            notes.approximated.append((f"actors[{index}]", words))


EXPORTER = Exporter(
    name="openscenario",
    label="OpenSCENARIO XML of actors and rules, with --version 1.0 to 1.3",
    files=openscenario_files,
    options=("version",),
)
