"""The scene of a vehicle that runs a red light."""

from __future__ import annotations

import math
from collections import Counter
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from shapely import LineString

from odscen.lanegraph.query import node_id
from odscen.scenario.templates.scene_sites import LaneStretch, UnfitPlaceError, first_fit
from odscen.scenario.templates.scene_template import (
    SceneTemplate,
    TemplateParameter,
    TemplateScene,
    at_once,
    kmh,
    metres_at,
    node_near,
    rule,
    vehicle,
)

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from odscen.scenario.signals.light import Light, SignalMovement
    from odscen.scenario.templates.scene_template import TemplateSite

_FRONT = 4.0
"""Metres from the stop line to the middle of the ego that waits: half its length, and a little."""
_STARTING = 2.6
"""m/s2 with which SUMO's cars start."""
_STEADY = 2.2
"""Seconds of constant speed of the ego before the paths cross."""
_PASSING = 3.0
"""Seconds after which the runner has left the place where the paths cross."""
_LONGEST = 120.0
"""Metres from the runner's start to the stop line, at most."""


class _CrossingPaths(NamedTuple):
    """Two movements through a light that cross: paths with their ends at the far side."""

    light: Light
    ego: LaneStretch
    runner: LaneStretch
    movement: SignalMovement
    stop_line: float
    runner_line: float


def _red_light(site: TemplateSite, values: Mapping[str, float]) -> TemplateScene:
    why: Counter[str] = Counter()
    meetings = {
        id(crossing_movement.ego): crossing_movement
        for crossing_movement in _crossing_movements(site, why)
    }

    def place(stretch: LaneStretch) -> TemplateScene:
        return _place_at_light(site, meetings[id(stretch)], values)

    candidates = [meeting.ego for meeting in meetings.values()]
    what = "a vehicle that runs a red light"
    map_name = site.region.graph.map_name
    return first_fit(candidates, why, place, what=what, map_name=map_name)


def _place_at_light(
    site: TemplateSite, found: _CrossingPaths, values: Mapping[str, float]
) -> TemplateScene:
    graph = site.region.graph
    mine, theirs = _find_meeting_nodes(site, found)
    ego, fast = values["ego_speed"], values["speed"]
    needed = ego**2 / (2.0 * _STARTING) + ego * _STEADY
    at = min(found.stop_line - _FRONT, metres_at(found.ego, mine) - needed)
    if at < _FRONT:
        raise UnfitPlaceError("have a lane before the light that is too short for the ego")
    start = node_near(site, found.ego, at)
    ego_metres = metres_at(found.ego, mine) - metres_at(found.ego, start)
    # Both begin at rest, and the other one's speed is in the proportion of their metres.
    runner_metres = ego_metres * fast / ego
    spot = metres_at(found.runner, theirs) - runner_metres
    if spot < 0.0:
        raise UnfitPlaceError(
            "have a lane before the light that is too short for the other vehicle"
        )
    if spot > found.runner_line - _FRONT:
        raise UnfitPlaceError("would have the other vehicle start behind its stop line")
    runner = node_near(site, found.runner, spot)
    shows = {"light": found.light.names[0], "movement": found.movement.exact_name}
    green = {"signal": shows | {"shows": "green"}, "edge": "rising"}
    arrive = {"at": node_id(graph, theirs), "to": "ego", "when_at": node_id(graph, mine)}
    return TemplateScene(
        actors=(
            vehicle(site, "ego", start, int(found.ego.nodes[-1]), speed=ego, moving=False,
                    ego=True),
            vehicle(site, "runner", runner, int(found.runner.nodes[-1]), speed=fast, moving=False,
                    driver="story"),
        ),
        rules=(
            at_once("hold", "ego", {"stop": {}}),
            at_once("wait", "runner", {"ignore": {"red": True, "right_of_way": True}},
                    {"stop": {}}),
            rule("green", "ego", {"all": [{"rule": {"id": "hold"}}, green]}, {"release": {}}),
            rule("run", "runner",
                 {"all": [{"rule": {"id": "wait"}},
                          {"rule": {"id": "green", "has": "started"}}]},
                 {"arrive": arrive}, {"speed": {"to": round(fast, 4), "shape": "step"}}),
            # A story that drives on would take the next bend at any speed.
            rule("past", "runner", {"rule": {"id": "run", "has": "ended"}, "delay": _PASSING},
                 {"release": {}}, {"drive": {"by": "sumo"}}),
        ),
        duration=180.0,
        wanted=(
            f"The ego starts when its light turns green. The other vehicle does not heed its red "
            f"light and is where the paths cross at the instant at which the ego is there; the "
            f"ego then drives at {kmh(ego)}, the other one at about {kmh(fast)}."
        ),
    )  # fmt: skip


def _crossing_movements(site: TemplateSite, why: Counter[str]) -> Iterator[_CrossingPaths]:
    """Pairs of movements straight through a light from different legs, in the map's order."""
    names = {name: row for row, name in enumerate(map(str, site.region.graph.lanes.lanes.keys))}
    for light in site.lights:
        paths = []
        for movement in light.movements:
            if movement.turn == "straight" and movement.lanes[0] in names:
                path = _path_through_junction(site, names[movement.lanes[0]], movement.lanes[1])
                if path is not None:
                    paths.append((movement, *path))
        pairs = [
            _CrossingPaths(light, path[1], other[1], path[0], path[2], other[2])
            for path in paths
            for other in paths
            if path[0].approach != other[0].approach
        ]
        if not pairs:
            why["have no two movements straight on from different legs"] += 1
        yield from pairs


def _path_through_junction(
    site: TemplateSite, row: int, out: str
) -> tuple[LaneStretch, float] | None:
    """Path over a lane and through a junction, and the metres at which the junction begins."""
    lanes, stretches = site.region.graph.lanes, site.stretches
    first, last = (int(lanes.lanes.first_node[row + number]) for number in (0, 1))
    nodes = list(range(max(first, last - int(_LONGEST / lanes.spacing)), last))
    if not stretches.plain[nodes].all():
        return None
    before = len(nodes) - 1
    exit_nodes = 0
    for follower in _nodes_behind(site, nodes[-1], out):
        nodes.append(follower)
        exit_nodes += 1
    if not exit_nodes:
        return None
    steps = [
        math.dist((lanes.x[a], lanes.y[a]), (lanes.x[b], lanes.y[b])) for a, b in pairwise(nodes)
    ]
    along = np.concatenate([[0.0], np.cumsum(steps)])
    return LaneStretch(np.array(nodes), along, 0.0), float(along[before])


def _nodes_behind(site: TemplateSite, node: int, out: str) -> list[int]:
    """Nodes behind the end of a lane up to some metres on the lane ``out``."""
    lanes = site.region.graph.lanes
    router = site.stretches.router
    keys = lanes.lanes.keys
    rows = [row for row, key in enumerate(keys) if str(key) == out]
    if not rows:
        return []
    there = int(lanes.lanes.first_node[rows[0]])
    beyond = min(there + int(20.0 / lanes.spacing), int(lanes.lanes.first_node[rows[0] + 1]) - 1)
    path = router.path(node, beyond).tolist()
    return (
        [int(node_behind) for node_behind in path[1:]]
        if len(path) < int(100.0 / lanes.spacing)
        else []
    )


def _find_meeting_nodes(site: TemplateSite, found: _CrossingPaths) -> tuple[int, int]:
    """Nodes of both paths next to where they cross.

    Raises
    ------
    UnfitPlaceError
        If they do not cross.
    """
    lanes = site.region.graph.lanes
    lines = [
        LineString(np.stack([lanes.x[stretch.nodes], lanes.y[stretch.nodes]], axis=1))
        for stretch in (found.ego, found.runner)
    ]
    crossed = lines[0].intersection(lines[1])
    if crossed.is_empty or crossed.geom_type != "Point":
        raise UnfitPlaceError("are two movements whose paths do not cross at one place")
    nodes = []
    for stretch in (found.ego, found.runner):
        away = np.hypot(lanes.x[stretch.nodes] - crossed.x, lanes.y[stretch.nodes] - crossed.y)
        nodes.append(int(stretch.nodes[np.argmin(away)]))
    if not all(metres_at(placed_path, node) > line for placed_path, node, line in (
        (found.ego, nodes[0], found.stop_line), (found.runner, nodes[1], found.runner_line),
    )):  # fmt: skip
        raise UnfitPlaceError("cross before the stop line")
    return nodes[0], nodes[1]


RED_LIGHT = SceneTemplate(
    name="red-light",
    title="Red-light runner",
    summary="The ego starts at green; a vehicle from another leg runs its red light and is where "
    "the paths cross at the same instant.",
    source="No protocol: the numbers are odscen's choice.",
    needs="a traffic light with movements straight on from two legs that cross",
    parameters=(
        TemplateParameter(
            "ego_speed",
            25 / 3.6,
            2,
            12,
            "m/s",
            "speed of the ego where the paths cross",
            "Ego speed",
        ),
        TemplateParameter(
            "speed",
            50 / 3.6,
            3,
            30,
            "m/s",
            "speed of the other vehicle where the paths cross",
            "Speed of the other vehicle",
        ),
    ),
    place=_red_light,
)
