"""The scene of a vehicle that overtakes and meets the ego."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from odscen.base.categories import Category
from odscen.base.errors import InputError
from odscen.scenario.templates.scene_sites import LaneStretch, UnfitPlaceError, first_fit
from odscen.scenario.templates.scene_template import (
    SceneTemplate,
    TemplateParameter,
    TemplateScene,
    apart,
    at_once,
    body_length,
    driven,
    kmh,
    near_side,
    node_near,
    rule,
    vehicle,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.scenario.templates.scene_template import TemplateSite

_REAR = 6.0
_STRAIGHT = 0.05
_WIDEST = 6.0
"""Metres between the centre lines of the two lanes, at most."""


class Overtaking(NamedTuple):
    """When and where an overtaking is over.

    Attributes
    ----------
    back
        Seconds until the overtaking vehicle begins to return to its lane.
    total, metres
        Seconds and metres of it until it is back in its lane.
    gap
        Free metres to the oncoming vehicle at which it begins.
    """

    back: float
    total: float
    metres: float
    gap: float


def overtaking(values: Mapping[str, float], lengths: float) -> Overtaking:
    """How long overtaking takes; ``lengths`` are half of both bodies twice, metres.

        relative metres R = gap before + bodies + gap after = a t^2/2, then (v1 - v0) (t - t1/2)

    Raises
    ------
    InputError
        If the overtaking vehicle is not at least 1 m/s faster.
    """
    slow, fast, rate = values["slow_speed"], values["speed"], values["acceleration"]
    more = fast - slow
    if more < 1.0:
        raise InputError(
            f"speed must be at least 1 m/s above slow_speed ({slow:g} m/s), not {fast:g} m/s"
        )
    rest = 2.0 * values["gap"] + lengths
    ramp = more / rate
    gained = more * ramp / 2.0
    back = ramp + (rest - gained) / more
    back = max(back, ramp, values["over"] + 0.1)
    total = back + values["over"]
    metres = slow * total + more * (total - ramp / 2.0)
    at_end = values["margin"] * (fast + values["ego_speed"])
    return Overtaking(back, total, metres, at_end + metres + values["ego_speed"] * total)


def _oncoming_scene(site: TemplateSite, values: Mapping[str, float]) -> TemplateScene:
    slow, fast, ego = values["slow_speed"], values["speed"], values["ego_speed"]
    half_car = body_length(site, Category.CAR) / 2.0
    half_bike = body_length(site, Category.BICYCLE) / 2.0
    move = overtaking(values, 2.0 * (half_car + half_bike))
    settle = values["approach"]
    bike = _REAR + half_car + values["gap"] + half_bike
    meet = _REAR + slow * settle + 2.0 * half_car + move.gap
    metres = meet + ego * settle + _REAR

    def place(stretch: LaneStretch) -> TemplateScene:
        near = near_side(site, stretch)
        other = _opposite_stretch(site, stretch, -near)
        across = apart(site, int(stretch.nodes[0]), int(other.nodes[-1]))
        start, ahead = (node_near(site, stretch, at) for at in (_REAR, bike))
        oncoming = node_near(site, other, float(other.along[-1]) - (meet + ego * settle))
        last = int(stretch.nodes[-1])
        aside = {"to": round(-near * across, 3), "over": values["over"]}
        faster = {"to": round(fast, 4), "rate": values["acceleration"]}
        stays = aside | {"over": round(move.back - values["over"], 4)}
        clear = {
            "of": "overtaker", "to": "ego", "along": "longitudinal", "below": round(move.gap, 3),
        }  # fmt: skip
        return TemplateScene(
            actors=(
                vehicle(site, "ego", oncoming, int(other.nodes[-1]), speed=ego, ego=True),
                vehicle(site, "overtaker", start, last, speed=fast, initial_speed=slow),
                vehicle(site, "bicycle", ahead, last, speed=slow, category=Category.BICYCLE),
            ),
            rules=(
                driven("ride", "bicycle", slow),
                at_once(
                    "follow", "overtaker",
                    {"keep_gap": {
                        "to": "bicycle", "metres": values["gap"], "lasting": settle - 0.5,
                    }},
                ),
                rule(
                    "overtake", "overtaker",
                    {"all": [{"rule": {"id": "follow"}}, {"distance": clear}]},
                    {"offset": aside}, {"offset": stays},
                    {"offset": {"to": 0.0, "over": values["over"]}},
                ),
                rule(
                    "accelerate", "overtaker",
                    {"all": [{"rule": {"id": "follow"}},
                             {"rule": {"id": "overtake", "has": "started"}}]},
                    {"speed": faster},
                ),
            ),
            duration=math.ceil(settle + move.total + 8.0),
            wanted=(
                f"A bicycle at {kmh(slow)}, the overtaking vehicle reaches {kmh(fast)}, the ego "
                f"comes towards it at {kmh(ego)}. It pulls out {move.gap:.1f} m before the ego "
                f"and is back in its lane {move.total:.2f} s later, when the time to collision "
                f"with the ego is {values['margin']:g} s."
            ),
        )  # fmt: skip

    found, why = site.stretches.of_length(metres, bend=_STRAIGHT)
    what = "overtaking with oncoming traffic"
    return first_fit(found, why, place, what=what, map_name=site.region.graph.map_name)


def _opposite_stretch(site: TemplateSite, stretch: LaneStretch, side: int) -> LaneStretch:
    """The lane of the other direction beside a stretch, in its own direction.

    Raises
    ------
    UnfitPlaceError
        If there is none all along.
    """
    lanes, plain = site.region.graph.lanes, np.flatnonzero(site.stretches.plain)
    rows = lanes.left_lane if side > 0 else lanes.right_lane
    if (rows[stretch.nodes] >= 0).any():
        raise UnfitPlaceError(
            "have another lane of their own direction between them and oncoming traffic"
        )
    tree = cKDTree(np.stack([lanes.x[plain], lanes.y[plain], lanes.z[plain]], axis=1))
    hdg = lanes.hdg[stretch.nodes]
    middle = (lanes.width[stretch.nodes] * side, np.zeros(len(hdg)))
    x = lanes.x[stretch.nodes] - middle[0] * np.sin(hdg)
    y = lanes.y[stretch.nodes] + middle[0] * np.cos(hdg)
    away, index = tree.query(np.stack([x, y, lanes.z[stretch.nodes]], axis=1))
    found = plain[index]
    alongside = np.less(away, lanes.spacing + 0.5) & np.less(np.cos(lanes.hdg[found] - hdg), -0.9)
    if not np.all(alongside):
        raise UnfitPlaceError("have no lane for oncoming traffic beside them all along")
    if apart(site, int(stretch.nodes[0]), int(found[0])) > _WIDEST:
        raise UnfitPlaceError(f"have oncoming traffic more than {_WIDEST:.0f} m away")
    order = found[::-1]
    # Followed from its first node, so that every node is there once and in order.
    nodes, along = [int(order[0])], [0.0]
    while nodes[-1] != int(order[-1]):
        after = int(site.stretches.next[nodes[-1]])
        if after < 0 or not site.stretches.plain[after] or len(nodes) > 2 * len(order):
            raise UnfitPlaceError("have a lane for oncoming traffic that does not go through")
        along.append(along[-1] + float(site.stretches.step[nodes[-1]]))
        nodes.append(after)
    return LaneStretch(np.array(nodes), np.array(along), stretch.bend)


ONCOMING = SceneTemplate(
    name="oncoming",
    title="Overtaking with oncoming traffic",
    summary="A car overtakes a bicycle on the ego's side of the road and returns to its lane in "
    "front of the ego.",
    source="No protocol: the numbers are odscen's choice.",
    needs="a road with one lane for each direction",
    parameters=(
        TemplateParameter("ego_speed", 40 / 3.6, 2, 40, "m/s", "speed of the ego", "Ego speed"),
        TemplateParameter(
            "speed",
            40 / 3.6,
            2,
            40,
            "m/s",
            "speed that the overtaking car reaches",
            "Overtaking car speed",
        ),
        TemplateParameter(
            "slow_speed", 18 / 3.6, 1, 12, "m/s", "speed of the bicycle", "Bicycle speed"
        ),
        TemplateParameter(
            "acceleration",
            2.5,
            0.5,
            6,
            "m/s2",
            "of the overtaking car",
            "Overtaking car acceleration",
        ),
        TemplateParameter("gap", 8, 3, 50, "m", "free gap to the bicycle before and after", "Gap"),
        TemplateParameter(
            "over", 2, 1, 6, "s", "duration of each change of side", "Lane-change duration"
        ),
        TemplateParameter(
            "margin",
            1,
            -2,
            20,
            "s",
            "time to collision with the ego when it is back in its lane",
            "Final time to collision",
        ),
        TemplateParameter(
            "approach", 3.5, 2, 20, "s", "time before it, in which the gap settles", "Lead time"
        ),
    ),
    place=_oncoming_scene,
)
