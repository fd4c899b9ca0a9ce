"""Scenes of recorded traffic as scenarios with parameters, and as cases of sweeps of these."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from odscen.app.maps import load_map
from odscen.app.scenarios import SUFFIX, write_scenario
from odscen.base.given_files import as_path
from odscen.base.text_files import write_text
from odscen.formats.tracks.lane_places import fit_on_map
from odscen.formats.tracks.scenes import exposure, find_scenes
from odscen.formats.tracks.template_fit import describe_values, draw_values, fit_templates
from odscen.scenario.templates.scene_sites import NoPlaceError
from odscen.scenario.templates.template_registry import TEMPLATES, place_open_template

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.base.given_files import GivenPath
    from odscen.formats.tracks.recorded_traffic import RecordedTraffic
    from odscen.maps.map_entry import MapEntry
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.templates.scene_template import SceneTemplate

REPORT_FILE = "templates.json"


def write_recorded_templates(
    recorded: RecordedTraffic,
    entry: MapEntry,
    out: GivenPath,
    *,
    place_on: MapEntry | None = None,
    samples: int = 100,
    seed: int = 0,
) -> dict[str, Any]:
    """Write scenarios of the templates that scenes of a recording are of, and cases for sweeps.

    Parameters
    ----------
    entry
        The map in whose frame the recording is.
    out
        Folder. Of each template ``TEMPLATE.scenario.json``, whose parameters may be whatever was
        recorded or drawn, ``TEMPLATE.scenes.json`` (a plan of a sweep: a case for each scene) and
        ``TEMPLATE.samples.json`` (cases drawn from the distribution of the scenes); and
        ``templates.json``, what is given back.
    place_on
        Where the scenarios are; the map of the recording if not given.
    samples
        How many cases are drawn.
    seed
        Of the draws.

    Returns
    -------
    dict
        ``templates``: of each ``scenes`` with their values, ``distribution``
        (:func:`~odscen.formats.tracks.template_fit.describe_values`), ``unfit`` (why other scenes
        are none of it), ``per_100_km``, ``per_hour`` and ``files``; where the map has no room
        for it ``no_room`` says why, and ``cases_left_out`` how many need more than there is.

    Raises
    ------
    InputError
        If the recording has no road user.
    """
    folder, graph = as_path(out), entry.graph()
    placed, _ = fit_on_map(recorded.rows, graph)
    scenes = find_scenes(placed, graph)
    fit, rates = fit_templates(placed, scenes, graph), exposure(placed, scenes)
    folder.mkdir(parents=True, exist_ok=True)
    templates: dict[str, dict[str, Any]] = {}
    for name, unfit in fit.unfit.items():
        own = [scene for scene in fit.scenes if scene.template == name]
        row: dict[str, Any] = {
            "scenes": [scene._asdict() for scene in own],
            "unfit": dict(sorted(unfit.items(), key=lambda item: (-item[1], item[0]))),
            "per_hour": round(len(own) / rates["hours"], 3) if rates["hours"] else None,
            "per_100_km": (
                round(100.0 * len(own) / rates["vehicle_km"], 3) if rates["vehicle_km"] else None
            ),
        }
        templates[name] = row
        if not own:
            continue
        row["distribution"] = describe_values(own)
        cases = {
            "scenes": [scene.values for scene in own],
            "samples": draw_values(own, samples, seed=seed),
        }
        placed_on = place_on or entry
        try:
            scenario, kept, left_out = _place_cases(TEMPLATES[name], placed_on, cases)
        except NoPlaceError as error:
            row["no_room"] = str(error)
            continue
        row["cases_left_out"] = left_out
        row["files"] = [f"{name}{SUFFIX}"]
        write_scenario(scenario, folder / f"{name}{SUFFIX}")
        for kind, values in kept.items():
            if values:
                row["files"].append(f"{name}.{kind}.json")
                write_text(folder / row["files"][-1], json.dumps(_plan_of(values), indent=1) + "\n")
    report = {"exposure": {key: rates[key] for key in ("hours", "vehicle_km")}}
    report |= {"templates": templates}
    write_text(folder / REPORT_FILE, json.dumps(report, indent=1) + "\n")
    return report


def _plan_of(values: Sequence[Mapping[str, float]]) -> dict[str, Any]:
    """Plan of a sweep with these cases."""
    names = list(values[0])
    table = [[row[name] for name in names] for row in values]
    return {"method": "grid", "vary": [{"parameters": names, "table": table}]}


def _place_cases(
    template: SceneTemplate, entry: MapEntry, cases: Mapping[str, Sequence[Mapping[str, float]]]
) -> tuple[Scenario, dict[str, list[Mapping[str, float]]], int]:
    """Place a template with room for all cases, or for as many of the slower ones as there is."""
    loaded = load_map(entry)
    listed = [(kind, values) for kind, rows in cases.items() for values in rows]
    fastest = next(name for name in ("ego_speed", "speed") if name in listed[0][1])
    slowest_first = sorted(range(len(listed)), key=lambda row: listed[row][1][fastest])
    count = len(listed)
    while True:
        kept = [listed[row] for row in sorted(slowest_first[:count])]
        sets = [values for _, values in kept]
        try:
            scenario = place_open_template(
                template, loaded.sumo.graph, loaded.usable, loaded.lights,
                sets=[_middle_of(sets), *sets], name=template.name,
            )  # fmt: skip
        except NoPlaceError:
            if count == 1:
                raise
            count = -(-count // 2)
            continue
        by_kind = {kind: [values for of, values in kept if of == kind] for kind in cases}
        return scenario, by_kind, len(listed) - count


def _middle_of(sets: Sequence[Mapping[str, float]]) -> Mapping[str, float]:
    """The set whose ranks are nearest to the medians."""
    table = np.array([list(values.values()) for values in sets])
    ranks = table.argsort(axis=0, kind="stable").argsort(axis=0, kind="stable")
    away = np.abs(ranks - (len(sets) - 1) / 2.0).sum(axis=1)
    return sets[int(np.argmin(away))]
