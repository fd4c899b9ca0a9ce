"""Signal programs of scenarios: shown, taken over from SUMO's files, and written as such."""

from __future__ import annotations

from collections import Counter
from copy import deepcopy
from typing import TYPE_CHECKING

from lxml import etree

from odscen.app.maps import map_of
from odscen.app.scenarios import given_scenario
from odscen.base.errors import InputError, NotFoundError, in_file
from odscen.base.given_files import as_path, read_given
from odscen.base.xml_reading import read_xml
from odscen.scenario.checks.signal_checks import signal_problems
from odscen.scenario.document.problems import refuse_errors
from odscen.scenario.document.sumo_document import SumoFile, SumoProject
from odscen.scenario.edits.edit_registry import changed_part, with_fields

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence

    from odscen.base.given_files import GivenPath
    from odscen.formats.tll_file import SignalFile
    from odscen.formats.tll_program import TakenPlan
    from odscen.maps.store import Workspace
    from odscen.records.light_programs import LightProgram
    from odscen.scenario.document.scenario_document import Scenario

_DAY = 86_400.0


def signal_programs(
    workspace: Workspace, scenario: Scenario | GivenPath, *, whole_day: bool = False
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


def export_signals(workspace: Workspace, scenario: Scenario | GivenPath) -> str:
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
    scenario: Scenario | GivenPath,
    file: GivenPath,
    *,
    junctions: Sequence[str] = (),
    strict: bool = False,
) -> tuple[Scenario, tuple[str, ...]]:
    """Take programs of lights over from a SUMO file, in place of those that the scenario has.

    A program that stages cannot say, or that we would not allow, such as one with short
    intergreens, runs as it is: raw phases, as SUMO's own file, with what was found beside it.

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
    strict
        Refuse such programs instead.

    Returns
    -------
    tuple of Scenario and tuple of str
        The scenario, and in words what was taken otherwise than the file says it.

    Raises
    ------
    InputError
        If the file cannot be read, or a program in it is not one of this light; names the program.
    NotFoundError
        If a junction has no light.
    ScenarioError
        With ``strict``, if greens conflict or intergreens are too short, with the movements and
        times.
    """
    return take_signals(
        workspace,
        given_scenario(scenario),
        read_given(as_path(file)),
        file=str(file),
        junctions=junctions,
        strict=strict,
    )


def take_signals(
    workspace: Workspace,
    scenario: Scenario,
    content: bytes,
    *,
    file: str,
    junctions: Sequence[str] = (),
    strict: bool = False,
) -> tuple[Scenario, tuple[str, ...]]:
    """Take programs over from the content of a file; see :func:`import_signals`.

    Parameters
    ----------
    file
        Name of the file, for messages.
    """
    from odscen.formats.tll_file import parse_signal_file
    from odscen.formats.tll_loops import taken_loops
    from odscen.formats.tll_program import ParameterError, taken_timing

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
    raw: list[str] = []
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
            try:
                timing, more = taken_timing(views[light.id], plans, loops=loops)
                own = changed_part(scenario.signals, {"junctions": (timing,)})
                refuse_errors(signal_problems(own, loaded.lights))
            except ParameterError:
                raise
            except InputError as error:
                states = [phase.state for plan in plans for phase in plan.program.phases]
                fits = {len(state) for state in states} == {len(light.phases[0].state)}
                if strict or not fits:
                    raise
                raw.append(light.id)
                notes.append(
                    f"tlLogic {light.id!r} runs as it is in the file: {_list_reasons(error)}"
                )
                for name in views[light.id].names:
                    timings.pop(name, None)
                continue
            notes += more
            for name in views[light.id].names:
                timings.pop(name, None)
            timings[timing.junction] = timing
        scenario = with_raw_programs(scenario, content, raw, found)
    signals = changed_part(scenario.signals, {"junctions": tuple(timings.values())})
    refuse_errors(signal_problems(signals, loaded.lights))
    return with_fields(scenario, signals=signals), tuple(notes)


def _list_reasons(error: InputError) -> str:
    problems = getattr(error, "problems", ()) or ()
    return "; ".join(map(str, problems)) or str(error)


_IN_FORCE = "in-force."
"""How names of programs begin that run as they are."""
RAW_PROGRAMS = "programs-in-force.add.xml"
"""File of a scenario with programs that run as they are."""


def with_raw_programs(
    scenario: Scenario, content: bytes, raw: Sequence[str], taken: Collection[str]
) -> Scenario:
    """Keep the elements of a file that belong to these lights as SUMO's own file.

    Those of an earlier file stay for lights that are not among ``taken``.
    """
    project = scenario.sumo or SumoProject()
    old = [file for file in project.files if file.name == RAW_PROGRAMS]
    kept = [file for file in project.files if file.name != RAW_PROGRAMS]
    parts: list[etree._Element] = []
    for file in old:
        parts += _elements_of_lights(read_xml(file.text), lambda light: light not in taken)
    parts += _elements_of_lights(read_xml(content), lambda light: light in raw)
    if not parts:
        files: tuple[SumoFile, ...] = tuple(kept)
    else:
        root = etree.Element("additional")
        root.extend(parts)
        counts = dict(sorted(Counter(str(part.tag) for part in parts).items()))
        text = etree.tostring(root, encoding="unicode", pretty_print=True)
        files = (*kept, SumoFile.of(RAW_PROGRAMS, "additional", text, counts))
    if not files and scenario.sumo is None:
        return scenario
    changed = project.model_copy(update={"files": files})
    return scenario.model_copy(update={"sumo": changed})


def _elements_of_lights(
    root: etree._Element, wanted: Callable[[str], bool]
) -> list[etree._Element]:
    """Programs of some lights with their WAUTs, and detectors before them if they need any."""
    programs = [logic for logic in root.iter("tlLogic") if wanted(logic.get("id", ""))]
    at = [
        junction for junction in root.iter("wautJunction") if wanted(junction.get("junctionID", ""))
    ]
    names = {junction.get("wautID") for junction in at}
    wauts = [waut for waut in root.iter("WAUT") if waut.get("id") in names]
    loops: list[etree._Element] = []
    if any(logic.get("type", "static") != "static" for logic in programs):
        tags = ("inductionLoop", "e1Detector", "laneAreaDetector", "e2Detector")
        loops = [loop for tag in tags for loop in root.iter(tag)]
    parts = [deepcopy(part) for part in (*loops, *programs, *wauts, *at)]
    for element in [inner for part in parts for inner in part.iter()]:
        # The network may have a program of the same name already, which SUMO refuses.
        for key in ("programID", "startProg", "to"):
            name = element.get(key)
            if name is not None and not name.startswith(_IN_FORCE):
                element.set(key, _IN_FORCE + name)
    return parts


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
