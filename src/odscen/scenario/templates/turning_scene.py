"""The scene of a pedestrian who crosses the road into which the ego turns."""

from __future__ import annotations

import math
from collections import Counter
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.base.categories import Category
from odscen.lanegraph.graphs import Relation
from odscen.scenario.templates.scene_sites import LaneStretch, UnfitPlaceError, first_fit
from odscen.scenario.templates.scene_template import (
    CHILD,
    SceneTemplate,
    TemplateParameter,
    TemplateScene,
    at_once,
    body_length,
    kmh,
    near_side,
    node_near,
    pedestrian,
    rule,
    vehicle,
)

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from odscen.base.arrays import BoolArray
    from odscen.scenario.templates.scene_template import TemplateSite

_REAR = 6.0
_TURN = math.radians(60.0), math.radians(120.0)
"""Between these a change of heading is a turn."""
_BEHIND = 14.0, 30.0
"""Metres behind the junction between which the pedestrian crosses."""
_ONWARD = 12.0
_FIRST, _LAST = 40, 400
"""Nodes of the lane before a junction, and of a path, that are looked at."""


class _Turn(NamedTuple):
    """A path through a junction.

    Attributes
    ----------
    path
        From the lane before it on.
    exit
        Its part on the lane behind.
    begin
        Metres along the path at which that begins.
    """

    path: LaneStretch
    exit: LaneStretch
    begin: float


def _place_turning(site: TemplateSite, values: Mapping[str, float]) -> TemplateScene:
    why: Counter[str] = Counter()
    turns = {id(turn.path): turn for turn in _find_turns(site, why)}

    def place(path: LaneStretch) -> TemplateScene:
        turn = turns[id(path)]
        for behind in np.arange(*_BEHIND, 2.0).tolist():
            try:
                return _place_at_turn(site, turn, behind, values)
            except UnfitPlaceError as error:
                unfit = error
        raise unfit

    paths = [turn.path for turn in turns.values()]
    what = "a pedestrian who crosses where the ego turns"
    return first_fit(paths, why, place, what=what, map_name=site.region.graph.map_name)


def _place_at_turn(
    site: TemplateSite, turn: _Turn, behind: float, values: Mapping[str, float]
) -> TemplateScene:
    speed, walking = values["ego_speed"], values["walking_speed"]
    if turn.exit.along[-1] < behind + _ONWARD:
        raise UnfitPlaceError("have a lane behind the junction that is too short")
    near = near_side(site, turn.exit)
    crossing = site.sides.crossing(turn.exit, behind, near=near)
    distance = speed * crossing.metres / walking
    lead_in = distance + speed * values["approach"] + body_length(site, Category.CAR) / 2.0
    at = turn.begin + crossing.along - lead_in
    if at < _REAR:
        raise UnfitPlaceError("have a lane before the junction that is too short for the ego")
    start = node_near(site, turn.path, at)
    if not site.stretches.plain[start]:
        raise UnfitPlaceError("would have the ego start in the junction")
    far = {
        "of": "ego", "place": list(crossing.meets), "along": "lane", "below": round(distance, 3),
    }  # fmt: skip
    walk = {"to": crossing.end, "through": [list(crossing.meets)], "speed": round(walking, 4)}
    when = {"all": [{"rule": {"id": "wait", "has": "started"}}, {"distance": far}]}
    return TemplateScene(
        actors=(
            vehicle(site, "ego", start, int(turn.exit.nodes[-1]), speed=speed, ego=True,
                    ignores_red=True),
            pedestrian("walker", crossing),
        ),
        rules=(
            at_once("wait", "walker", {"stop": {}}),
            rule("cross", "walker", when, {"walk": walk}),
        ),
        duration=math.ceil(values["approach"] + crossing.metres / walking + 60.0),
        wanted=(
            f"Ego {kmh(speed)}, pedestrian {kmh(walking)}. The pedestrian starts when the ego's "
            f"front is {distance:.2f} m away along its turn, so that both are at the place where "
            f"their paths meet at one instant if the ego keeps its speed."
        ),
    )  # fmt: skip


def _find_turns(site: TemplateSite, why: Counter[str]) -> Iterator[_Turn]:
    """Paths over a lane and through a junction onto another road, in the map's order."""
    lanes = site.region.graph.lanes
    junction = np.array(
        [junction is not None for junction in lanes.lanes.junctions], dtype=np.bool_
    )
    follows = lanes.relation == Relation.SUCCESSOR
    after: dict[int, list[tuple[int, float]]] = {}
    edges = zip(lanes.source[follows], lanes.target[follows], lanes.length[follows], strict=True)
    for source, target, metres in edges:
        after.setdefault(int(source), []).append((int(target), float(metres)))
    drivable = site.stretches.drivable
    for row in np.flatnonzero(~junction).tolist():
        first, end = (int(lanes.lanes.first_node[row + n]) for n in (0, 1))
        nodes = list(range(max(first, end - _FIRST), end))
        if not site.stretches.plain[nodes].all():
            continue
        for begin, metres in after.get(nodes[-1], ()):
            if not junction[lanes.lane[begin]]:
                continue
            turn = _follow_turn(site, nodes, (begin, metres), after, junction[lanes.lane])
            if turn is None or not drivable[turn.path.nodes].all():
                continue
            out = turn.exit.nodes[0]
            angle = math.remainder(float(lanes.hdg[out] - lanes.hdg[nodes[-1]]), math.tau)
            if _TURN[0] <= abs(angle) <= _TURN[1]:
                yield turn
            else:
                why["are no turns"] += 1


def _follow_turn(
    site: TemplateSite,
    nodes: list[int],
    first: tuple[int, float],
    after: Mapping[int, list[tuple[int, float]]],
    inside: BoolArray,
) -> _Turn | None:
    """Follow a lane into a junction, and the one behind it to its end."""
    lanes = site.region.graph.lanes
    steps = [float(s) for s in np.hypot(np.diff(lanes.x[nodes]), np.diff(lanes.y[nodes]))]
    path, node = list(nodes), first[0]
    steps.append(first[1])
    path.append(node)
    out: int | None = None
    while len(path) < _LAST:
        if not inside[node]:
            out = len(path) - 1 if out is None else out
            if not site.stretches.plain[node]:
                return None
        ways = after.get(node, [])
        if len(ways) != 1 or (out is not None and inside[ways[0][0]]):
            break
        node, metres = ways[0]
        path.append(node)
        steps.append(metres)
    if out is None:
        return None
    along = np.concatenate([[0.0], np.cumsum(steps)])
    rows = np.array(path, dtype=np.int64)
    behind = LaneStretch(rows[out:], along[out:] - along[out], 0.0)
    return _Turn(LaneStretch(rows, along, 0.0), behind, float(along[out]))


TURNING = SceneTemplate(
    name="turning",
    title="Pedestrian where the ego turns",
    summary="The ego turns at a junction; a pedestrian crosses the road that it turns into.",
    source="Euro NCAP AEB VRU, CPTA (turning adult): the ego at 10 to 20 km/h, the pedestrian at "
    "5 km/h, hit at 50 % of the width.",
    needs="a junction with a turn, and a sidewalk on either side of the road behind it",
    parameters=(
        TemplateParameter("ego_speed", 15 / 3.6, 2, 12, "m/s", "speed of the ego", "Ego speed"),
        TemplateParameter(
            "walking_speed", CHILD, 0.5, 4, "m/s", "speed of the pedestrian", "Pedestrian speed"
        ),
        TemplateParameter(
            "approach", 1, 0.2, 20, "s", "time before the pedestrian starts", "Lead time"
        ),
    ),
    place=_place_turning,
)
