"""Loops of a SUMO file as detectors of a scenario: at which lane, how far from the stop line."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from odscen.convert.lane_table.table import SumoLight
    from odscen.formats.tll_file import FileLoop
    from odscen.scenario.signals.light import Light
    from odscen.sumo.realize.road_net import RoadNet

_SHORTEST_LOOP = 0.1
"""Metres of a loop: SUMO's have none if they do not say."""

_NAME = re.compile(r"[^A-Za-z0-9_.-]+")


class TakenLoop(NamedTuple):
    """A loop: SUMO's lane at the stop line, movements over it, metres, and a name or nothing."""

    lane: str
    movements: tuple[int, ...]
    before: float
    length: float
    name: str


def taken_loops(loops: Iterable[FileLoop], light: SumoLight, net: RoadNet) -> dict[str, TakenLoop]:
    """Loops for vehicles that lie before the stop lines of a light, by their ids."""
    movements: dict[str, list[int]] = {}
    for number, link in enumerate(light.links):
        movements.setdefault(link.source, []).append(number)
    taken = {}
    for loop in loops:
        if loop.persons or loop.lane not in net.lanes:
            continue
        stop_line = _find_stop_line(loop, movements, net)
        if stop_line is not None:
            lane, metres = stop_line
            length = max(loop.length, _SHORTEST_LOOP)
            taken[loop.id] = TakenLoop(
                lane, tuple(movements[lane]), round(metres, 2), round(length, 2), loop.name
            )
    return taken


def _find_stop_line(
    loop: FileLoop, stop_lines: Mapping[str, object], net: RoadNet
) -> tuple[str, float] | None:
    """Lane at the stop line that a loop leads to, and the metres from its front end to there."""
    pos = loop.pos if loop.pos >= 0.0 else net.lanes[loop.lane].length + loop.pos
    todo = [(net.lanes[loop.lane].length - pos - loop.length, loop.lane)]
    seen = {loop.lane}
    # Nearest lane first, so that of several stop lines the next one is found.
    while todo:
        todo.sort()
        metres, lane = todo.pop(0)
        if lane in stop_lines:
            return lane, metres
        for link in net.links_from.get(lane, ()):
            onto = link.via or link.target
            if onto not in seen:
                seen.add(onto)
                todo.append((metres + net.lanes[onto].length, onto))
    return None


def taken_detectors(
    gaps: Mapping[str, Mapping[str, float]], loops: Mapping[str, TakenLoop], light: Light
) -> list[dict[str, Any]]:
    """Detectors of a scenario; loops of one name in all lanes of an approach are one of them.

    Parameters
    ----------
    gaps
        Seconds by loop, of each stage.
    """
    together: dict[tuple[str, str, float, float, tuple[str, ...], float], list[str]] = {}
    for name, loop in loops.items():
        stages = tuple(stage for stage, some in gaps.items() if name in some)
        if stages:
            gap = max(some[name] for some in gaps.values() if name in some)
            approach = light.movements[loop.movements[0]].approach
            own = loop.name or name
            key = (own, approach, loop.before, loop.length, stages, gap)
            together.setdefault(key, []).append(name)
    detectors: list[dict[str, Any]] = []
    taken: set[str] = set()
    for (own, approach, before, length, stages, gap), names in together.items():
        covered = {n for name in names for n in loops[name].movements}
        everything = {
            n for n, m in enumerate(light.movements) if m.approach == approach and m.drive
        }
        places = (
            [approach]
            if covered == everything
            else [light.movements[loops[name].movements[0]].lanes[0] for name in names]
        )
        for place in places:
            row = {"before": before, "length": length, "stages": list(stages), "gap": gap}
            detectors.append({"id": _make_unique_name(own, taken), "at": place, **row})
    return detectors


def _make_unique_name(name: str, taken: set[str]) -> str:
    plain = _NAME.sub("-", name).strip("-.") or "D"
    unique, number = plain[:60], 1
    while unique in taken:
        number += 1
        unique = f"{plain[:56]}-{number}"
    taken.add(unique)
    return unique
