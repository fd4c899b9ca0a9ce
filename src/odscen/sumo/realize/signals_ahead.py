"""What the traffic lights of a network show on the lanes of the lane graph."""

from __future__ import annotations

from itertools import accumulate
from typing import TYPE_CHECKING, NamedTuple

from odscen.learning.traffic_snapshots import LightView, SignalAhead, no_lights
from odscen.scenario.document.signals_document import Signals

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from odscen.convert.lane_table.table import SumoLight
    from odscen.sumo.realize.sumo_map import SumoMap

AS_THE_MAP = Signals()
LightLog = list[tuple[float, str]]
"""Times (s) and states of one light, from each time on."""


class _LitLane(NamedTuple):
    row: int
    links: tuple[int, ...]


def lights_at(sumo_map: SumoMap, logs: Mapping[str, LightLog], time: float) -> LightView:
    """Find what lights show at a time of a run.

    Parameters
    ----------
    logs
        For each light, by its SUMO id, what it showed, in the order of time.
    time
        Seconds.
    """
    view = no_lights(len(sumo_map.graph.lanes.lanes.keys))
    for light in sumo_map.lights:
        shown = [log for log in logs.get(light.id, []) if log[0] <= time + 1e-6]
        for lane in _lit_lanes(sumo_map, light) if shown else ():
            states = [(since, _signal_seen(state, lane.links)) for since, state in shown]
            now = states[-1][1]
            began = next(
                (after[0] for before, after in _pairs_back(states) if before[1] != now),
                states[0][0],
            )
            view.state[lane.row] = now
            view.since[lane.row] = 0.0 if now == SignalAhead.NONE else max(time - began, 0.0)
    return view


def lights_at_start(sumo_map: SumoMap, signals: Signals = AS_THE_MAP) -> LightView:
    """Find what lights show when a run begins whose programs are those of the map.

    For how long they have shown it is counted as if the programs had been running before.

    Parameters
    ----------
    signals
        Of a scenario; their offsets count, other changes of programs are not looked at.
    """
    offsets = {timing.junction: timing.offset for timing in signals.junctions if timing.offset}
    logs = {}
    for light in sumo_map.lights:
        names = (light.id, *map(str, light.junctions))
        offset = next((offsets[name] for name in names if name in offsets), light.offset)
        logs[light.id] = _log_cycle_before_start(light, offset)
    return lights_at(sumo_map, logs, 0.0)


def _log_cycle_before_start(light: SumoLight, offset: float) -> LightLog:
    """States of one cycle up to second 0, and what is shown then.

    SUMO's programs are at ``time - offset`` of their cycle.
    """
    phases = light.phases
    ends = [*accumulate(phase.duration for phase in phases)]
    cycle = ends[-1] if ends else 0.0
    if cycle <= 0.0:
        return [(0.0, phases[0].state)] if phases else []
    place = -offset % cycle
    starts = [0.0, *ends[:-1]]
    log = [(start - place, phase.state) for start, phase in zip(starts, phases, strict=True)]
    log += [(time - cycle, state) for time, state in log]
    return sorted(pair for pair in log if pair[0] <= 0.0)


def _lit_lanes(sumo_map: SumoMap, light: SumoLight) -> Iterable[_LitLane]:
    """Lanes of the lane graph whose end is at a stop line of the light."""
    rows = {str(key): row for row, key in enumerate(sumo_map.graph.lanes.lanes.keys)}
    lit_lanes: dict[int, list[int]] = {}
    for place, link in enumerate(light.links):
        row = rows.get(sumo_map.lane_names.get(link.source, ""))
        if row is not None:
            lit_lanes.setdefault(row, []).append(place)
    return [_LitLane(row, tuple(links)) for row, links in lit_lanes.items()]


def _signal_seen(state: str, links: Sequence[int]) -> SignalAhead:
    letters = {state[link] for link in links if link < len(state)}
    for wanted, shown in (("Gg", SignalAhead.GREEN), ("yYu", SignalAhead.YELLOW)):
        if letters & set(wanted):
            return shown
    return SignalAhead.RED if letters & set("rs") else SignalAhead.NONE


def _pairs_back(
    states: Sequence[tuple[float, SignalAhead]],
) -> Iterable[tuple[tuple[float, SignalAhead], tuple[float, SignalAhead]]]:
    """Neighbours in the list, the last first."""
    for place in range(len(states) - 1, 0, -1):
        yield states[place - 1], states[place]
