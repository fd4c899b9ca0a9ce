"""Scenes with a pedestrian who crosses away from crosswalks."""

from __future__ import annotations

import math
from enum import Enum
from itertools import product
from typing import TYPE_CHECKING, Any

from odscen.base.categories import Category
from odscen.base.errors import InputError
from odscen.scenario.templates.scene_sites import NoPlaceError, UnfitPlaceError, first_fit
from odscen.scenario.templates.scene_template import (
    CHILD,
    NO_COLLISION,
    SceneTemplate,
    TemplateParameter,
    TemplateScene,
    at_once,
    beside,
    body_length,
    exact_start,
    kmh,
    metres_at,
    near_side,
    node_near,
    pedestrian,
    rule,
    vehicle,
)

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.scenario.templates.scene_sites import LaneStretch, RoadCrossing
    from odscen.scenario.templates.scene_template import TemplateSite

_REAR = 6.0
_STRAIGHT = 0.05
_EGO_SPEEDS = tuple(speed / 3.6 for speed in (40, 35, 30, 25, 20))
"""m/s; of the protocol's 10 to 60 km/h in steps of 5, those that are tried."""
_BEYOND = 12.0
"""Metres of the stretch behind the place where the paths meet."""
_KERB, _HIDDEN = 0.1, 1.0
"""Metres beside the lane at which a vehicle is parked, and at which a hidden one is at least."""
_FOR_EVER = 3600.0
_FIRST_STEP = 0.3
"""Metres that a pedestrian walks at least before the ego's front is at its path."""
_REACHES = (4.0, 7.0, 10.0, 14.0)
"""Metres from the sidewalk to that place, at most; short ones first, they need the least road."""


class _HiddenBy(Enum):
    """Where the vehicle stands that hides a pedestrian."""

    NOTHING = "nothing"
    IN_LANE = "lane"
    AT_KERB = "kerb"


def _runs_out(
    site: TemplateSite, values: Mapping[str, float], *, walker: str, hidden: Sequence[_HiddenBy]
) -> TemplateScene:
    given = values.get("ego_speed")
    speeds = _EGO_SPEEDS if given is None else (given,)
    for hides, speed, reach in product(hidden, speeds, _REACHES):
        try:
            wanted = {**values, "ego_speed": speed}
            return _crossing_scene(site, (wanted,), reach, walker=walker, hidden=hides)
        except NoPlaceError as error:
            refused = error
    raise refused


def _mid_block_of(site: TemplateSite, sets: Sequence[Mapping[str, float]]) -> TemplateScene:
    for reach in _REACHES:
        try:
            return _crossing_scene(site, sets, reach, walker="walker", hidden=_HiddenBy.NOTHING)
        except NoPlaceError as error:
            refused = error
    raise refused


def _crossing_scene(
    site: TemplateSite,
    sets: Sequence[Mapping[str, float]],
    reach: float,
    *,
    walker: str,
    hidden: _HiddenBy,
) -> TemplateScene:
    """Place it with the first of several sets of numbers, and with room for each of them."""
    values = sets[0]
    speed, walking = values["ego_speed"], values["walking_speed"]
    half = body_length(site, Category.CAR) / 2.0
    width = site.usable.bodies[Category.CAR].width
    metres = max(
        _REAR
        + each["ego_speed"] * each["approach"]
        + half
        + each["ego_speed"] * _walked_metres(reach, each["hit"], width) / each["walking_speed"]
        + _BEYOND
        for each in sets
    )

    def place(stretch: LaneStretch) -> TemplateScene:
        near = near_side(site, stretch)
        parked_lane = beside(site, stretch, near) if hidden is _HiddenBy.IN_LANE else None
        along = stretch.along[-1] - _BEYOND
        beyond = _HIDDEN if hidden is _HiddenBy.AT_KERB else 0.0
        crossing = site.sides.crossing(stretch, along, near=near, beyond=beyond)
        if crossing.metres > reach:
            raise UnfitPlaceError(f"are more than {reach:.0f} m from the sidewalk")
        if min(_walked_metres(crossing.metres, each["hit"], width) for each in sets) < _FIRST_STEP:
            raise UnfitPlaceError("are so near to the sidewalk that the ego would be past first")
        # Its centre is to be at this share of the ego's width, from the side that it comes from.
        distance = speed * _walked_metres(crossing.metres, values["hit"], width) / walking
        farthest = max(
            each["ego_speed"]
            * (
                _walked_metres(crossing.metres, each["hit"], width) / each["walking_speed"]
                + each["approach"]
            )
            for each in sets
        )
        start = node_near(site, stretch, crossing.along - farthest - half)
        ego = vehicle(site, "ego", start, int(stretch.nodes[-1]), speed=speed, ego=True)
        actors = [ego, pedestrian(walker, crossing)]
        rules = [at_once("wait", walker, {"stop": {}})]
        seen = ""
        if parked_lane is not None:
            actors.append(_park_vehicle(site, parked_lane, crossing.along - values["clearance"]))
            rules.append(at_once("parked", "parked", {"stop": {}}))
            seen = " It is hidden by a vehicle stopped in the lane at the kerb."
        elif hidden is _HiddenBy.AT_KERB:
            at = crossing.along - values["clearance"]
            parked, pose = _park_at_kerb(site, stretch, at, near)
            actors.append(parked)
            stays = [[0.0, *pose], [_FOR_EVER, *pose]]
            rules.append(at_once("parked", "parked", {"replay": {"rows": stays}}))
            seen = " It is hidden by a vehicle parked beside the lane."
        rules.append(_crossing_rule(walker, crossing, distance, walking))
        duration = max(
            each["approach"] + crossing.metres / each["walking_speed"] + 20.0 for each in sets
        )
        if len(sets) > 1:
            duration += farthest / min(each["ego_speed"] for each in sets)
        walks = f"{crossing.metres - width / 2.0:.4f} + {width:.4f} * $hit"
        return TemplateScene(
            actors=tuple(actors),
            rules=tuple(rules),
            duration=math.ceil(duration),
            formulas={
                ("actors", "ego", "speed"): "$ego_speed",
                ("actors", "ego", "initial_speed"): "$ego_speed",
                ("rules", "cross", "when", "all", 1, "distance", "below"): (
                    f"$ego_speed * ({walks}) / $walking_speed"
                ),
                ("rules", "cross", "then", 0, "walk", "speed"): "$walking_speed",
            },
            wanted=(
                f"Ego {kmh(speed)}, pedestrian {kmh(walking)}. The pedestrian starts when the "
                f"ego's front is {distance:.2f} m away, so that both are at the place where "
                f"their paths meet at one instant if the ego does not brake: the pedestrian "
                f"would be hit at {values['hit'] * 100:.0f} % of the ego's width.{seen}"
            ),
        )

    found, why = site.stretches.of_length(metres, bend=_STRAIGHT)
    what = "a pedestrian who crosses"
    return first_fit(found, why, place, what=what, map_name=site.region.graph.map_name)


def _walked_metres(metres: float, hit: float, width: float) -> float:
    """Metres that a pedestrian walks from its start until the ego's front is at its path."""
    return metres - (0.5 - hit) * width


def _park_vehicle(site: TemplateSite, lane: LaneStretch, front: float) -> dict[str, Any]:
    """Make a vehicle that stands with its front where is said, or up to a node's spacing before."""
    half = body_length(site, Category.CAR) / 2.0
    centre = front - half - site.region.graph.lanes.spacing / 2.0
    node = node_near(site, lane, centre)
    if metres_at(lane, node) > front - half:
        raise UnfitPlaceError("have no node for a vehicle where it is to stand")
    last = int(lane.nodes[-1])
    return vehicle(site, "parked", node, last, speed=CHILD, moving=False)


def _park_at_kerb(
    site: TemplateSite, lane: LaneStretch, front: float, near: int
) -> tuple[dict[str, Any], list[float]]:
    """Make a vehicle that is parked beside a lane, and the pose of its body's centre."""
    body = site.usable.bodies[Category.CAR]
    centre = front - body.length / 2.0
    node = node_near(site, lane, centre)
    lanes = site.region.graph.lanes
    hdg, ahead = float(lanes.hdg[node]), centre - metres_at(lane, node)
    aside = near * (float(lanes.width[node]) / 2.0 + body.width / 2.0 + _KERB)
    c, s = math.cos(hdg), math.sin(hdg)
    x = float(lanes.x[node]) + ahead * c - aside * s
    y = float(lanes.y[node]) + ahead * s + aside * c
    parked = vehicle(site, "parked", node, int(lane.nodes[-1]), speed=CHILD, moving=False)
    return parked, [round(x, 3), round(y, 3), round(math.remainder(hdg, math.tau), 5)]


def _crossing_rule(
    walker: str, crossing: RoadCrossing, distance: float, walking: float
) -> dict[str, Any]:
    far = {
        "of": "ego", "place": list(crossing.meets), "along": "lane", "below": round(distance, 3),
    }  # fmt: skip
    walk = {"to": crossing.end, "through": [list(crossing.meets)], "speed": round(walking, 4)}
    when = {"all": [{"rule": {"id": "wait", "has": "started"}}, {"distance": far}]}
    return rule("cross", walker, when, {"walk": walk})


def _child_scene(site: TemplateSite, values: Mapping[str, float]) -> TemplateScene:
    return _runs_out(site, values, walker="child", hidden=(_HiddenBy.IN_LANE, _HiddenBy.AT_KERB))


def _mid_block(site: TemplateSite, values: Mapping[str, float]) -> TemplateScene:
    return _runs_out(site, values, walker="walker", hidden=(_HiddenBy.NOTHING,))


_SPEEDS = (
    TemplateParameter(
        "ego_speed",
        None,
        2,
        30,
        "m/s",
        "speed of the ego; default: the highest of 40, 35, 30, 25 and 20 km/h that has room",
        "Ego speed",
    ),
    TemplateParameter(
        "walking_speed", CHILD, 0.5, 4, "m/s", "speed of the pedestrian", "Pedestrian speed"
    ),
    TemplateParameter(
        "approach", 2, 0.5, 20, "s", "time before the pedestrian starts", "Lead time"
    ),
    TemplateParameter(
        "hit", 0.5, 0.1, 0.9, "",
        "share of the ego's width, from the side of the pedestrian, at which it would be hit",
        "Impact point",
    ),
)  # fmt: skip

HIDDEN_CHILD = SceneTemplate(
    name="hidden-child",
    title="Child from behind a parked car",
    summary="A child comes out in front of a vehicle stopped at the kerb, into the ego's path.",
    source="Euro NCAP AEB VRU, CPNCO-50 (nearside child from obstruction): child at 5 km/h, hit at "
    "50 % of the width; the ego at 10 to 60 km/h, here at 40 or less.",
    needs="a sidewalk on either side of a road; where it has one lane, the vehicle is beside it",
    parameters=(
        *_SPEEDS,
        TemplateParameter(
            "clearance", 1, 0.3, 5, "m",
            "least distance from the front of the stopped vehicle to the child's path", "Clearance",
        ),
    ),
    place=_child_scene,
)  # fmt: skip
MID_BLOCK = SceneTemplate(
    name="mid-block",
    title="Pedestrian mid-block",
    summary="A pedestrian crosses the road between two junctions, where there is no crosswalk.",
    source="Euro NCAP AEB VRU: walking adult at 5 km/h from the near side, the ego at 10 to "
    "60 km/h, here at 40 or less.",
    needs="a sidewalk on either side of a road, away from crosswalks",
    parameters=(*_SPEEDS[:-1], _SPEEDS[-1]._replace(low=-4.0, high=10.0)),
    place=_mid_block,
    place_open=_mid_block_of,
)


_FASTER = 1.5
"""Speed that the van reaches in front of the ego, over that of the ego."""
_AFTER_CUT_IN = 0.5
"""Seconds from the end of the van's change of lanes to the start of the pedestrian, at least."""


def _van_and_walker(site: TemplateSite, values: Mapping[str, float]) -> TemplateScene:
    for reach in _REACHES:
        try:
            return _van_scene(site, values, reach)
        except NoPlaceError as error:
            refused = error
    raise refused


def _van_scene(site: TemplateSite, values: Mapping[str, float], reach: float) -> TemplateScene:
    ego, van, over = values["ego_speed"], values["van_speed"], values["over"]
    closing, distance = ego - van, values["distance"]
    if closing < 1.0:
        raise InputError(
            f"ego_speed must be at least 1 m/s above van_speed ({van:g} m/s), not {ego:g} m/s"
        )
    length = body_length(site, Category.CAR)
    halves = (length + body_length(site, Category.VAN)) / 2.0
    ahead = halves + (values["ttc"] + values["approach"]) * closing
    lead_in = length / 2.0 + ego * (values["approach"] + over + _AFTER_CUT_IN) + distance
    metres = _REAR + max(lead_in, ahead) + _BEYOND

    def place(stretch: LaneStretch) -> TemplateScene:
        near = near_side(site, stretch)
        lane = beside(site, stretch, -near)
        crossing = site.sides.crossing(stretch, stretch.along[-1] - _BEYOND, near=near)
        if crossing.metres > reach:
            raise UnfitPlaceError(f"are more than {reach:.0f} m from the sidewalk")
        start = node_near(site, stretch, crossing.along - lead_in)
        first, beyond = exact_start(site, lane, metres_at(stretch, start) + ahead)
        last = int(stretch.nodes[-1])
        faster = {"speed": {"to": round(ego * _FASTER, 4), "rate": values["acceleration"]}}
        change = {"lane": {"by": near, "over": over}}
        far = {
            "of": "ego", "place": list(crossing.meets), "along": "lane",
            "below": round(distance, 3),
        }  # fmt: skip
        walk = {
            "to": crossing.end, "through": [list(crossing.meets)],
            "speed": round(values["walking_speed"], 4),
        }  # fmt: skip
        return TemplateScene(
            actors=(
                vehicle(site, "ego", start, last, speed=ego, ego=True),
                vehicle(
                    site, "van", first, int(lane.nodes[-1]), speed=van, category=Category.VAN,
                    longitudinal_offset=beyond,
                ),
                pedestrian("walker", crossing),
            ),
            rules=(
                at_once("wait", "walker", {"stop": {}}),
                rule(
                    "cut-in", "van", {"ttc": {"of": "ego", "to": "van", "below": values["ttc"]}},
                    {"together": [change, faster]},
                ),
                rule("cross", "walker", {"distance": far}, {"walk": walk}),
            ),
            duration=math.ceil(values["approach"] + over + distance / ego + reach + 60.0),
            wanted=(
                f"Ego {kmh(ego)}, van {kmh(van)}. The van changes into the ego's lane at a time "
                f"to collision of {values['ttc']:g} s, and drives on faster than the ego. The "
                f"pedestrian, at {kmh(values['walking_speed'])}, begins to cross when the ego's "
                f"front is {distance:g} m away, {crossing.metres:.2f} m from the middle of its "
                f"lane."
            ),
            criteria=(NO_COLLISION, "stopped(ego) == 1", "min_distance(ego,walker) >= 0.5 m"),
        )  # fmt: skip

    found, why = site.stretches.of_length(metres, bend=_STRAIGHT)
    what = "a van that cuts in and a pedestrian who crosses"
    return first_fit(found, why, place, what=what, map_name=site.region.graph.map_name)


VAN_AND_WALKER = SceneTemplate(
    name="van-and-walker",
    title="Cut-in, then a pedestrian",
    summary="A van cuts in ahead of the ego, and then a pedestrian crosses between two junctions; "
    "the ego is to stop before the pedestrian.",
    source="No protocol: the numbers are odscen's choice.",
    needs="two lanes of one direction, and a sidewalk on either side of the road",
    parameters=(
        TemplateParameter("ego_speed", 6, 2, 30, "m/s", "speed of the ego", "Ego speed"),
        TemplateParameter(
            "van_speed", 3, 1, 28, "m/s", "speed of the van before it changes lanes", "Van speed"
        ),
        TemplateParameter(
            "ttc",
            3,
            0.5,
            10,
            "s",
            "time to collision with the van at which it changes lanes",
            "Time to collision",
        ),
        TemplateParameter(
            "over", 2, 1, 10, "s", "duration of the lane change", "Lane-change duration"
        ),
        TemplateParameter(
            "acceleration", 2, 0, 5, "m/s2", "of the van as it changes lanes", "Van acceleration"
        ),
        TemplateParameter(
            "distance",
            30,
            2,
            100,
            "m",
            "from the ego's front to the pedestrian who starts",
            "Distance to the pedestrian",
        ),
        TemplateParameter(
            "walking_speed", 1, 0.5, 4, "m/s", "speed of the pedestrian", "Pedestrian speed"
        ),
        TemplateParameter(
            "approach", 2, 0.5, 20, "s", "time before the van changes lanes", "Lead time"
        ),
    ),
    place=_van_and_walker,
)


def _place_reversing(site: TemplateSite, values: Mapping[str, float]) -> TemplateScene:
    for reach in _REACHES:
        try:
            return _reversing_scene(site, values, reach)
        except NoPlaceError as error:
            refused = error
    raise refused


def _reversing_scene(
    site: TemplateSite, values: Mapping[str, float], reach: float
) -> TemplateScene:
    speed, walking = values["reversing_speed"], values["walking_speed"]
    length = body_length(site, Category.CAR)
    room = speed * reach / walking + length
    metres = _BEYOND + room + length + _REAR

    def place(stretch: LaneStretch) -> TemplateScene:
        near = near_side(site, stretch)
        crossing = site.sides.crossing(stretch, _BEYOND, near=near)
        if crossing.metres > reach:
            raise UnfitPlaceError(f"are more than {reach:.0f} m from the sidewalk")
        seconds = crossing.metres / walking
        node, offset = exact_start(site, stretch, crossing.along + speed * seconds + length / 2.0)
        begin = _pose_on(site, node, offset)
        back = speed * (seconds + values["beyond"])
        end = _pose_on(site, node, offset - back)
        rows = [[0.0, *begin], [round(seconds + values["beyond"], 4), *end]]
        starts = {"time": {"after": values["approach"]}}
        walk = {
            "to": crossing.end, "through": [list(crossing.meets)], "speed": round(walking, 4),
        }  # fmt: skip
        ego = vehicle(
            site, "ego", node, int(stretch.nodes[-1]), speed=CHILD, moving=False, ego=True,
            longitudinal_offset=offset, driver="story",
        )  # fmt: skip
        return TemplateScene(
            actors=(ego, pedestrian("walker", crossing)),
            rules=(
                at_once("wait", "walker", {"stop": {}}),
                rule("reverse", "ego", starts, {"replay": {"rows": rows}}),
                rule("cross", "walker", starts, {"walk": walk}),
            ),
            duration=math.ceil(values["approach"] + seconds + values["beyond"] + 60.0),
            wanted=(
                f"The ego reverses at {kmh(speed)}, a pedestrian crosses behind it at "
                f"{kmh(walking)}. Both start after {values['approach']:g} s; after "
                f"{seconds:.2f} s more the ego's rear is where the pedestrian is in the middle of "
                f"its lane."
            ),
        )

    found, why = site.stretches.of_length(metres, bend=_STRAIGHT)
    what = "a vehicle that reverses"
    return first_fit(found, why, place, what=what, map_name=site.region.graph.map_name)


def _pose_on(site: TemplateSite, node: int, ahead: float) -> list[float]:
    """X, y and heading so many metres ahead of a node on a straight lane."""
    lanes = site.region.graph.lanes
    hdg = float(lanes.hdg[node])
    x = float(lanes.x[node]) + ahead * math.cos(hdg)
    y = float(lanes.y[node]) + ahead * math.sin(hdg)
    return [round(x, 4), round(y, 4), round(math.remainder(hdg, math.tau), 6)]


REVERSING = SceneTemplate(
    name="reversing",
    title="Reversing",
    summary="The ego reverses towards a pedestrian who crosses behind it.",
    source="Euro NCAP AEB VRU, CPRA (reversing, adult): the ego at 4 or 8 km/h, the pedestrian at "
    "5 km/h, hit at 50 % of the width.",
    needs="a sidewalk on either side of a road, away from crosswalks",
    parameters=(
        TemplateParameter(
            "reversing_speed", 4 / 3.6, 0.3, 6, "m/s", "speed of the ego", "Ego speed"
        ),
        TemplateParameter(
            "walking_speed", CHILD, 0.5, 4, "m/s", "speed of the pedestrian", "Pedestrian speed"
        ),
        TemplateParameter(
            "approach", 2, 0.5, 20, "s", "time before the pedestrian starts", "Lead time"
        ),
        TemplateParameter(
            "beyond",
            1,
            0,
            10,
            "s",
            "time that it reverses on behind the pedestrian's path",
            "Time behind the path",
        ),
    ),
    place=_place_reversing,
)
