"""Scenes of vehicles that drive the same way: cut-in, braking lead vehicle, bus at its stop."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from odscen.base.categories import Category
from odscen.base.errors import InputError
from odscen.scenario.templates.scene_sites import LaneStretch, UnfitPlaceError, first_fit
from odscen.scenario.templates.scene_template import (
    LEFT,
    RIGHT,
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
    from collections.abc import Mapping, Sequence

    from odscen.scenario.templates.scene_template import TemplateSite

_REAR = 6.0
"""Metres from the beginning of a stretch to the middle of the first vehicle."""
_AFTER = 4.0
"""Seconds of the run that a stretch has room for after the scene."""
_STRAIGHT = 0.1
"""Radians that a stretch may bend."""
_SETTLING = 4.0
"""Seconds that a gap needs to settle, and one more for each metre."""
LEAST_CLOSING = 1.0
"""m/s by which the ego is faster than who cuts in, at least."""
_MOST_OFFSET = 10.0
"""Metres from its node at which a vehicle may start at most."""
INTRUSION = 0.3
"""Metres over the lane's border at which UN R157 counts a vehicle as in the lane (5.2.5.2)."""


def _cut_in(site: TemplateSite, values: Mapping[str, float]) -> TemplateScene:
    return _place_cut_in(site, (values,))


def _place_cut_in(site: TemplateSite, sets: Sequence[Mapping[str, float]]) -> TemplateScene:
    """Place it with the first of several sets of numbers, and with room for each of them."""
    values = sets[0]
    ego, speed, over = values["ego_speed"], values["speed"], values["over"]
    length, width = body_length(site, Category.CAR), site.usable.bodies[Category.CAR].width
    intrusion = _time_of_intrusion(values)
    metres = max(
        _REAR
        + length
        + (_time_of_intrusion(each) + each["over"] + each["approach"])
        * (each["ego_speed"] - each["speed"])
        + each["speed"] * (each["approach"] + each["over"] + _AFTER)
        for each in sets
    )

    def place(stretch: LaneStretch) -> TemplateScene:
        near = near_side(site, stretch)
        lane = _stretch_on_either_side(site, stretch, near)
        centre = apart(site, int(stretch.nodes[0]), int(lane.nodes[0]))
        border = site.region.graph.lanes.width[lane.nodes[0]] / 2.0 - width / 2.0 + INTRUSION
        # half-cosine: offset = centre (1 - cos(pi t / over)) / 2
        share = math.acos(1.0 - 2.0 * min(border / centre, 1.0)) / math.pi
        begins = intrusion + share * over
        start = node_near(site, stretch, _REAR)
        ahead = length + max(
            (_time_of_intrusion(each) + share * each["over"] + each["approach"])
            * (each["ego_speed"] - each["speed"])
            for each in sets
        )
        other = node_near(site, lane, _REAR + ahead)
        last = int(stretch.nodes[-1])
        side = LEFT if _is_left(site, lane, stretch) else RIGHT
        return TemplateScene(
            actors=(
                vehicle(site, "ego", start, last, speed=ego, ego=True),
                vehicle(site, "challenger", other, int(lane.nodes[-1]), speed=speed),
            ),
            rules=(
                driven("cruise", "challenger", speed),
                rule(
                    "cut-in",
                    "challenger",
                    {"ttc": {"of": "ego", "to": "challenger", "below": round(begins, 4)}},
                    {"lane": {"by": side, "over": over}},
                ),
            ),
            duration=math.ceil(
                max(
                    (ahead - length) / (each["ego_speed"] - each["speed"]) + each["over"]
                    for each in sets
                )
                + 10.0
            )
            if len(sets) > 1
            else math.ceil(values["approach"] + over + 10.0),
            formulas={
                ("actors", "ego", "speed"): "$ego_speed",
                ("actors", "ego", "initial_speed"): "$ego_speed",
                ("actors", "challenger", "speed"): "$speed",
                ("actors", "challenger", "initial_speed"): "$speed",
                ("rules", "cruise", "then", 0, "speed", "to"): "$speed",
                ("rules", "cut-in", "when", "ttc", "below"): f"$ttc + {share:.6f} * $over",
                ("rules", "cut-in", "then", 0, "lane", "over"): "$over",
            },
            wanted=(
                f"Ego {kmh(ego)}, challenger {kmh(speed)}. The challenger begins to change lanes "
                f"at a time to collision of {begins:.2f} s, so that it is {INTRUSION:g} m over "
                f"the border of the ego's lane at {intrusion:.2f} s."
            ),
        )

    found, why = site.stretches.of_length(metres, bend=_STRAIGHT)
    return first_fit(found, why, place, what="a cut-in", map_name=site.region.graph.map_name)


def _time_of_intrusion(values: Mapping[str, float]) -> float:
    """Time to collision when the vehicle is in the lane; without a wanted one that of UN R157.

    Raises
    ------
    InputError
        If the ego is not faster.
    """
    ego, speed = values["ego_speed"], values["speed"]
    if ego - speed < LEAST_CLOSING:
        raise InputError(
            f"ego_speed must be at least 1 m/s above speed ({speed:g} m/s), not {ego:g} m/s"
        )
    # 5.2.5.2: TTC at the intrusion above v_rel / (2 * 6 m/s2) + 0.35 s
    return values.get("ttc", (ego - speed) / 12.0 + 0.35)


def _stretch_on_either_side(site: TemplateSite, stretch: LaneStretch, near: int) -> LaneStretch:
    try:
        return beside(site, stretch, near)
    except UnfitPlaceError:
        pass
    try:
        return beside(site, stretch, -near)
    except UnfitPlaceError:
        raise UnfitPlaceError("have no second lane of the same direction all along") from None


def _is_left(site: TemplateSite, lane: LaneStretch, of: LaneStretch) -> bool:
    """Whether the stretch ``of`` is on the left of a lane."""
    lanes = site.region.graph.lanes
    return int(lanes.left_lane[lane.nodes[0]]) == int(lanes.lane[of.nodes[0]])


CUT_IN = SceneTemplate(
    name="cut-in",
    title="Cut-in",
    summary="A slower vehicle in the next lane changes into the ego's lane close ahead of it.",
    source="UN Regulation No. 157 (ALKS), 5.2.5.2: a collision has to be avoided if the time to "
    "collision is above v_rel / (2 x 6 m/s2) + 0.35 s when the vehicle is 0.3 m over the lane's "
    "border. Speeds: the ego's is the limit of 60 km/h of the regulation's first version; the "
    "other one's and the time of the lane change are odscen's choice.",
    needs="two lanes of one direction",
    parameters=(
        TemplateParameter("ego_speed", 60 / 3.6, 2, 60, "m/s", "speed of the ego", "Ego speed"),
        TemplateParameter(
            "speed", 40 / 3.6, 1, 58, "m/s",
            "speed of the vehicle that cuts in", "Cut-in vehicle speed",
        ),
        TemplateParameter(
            "ttc", None, 0.1, 10, "s",
            "time to collision when it is 0.3 m over the border; default: the limit of UN R157",
            "Time to collision",
        ),
        TemplateParameter(
            "over", 3, 1, 10, "s", "duration of the lane change", "Lane-change duration"
        ),
        TemplateParameter("approach", 2, 0.5, 20, "s", "time before it", "Lead time"),
    ),
    place=_cut_in,
    place_open=_place_cut_in,
)  # fmt: skip


def _lead_brakes(site: TemplateSite, values: Mapping[str, float]) -> TemplateScene:
    return _place_lead_brakes(site, (values,))


def _place_lead_brakes(site: TemplateSite, sets: Sequence[Mapping[str, float]]) -> TemplateScene:
    """Place it with the first of several sets of numbers, and with room for each of them."""
    values = sets[0]
    speed, gap, rate = values["speed"], values["gap"], values["deceleration"]
    length = body_length(site, Category.CAR)
    # What a start cannot be moved by has to settle first.
    far = max(abs(each["gap"] - gap) for each in sets) - _MOST_OFFSET / 2.0
    settle = max(each["approach"] for each in sets) + (_SETTLING + far if far > 0.0 else 0.0)
    ahead = gap + length
    metres = max(
        _REAR
        + length
        + each["gap"]
        + each["speed"] * settle
        + each["speed"] ** 2 / (2.0 * each["deceleration"])
        + length
        for each in sets
    )

    def place(stretch: LaneStretch) -> TemplateScene:
        start = node_near(site, stretch, _REAR)
        lead, beyond = exact_start(site, stretch, metres_at(stretch, start) + ahead)
        last = int(stretch.nodes[-1])
        return TemplateScene(
            actors=(
                vehicle(site, "ego", start, last, speed=speed, ego=True),
                vehicle(site, "lead", lead, last, speed=speed, longitudinal_offset=beyond),
            ),
            rules=(
                driven("cruise", "lead", speed),
                at_once(
                    "follow",
                    "ego",
                    {"keep_gap": {"to": "lead", "metres": gap, "lasting": settle}},
                    {"release": {}},
                ),
                rule(
                    "brake",
                    "lead",
                    {"all": [{"rule": {"id": "follow"}}, {"rule": {"id": "cruise"}}]},
                    {"brake": {"by": rate}},
                ),
            ),
            duration=math.ceil(
                max(settle + each["speed"] / each["deceleration"] for each in sets) + 8.0
            ),
            formulas={
                ("actors", "ego", "speed"): "$speed",
                ("actors", "ego", "initial_speed"): "$speed",
                ("actors", "lead", "speed"): "$speed",
                ("actors", "lead", "initial_speed"): "$speed",
                ("rules", "cruise", "then", 0, "speed", "to"): "$speed",
                ("rules", "follow", "then", 0, "keep_gap", "metres"): "$gap",
                # As near to the wanted gap as a start may be moved; the rest settles.
                ("actors", "lead", "longitudinal_offset"): (
                    f"min({_MOST_OFFSET:g}, max(-{_MOST_OFFSET:g}, $gap - {gap - beyond:.3f}))"
                ),
                ("rules", "brake", "then", 0, "brake", "by"): "$deceleration",
            },
            wanted=(
                f"Both at {kmh(speed)}, {gap:g} m apart. After {settle:g} s the lead vehicle "
                f"brakes with {rate:g} m/s2 to a standstill, and the ego drives itself."
            ),
        )

    found, why = site.stretches.of_length(metres, bend=1.0)
    what = "a lead vehicle that brakes"
    return first_fit(found, why, place, what=what, map_name=site.region.graph.map_name)


LEAD_BRAKES = SceneTemplate(
    name="lead-brakes",
    title="Lead vehicle brakes",
    summary="The vehicle ahead brakes to a standstill; the ego follows at a set gap.",
    source="Euro NCAP car-to-car rear braking (CCRb): both vehicles at 50 km/h, 12 or 40 m apart, "
    "braking with 2 or 6 m/s2.",
    needs="a lane between junctions",
    parameters=(
        TemplateParameter(
            "speed", 50 / 3.6, 2, 60, "m/s", "speed of both", "Speed of both vehicles"
        ),
        TemplateParameter("gap", 40, 2, 200, "m", "free gap", "Gap"),
        TemplateParameter(
            "deceleration",
            6,
            0.5,
            12,
            "m/s2",
            "of the lead vehicle",
            "Deceleration of the lead vehicle",
        ),
        TemplateParameter(
            "approach", 4, 3, 20, "s", "time before it, in which the gap settles", "Lead time"
        ),
    ),
    place=_lead_brakes,
    place_open=_place_lead_brakes,
)


def _bus_scene(site: TemplateSite, values: Mapping[str, float]) -> TemplateScene:
    speed, ttc = values["ego_speed"], values["ttc"]
    halves = (body_length(site, Category.CAR) + body_length(site, Category.BUS)) / 2.0
    ahead = halves + (ttc + values["approach"]) * speed
    metres = _REAR + ahead + 60.0

    def place(stretch: LaneStretch) -> TemplateScene:
        near = near_side(site, stretch)
        lane = beside(site, stretch, near)
        start, stop = node_near(site, stretch, _REAR), node_near(site, lane, _REAR + ahead)
        last = int(stretch.nodes[-1])
        bus = vehicle(
            site, "bus", stop, int(lane.nodes[-1]), speed=values["speed"],
            category=Category.BUS, moving=False,
        )  # fmt: skip
        rate = values["acceleration"]
        starts = {"speed": {"to": 3.0, "rate": rate}}
        pulls_out = [
            {"lane": {"by": -near, "over": values["over"]}},
            {"speed": {"to": round(values["speed"], 4), "rate": rate}},
        ]
        when = {"ttc": {"of": "ego", "to": "bus", "below": ttc}}
        return TemplateScene(
            actors=(vehicle(site, "ego", start, last, speed=speed, ego=True), bus),
            rules=(
                at_once("stop", "bus", {"stop": {}}),
                rule(
                    "leave", "bus", {"all": [{"rule": {"id": "stop"}}, when]},
                    starts, {"together": pulls_out},
                ),
            ),
            duration=math.ceil(values["approach"] + 30.0),
            wanted=(
                f"Ego {kmh(speed)}. The bus leaves its stop when the ego's time to collision with "
                f"it, if they were in one lane, is {ttc:g} s; its front is "
                f"{metres_at(lane, stop) - metres_at(stretch, start):.0f} m ahead then at most."
            ),
        )  # fmt: skip

    found, why = site.stretches.of_length(metres, bend=_STRAIGHT)
    what = "a bus that leaves its stop"
    return first_fit(found, why, place, what=what, map_name=site.region.graph.map_name)


BUS_LEAVES = SceneTemplate(
    name="bus-leaves",
    title="Bus leaves its stop",
    summary="A bus is stopped in the lane at the kerb and pulls out into the ego's lane.",
    source="No protocol: the numbers are odscen's choice.",
    needs="two lanes of one direction",
    parameters=(
        TemplateParameter("ego_speed", 40 / 3.6, 2, 60, "m/s", "speed of the ego", "Ego speed"),
        TemplateParameter(
            "ttc", 5, 1, 20, "s", "time to collision at which the bus starts", "Time to collision"
        ),
        TemplateParameter(
            "speed", 30 / 3.6, 3, 20, "m/s", "speed that the bus reaches", "Bus speed"
        ),
        TemplateParameter("acceleration", 1.2, 0.3, 3, "m/s2", "of the bus", "Bus acceleration"),
        TemplateParameter(
            "over", 5, 2, 12, "s", "duration of the lane change", "Lane-change duration"
        ),
        TemplateParameter("approach", 2, 0.5, 20, "s", "time before it", "Lead time"),
    ),
    place=_bus_scene,
)
