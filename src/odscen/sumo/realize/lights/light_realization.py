"""How each traffic light of a run is to be run: its programs, detectors and plans of the day.

Either the stages of the network are timed anew, and yellow, clearing of crossings and all-red stay
(:mod:`odscen.convert.signals.signal_programs`); or the scenario has stages of its own
(:mod:`odscen.scenario.signals`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING

from odscen.convert.model.extended_greens import (
    CONTROL_PARAM,
    EXTENDED_PARAMS,
    MAP_STAGES,
    STAGES_PARAM,
)
from odscen.scenario.document.signals_document import JunctionTiming
from odscen.scenario.signals.program_design import (
    ONLY_PLAN,
    DesignedProgram,
    TimedPlan,
    active_plans,
)
from odscen.sumo.realize.lights.actuated.call_areas import call_areas, called
from odscen.sumo.realize.lights.actuated.called_light import called_light
from odscen.sumo.realize.lights.light_detectors import (
    bus_areas,
    ended_with_buses,
    idle_loop,
    idle_loops,
    may_end,
    vehicle_loops,
    waiting_places,
)
from odscen.sumo.realize.lights.light_views import scenario_lights
from odscen.sumo.realize.lights.shown_light import ShownLight
from odscen.sumo.realize.lights.stage_phases import (
    PhasePlan,
    SumoPhase,
    bus_phases,
    calling_movements,
    extended_phases,
    kept_cycle,
    kept_phases,
    plan_phases,
    started_offset,
)
from odscen.sumo.realize.project_files import lights_in_force

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.convert.lane_table.table import SumoLight
    from odscen.records.light_programs import LightProgram, ShownPlan
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.document.signals_document import Control
    from odscen.scenario.signals.light import Light
    from odscen.sumo.realize.lights.actuated.call_areas import CallArea
    from odscen.sumo.realize.lights.actuated.called_light import CalledLight
    from odscen.sumo.realize.lights.light_detectors import BusArea, PlacedLoop
    from odscen.sumo.realize.sumo_map import SumoMap

TYPES: dict[Control, str] = {"fixed": "static", "extended": "actuated", "actuated": "actuated"}
"""``type`` of a ``<tlLogic>``."""

GROUP_PARAM = "odscen.group."
"""How parameters begin that name signal groups; their values are places in the states."""


@dataclass(frozen=True, slots=True)
class SumoProgram:
    """One ``<tlLogic>`` with what it needs."""

    id: str
    kind: str
    offset: float
    plan: PhasePlan
    conditions: Mapping[str, str]
    params: Mapping[str, str]


@dataclass(frozen=True, slots=True)
class RealizedLight:
    """A light as SUMO is to run it; ``programs`` are empty if it keeps the network's.

    ``switches`` are seconds of the run and the program that then takes over.
    """

    shown: LightProgram
    programs: tuple[SumoProgram, ...] = ()
    loops: tuple[PlacedLoop, ...] = ()
    switches: tuple[tuple[float, str], ...] = ()
    buses: tuple[BusArea, ...] = ()
    areas: tuple[CallArea, ...] = ()

    @property
    def watched(self) -> bool:
        """Whether SUMO runs detectors of it that are placed here."""
        return self.shown.control != "extended" and any(
            program.kind == "actuated" for program in self.programs
        )


def realized_lights(
    scenario: Scenario, sumo_map: SumoMap, *, until: float | None = None
) -> tuple[RealizedLight, ...]:
    """How each light of the map is run.

    Parameters
    ----------
    scenario
        Its signals without errors, see
        :func:`odscen.scenario.checks.signal_checks.signal_problems`.
    until
        Seconds that the run lasts; the scenario's duration if not given.
    """
    signals = scenario.signals
    if scenario.sumo is not None:
        lights = lights_in_force(scenario.sumo, sumo_map.lights)
        if lights != sumo_map.lights:
            sumo_map = replace(sumo_map, lights=lights)
    if not signals.junctions:
        return _mapped_lights(sumo_map, signals.control, buses=signals.bus_priority)
    timings = {timing.junction: timing for timing in signals.junctions}
    until = scenario.simulation.duration if until is None else until
    realized_lights = []
    for light, view in zip(sumo_map.lights, scenario_lights(sumo_map), strict=True):
        own = [timings[name] for name in view.names if name in timings]
        timing = own[0] if own else JunctionTiming(junction=view.names[0])
        if timing.green and len(timing.green) != len(view.green):  # of a network of before
            timing = timing.model_copy(update={"green": ()})
        asked = signals.bus_priority if timing.bus_priority is None else timing.bus_priority
        control = signals.control_of(timing)
        realizing = _LightRealizer(light, view, timing, control, sumo_map, buses=asked)
        realized_lights.append(
            realizing.designed(scenario.demand.clock, until) if timing.stages else realizing.kept()
        )
    return tuple(realized_lights)


@lru_cache(maxsize=8)
def _mapped_lights(
    sumo_map: SumoMap, control: Control | None, *, buses: bool
) -> tuple[RealizedLight, ...]:
    """All lights as the map has them: the same for all scenarios that say no more of them."""
    return tuple(
        _LightRealizer(
            light, view, JunctionTiming(junction=view.names[0]), control, sumo_map, buses=buses
        ).kept()
        for light, view in zip(sumo_map.lights, scenario_lights(sumo_map), strict=True)
    )


class _LightRealizer:
    """One light."""

    def __init__(
        self,
        light: SumoLight,
        view: Light,
        timing: JunctionTiming,
        control: Control | None,
        sumo_map: SumoMap,
        *,
        buses: bool = False,
    ) -> None:
        self._buses = bus_areas(light, view, sumo_map.net) if buses else ()
        self._is_as_in_network = not self._buses and control in (None, sumo_map.control)
        control = control or sumo_map.control or "fixed"
        self._light = light
        self._view = view
        self._timing = timing
        # Buses prolong greens themselves, and what they take has to be given back.
        control = "fixed" if self._buses and control == "extended" else control
        self._control = control
        self._map = sumo_map
        self._net = sumo_map.net
        self._picture = ShownLight(light, view, control, sumo_map)

    def kept(self) -> RealizedLight:
        """The network's stages, perhaps with other greens, offset or control."""
        light, timing = self._light, self._timing
        phases = kept_phases(light, timing.green)
        offset = timing.offset or light.offset
        changed = [p.seconds for p in phases] != [p.duration for p in light.phases]
        loops: tuple[PlacedLoop, ...] = ()
        areas: tuple[CallArea, ...] = ()
        conditions: dict[str, str] = {}
        called = self._realize_called(phases) if self._control == "actuated" else None
        if called is not None:
            loops, areas, conditions = called.loops, called.areas, dict(called.conditions)
        elif self._control == "actuated":
            loops = self._place_loops({p.stage: p for p in phases if p.prolonged})
            phases = self._add_endings(phases, loops, conditions)
        elif self._control == "extended":
            phases = extended_phases(phases)
        plan = PhasePlan(tuple(phases), len(phases)) if called is None else called.plan
        if self._buses and self._control == "fixed":
            plan = bus_phases(plan, {p.stage: _green_links(p.state) for p in phases}, self._buses,
                              conditions)  # fmt: skip
            loops = idle_loops(light, self._net, self._buses)
        plans = (self._picture.plan(ONLY_PLAN, offset, plan),)
        shown = self._picture.program(
            self._picture.own_groups(), plans, loops, self._buses, own=False
        )
        if self._is_as_in_network and not changed and offset == light.offset:
            return RealizedLight(shown)
        kind = "actuated" if self._buses else TYPES[self._control]
        params = self._loop_params(loops)
        if called is not None:
            params |= {STAGES_PARAM: MAP_STAGES}
        if self._control == "extended":
            params |= EXTENDED_PARAMS
        start = started_offset(plan, offset)
        program = SumoProgram(ONLY_PLAN, kind, start, plan, conditions, params)
        return RealizedLight(shown, (program,), loops, buses=self._buses, areas=areas)

    def _realize_called(self, phases: Sequence[SumoPhase]) -> CalledLight | None:
        """The map's stages, which vehicles and people call, where there is a choice."""
        return called_light(
            self._light, self._view, self._net, phases, detectors=self._timing.detectors,
            buses=self._buses,
        )  # fmt: skip

    def _add_endings(
        self, phases: Sequence[SumoPhase], loops: Sequence[PlacedLoop], conditions: dict[str, str]
    ) -> list[SumoPhase]:
        """Say of the phase behind each prolonged one when it is to come."""
        result = list(phases)
        for index, phase in enumerate(phases):
            if not phase.prolonged:
                continue
            expression = may_end(loops, phase.stage, _green_links(phase.state))
            if not expression:
                result[index] = replace(result[index], least=0.0, most=0.0)
                continue
            name = f"end{phase.stage}"
            conditions[name] = ended_with_buses(expression, self._buses, _green_links(phase.state))
            after = (index + 1) % len(phases)
            result[after] = replace(result[after], early=name, final="1")
        return result

    def designed(self, clock: float, until: float) -> RealizedLight:
        """A program of the scenario."""
        program = DesignedProgram(self._timing, self._view, self._control)
        plans = program.plans()
        active = active_plans(plans, clock=clock, until=until)
        calling = calling_movements(program)
        walks = {n for n, movement in enumerate(self._view.movements) if movement.walk}
        loops = waiting_places(
            self._light, self._net, {name: own & walks for name, own in calling.items()}
        )
        if calling and self._control == "fixed":
            first = program.plans()[0].stages[0]
            shown = [n for g in sorted(first.groups) for n in program.groups[g].movements]
            cars = [n for n in shown if not self._view.movements[n].walk]
            loops = (*loops, *(idle_loop(self._light, self._net, n) for n in cars[:1]))
        if self._control == "actuated":
            stages = {s.id: s for plan in plans for s in plan.stages}
            loops = (
                *self._place_loops(
                    {
                        name: SumoPhase(0.0, "", "", name, stage.least, stage.most)
                        for name, stage in stages.items()
                    },
                    {
                        stage.id: {n for g in stage.groups for n in program.groups[g].movements}
                        for stage in stages.values()
                    },
                ),
                *loops,
            )
        every = call_areas(self._light, self._view, self._net, loops)
        wanted = {n for own in calling.values() for n in own}
        areas = tuple(area for area in every if wanted & set(area.movements))
        made: list[SumoProgram] = []
        shown_plans: list[ShownPlan] = []
        for plan in plans:
            if plan.id in {name for _, name in active}:
                sumo_program = self._make_program(program, plan, loops, areas)
                made.append(sumo_program)
                begins = tuple(time for time, name in active if name == plan.id)
                shown_plans.append(
                    self._picture.plan(plan.id, plan.offset, sumo_program.plan, begins)
                )
        groups = tuple(
            self._picture.group(group.id, group.movements) for group in program.groups.values()
        )
        shown_light = self._picture.program(
            groups, tuple(shown_plans), loops, self._buses, own=True
        )
        return RealizedLight(shown_light, tuple(made), loops, active, self._buses, areas)

    def _make_program(
        self,
        program: DesignedProgram,
        plan: TimedPlan,
        loops: Sequence[PlacedLoop],
        areas: Sequence[CallArea],
    ) -> SumoProgram:
        calling = calling_movements(program)
        conditions, ends, calls = {}, {}, {}
        for stage in plan.stages:
            green = {n for g in stage.groups for n in program.groups[g].movements}
            expression = may_end(loops, stage.id, green)
            if self._control == "actuated" and expression and stage.most > stage.least:
                ends[stage.id] = f"end{stage.id}"
                conditions[ends[stage.id]] = ended_with_buses(expression, self._buses, green)
            if stage.on_call:
                calls[stage.id] = f"call{stage.id}"
                conditions[calls[stage.id]] = called(loops, areas, stage.id, calling[stage.id])
        switched = bool(program.timing.plans) and (bool(loops) or self._control == "actuated")
        phases = plan_phases(program, plan, ends=ends, calls=calls, switched=switched)
        free = self._control == "fixed" and not phases.chooses
        params = self._loop_params(() if free else loops)
        params |= {
            f"{GROUP_PARAM}{group.id}": " ".join(map(str, group.movements))
            for group in program.groups.values()
        }
        params[CONTROL_PARAM] = self._control
        if program.timing.plans:
            before = sum(phase.seconds for phase in phases.phases[: phases.first])
            params["GSP"] = f"{before + 1:g}"
        offset = plan.offset
        cycle = kept_cycle(program, plan)
        if cycle is not None:
            params |= {"coordinated": "true", "cycleTime": f"{cycle:g}"}
            # The cycle is counted from the end of the first stage; SUMO errs before a positive one.
            offset = -(-(offset + plan.stages[0].green) % cycle)
        else:
            offset = started_offset(phases, offset)
        return SumoProgram(
            plan.id, "static" if free else "actuated", offset, phases, conditions, params
        )

    def _place_loops(
        self, stages: Mapping[str, SumoPhase], green: Mapping[str, set[int]] | None = None
    ) -> tuple[PlacedLoop, ...]:
        return vehicle_loops(
            self._light,
            self._view,
            self._net,
            designed=self._timing.detectors,
            green=green or {name: _green_links(phase.state) for name, phase in stages.items()},
            least={name: phase.least for name, phase in stages.items()},
        )

    def _loop_params(self, loops: Sequence[PlacedLoop]) -> dict[str, str]:
        """SUMO's parameters: one loop a lane as its own, the others only to be shown."""
        params = {
            f"linkSignalID:{n}": " ".join(names)
            for n, names in enumerate(self._light.signals)
            if names
        }
        if not loops:
            return params
        lanes = dict.fromkeys(
            link.source
            for link, movement in zip(self._light.links, self._view.movements, strict=True)
            if movement.drive
        )
        params |= dict.fromkeys(lanes, "NO_DETECTOR")
        extra = []
        for loop in loops:
            if params.get(loop.before) == "NO_DETECTOR":
                params[loop.before] = loop.id
            else:
                extra.append(loop.id)
        # Whether a lane counts for a stage is said by conditions, so SUMO need not judge.
        params |= {"jam-threshold": "3600", "passing-time": "0.001"}
        if extra:
            params["extra-detectors"] = " ".join(extra)
        return params


def _green_links(state: str) -> set[int]:
    return {n for n, letter in enumerate(state) if letter in "Gg"}
