"""Lights along a corridor coordinated: one cycle, offsets for the widest bands, a picture."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from odscen.app.maps import map_of
from odscen.app.scenarios import given_scenario
from odscen.app.signals.program_editing import take_over_program
from odscen.app.signals.signal_optimisation import chosen_lights
from odscen.base.errors import InputError, NotFoundError
from odscen.drawing.time_space import DiagramBand, DiagramLight, time_space_svg
from odscen.scenario.checks.signal_checks import signal_problems
from odscen.scenario.document.problems import refuse_errors
from odscen.scenario.document.signals_document import JunctionTiming
from odscen.scenario.signals.green_wave import (
    LEAST_BAND,
    Band,
    WaveLight,
    green_bands,
    widest_offsets,
)
from odscen.sumo.calibrate.corridor_lights import CorridorFinder, wave_lights
from odscen.sumo.calibrate.light_timing import (
    merged_phases,
    plan_at,
    retimed,
    stretched,
    timing_of,
    with_greens,
    with_timings,
)
from odscen.sumo.realize.lights.light_realization import realized_lights

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.app.maps import LoadedMap
    from odscen.base.given_files import GivenPath
    from odscen.maps.store import Workspace
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.signals.green_wave import Favoured
    from odscen.sumo.calibrate.corridor_lights import CorridorDirection
    from odscen.sumo.calibrate.light_timing import LightTimes

COORDINATION = "corridor"
"""Name of the coordination of lights with programs of their own."""


@dataclass(frozen=True, slots=True)
class CoordinatedLight:
    """A light of the corridor: metres from the first one, its offset (s), and its windows."""

    junctions: tuple[str, ...]
    metres: float
    offset: float
    wave: WaveLight


@dataclass(frozen=True, slots=True)
class Coordination:
    """Lights of a corridor with one cycle and offsets.

    Attributes
    ----------
    scenario
        With the new times.
    cycle
        Seconds.
    lights
        In the order of the corridor.
    out, back
        Bands along the corridor and back; 0 s wide where one cannot drive.
    before
        Seconds of both bands with the cycle, but all offsets as they were.
    """

    scenario: Scenario
    cycle: float
    lights: tuple[CoordinatedLight, ...]
    out: Band
    back: Band
    before: tuple[float, float]

    @property
    def worth_it(self) -> bool:
        """Whether a direction has a band that vehicles fit into."""
        return max(self.out.seconds, self.back.seconds) >= LEAST_BAND

    @property
    def doubts(self) -> tuple[str, ...]:
        """Which direction has no band to speak of, in sentences."""
        narrow = [
            (name, band)
            for name, band in (("along", self.out), ("back", self.back))
            if band.seconds < LEAST_BAND
        ]
        if len(narrow) == 2:
            return (
                f"There is no green wave: neither direction has a band of {LEAST_BAND:g} s; give "
                "another cycle or speed, or fewer lights.",
            )
        return tuple(
            f"There is no green wave {name}: its band of {band.seconds:.1f} s lets no vehicle "
            "through that others follow."
            for name, band in narrow
        )

    def to_words(self) -> tuple[str, ...]:
        """What has come of it, in sentences."""
        offsets = ", ".join(
            f"{', '.join(light.junctions)}: {light.offset:g} s" for light in self.lights
        )
        bands = zip(("along", "back"), (self.out, self.back), self.before, strict=True)
        return (
            f"All {len(self.lights)} lights have a cycle of {self.cycle:g} s; offsets: {offsets}.",
            *(
                f"Band {name}: {band.seconds:.0f} s, {100.0 * band.seconds / self.cycle:.0f} % of "
                f"the cycle (was {before:.0f} s)."
                for name, band, before in bands
            ),
            *self.doubts,
        )

    def to_dict(self) -> dict[str, Any]:
        """All of it but the scenario, as data; bandwidths in seconds and as share of the cycle."""
        return {
            "cycle": self.cycle,
            "bands": {
                name: {**band._asdict(), "share": band.seconds / self.cycle}
                for name, band in (("out", self.out), ("back", self.back))
            },
            "worth_it": self.worth_it,
            "doubts": list(self.doubts),
            "bands_before": dict(zip(("out", "back"), self.before, strict=True)),
            "lights": [
                {
                    "junctions": list(light.junctions),
                    "metres": light.metres,
                    "offset": light.offset,
                    "out_time": light.wave.out_time,
                    "back_time": light.wave.back_time,
                    "out": [window._asdict() for window in light.wave.out],
                    "back": [window._asdict() for window in light.wave.back],
                }
                for light in self.lights
            ],
        }

    def to_svg(self) -> str:
        """Time-space diagram: time to the right, distance upwards."""
        lights = [
            DiagramLight(
                ", ".join(light.junctions), light.metres, light.offset,
                tuple(light.wave.out), tuple(light.wave.back),
            )
            for light in self.lights
        ]  # fmt: skip
        bands = []
        if self.out.seconds:
            times = tuple(self.out.begin + light.wave.out_time for light in self.lights)
            bands.append(DiagramBand("out", times, self.out.seconds))
        if self.back.seconds:
            times = tuple(self.back.begin + light.wave.back_time for light in self.lights)
            bands.append(DiagramBand("back", times, self.back.seconds))
        return time_space_svg(lights, bands, cycle=self.cycle, title=self.scenario.name)


def coordinate_signals(
    workspace: Workspace,
    scenario: Scenario | GivenPath,
    *,
    junctions: Sequence[str] = (),
    along: Sequence[str] = (),
    favoured: Favoured = "both",
    speed: float | None = None,
    cycle: float | None = None,
) -> Coordination:
    """Give lights along a corridor one cycle, and the offsets with the widest bands.

    Stages and their order stay; greens are stretched in proportion where the cycle of a light is
    another. Actuated lights with the map's stages become fixed-time ones; those with bus priority
    get the map's program as an actuated one of the scenario, in which buses get green earlier while
    the light keeps its place in the cycle.

    Parameters
    ----------
    workspace
        Has the map.
    scenario
        The scenario, or its file; it is not changed.
    junctions
        Lights in driving order.
    along
        Instead: roads, by segment (``r12``), id or name; all lights that one comes to over them.
    favoured
        Direction whose band is the wider one: ``out`` is in the order of the lights.
    speed
        Progression speed, m/s; the speed limits if not given.
    cycle
        Seconds; the longest of the lights if not given.

    Returns
    -------
    Coordination
        The scenario with the new times, and the bands in which one drives without a stop.

    Raises
    ------
    InputError
        If there are fewer than two lights, one cannot drive from one to the next, another light
        lies between, or the cycle is too short for a light.
    NotFoundError
        If a junction has no light, or the map has no such road.
    ScenarioError
        With every problem of the signals.
    """
    scenario = given_scenario(scenario)
    loaded = map_of(workspace, scenario)
    if bool(junctions) == bool(along):
        raise InputError(
            "name either the junctions of the corridor or the roads along which it leads"
        )
    if speed is not None and not speed > 0.0:
        raise InputError(f"a progression speed of {speed:g} m/s: it has to be positive")
    refuse_errors(signal_problems(scenario.signals, loaded.lights))
    finder = CorridorFinder(loaded.sumo)
    numbers = chosen_lights(loaded, junctions) if junctions else _order_lights_along(loaded, along)
    if len(numbers) < 2:
        named = ", ".join(junctions or along)
        raise InputError(
            f"a corridor needs two traffic lights, but {named:.200} has {len(numbers)}"
        )
    if along:
        numbers = finder.in_order(numbers)
    scenario = _keep_priority(workspace, scenario, [loaded.lights[n].names for n in numbers])
    return _coordinate_lights(scenario, loaded, finder, numbers, favoured, speed, cycle)


def _keep_priority(
    workspace: Workspace, scenario: Scenario, lights: Sequence[tuple[str, ...]]
) -> Scenario:
    """Give lights with bus priority programs that come back to their place in the cycle."""
    for names in lights:
        timing = timing_of(scenario, names)
        own = None if timing is None else timing.bus_priority
        asked = scenario.signals.bus_priority if own is None else own
        if not asked or (timing is not None and timing.stages):
            continue
        entry = timing or JunctionTiming(junction=names[0])
        # Buses change the length of stages, which only an actuated program has.
        entry = entry.model_copy(update={"control": "actuated", "bus_priority": True})
        scenario = take_over_program(workspace, with_timings(scenario, [entry]), names[0])
    return scenario


def _coordinate_lights(
    scenario: Scenario,
    loaded: LoadedMap,
    finder: CorridorFinder,
    numbers: Sequence[int],
    favoured: Favoured,
    speed: float | None,
    cycle: float | None,
) -> Coordination:
    out = finder.direction(numbers, speed=speed)
    back = finder.direction(numbers[::-1], speed=speed)
    views = [loaded.lights[n] for n in numbers]
    names = [", ".join(view.names) for view in views]
    if out is None and back is None:
        raise InputError(
            f"one cannot drive through junctions {' - '.join(names)} in this order, nor back"
        )
    shown = [realized_light.shown for realized_light in realized_lights(scenario, loaded.sumo)]
    plans = [plan_at(shown[n], 0.0) for n in numbers]
    cycle = cycle or max(plan.cycle for plan in plans)
    times = [
        stretched(shown[n], view, timing_of(scenario, view.names), cycle)
        for n, view in zip(numbers, views, strict=True)
    ]
    phases = [
        with_greens(merged_phases(plan.phases), passing.green)
        for plan, passing in zip(plans, times, strict=True)
    ]
    waves = wave_lights(out, back, phases)
    offsets = widest_offsets(waves, cycle, favoured=favoured)
    entries = [
        _retime_with_offset(scenario, passing, offset, default=loaded.sumo.lights[n].offset)
        for passing, offset, n in zip(times, offsets, numbers, strict=True)
    ]
    new = with_timings(scenario, entries)
    refuse_errors(signal_problems(new.signals, loaded.lights))
    metres = _distances_from_first(out, back)
    lights = tuple(
        CoordinatedLight(view.names, at, offset, wave)
        for view, at, offset, wave in zip(views, metres, offsets, waves, strict=True)
    )
    before = green_bands(waves, [plan.offset for plan in plans], cycle)
    bands = green_bands(waves, offsets, cycle)
    return Coordination(new, cycle, lights, *bands, (before[0].seconds, before[1].seconds))


def _distances_from_first(
    out: CorridorDirection | None, back: CorridorDirection | None
) -> tuple[float, ...]:
    """Metres of each light from the first one."""
    if out is not None:
        return out.metres
    assert back is not None
    return tuple(back.metres[-1] - metres for metres in back.metres[::-1])


def _retime_with_offset(
    scenario: Scenario, times: LightTimes, offset: float, *, default: float
) -> JunctionTiming:
    timing = timing_of(scenario, times.junctions)
    if timing is not None and timing.stages:
        more = {} if times.plan else {"coordination": timing.coordination or COORDINATION}
        return retimed(scenario, times, hold=True, offset=offset, **more)
    # No offset means that of the map's program.
    own = offset if offset or not default else times.cycle
    return retimed(scenario, times, offset=own, control="fixed")


def _order_lights_along(loaded: LoadedMap, roads: Sequence[str]) -> list[int]:
    """Lights that one comes to over roads."""
    segments = loaded.sumo.graph.segments
    chosen: set[str] = set()
    for road in roads:
        ids = {road}
        found = _segments_of(loaded, ids)
        if not found:
            ids = _roads_called(loaded, road)
            found = _segments_of(loaded, ids)
        if not found:
            what = "road"
            known = [name for name, kind in zip(segments.ids, segments.kinds, strict=True)
                     if kind == "road"]  # fmt: skip
            raise NotFoundError(what, road, known)
        chosen |= found
    return [
        number
        for number, light in enumerate(loaded.lights)
        if chosen & {movement.approach for movement in light.movements if not movement.walk}
    ]


def _segments_of(loaded: LoadedMap, roads: set[str]) -> set[str]:
    segments = loaded.sumo.graph.segments
    return {
        str(name)
        for name, kind, parts in zip(segments.ids, segments.kinds, segments.parts, strict=True)
        if kind == "road" and (name in roads or any(part.road in roads for part in parts))
    }


def _roads_called(loaded: LoadedMap, name: str) -> set[str]:
    """Ids of the roads with a name in the file of the map."""
    from odscen.opendrive.parse import parse

    roads = parse(loaded.entry.read("xodr"), file=str(loaded.entry.path("xodr"))).roads
    return {str(road.id) for road in roads.values() if road.name == name}
