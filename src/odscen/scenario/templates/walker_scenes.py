"""Scenes with a pedestrian who crosses away from crosswalks."""

from __future__ import annotations

import math
from enum import Enum
from itertools import product
from typing import TYPE_CHECKING, Any

from odscen.base.categories import Category
from odscen.scenario.templates.scene_sites import NoPlaceError, UnfitPlaceError, first_fit
from odscen.scenario.templates.scene_template import (
    CHILD,
    SceneTemplate,
    TemplateParameter,
    TemplateScene,
    at_once,
    beside,
    body_length,
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
            return _crossing_scene(site, wanted, reach, walker=walker, hidden=hides)
        except NoPlaceError as error:
            refused = error
    raise refused


def _crossing_scene(
    site: TemplateSite,
    values: Mapping[str, float],
    reach: float,
    *,
    walker: str,
    hidden: _HiddenBy,
) -> TemplateScene:
    speed, walking = values["ego_speed"], values["walking_speed"]
    lead_in = speed * values["approach"] + body_length(site, Category.CAR) / 2.0
    metres = _REAR + lead_in + speed * reach / walking + _BEYOND

    def place(stretch: LaneStretch) -> TemplateScene:
        near = near_side(site, stretch)
        parked_lane = beside(site, stretch, near) if hidden is _HiddenBy.IN_LANE else None
        along = stretch.along[-1] - _BEYOND
        beyond = _HIDDEN if hidden is _HiddenBy.AT_KERB else 0.0
        crossing = site.sides.crossing(stretch, along, near=near, beyond=beyond)
        if crossing.metres > reach:
            raise UnfitPlaceError(f"are more than {reach:.0f} m from the sidewalk")
        distance = speed * crossing.metres / walking
        start = node_near(site, stretch, crossing.along - distance - lead_in)
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
            parked, pose = _at_kerb(site, stretch, at, near)
            actors.append(parked)
            stays = [[0.0, *pose], [_FOR_EVER, *pose]]
            rules.append(at_once("parked", "parked", {"replay": {"rows": stays}}))
            seen = " It is hidden by a vehicle parked beside the lane."
        rules.append(_crossing_rule(walker, crossing, distance, walking))
        duration = values["approach"] + crossing.metres / walking + 20.0
        return TemplateScene(
            actors=tuple(actors),
            rules=tuple(rules),
            duration=math.ceil(duration),
            wanted=(
                f"Ego {kmh(speed)}, pedestrian {kmh(walking)}. The pedestrian starts when the "
                f"ego's front is {distance:.2f} m away, so that both are at the place where "
                f"their paths meet at one instant if the ego does not brake: the pedestrian "
                f"would be hit at 50 % of the ego's width.{seen}"
            ),
        )

    found, why = site.stretches.of_length(metres, bend=_STRAIGHT)
    what = "a pedestrian who crosses"
    return first_fit(found, why, place, what=what, map_name=site.region.graph.map_name)


def _park_vehicle(site: TemplateSite, lane: LaneStretch, front: float) -> dict[str, Any]:
    """Make a vehicle that stands with its front where is said, or up to a node's spacing before."""
    half = body_length(site, Category.CAR) / 2.0
    centre = front - half - site.region.graph.lanes.spacing / 2.0
    node = node_near(site, lane, centre)
    if metres_at(lane, node) > front - half:
        raise UnfitPlaceError("have no node for a vehicle where it is to stand")
    last = int(lane.nodes[-1])
    return vehicle(site, "parked", node, last, speed=CHILD, moving=False)


def _at_kerb(
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
    ),
    TemplateParameter("walking_speed", CHILD, 0.5, 4, "m/s", "speed of the pedestrian"),
    TemplateParameter("approach", 2, 0.5, 20, "s", "time before the pedestrian starts"),
)

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
            "least distance from the front of the stopped vehicle to the child's path",
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
    parameters=_SPEEDS,
    place=_mid_block,
)
