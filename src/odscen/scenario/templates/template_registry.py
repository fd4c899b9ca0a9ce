"""All templates, and how one becomes a scenario."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from odscen.base.errors import InputError, NotFoundError
from odscen.lanegraph.query import largest_part
from odscen.scenario.document.json_form import dumps, loads
from odscen.scenario.edits.settings_edits import new_scenario
from odscen.scenario.placing.region import Region
from odscen.scenario.templates.car_scenes import BUS_LEAVES, CUT_IN, LEAD_BRAKES
from odscen.scenario.templates.impact_scenes import (
    BICYCLE_AHEAD,
    CUT_OUT,
    DRIFT,
    STATIONARY,
)
from odscen.scenario.templates.oncoming_scene import ONCOMING
from odscen.scenario.templates.red_light_scene import RED_LIGHT
from odscen.scenario.templates.scene_sites import LaneStretches, WalkSides
from odscen.scenario.templates.scene_template import STEADY_DRIVER, TemplateSite
from odscen.scenario.templates.turning_scene import TURNING
from odscen.scenario.templates.walker_scenes import (
    HIDDEN_CHILD,
    MID_BLOCK,
    REVERSING,
    VAN_AND_WALKER,
)

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.lanegraph.graphs import MapGraph
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.placing.region import Usable
    from odscen.scenario.signals.light import Light
    from odscen.scenario.templates.scene_template import SceneTemplate, TemplateScene

TEMPLATES: dict[str, SceneTemplate] = {
    template.name: template
    for template in (
        CUT_IN,
        CUT_OUT,
        STATIONARY,
        LEAD_BRAKES,
        BICYCLE_AHEAD,
        HIDDEN_CHILD,
        MID_BLOCK,
        VAN_AND_WALKER,
        TURNING,
        REVERSING,
        DRIFT,
        RED_LIGHT,
        ONCOMING,
        BUS_LEAVES,
    )
}
"""By name, in the order in which they are offered."""


def find_template(name: str) -> SceneTemplate:
    """Template of that name.

    Raises
    ------
    NotFoundError
        If there is none.
    """
    if name not in TEMPLATES:
        raise NotFoundError("template", name, list(TEMPLATES))
    return TEMPLATES[name]


def place_template(
    template: SceneTemplate,
    graph: MapGraph,
    usable: Usable,
    lights: Sequence[Light],
    *,
    values: Mapping[str, float],
    name: str,
) -> Scenario:
    """Place a template on a map; the same map and numbers give the same document.

    Parameters
    ----------
    values
        Numbers that differ from the template's, by the names of its parameters.
    name
        Of the scenario.

    Raises
    ------
    InputError
        If a number is unknown or out of its range.
    NoPlaceError
        If the map has no room; says where was looked and why not.
    """
    wanted = template.values(values)
    site, roi = _site_of_map(graph, usable, lights)
    data = _document_of_scene(template, template.place(site, wanted), graph, roi, name=name)
    return loads(json.dumps(data))


def place_open_template(
    template: SceneTemplate,
    graph: MapGraph,
    usable: Usable,
    lights: Sequence[Light],
    *,
    sets: Sequence[Mapping[str, float]],
    name: str,
) -> Scenario:
    """Place a template so that its numbers are parameters of the scenario, which a sweep varies.

    Parameters
    ----------
    sets
        Several sets of its numbers, for each of which there is to be room. The first one is what
        the parameters are, all together are between which bounds they may be.
    name
        Of the scenario.

    Raises
    ------
    InputError
        If a number is unknown or out of its range, or where the template begins depends on them.
    NoPlaceError
        If the map has no room; says where was looked and why not.
    """
    if template.place_open is None:
        raise InputError(f"the numbers of template {template.name!r} cannot be varied in one place")
    wanted = [template.values(values) for values in sets]
    site, roi = _site_of_map(graph, usable, lights)
    scene = template.place_open(site, wanted)
    data = _document_of_scene(template, scene, graph, roi, name=name)
    for (part, ident, *keys, last), formula in scene.formulas.items():
        place: Any = next(entry for entry in data[str(part)] if entry["id"] == ident)
        for key in keys:
            place = place[key]
        place[last] = formula
    used = " ".join(scene.formulas.values())
    data["parameters"] = {
        number.name: {
            "value": wanted[0][number.name],
            "unit": number.unit,
            "min": min(values[number.name] for values in wanted),
            "max": max(values[number.name] for values in wanted),
            "description": number.meaning,
        }
        for number in template.parameters
        if f"${number.name}" in used
    }
    return loads(json.dumps(data))


def _site_of_map(
    graph: MapGraph, usable: Usable, lights: Sequence[Light]
) -> tuple[TemplateSite, tuple[str, ...]]:
    """Look at the largest connected part of a map; its segments are the second."""
    roi = tuple(largest_part(graph.segments))
    region = Region.of(graph, roi)
    stretches, sides = LaneStretches(region, usable), WalkSides(region, usable)
    return TemplateSite(region, usable, lights, stretches, sides), roi


def _document_of_scene(
    template: SceneTemplate,
    scene: TemplateScene,
    graph: MapGraph,
    roi: Sequence[str],
    *,
    name: str,
) -> dict[str, Any]:
    words = f"{template.summary} {scene.wanted} Source: {template.source}"
    data: dict[str, Any] = json.loads(
        dumps(new_scenario(graph, name=name, roi=roi, description=words))
    )
    data["drivers"] = {"sets": [STEADY_DRIVER]}
    data["actors"], data["rules"] = list(scene.actors), list(scene.rules)
    data["criteria"] = list(scene.criteria)
    data["simulation"] = {"duration": scene.duration}
    return data
