"""From a scenario and its map to a prepared run. Pure: nothing is written yet."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from odscen.base.errors import InputError
from odscen.runs.layout import BEHAVIOUR_FILE, LIGHT_STAGES_FILE
from odscen.runs.run_settings import AS_DESIGNED
from odscen.scenario.document.json_form import dumps
from odscen.sumo.realize.lights.light_stages import lights_json, switched_lights
from odscen.sumo.realize.realization import realize
from odscen.sumo.realize.sumo_lane_places import lane_places
from odscen.sumo.runner.forecast import forecast
from odscen.sumo.runner.run_folder import SumoPreparedRun
from odscen.sumo.worker.behaviour.behaviour_doors import door_switches_lights

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from odscen.base.arrays import Int32Array
    from odscen.learning.behaviour.behaviour_model import BehaviourDoor
    from odscen.runs.run_settings import RunSettings
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.sumo.realize.road_users.free_flow import ModelSizes
    from odscen.sumo.realize.sumo_map import SumoMap

MESO_NOTE = (
    "meso: queues on sections of road instead of vehicles that follow each other. No lanes, lane "
    "changes, places across the lane, exact starts, collisions or hard braking; people on foot "
    "meet neither each other nor vehicles; places are interpolated"
)


def prepare(
    scenario: Scenario,
    sumo_map: SumoMap,
    net: Path,
    assets: ModelSizes | None = None,
    *,
    settings: RunSettings = AS_DESIGNED,
    assigned: Mapping[str, Int32Array] | None = None,
    assignment_json: str | None = None,
) -> SumoPreparedRun:
    """Realize a scenario and put together what its run folder will hold.

    Parameters
    ----------
    sumo_map
        Of the scenario's map; made once by :meth:`odscen.sumo.realize.sumo_map.SumoMap.of` for many
        runs.
    net
        The map's ``net.net.xml``.
    assets
        See :func:`odscen.sumo.realize.realization.realize`.
    settings
        How it is run. A run in slices can be resumed.
    assigned
        See :func:`odscen.sumo.realize.realization.realize`.
    assignment_json
        How these routes were found, kept in the run folder.

    Raises
    ------
    ScenarioError
        With every actor and flow whose spawn or goal is not usable.
    InputError
        If a model is to switch lights where there is none to switch.
    """
    realization = realize(scenario, sumo_map, assets, settings=settings, assigned=assigned)
    plan = realization.plan
    return SumoPreparedRun(
        plan=plan,
        sumo_files=_with_behaviour(realization.files, settings.behaviour, scenario, sumo_map),
        net=net,
        settings=settings,
        scenario_json=dumps(scenario),
        assignment_json=assignment_json,
        problems=realization.problems,
        notes=((MESO_NOTE,) if settings.meso else ()) + realization.notes,
        places=lane_places(sumo_map),
        lights=realization.lights,
        about={
            "map": scenario.map.name,
            "map_sha256": scenario.map.sha256,
            "meso": settings.meso,
        }
        | _describe_driver(settings.behaviour),
        expected=forecast(
            plan,
            realization.files,
            every=settings.recording.every,
            lanes=len(sumo_map.net.lanes),
        ),
    )


def _describe_driver(door: BehaviourDoor | None) -> dict[str, Any]:
    """What the summary says of a behaviour model."""
    if door is None:
        return {}
    return {"behaviour": door.shown, "behaviour_options": dict(door.options)}


def _with_behaviour(
    files: Mapping[str, str], door: BehaviourDoor | None, scenario: Scenario, sumo_map: SumoMap
) -> Mapping[str, str]:
    """SUMO's files, and what drives or switches lights instead of it."""
    if door is None:
        return files
    door_fields = {name: value for name, value in asdict(door).items() if value is not None}
    files = {**files, BEHAVIOUR_FILE: json.dumps(door_fields, indent=2) + "\n"}
    if not door_switches_lights(door):
        return files
    lights = switched_lights(scenario, sumo_map)
    if not lights:
        raise InputError(
            f"it switches lights, and map {scenario.map.name!r} has none with two stages or more",
            element=door.shown,
        )
    return {**files, LIGHT_STAGES_FILE: lights_json(lights)}
