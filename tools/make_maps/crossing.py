"""Junctions with every movement, and their furniture."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from tools.make_maps import furniture
from tools.make_maps.geometry import turn_between
from tools.make_maps.parts import car_lanes

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scenariogeneration import xodr

    from tools.make_maps.builder import Builder, Link
    from tools.make_maps.parts import End, LaneSpec

STRAIGHT = math.pi / 4
"""Turns by less than this count as straight on."""

Pairs = list[tuple[int, int]]


def crossing(
    builder: Builder,
    ends: Sequence[End],
    *,
    control: str = "none",
    major: Sequence[int] = (),
    crosswalks: bool = True,
    name: str = "",
    speed: float = 30.0,
    kind: str = "town",
    country: str = "DE",
) -> xodr.Junction:
    """Add a junction with every movement, and its furniture.

    Parameters
    ----------
    builder
        The map so far.
    ends
        The road ends that meet.
    control
        ``lights``, ``stop``, ``yield`` or ``none`` (right before left).
    major
        Positions of the ends that have priority where signs rule.
    crosswalks
        Whether each arm has one.
    name
        Name of the junction.
    speed
        Limit in km/h on the connecting roads.
    kind
        Road type of the connecting roads.
    country
        Whose signs it has: one of :data:`tools.make_maps.furniture.SIGNS`.
    """
    junction = builder.new_junction(ends, name)
    links: list[Link] = []
    for start in ends:
        for end, pairs in movements(start, [e for e in ends if e is not start]):
            links.append(builder.connect(junction, start, end, pairs, speed=speed, kind=kind))
    back = furniture.STOP_LINE if crosswalks else furniture.STOP_LINE_ALONE
    for number, end in enumerate(ends):
        if crosswalks:
            furniture.crosswalk(builder, end)
        if crosswalks or (control != "none" and number not in major):
            furniture.stop_line(builder, end, back=back)
        furniture.solid_lines(end)
    if control == "lights":
        furniture.lights(builder, junction, ends, links, crosswalks=crosswalks)
    elif control != "none":
        furniture.signs(builder, junction, ends, control, major, back=back, country=country)
    return junction


def movements(start: End, exits: Sequence[End]) -> list[tuple[End, Pairs]]:
    """All movements from ``start``: exit and lane pairs.

    Bicycle lanes and sidewalks go with the rightmost movement of the rightmost lane for cars;
    bicycle lanes also straight on.
    """
    coming = start.lanes(arriving=True)
    lanes = car_lanes(coming)
    exits = [end for end in exits if car_lanes(end.lanes(arriving=False))]
    if not lanes or not exits:
        return []
    turns = [turn_between(start.approach, end.departure) for end in exits]
    found: list[tuple[End, Pairs]] = []
    for end, turn in sorted(zip(exits, turns, strict=True), key=lambda item: item[1]):
        going = end.lanes(arriving=False)
        rightmost = turn == min(turns)
        for pair in _lane_pairs(lanes, car_lanes(going), turn, turns):
            curb = rightmost and pair[0] == lanes[-1]
            found.append((end, [pair, *(_curb_pairs(coming, going, pair) if curb else [])]))
        if abs(turn) < STRAIGHT and not rightmost:
            found += [(end, [pair]) for pair in _bike_pairs(coming, going)]
    used = {i for _, pairs in found for i, _ in pairs}
    if missing := [lane for lane in lanes if lane not in used]:
        raise ValueError(f"lanes {missing} of road {start.record.id} lead nowhere")
    return found


def _lane_pairs(
    coming: Sequence[int], going: Sequence[int], turn: float, turns: Sequence[float]
) -> Pairs:
    """Left turns from the inner lane, right turns from the outer one, straight on from all.

    Where fewer lanes go straight on, the inner ones only turn left, if there is a left turn at all.
    Where none does, the lanes of a road of more than two are shared by both turns.
    """
    if len(coming) > 2 and all(abs(one) > STRAIGHT for one in turns):
        half = min((len(coming) + 1) // 2 if len(turns) > 1 else len(coming), len(going))
        if turn > STRAIGHT:
            return list(zip(coming[:half], going[:half], strict=True))
        return list(zip(coming[-half:], going[-half:], strict=True))
    if turn > STRAIGHT:
        return [(coming[0], going[0])]
    if turn < -STRAIGHT:
        return [(coming[-1], going[-1])]
    count = min(len(coming), len(going))
    if len(coming) > 1 and any(other < -STRAIGHT for other in turns) and max(turns) < STRAIGHT:
        return list(zip(coming[:count], going[:count], strict=True))
    return list(zip(coming[-count:], going[-count:], strict=True))


def _curb_pairs(
    coming: Sequence[LaneSpec], going: Sequence[LaneSpec], pair: tuple[int, int]
) -> Pairs:
    """Lanes beside the rightmost one that both roads have."""
    pairs = []
    for step in range(1, len(coming) - pair[0]):
        i, j = pair[0] + step, pair[1] + step
        if j >= len(going) or coming[i].kind != going[j].kind:
            break
        pairs.append((i, j))
    return pairs


def _bike_pairs(coming: Sequence[LaneSpec], going: Sequence[LaneSpec]) -> Pairs:
    ins = [i for i, lane in enumerate(coming) if lane.kind == "biking"]
    outs = [j for j, lane in enumerate(going) if lane.kind == "biking"]
    return list(zip(ins, outs, strict=False))
