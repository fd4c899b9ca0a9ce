"""OpenSCENARIO: actors and rules as entities and a storyboard, the map beside it."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from odscen.base.errors import InputError
from odscen.formats.exporter import Exporter

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lxml.etree import _Element

    from odscen.formats.exporter import ExportFiles, ExportSource
    from odscen.formats.openscenario.dialect import Dialect, ExportNotes
    from odscen.scenario.document.scenario_document import Scenario

_DATE = "2026-01-01T00:00:00"
"""Of the file's header: the same scenario gives the same file on any day."""
LATEST = "1.2"
LEFT_HANDED = "CARLA:"
"""How ScenarioRunner's descriptions begin of files in CARLA's frame, which ours are not in."""


def openscenario_files(source: ExportSource) -> ExportFiles:
    """A file of OpenSCENARIO, its map, and what could not be said.

    Raises
    ------
    InputError
        If the version cannot be written.
    """
    from odscen.formats.openscenario.dialect import Dialect, ExportNotes
    from odscen.formats.openscenario.xosc_entities import entity
    from odscen.formats.openscenario.xosc_places import Places
    from odscen.formats.openscenario.xosc_signals import traffic_signals
    from odscen.formats.openscenario.xosc_storyboard import Story

    dialect, notes = Dialect.of(source.options.get("version", LATEST)), ExportNotes()
    scenario, places = source.scenario, Places(source)
    _note_traffic(source, dialect, notes)
    said = scenario.environment.model_dump(exclude_defaults=True) or scenario.demand.clock
    # ScenarioRunner asks each file for its weather.
    sky = _weather(source, dialect) if said or dialect.for_scenario_runner else None
    story = Story(scenario, places, dialect, notes, sky)
    entities = [entity(actor, places, dialect) for actor in scenario.actors]
    signals = traffic_signals(source, notes)
    return _files(source, dialect, entities, story.storyboard(), notes, signals)


def files_as_run(source: ExportSource) -> ExportFiles:
    """What happened in a run: a file of OpenSCENARIO, its map, and what could not be said.

    Raises
    ------
    InputError
        If the version cannot be written, or too much or nothing was recorded.
    """
    from odscen.formats.openscenario.dialect import Dialect, ExportNotes
    from odscen.formats.openscenario.xosc_as_run import AsRun, lines_of
    from odscen.formats.openscenario.xosc_places import Places
    from odscen.formats.openscenario.xosc_triggers import Triggers

    happened = source.happened
    if happened is None:
        raise InputError("what happened is known of runs only")
    dialect, notes = Dialect.of(source.options.get("version", LATEST)), ExportNotes()
    triggers = Triggers(Places(source), dialect, notes, {})
    lines = lines_of(happened)
    made = AsRun(source, happened, dialect, triggers, _weather(source, dialect), lines)
    for user in happened.users:
        if user.id not in lines:
            notes.left_out.append((user.id, "never in the simulation"))
    return _files(source, dialect, list(made.entities()), made.storyboard(), notes)


def _weather(source: ExportSource, dialect: Dialect) -> _Element:
    from odscen.formats.openscenario.xosc_weather import environment, said_of

    scenario = source.scenario
    return environment(_parameters(source), scenario.demand.clock, dialect, said_of(scenario))


def _files(
    source: ExportSource,
    dialect: Dialect,
    entities: Sequence[_Element],
    storyboard: _Element,
    notes: ExportNotes,
    signals: _Element | None = None,
) -> ExportFiles:
    from lxml import etree

    from odscen.formats.openscenario.dialect import xml

    header = xml(
        "FileHeader",
        revMajor=1,
        revMinor=dialect.minor,
        date=_DATE,
        description=_title(source.scenario, dialect),
        author="odscen",
    )
    map_name = f"{source.scenario.map.name}.xodr"
    root = xml(
        "OpenSCENARIO",
        header,
        xml("ParameterDeclarations"),
        xml("CatalogLocations"),
        xml("RoadNetwork", xml("LogicFile", filepath=map_name), signals),
        xml("Entities", *entities),
        storyboard,
    )
    text = etree.tostring(root, pretty_print=True, xml_declaration=True, encoding="UTF-8")
    said = {"approximated": notes.rows(notes.approximated), "left_out": notes.rows(notes.left_out)}
    return {
        f"{source.name}.xosc": text.decode(),
        f"{source.name}.export.json": json.dumps(said, indent=2, ensure_ascii=False) + "\n",
        map_name: source.map_file,
    }


def _title(scenario: Scenario, dialect: Dialect) -> str:
    """Description of the file; ScenarioRunner takes it as a name."""
    said = "" if dialect.for_scenario_runner else scenario.description
    return (said or scenario.name).removeprefix(LEFT_HANDED)


def _parameters(source: ExportSource) -> dict[str, float]:
    given = source.scenario.environment
    return {**(source.assets.weather(given.preset) or {}), **given.parameters}


def _note_traffic(source: ExportSource, dialect: Dialect, notes: ExportNotes) -> None:
    """Say what only SUMO knows: drivers, traffic, signals and measures do not travel."""
    from odscen.lanegraph.query import largest_part
    from odscen.scenario.document.scenario_document import STEP_WITH_RULES, Simulation
    from odscen.scenario.templates.scene_template import STEADY_DRIVER

    scenario = source.scenario
    if scenario.environment.model_dump(exclude_defaults=True):
        words = "sun, clouds, fog, rain and friction of the weather"
        notes.approximated.append(("environment", words))
    every = set(largest_part(source.sumo_map.graph.segments))
    usual = Simulation(
        duration=scenario.simulation.duration,
        step_length=STEP_WITH_RULES if scenario.rules else Simulation().step_length,
    )
    given = {
        "seed": scenario.seed > 0,
        "roi": set(scenario.roi) != every,
        "drivers": [one.model_dump(exclude_unset=True) for one in scenario.drivers.sets]
        not in ([], [STEADY_DRIVER]),
        "simulation": scenario.simulation != usual,
        "variant": scenario.variant is not None,
        "study": bool(scenario.study.model_dump(exclude_defaults=True)),
        "description": scenario.description not in ("", _title(scenario, dialect)),
        "flows": bool(scenario.flows),
        "demand": bool(scenario.demand.parts),
        "transit": bool(scenario.transit.lines),
        "measures": bool(scenario.measures),
        "signals": bool(scenario.signals.model_dump(exclude_defaults=True)),
    }
    if scenario.parameters:
        notes.approximated.append(("parameters", "their values are put in where they are used"))
    for part, there in given.items():
        if there:
            notes.left_out.append((part, "OpenSCENARIO has no word for it"))
    for index, actor in enumerate(scenario.actors):
        if actor.via:
            words = "a property: OpenSCENARIO's controller finds its own route to the goal"
            notes.approximated.append((f"actors[{index}].via", words))
        if actor.initial_speed is None and actor.speed is None and not actor.ego:
            words = "SUMO drives it, OpenSCENARIO's default controller keeps its speed of 0"
            notes.approximated.append((f"actors[{index}]", words))


EXPORTER = Exporter(
    name="openscenario",
    label="OpenSCENARIO XML of actors and rules, with --version 1.0 to 1.3",
    files=openscenario_files,
    options=("version",),
    runs=files_as_run,
)
