"""Stages of a run's lights for a model that switches them, and the ways between all of them.

Yellow, all-red and clearance of a way follow from the paths of what ends and what begins, as in
programs of a scenario, so a model may choose any stage after any other.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

from odscen.convert.model.net import CROSSED, UNUSED
from odscen.learning.behaviour.light_model import APPROACH, LightFacts, facts_from_dict
from odscen.scenario.document.signals_document import JunctionTiming
from odscen.scenario.signals.program_design import DesignedProgram, change_steps, stage_state
from odscen.sumo.realize.lights.actuated.stage_variants import StageVariants
from odscen.sumo.realize.lights.light_views import scenario_lights
from odscen.sumo.realize.lights.stage_phases import kept_phases

if TYPE_CHECKING:
    from odscen.convert.lane_table.table import SumoLight
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.signals.light import Light
    from odscen.sumo.realize.road_net import RoadNet
    from odscen.sumo.realize.sumo_map import SumoMap

Step = tuple[float, str]
"""Seconds, and the state that is shown."""


@dataclass(frozen=True, slots=True)
class SwitchedLight:
    """A light, and by stage and stage the steps that lie between their greens."""

    facts: LightFacts
    ways: tuple[tuple[tuple[Step, ...], ...], ...]


def switched_lights(scenario: Scenario, sumo_map: SumoMap) -> tuple[SwitchedLight, ...]:
    """Lights of a scenario that a model can switch: those of two stages and more.

    Their stages are those of the scenario's programs, else the map's. Lights of which is not known
    which movements meet keep their program.
    """
    timings = {timing.junction: timing for timing in scenario.signals.junctions}
    lights = []
    for light, view in zip(sumo_map.lights, scenario_lights(sumo_map), strict=True):
        own = [timings[name] for name in view.names if name in timings]
        timing = own[0] if own else JunctionTiming(junction=view.names[0])
        made = _designed_light(timing, view) if timing.stages else _map_light(light, timing, view)
        if made is not None:
            names, states, least, ways = made
            lights.append(
                SwitchedLight(_light_facts(light, names, states, least, ways, sumo_map.net), ways)
            )
    return tuple(lights)


def lights_json(lights: tuple[SwitchedLight, ...]) -> str:
    """Lights as JSON."""
    return json.dumps([asdict(light) for light in lights]) + "\n"


def lights_from_json(text: str) -> tuple[SwitchedLight, ...]:
    """Inverse of :func:`lights_json`."""
    return tuple(
        SwitchedLight(
            facts_from_dict(values["facts"]),
            tuple(
                tuple(tuple((seconds, state) for seconds, state in way) for way in row)
                for row in values["ways"]
            ),
        )
        for values in json.loads(text)
    )


_Made = tuple[
    tuple[str, ...], tuple[str, ...], tuple[float, ...], tuple[tuple[tuple[Step, ...], ...], ...]
]


def _map_light(light: SumoLight, timing: JunctionTiming, view: Light) -> _Made | None:
    """Stages of the map's program, with their crossings."""
    phases = kept_phases(light, timing.green)
    variants = StageVariants(phases, view)
    if not variants.usable:
        return None
    stages = [kinds[0] for kinds in variants.of_stage]
    ways = tuple(
        tuple(
            ()
            if stage is other
            else tuple((phase.seconds, phase.state) for phase in variants.way(stage, other))
            for other in stages
        )
        for stage in stages
    )
    greens = [phases[at] for at in variants.stages]
    return (
        tuple(phase.stage for phase in greens),
        tuple(phase.state for phase in greens),
        tuple(phase.least or phase.seconds for phase in greens),
        ways,
    )


def _designed_light(timing: JunctionTiming, view: Light) -> _Made | None:
    """Stages of a program of the scenario; of several plans those of the first."""
    program = DesignedProgram(timing, view, "fixed")
    stages = program.plans()[0].stages
    if len(stages) < 2:
        return None
    ways = tuple(
        tuple(
            ()
            if stage is other
            else tuple((step[0], step[1]) for step in change_steps(program, stage, other))
            for other in stages
        )
        for stage in stages
    )
    return (
        tuple(stage.id for stage in stages),
        tuple(stage_state(program, stage) for stage in stages),
        tuple(stage.least or stage.green for stage in stages),
        ways,
    )


def _light_facts(
    light: SumoLight,
    names: tuple[str, ...],
    states: tuple[str, ...],
    least: tuple[float, ...],
    ways: tuple[tuple[tuple[Step, ...], ...], ...],
    net: RoadNet,
) -> LightFacts:
    drives = [(n, link) for n, link in enumerate(light.links) if link.turn not in {CROSSED, UNUSED}]
    lanes = tuple(dict.fromkeys(link.source for _, link in drives))
    exits = tuple(dict.fromkeys(link.target for _, link in drives))
    approaches = tuple(_lanes_upstream(net, lane) for lane in lanes)

    def served(state: str, lane: str, end: str) -> bool:
        return any(state[n] in "Gg" for n, link in drives if getattr(link, end) == lane)

    return LightFacts(
        id=light.id,
        junctions=tuple(light.junctions),
        stages=names,
        states=states,
        least_green=least,
        change=tuple(tuple(sum(s for s, _ in way) for way in row) for row in ways),
        approaches=approaches,
        lengths=tuple(sum(net.lanes[lane].length for lane in chain) for chain in approaches),
        exits=exits,
        serves=tuple(tuple(served(state, lane, "source") for lane in lanes) for state in states),
        leads=tuple(tuple(served(state, lane, "target") for lane in exits) for state in states),
    )


def _lanes_upstream(net: RoadNet, lane: str) -> tuple[str, ...]:
    """A lane and those that lead to it, up to :data:`APPROACH` metres or the junction before."""
    chain, length = [lane], net.lanes[lane].length
    while length < APPROACH:
        before = _lane_of_same_road(net, chain[-1])
        if before is None or before in chain:
            break
        chain.append(before)
        length += net.lanes[before].length
    return tuple(chain)


def _lane_of_same_road(net: RoadNet, lane: str) -> str | None:
    """Lane that leads onto a lane from an edge that leads to no other; of several the nearest.

    Between two edges of a road SUMO has lanes inside a junction, too; they are passed over.
    """
    own = net.lanes[lane]
    begin = net.ends.get(own.edge, ("", ""))[0]
    found = []
    for edge in sorted(edge for edge, (_, end) in net.ends.items() if begin and end == begin):
        lanes = net.edge_lanes.get(edge, ())
        links = [link for before in lanes for link in net.links_from.get(before.id, ())]
        if {net.lanes[link.target].edge for link in links} == {own.edge}:
            found += [link.source for link in links if link.target == lane]
    return min(found, key=lambda x: (abs(net.lanes[x].index - own.index), x), default=None)
