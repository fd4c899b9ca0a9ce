"""What the records of a run say of a traffic light: its groups, plans and detectors."""

from __future__ import annotations

from itertools import count
from typing import TYPE_CHECKING

from odscen.records.light_programs import (
    LightProgram,
    ProgramPhase,
    ShownGroup,
    ShownPlan,
)
from odscen.scenario.signals.light import shortest_names
from odscen.sumo.realize.lights.actuated.detector_places import shown_bus_areas, shown_detectors

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.convert.lane_table.table import SumoLight
    from odscen.scenario.document.signals_document import Control
    from odscen.scenario.signals.light import Light
    from odscen.sumo.realize.lights.light_detectors import BusArea, PlacedLoop
    from odscen.sumo.realize.lights.stage_phases import PhasePlan
    from odscen.sumo.realize.sumo_map import SumoMap


class ShownLight:
    """One light, under the control that it has in the run."""

    def __init__(self, light: SumoLight, view: Light, control: Control, sumo_map: SumoMap) -> None:
        self._light = light
        self._view = view
        self._control = control
        self._map = sumo_map
        self._net = sumo_map.net

    def program(
        self,
        groups: tuple[ShownGroup, ...],
        plans: tuple[ShownPlan, ...],
        loops: Sequence[PlacedLoop],
        buses: Sequence[BusArea],
        *,
        own: bool,
    ) -> LightProgram:
        """All of it; ``own`` says whether the program is the scenario's."""
        light = self._light
        detectors = (
            *shown_detectors(loops, light, self._map),
            *shown_bus_areas(buses, plans, self._map),
        )
        return LightProgram(
            light.id, self._view.names, self._control, own, groups, plans, detectors
        )

    def plan(
        self, name: str, offset: float, plan: PhasePlan, begins: tuple[float, ...] = ()
    ) -> ShownPlan:
        """One cycle of a plan, and at which seconds of the run it takes over."""
        phases = []
        for p in plan.cycle:
            free = self._control != "fixed" and p.prolonged and p.earliest_end is None
            least, most = (p.least, p.most) if free else (0.0, 0.0)
            phases.append(ProgramPhase(p.seconds, p.state, p.name, p.stage, least, most, p.on_call))
        return ShownPlan(name, offset, tuple(phases), begins)

    def group(self, name: str, links: tuple[int, ...]) -> ShownGroup:
        """A signal group with the lanes of its movements; ``links`` are places in the states."""
        movements = self._view.movements
        walk = bool(movements) and all(movements[n].walk for n in links)
        lanes = tuple(self._lanes_of_link(n) for n in links)
        names = shortest_names(links, movements) if movements else ()
        paths = tuple(self._light.links[n].path for n in links)
        return ShownGroup(name, links, names, walk, () if walk else lanes, paths)

    def own_groups(self) -> tuple[ShownGroup, ...]:
        """Groups of the network's program: links that always show the same, but for who yields."""
        if not self._light.links:
            return ()
        columns: dict[tuple[str, ...], list[int]] = {}
        for n, movement in enumerate(self._view.movements):
            if not movement.turn:
                continue
            shown = tuple(phase.state[n].lower() for phase in self._light.phases)
            columns.setdefault((movement.approach, str(movement.walk), *shown), []).append(n)
        names = {True: count(1), False: count(1)}
        groups = []
        for links in columns.values():
            walk = self._view.movements[links[0]].walk
            name = f"{'P' if walk else 'V'}{next(names[walk])}"
            groups.append(self.group(name, tuple(links)))
        return tuple(groups)

    def _lanes_of_link(self, n: int) -> tuple[str, ...]:
        """Lane before the light, and the lanes of a link inside the junction."""
        link = self._light.links[n]
        onto = next(
            (
                onward.via
                for onward in self._net.links_from.get(link.source, ())
                if onward.target == link.target
            ),
            None,
        )
        if onto is None:
            return link.source, link.target
        return link.source, onto, *(lane.id for lane in self._net.leaving(onto)[:-1])
