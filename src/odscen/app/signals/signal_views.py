"""Signal programs to be looked at: of a scenario or of a run, with the shape of the junction."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Literal, NamedTuple

from odscen.app.maps import map_of
from odscen.app.scenarios import given_scenario
from odscen.app.signals.signal_plans import signal_programs
from odscen.base.errors import InputError, NotFoundError
from odscen.scenario.signals.program_design import DesignedProgram
from odscen.sumo.realize.lights.actuated.detector_places import lane_lines
from odscen.sumo.realize.sumo_map import NETWORK_CONTROLS

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from odscen.app.maps import LoadedMap
    from odscen.base.given_files import GivenPath
    from odscen.convert.model.conversion_settings import ConverterName
    from odscen.maps.store import Workspace
    from odscen.records.light_programs import LightProgram
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.document.signals_document import JunctionTiming, Signals
    from odscen.scenario.signals.light import Light
    from odscen.scenario.signals.program_design import DesignedGroup

ProgramOrigin = Literal["scenario", "retimed", "odscen", "netconvert", "file"]
"""Whose a program is: the scenario's own; stages of the map with times, control or priority of the
scenario; or what a converter made, or the network that was brought in has."""

DETECTABLE = 150.0
"""Metres before the stop line within which detectors can be placed by pointing."""


def program_origin(
    light: LightProgram, signals: Signals, converter: ConverterName
) -> ProgramOrigin:
    """Whose the program of a light is, in a scenario with these signals."""
    if light.own:
        return "scenario"
    timing = next(
        (junction for junction in signals.junctions if junction.junction in light.junctions), None
    )
    priority = signals.bus_priority if timing is None else bool(timing.bus_priority)
    changed = timing is not None and (bool(timing.green) or timing.offset != 0.0)
    if changed or priority or light.control not in ("fixed", NETWORK_CONTROLS[converter]):
        return "retimed"
    return converter


def chosen_lights(
    lights: Iterable[LightProgram], junctions: Sequence[str]
) -> tuple[LightProgram, ...]:
    """Lights by junction or by SUMO's id; all without any names.

    Raises
    ------
    NotFoundError
        If one of the names is of no light.
    """
    known = tuple(lights)
    named = {name: light for light in known for name in (light.id, *light.junctions)}
    for junction in junctions:
        if junction not in named:
            raise NotFoundError(
                "traffic light in junction", junction, [light.junctions[0] for light in known]
            )
    chosen = {named[junction].id for junction in junctions}
    return tuple(light for light in known if not chosen or light.id in chosen)


def signal_sheets(
    workspace: Workspace, scenario: Scenario | GivenPath, *, junctions: Sequence[str] = ()
) -> dict[str, str]:
    """Draw what lights of a scenario are told to show, with all plans of the day.

    Parameters
    ----------
    junctions
        Lights, by OpenDRIVE junction or SUMO's id; all if empty.

    Returns
    -------
    File names, made of the junctions, and SVG documents.

    Raises
    ------
    InputError
        If the map has no lights.
    NotFoundError
        If a junction has no light.
    ScenarioError
        With every problem of the signals.
    """
    from odscen.reports.signal_sheet import signal_sheet

    scenario = given_scenario(scenario)
    drawing = map_of(workspace, scenario).drawing
    lights = chosen_lights(signal_programs(workspace, scenario, whole_day=True), junctions)
    if not lights:
        raise InputError(f"map {scenario.map.name!r} has no traffic lights")
    sheets: dict[str, str] = {}
    for light in lights:
        stem = re.sub(r"[^\w.-]", "_", light.junctions[0])
        name = f"{stem}.svg" if f"{stem}.svg" not in sheets else f"{stem}-{len(sheets)}.svg"
        sheets[name] = signal_sheet(light, drawing=drawing, title=scenario.name)
    return sheets


class GroupPair(NamedTuple):
    """Two signal groups of a program, one of which ends and the other begins.

    Attributes
    ----------
    needed, given
        Seconds of intergreen that their paths need, and that the scenario says; ``None`` if it does
        not.
    used
        Seconds that the program keeps.
    together
        Whether both may have green at once: ``free`` if they do not meet, ``yields`` if ``ending``
        has to give way, ``first`` if ``beginning`` has to, ``never``.
    """

    ending: str
    beginning: str
    needed: float
    given: float | None
    used: float
    together: Literal["free", "yields", "first", "never"]


def group_pairs(timing: JunctionTiming, light: Light) -> tuple[GroupPair, ...]:
    """All ordered pairs of groups of a program that meet, as in the document; else none."""
    program = DesignedProgram(timing, light, "fixed")
    given = {row[:2]: row[2] for row in timing.intergreens}
    pairs = []
    for group in program.groups.values():
        for other in program.groups.values():
            if group is other:
                continue
            needed, _ = program.needed(group.id, other.id)
            together = _rank_turn_against(light, group, other)
            if needed or together != "free" or (group.id, other.id) in given:
                pair = group.id, other.id
                used = program.intergreen(*pair)
                pairs.append(GroupPair(*pair, needed, given.get(pair), used, together))
    return tuple(pairs)


def _rank_turn_against(
    light: Light, one: DesignedGroup, other: DesignedGroup
) -> Literal["free", "yields", "first", "never"]:
    own = set(one.movements)
    met = [
        meeting
        for i in one.movements
        for j in other.movements
        if (meeting := light.met.get((min(i, j), max(i, j)))) is not None
    ]
    if any(not meeting.shares or meeting.yields < 0 for meeting in met):
        return "never"
    if any(meeting.yields in own for meeting in met):
        return "yields"
    return "first" if met else "free"


class DetectorLane(NamedTuple):
    """A lane before a light: its name and that of its approach, and its line to the stop line."""

    at: str
    approach: str
    line: tuple[tuple[float, float], ...]


def detector_lanes(loaded: LoadedMap, junction: str) -> tuple[DetectorLane, ...]:
    """Lanes of vehicles before a light, with their last :data:`DETECTABLE` metres."""
    lanes = []
    for light, view in zip(loaded.sumo.lights, loaded.lights, strict=True):
        if junction in view.names:
            for n, line in lane_lines(light, loaded.sumo, DETECTABLE).items():
                movement = view.movements[n]
                lanes.append(DetectorLane(movement.lanes[0], movement.approach, line))
    return tuple(lanes)
