"""OpenSCENARIO: actors and rules as entities and a storyboard, the map beside it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.formats.base import ExportNotes, Format, FormatOption

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lxml.etree import _Element

    from odscen.formats.base import (
        ExportFiles,
        ExportSource,
        FileContent,
        GivenFile,
        ImportSource,
        RecordedRun,
    )
    from odscen.formats.openscenario.dialect import Dialect
    from odscen.scenario.document.scenario_document import Scenario

_DATE = "2026-01-01T00:00:00"
"""Of the file's header: the same scenario gives the same file on any day."""
LATEST = "1.2"
LEFT_HANDED = "CARLA:"
"""How ScenarioRunner's descriptions begin of files in CARLA's frame, which ours are not in."""


def read_openscenario(source: ImportSource) -> FileContent:
    """Scenario of a file, with a verdict on each of its elements."""
    from odscen.formats.openscenario_import.xosc_file import read_xosc_file

    return read_xosc_file(source)


def choose_main(files: Sequence[GivenFile]) -> int:
    """Which of several files is the scenario, or the distribution that varies it."""
    from odscen.formats.openscenario_import.xosc_file import choose_main_file

    return choose_main_file(files)


def write_openscenario(source: ExportSource) -> ExportFiles:
    """A file of OpenSCENARIO, its map, and what could not be said.

    Raises
    ------
    InputError
        If the version cannot be written, or of a run too much or nothing was recorded.
    """
    from odscen.formats.openscenario.dialect import Dialect

    dialect = Dialect.of(source.options.get("version", LATEST))
    if source.recorded is None:
        return _write_scenario(source, dialect)
    return _write_run(source, source.recorded, dialect)


def _write_scenario(source: ExportSource, dialect: Dialect) -> ExportFiles:
    from odscen.formats.openscenario.xosc_entities import entity
    from odscen.formats.openscenario.xosc_places import Places
    from odscen.formats.openscenario.xosc_signals import traffic_signals
    from odscen.formats.openscenario.xosc_storyboard import Story

    notes = ExportNotes()
    scenario, places = source.scenario, Places(source)
    _note_traffic(source, dialect, notes)
    has_environment = (
        scenario.environment.model_dump(exclude_defaults=True) or scenario.demand.clock
    )
    # ScenarioRunner asks each file for its weather.
    sky = (
        _write_weather(source, dialect) if has_environment or dialect.for_scenario_runner else None
    )
    story = Story(scenario, places, dialect, notes, sky)
    entities = [entity(actor, places, dialect) for actor in scenario.actors]
    signals = traffic_signals(source, notes)
    return _make_files(source, dialect, entities, story.storyboard(), notes, signals)


def _write_run(source: ExportSource, recorded: RecordedRun, dialect: Dialect) -> ExportFiles:
    from odscen.formats.openscenario.xosc_as_run import AsRun, lines_of
    from odscen.formats.openscenario.xosc_places import Places
    from odscen.formats.openscenario.xosc_triggers import Triggers

    notes = ExportNotes()
    triggers = Triggers(Places(source), dialect, notes, {})
    lines = lines_of(recorded)
    made = AsRun(source, recorded, dialect, triggers, _write_weather(source, dialect), lines)
    for user in recorded.users:
        if user.id not in lines:
            notes.left_out.append((user.id, "never in the simulation"))
    return _make_files(source, dialect, list(made.entities()), made.storyboard(), notes)


def _write_weather(source: ExportSource, dialect: Dialect) -> _Element:
    from odscen.formats.openscenario.xosc_weather import environment, said_of

    scenario = source.scenario
    return environment(
        _weather_parameters(source), scenario.demand.clock, dialect, said_of(scenario)
    )


def _make_files(
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
        description=_make_title(source.scenario, dialect),
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
    return {
        f"{source.name}.xosc": text.decode(),
        **notes.files(source.name),
        map_name: source.map_file,
    }


def _make_title(scenario: Scenario, dialect: Dialect) -> str:
    """Description of the file; ScenarioRunner takes it as a name."""
    description = "" if dialect.for_scenario_runner else scenario.description
    return (description or scenario.name).removeprefix(LEFT_HANDED)


def _weather_parameters(source: ExportSource) -> dict[str, float]:
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
        after_story=scenario.simulation.after_story,
    )
    given = {
        "seed": scenario.seed > 0,
        "roi": set(scenario.roi) != every,
        "drivers": [
            driver_set.model_dump(exclude_unset=True) for driver_set in scenario.drivers.sets
        ]
        not in ([], [STEADY_DRIVER]),
        "simulation": scenario.simulation != usual,
        "variant": scenario.variant is not None,
        "study": bool(scenario.study.model_dump(exclude_defaults=True)),
        "description": scenario.description not in ("", _make_title(scenario, dialect)),
        "flows": bool(scenario.flows),
        "demand": bool(scenario.demand.parts),
        "transit": bool(scenario.transit.lines),
        "criteria": bool(scenario.criteria),
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


FORMAT = Format(
    id="openscenario",
    title="OpenSCENARIO",
    label="OpenSCENARIO XML of actors and rules, with --version 1.0 to 1.3",
    description="Road users and rules for esmini, ScenarioRunner and others, with the map beside "
    "them. SUMO traffic is not exported.",
    of=("scenario", "run"),
    suffixes=(".xosc", ".xml"),
    read=read_openscenario,
    write=write_openscenario,
    options=(
        FormatOption(
            "version", "Of OpenSCENARIO: 1.0 to 1.3.", ("1.0", "1.1", "1.2", "1.3"), LATEST
        ),
        FormatOption("ego", "What drives the ego: SUMO, or its story.", ("story", "sumo"), "story"),
    ),
    choose_main=choose_main,
)
