"""Traffic lights: their programs as controllers, and the signals of a movement."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from odscen.convert.lane_table.light_heads import SignalHeads
from odscen.formats.openscenario.dialect import xml
from odscen.scenario.signals.light import find_light, find_movements
from odscen.sumo.realize.lights.light_realization import realized_lights
from odscen.sumo.realize.lights.light_views import scenario_lights

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from lxml.etree import _Element

    from odscen.convert.lane_table.table import SumoLight
    from odscen.formats.base import ExportNotes, ExportSource
    from odscen.records.light_programs import LightProgram, ProgramPhase, ShownPlan
    from odscen.sumo.realize.sumo_map import SumoMap


_LAMPS: Final = {
    "red": "on;off;off",
    "yellow": "off;on;off",
    "green": "off;off;on",
    "off": "off;off;off",
}


def lamps_of(colour: str) -> str:
    """State of a signal of three lamps, from the top, that shows a colour or is off.

    esmini knows modes of lamps and no colours: it refuses a file with a state ``green``.
    """
    return _LAMPS[colour.lower()]


def light_action(signal: str, colour: str) -> _Element:
    """``GlobalAction`` that makes a signal show ``red``, ``yellow``, ``green`` or ``off``."""
    return lights_action(xml("TrafficSignalStateAction", name=signal, state=lamps_of(colour)))


def lights_action(content: _Element) -> _Element:
    """``GlobalAction`` about traffic lights."""
    return xml("GlobalAction", xml("InfrastructureAction", xml("TrafficSignalAction", content)))


def traffic_signals(source: ExportSource, notes: ExportNotes) -> _Element | None:
    """``TrafficSignals`` with a controller for each light that the map has signals of."""
    lights = source.sumo_map.lights
    if not lights:
        return None
    programs = realized_lights(source.scenario, source.sumo_map)
    found = [
        _write_controller(light, program.shown, notes)
        for light, program in zip(lights, programs, strict=True)
        if any(light.signals)
    ]
    return xml("TrafficSignals", *found) if found else None


def signal_of(source: ExportSource, light: str, movement: str) -> tuple[str, bool] | None:
    """Id of the OpenDRIVE signal over a movement, and whether it is over others too."""
    views = scenario_lights(source.sumo_map)
    view = find_light(views, light)
    links = () if view is None else find_movements(movement, view.movements)
    if view is None or not links:
        return None
    own = source.sumo_map.lights[views.index(view)].signals
    if not own[links[0]]:
        return None
    signal = own[links[0]][0]
    others = {n for n, names in enumerate(own) if signal in names} - set(links)
    return signal, bool(others)


def movement_of(sumo_map: SumoMap, signal: str) -> tuple[str, str] | None:
    """Name of the light of an OpenDRIVE signal, and of the first movement that it is over."""
    for light, view in zip(sumo_map.lights, scenario_lights(sumo_map), strict=True):
        for names, movement in zip(light.signals, view.movements, strict=False):
            if signal in names and movement.turn:
                return view.names[0], movement.exact_name
    return None


def signals_of(source: ExportSource, light: str) -> tuple[str, ...]:
    """Ids of the OpenDRIVE signals of a light."""
    views = scenario_lights(source.sumo_map)
    view = find_light(views, light)
    own = () if view is None else source.sumo_map.lights[views.index(view)].signals
    return tuple(sorted({signal for signals in own for signal in signals}))


def signal_phase(source: ExportSource, light: str, movement: str) -> tuple[str, str] | None:
    """Name of the controller of a light, and of its first phase in which a movement has green."""
    views = scenario_lights(source.sumo_map)
    view = find_light(views, light)
    links = () if view is None else find_movements(movement, view.movements)
    if view is None or not links:
        return None
    row = views.index(view)
    if not any(source.sumo_map.lights[row].signals):
        return None
    program = realized_lights(source.scenario, source.sumo_map)[row].shown
    names = [
        _phase_name(number, phase)
        for number, phase in enumerate(from_the_start(program.plans[0]), start=1)
        if phase.state[links[0]] in "Gg"
    ]
    return (program.junctions[0], names[0]) if names else None


def _phase_name(number: int, phase: ProgramPhase) -> str:
    return f"{number} {phase.name}".strip()


def _write_controller(light: SumoLight, program: LightProgram, notes: ExportNotes) -> _Element:
    plan, name = program.plans[0], program.junctions[0]
    where = f"signals of {name}"
    if len(program.plans) > 1:
        notes.approximated.append((where, "only the first plan of the day"))
    if program.control != "fixed" or any(phase.on_call or phase.most for phase in plan.phases):
        notes.approximated.append((where, "each green as long as planned: nothing prolongs it"))
    heads, phases = SignalHeads([light]), []
    for number, phase in enumerate(from_the_start(plan), start=1):
        shown = heads.states({light.id: phase.state})
        states = [
            xml("TrafficSignalState", trafficSignalId=signal, state=lamps_of(state))
            for signal, state in sorted(shown.items())
        ]
        about = {"name": _phase_name(number, phase), "duration": float(phase.seconds)}
        phases.append(xml("Phase", *states, **about))
    return xml("TrafficSignalController", *phases, name=name)


def from_the_start(plan: ShownPlan) -> Sequence[ProgramPhase]:
    """Phases of one cycle from the start of the run on.

    A program begins ``offset`` seconds after that, as if it had run before; so the phase that is
    shown at the start may come in two parts.
    """
    return tuple(_rotate_phases(plan.phases, -plan.offset % plan.cycle))


def _rotate_phases(phases: Sequence[ProgramPhase], gone: float) -> Iterator[ProgramPhase]:
    """Phases after so many seconds of the cycle, then those before."""
    before, now = [], 0.0
    for phase in phases:
        first = min(max(gone - now, 0.0), phase.seconds)
        now += phase.seconds
        if first > 0.0:
            before.append(phase._replace(seconds=first))
        if first < phase.seconds:
            yield phase._replace(seconds=phase.seconds - first)
    yield from before
