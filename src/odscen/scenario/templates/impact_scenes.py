"""Scenes of active safety along a lane: stopped car, bicycle, cut-out, drift."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from odscen.base.categories import Category
from odscen.base.errors import InputError
from odscen.scenario.templates.scene_sites import UnfitPlaceError, first_fit
from odscen.scenario.templates.scene_template import (
    NO_COLLISION,
    SceneTemplate,
    TemplateParameter,
    TemplateScene,
    apart,
    at_once,
    beside,
    body_length,
    driven,
    exact_start,
    kmh,
    metres_at,
    near_side,
    node_near,
    rule,
    vehicle,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.scenario.templates.scene_sites import LaneStretch
    from odscen.scenario.templates.scene_template import TemplateSite

_REAR = 6.0
"""Metres from the beginning of a stretch to the middle of the first vehicle."""
_BEYOND = 20.0
"""Metres of a stretch behind the place of the impact."""
_STRAIGHT = 0.02
"""Radians that a stretch may bend: places are those on a straight line."""


def _place_stationary(site: TemplateSite, values: Mapping[str, float]) -> TemplateScene:
    speed, overlap, ttc = values["ego_speed"], values["overlap"], values["ttc"]
    length, width = body_length(site, Category.CAR), site.usable.bodies[Category.CAR].width
    gap = speed * ttc

    def place(stretch: LaneStretch) -> TemplateScene:
        near = near_side(site, stretch)
        start = node_near(site, stretch, _REAR)
        there = metres_at(stretch, start) + length + gap
        target, beyond = exact_start(site, stretch, there)
        last = int(stretch.nodes[-1])
        # Each half of it beside the middle: both bodies stay in narrow lanes.
        beside = round(near * (1.0 - overlap) * width / 2.0, 3)
        stands = vehicle(
            site, "target", target, last, speed=speed, moving=False, driver="story",
            longitudinal_offset=beyond, lateral_offset=beside,
        )  # fmt: skip
        ego = vehicle(site, "ego", start, last, speed=speed, ego=True, lateral_offset=-beside)
        return TemplateScene(
            actors=(ego, stands),
            rules=(at_once("stands", "target", {"stop": {}}),),
            duration=math.ceil(ttc + 60.0),
            wanted=(
                f"Ego {kmh(speed)}, {gap:.2f} m behind a stopped car, a time to collision of "
                f"{ttc:g} s. Bodies overlap by {overlap * 100:.0f} % of their width."
            ),
        )

    metres = _REAR + 2.0 * length + gap + _BEYOND
    found, why = site.stretches.of_length(metres, bend=_STRAIGHT)
    what = "a stopped car ahead"
    return first_fit(found, why, place, what=what, map_name=site.region.graph.map_name)


STATIONARY = SceneTemplate(
    name="stationary",
    title="Stopped car ahead",
    summary="The ego approaches a stopped car that is in front of a part of its width.",
    source="Euro NCAP car-to-car rear stationary (CCRs): the ego at 10 to 80 km/h, overlap 50, 75 "
    "or 100 %, from a time to collision of 4 s on.",
    needs="a straight lane between junctions",
    parameters=(
        TemplateParameter("ego_speed", 50 / 3.6, 2, 60, "m/s", "speed of the ego", "Ego speed"),
        TemplateParameter(
            "overlap",
            0.5,
            0.1,
            1,
            "",
            "share of the ego's width that the target is in front of",
            "Overlap",
        ),
        TemplateParameter(
            "ttc", 4, 1, 20, "s", "time to collision at the start", "Time to collision"
        ),
    ),
    place=_place_stationary,
)


def _bicycle_ahead(site: TemplateSite, values: Mapping[str, float]) -> TemplateScene:
    speed, slow, ttc = values["ego_speed"], values["bicycle_speed"], values["ttc"]
    closing = speed - slow
    if closing < 1.0:
        raise InputError(
            f"ego_speed must be at least 1 m/s above bicycle_speed ({slow:g} m/s), not "
            f"{speed:g} m/s"
        )
    length, width = body_length(site, Category.CAR), site.usable.bodies[Category.CAR].width
    halves = (length + body_length(site, Category.BICYCLE)) / 2.0
    gap = closing * ttc

    def place(stretch: LaneStretch) -> TemplateScene:
        near = near_side(site, stretch)
        start = node_near(site, stretch, _REAR)
        there = metres_at(stretch, start) + halves + gap
        node, beyond = exact_start(site, stretch, there)
        last = int(stretch.nodes[-1])
        bicycle = vehicle(
            site, "bicycle", node, last, speed=slow, category=Category.BICYCLE, driver="story",
            longitudinal_offset=beyond,
            lateral_offset=round(near * (0.5 - values["hit"]) * width, 3),
        )  # fmt: skip
        return TemplateScene(
            actors=(vehicle(site, "ego", start, last, speed=speed, ego=True), bicycle),
            rules=(),
            duration=math.ceil(ttc + 60.0),
            wanted=(
                f"Ego {kmh(speed)}, bicycle {kmh(slow)}, {gap:.2f} m ahead: a time to collision "
                f"of {ttc:g} s. It would be hit at {values['hit'] * 100:.0f} % of the ego's width."
            ),
        )

    metres = _REAR + halves + length + speed * ttc + _BEYOND
    found, why = site.stretches.of_length(metres, bend=_STRAIGHT)
    what = "a bicycle ahead"
    return first_fit(found, why, place, what=what, map_name=site.region.graph.map_name)


BICYCLE_AHEAD = SceneTemplate(
    name="bicycle-ahead",
    title="Bicycle ahead",
    summary="The ego approaches a bicycle that drives at the side of its lane.",
    source="Euro NCAP AEB VRU, CBLA (longitudinal adult cyclist): the ego at 25 to 80 km/h, the "
    "bicycle at 20 km/h for a hit at 25 % of the width and at 15 km/h at 50 %.",
    needs="a straight lane between junctions",
    parameters=(
        TemplateParameter("ego_speed", 50 / 3.6, 2, 60, "m/s", "speed of the ego", "Ego speed"),
        TemplateParameter(
            "bicycle_speed", 20 / 3.6, 1, 12, "m/s", "speed of the bicycle", "Bicycle speed"
        ),
        TemplateParameter(
            "hit", 0.25, 0.1, 0.9, "",
            "share of the ego's width, from the side of the kerb, at which it would be hit",
            "Impact point",
        ),
        TemplateParameter(
            "ttc", 4, 1, 20, "s", "time to collision at the start", "Time to collision"
        ),
    ),
    place=_bicycle_ahead,
)  # fmt: skip


def _cut_out(site: TemplateSite, values: Mapping[str, float]) -> TemplateScene:
    speed, over, ttc = values["ego_speed"], values["over"], values["ttc"]
    if ttc <= over:
        raise InputError(f"ttc must be above over ({over:g} s), not {ttc:g} s")
    length = body_length(site, Category.CAR)
    gap, before = speed * values["headway"], speed * (ttc + values["approach"])

    def place(stretch: LaneStretch) -> TemplateScene:
        near = near_side(site, stretch)
        side = -near
        try:
            lane = beside(site, stretch, side)
        except UnfitPlaceError:
            side = near
            lane = beside(site, stretch, side)
        start = node_near(site, stretch, _REAR)
        first = metres_at(stretch, start) + length + gap
        lead, beyond = exact_start(site, stretch, first)
        target, further = exact_start(site, stretch, first + length + before)
        last = int(stretch.nodes[-1])
        stands = vehicle(
            site, "target", target, last, speed=speed, moving=False, driver="story",
            longitudinal_offset=further,
        )  # fmt: skip
        leaves = vehicle(
            site, "lead", lead, int(lane.nodes[-1]), speed=speed, driver="story",
            longitudinal_offset=beyond,
        )  # fmt: skip
        when = {"ttc": {"of": "lead", "to": "target", "below": ttc}}
        return TemplateScene(
            actors=(vehicle(site, "ego", start, last, speed=speed, ego=True), leaves, stands),
            rules=(
                at_once("stands", "target", {"stop": {}}),
                rule("cut-out", "lead", when, {"lane": {"by": side, "over": over}}),
            ),
            duration=math.ceil(values["approach"] + ttc + values["headway"] + 60.0),
            wanted=(
                f"All at {kmh(speed)} but the target, which is stopped. The vehicle ahead, "
                f"{gap:.2f} m before the ego, begins to leave the lane at a time to collision of "
                f"{ttc:g} s with the target; the ego's is then {ttc + values['headway']:.2f} s and "
                f"that for one vehicle's length more."
            ),
        )

    metres = _REAR + 3.0 * length + gap + before + _BEYOND + speed * over
    found, why = site.stretches.of_length(metres, bend=_STRAIGHT)
    what = "a cut-out"
    return first_fit(found, why, place, what=what, map_name=site.region.graph.map_name)


CUT_OUT = SceneTemplate(
    name="cut-out",
    title="Cut-out",
    summary="The vehicle ahead changes lanes, and shows a stopped car in the ego's lane.",
    source="UN Regulation No. 157 (ALKS), cut-out: the ego follows at the headway of the "
    "regulation for its speed, 60 km/h in its first version; the time to collision at which the "
    "vehicle ahead leaves is odscen's choice.",
    needs="two lanes of one direction",
    parameters=(
        TemplateParameter("ego_speed", 60 / 3.6, 2, 60, "m/s", "speed of the ego", "Ego speed"),
        TemplateParameter(
            "headway", 1.5, 0.3, 5, "s", "time headway to the vehicle ahead", "Time headway"
        ),
        TemplateParameter(
            "ttc",
            4,
            1.5,
            10,
            "s",
            "time to collision with the target at which it leaves the lane",
            "Time to collision",
        ),
        TemplateParameter(
            "over", 3, 1, 10, "s", "duration of the lane change", "Lane-change duration"
        ),
        TemplateParameter("approach", 2, 0.5, 20, "s", "time before it", "Lead time"),
    ),
    place=_cut_out,
)


def _place_drift(site: TemplateSite, values: Mapping[str, float]) -> TemplateScene:
    speed, aside = values["ego_speed"], values["lateral_speed"]
    length, width = body_length(site, Category.CAR), site.usable.bodies[Category.CAR].width

    def place(stretch: LaneStretch) -> TemplateScene:
        near = near_side(site, stretch)
        side = -near
        try:
            lane = beside(site, stretch, side)
        except UnfitPlaceError:
            side = near
            lane = beside(site, stretch, side)
        lanes = site.region.graph.lanes
        start = node_near(site, stretch, _REAR)
        centre = apart(site, int(stretch.nodes[0]), int(lane.nodes[0]))
        half_lane = float(lanes.width[start]) / 2.0
        # Free metres between the bodies when the side of the ego's is over the border.
        border = centre - half_lane - width / 2.0
        # From the begin until the sides would be this far into each other.
        seconds = (centre - width / 2.0) / aside
        other, beyond = exact_start(site, lane, metres_at(stretch, start))
        last = int(stretch.nodes[-1])
        path = {
            "points": [
                [round(length / 2.0 + speed * seconds, 4), round(side * aside * seconds, 4)]
            ],
            "speed": round(math.hypot(speed, aside), 5),
            "relative_to": "ego",
        }
        left = {"of": "beside", "to": "ego", "along": "lateral", "below": round(border, 4)}
        return TemplateScene(
            actors=(
                vehicle(site, "ego", start, last, speed=speed, ego=True),
                vehicle(
                    site,
                    "beside",
                    other,
                    int(lane.nodes[-1]),
                    speed=speed,
                    driver="story",
                    longitudinal_offset=beyond,
                ),
            ),
            rules=(
                driven("cruise", "beside", speed),
                rule("drift", "ego", {"time": {"after": values["approach"]}}, {"path": path}),
                rule("lane-left", "beside", {"distance": left}, {"horn": {}}),
            ),
            duration=math.ceil(values["approach"] + seconds + 60.0),
            wanted=(
                f"Both at {kmh(speed)}, side by side. After {values['approach']:g} s the ego "
                f"drifts aside at {aside:g} m/s: {(half_lane - width / 2.0):.2f} m to the border "
                f"of its lane, {centre - width:.2f} m to the other vehicle. The rule lane-left "
                f"fires when its side is over the border."
            ),
            criteria=("fired(lane-left) == 0", "lane_departure(ego) <= 0 m", NO_COLLISION),
        )

    metres = _REAR + length + speed * (values["approach"] + 4.0 / aside) + _BEYOND
    found, why = site.stretches.of_length(metres, bend=_STRAIGHT)
    what = "a vehicle that drifts out of its lane"
    return first_fit(found, why, place, what=what, map_name=site.region.graph.map_name)


DRIFT = SceneTemplate(
    name="drift",
    title="Lane drift",
    summary="The ego drifts out of its lane towards the vehicle beside it.",
    source="UN Regulation No. 130 (LDWS): 60 km/h or more, rate of departure 0.1 to 0.8 m/s, here "
    "with a vehicle in the next lane as in Euro NCAP's emergency lane keeping (0.3 to 0.6 m/s).",
    needs="two lanes of one direction",
    parameters=(
        TemplateParameter("ego_speed", 65 / 3.6, 2, 60, "m/s", "speed of both", "Ego speed"),
        TemplateParameter(
            "lateral_speed", 0.5, 0.1, 2, "m/s", "speed at which the ego drifts", "Lateral speed"
        ),
        TemplateParameter("approach", 2, 0.5, 20, "s", "time before it", "Lead time"),
    ),
    place=_place_drift,
)
