"""Signal programs of scenarios: shown, taken over from SUMO's files, and written as such."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.app.maps import map_of
from odscen.app.scenarios import given_scenario
from odscen.base.errors import InputError, NotFoundError, in_file
from odscen.base.given_files import read_given
from odscen.scenario.checks.signal_checks import signal_problems
from odscen.scenario.document.problems import refuse_errors
from odscen.scenario.edits.edit_registry import changed_part, with_fields

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from odscen.formats.tll_file import SignalFile
    from odscen.formats.tll_program import TakenPlan
    from odscen.maps.store import Workspace
    from odscen.records.light_programs import LightProgram
    from odscen.scenario.document.scenario_document import Scenario

_DAY = 86_400.0


def signal_programs(
    workspace: Workspace, scenario: Scenario | Path, *, whole_day: bool = False
) -> tuple[LightProgram, ...]:
    """Tell what each traffic light shows in a scenario.

    Parameters
    ----------
    workspace
        Has the map.
    scenario
        The scenario, or its file; it is not changed.
    whole_day
        Show all plans of the day, also those that do not begin while the scenario lasts.

    Returns
    -------
    tuple of LightProgram
        In the order of the map: each light with its plans, and their phases (s).

    Raises
    ------
    ScenarioError
        With every problem of the signals.
    NotFoundError
        If the workspace has no such map.
    """
    from odscen.sumo.realize.lights.light_realization import realized_lights

    scenario = given_scenario(scenario)
    loaded = map_of(workspace, scenario)
    refuse_errors(signal_problems(scenario.signals, loaded.lights))
    until = _DAY if whole_day else None
    return tuple(light.shown for light in realized_lights(scenario, loaded.sumo, until=until))


def export_signals(workspace: Workspace, scenario: Scenario | Path) -> str:
    """Write the programs that a scenario gives to lights, as SUMO's additional file.

    Parameters
    ----------
    workspace
        Has the map.
    scenario
        The scenario, or its file; it is not changed.

    Returns
    -------
    str
        The XML.

    Raises
    ------
    ScenarioError
        With every problem of the signals.
    InputError
        If the scenario leaves all lights as they are in the map.
    """
    from odscen.runs.layout import SIGNALS_FILE
    from odscen.sumo.realize.lights.light_realization import realized_lights
    from odscen.sumo.realize.lights.program_files import signals_xml
    from odscen.sumo.realize.realization import realize

    scenario = given_scenario(scenario)
    loaded = map_of(workspace, scenario)
    refuse_errors(signal_problems(scenario.signals, loaded.lights))
    lights = realized_lights(scenario, loaded.sumo)
    if any(light.buses for light in lights):  # detectors name the types of the demand's buses
        text = realize(scenario, loaded.sumo, workspace.assets()).files.get(SIGNALS_FILE)
    else:
        text = signals_xml(lights)
    if text is None:
        raise InputError(
            "the scenario changes no traffic light: all run the programs of the network"
        )
    return text


def import_signals(
    workspace: Workspace,
    scenario: Scenario | Path,
    file: Path,
    *,
    junctions: Sequence[str] = (),
) -> tuple[Scenario, tuple[str, ...]]:
    """Take programs of lights over from a SUMO file, in place of those that the scenario has.

    Parameters
    ----------
    workspace
        Has the map.
    scenario
        The scenario, or its file; it is not changed.
    file
        Additional file of SUMO with ``tlLogic``.
    junctions
        Lights, by OpenDRIVE junction or SUMO's id; all that the file and the map have if empty.

    Returns
    -------
    tuple of Scenario and tuple of str
        The scenario, and in words what was taken otherwise than the file says it.

    Raises
    ------
    InputError
        If the file cannot be read, or a program in it is not one of stages; names the program.
    NotFoundError
        If a junction has no light.
    ScenarioError
        If greens conflict or intergreens are too short, with the movements and times.
    """
    return take_signals(
        workspace,
        given_scenario(scenario),
        read_given(file),
        file=str(file),
        junctions=junctions,
    )


def take_signals(
    workspace: Workspace,
    scenario: Scenario,
    content: bytes,
    *,
    file: str,
    junctions: Sequence[str] = (),
) -> tuple[Scenario, tuple[str, ...]]:
    """Take programs over from the content of a file; see :func:`import_signals`.

    Parameters
    ----------
    file
        Name of the file, for messages.
    """
    from odscen.formats.tll_file import parse_signal_file
    from odscen.formats.tll_loops import taken_loops
    from odscen.formats.tll_program import taken_timing

    loaded = map_of(workspace, scenario)
    views = {light.id: view for light, view in zip(loaded.sumo.lights, loaded.lights, strict=True)}
    wanted = {light for light, view in views.items() if {light, *view.names} & set(junctions)}
    for name in junctions:
        if not any(name == light or name in view.names for light, view in views.items()):
            raise NotFoundError(
                "traffic light in junction",
                name,
                [n for view in views.values() for n in view.names],
            )
    timings = {timing.junction: timing for timing in scenario.signals.junctions}
    notes: list[str] = []
    with in_file(file):
        parsed = parse_signal_file(content)
        found = {program.light for program in parsed.programs} & (wanted or views.keys())
        if missing := sorted(wanted - found) or (not found and sorted(views)):
            raise InputError(f"the file has no program for {', '.join(map(repr, missing))}")
        for light in loaded.sumo.lights:
            if light.id not in found:
                continue
            loops = taken_loops(parsed.loops.values(), light, loaded.sumo.net)
            plans = _take_day_plans(parsed, light.id, scenario.demand.clock, notes)
            timing, more = taken_timing(views[light.id], plans, loops=loops)
            notes += more
            for name in views[light.id].names:
                timings.pop(name, None)
            timings[timing.junction] = timing
    signals = changed_part(scenario.signals, {"junctions": tuple(timings.values())})
    refuse_errors(signal_problems(signals, loaded.lights))
    return with_fields(scenario, signals=signals), tuple(notes)


def _take_day_plans(
    parsed: SignalFile, light: str, clock: float, notes: list[str]
) -> list[TakenPlan]:
    """Programs of a light that are run, with the times of day at which they begin."""
    from odscen.formats.tll_program import TakenPlan

    programs = {program.id: program for program in parsed.programs if program.light == light}
    switches = parsed.switches.get(light)
    if switches is None:
        last = list(programs.values())[-1]
        dropped = [f"program {name!r}" for name in programs if name != last.id]
        if dropped:
            notes.append(f"tlLogic {light!r}: {', '.join(dropped)} is never active in SUMO")
        return [TakenPlan(last, last.id)]
    times: dict[str, list[str]] = {}
    for seconds, name in ((0.0, switches.start), *switches.switches):
        if name not in programs:
            raise InputError(f"WAUT of {light!r}: there is no program {name!r}")
        times.setdefault(name, []).append(_clock_time(clock + seconds))
    return [TakenPlan(programs[name], name, tuple(dict.fromkeys(t))) for name, t in times.items()]


def _clock_time(seconds: float) -> str:
    whole = round(seconds % _DAY)
    return f"{whole // 3600 % 24:02d}:{whole // 60 % 60:02d}:{whole % 60:02d}"
