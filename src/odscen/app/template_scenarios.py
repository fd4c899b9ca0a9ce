"""Templates: offered, and placed on maps."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

from odscen.app.maps import load_map
from odscen.app.scenarios import SUFFIX, write_scenario
from odscen.base.errors import ConflictError
from odscen.base.given_files import as_path
from odscen.maps.folder_names import check_name
from odscen.scenario.templates.scene_sites import NoPlaceError
from odscen.scenario.templates.template_registry import TEMPLATES, find_template, place_template

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from odscen.base.given_files import GivenPath
    from odscen.maps.map_entry import MapEntry
    from odscen.maps.store import Workspace
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.templates.scene_template import SceneTemplate


def templates() -> tuple[SceneTemplate, ...]:
    """List the templates that can be placed on maps.

    Returns
    -------
    tuple of SceneTemplate
        In the order in which they are offered.
    """
    return tuple(TEMPLATES.values())


def template_scenario(
    workspace: Workspace,
    template: str,
    map_name: str,
    *,
    values: Mapping[str, float] | None = None,
    name: str | None = None,
) -> Scenario:
    """Place a template on a map.

    Parameters
    ----------
    workspace
        Has the map.
    template
        Its name, one of :func:`templates`.
    map_name
        Map of the workspace.
    values
        Numbers that differ from the template's, by the names of its parameters.
    name
        Of the scenario; made of those of template and map if not given.

    Returns
    -------
    Scenario
        The scene on the first place of the map that has room; the same map and numbers give the
        same document.

    Raises
    ------
    NotFoundError
        If there is no such template or map.
    InputError
        If a number is unknown or out of its range.
    NoPlaceError
        If the map has no room; says where was looked and why not.
    """
    found = find_template(template)
    loaded = load_map(workspace.map(map_name))
    return place_template(
        found,
        loaded.sumo.graph,
        loaded.usable,
        loaded.lights,
        values=values or {},
        name=name or f"{template}-{map_name}",
    )


def why_no_room(
    workspace: Workspace,
    template: str,
    map_name: str,
    *,
    values: Mapping[str, float] | None = None,
) -> str:
    """Say why a map has no room for a template, before it is placed.

    Parameters
    ----------
    values
        As in :func:`template_scenario`.

    Returns
    -------
    str
        Where was looked and why not; empty if there is room.

    Raises
    ------
    NotFoundError
        If there is no such template or map.
    InputError
        If a number is unknown or out of its range.
    """
    wanted = tuple(sorted((values or {}).items()))
    return _explain_no_room(find_template(template), workspace.map(map_name), wanted)


@lru_cache(maxsize=1024)
def _explain_no_room(
    template: SceneTemplate, entry: MapEntry, values: tuple[tuple[str, float], ...]
) -> str:
    """Look once for each map as it is and numbers: it takes up to seconds."""
    loaded = load_map(entry)
    try:
        place_template(
            template,
            loaded.sumo.graph,
            loaded.usable,
            loaded.lights,
            values=dict(values),
            name=template.name,
        )
    except NoPlaceError as error:
        return str(error)
    return ""


def write_template(
    workspace: Workspace,
    template: str,
    map_name: str,
    *,
    values: Mapping[str, float] | None = None,
    name: str | None = None,
    out: GivenPath | None = None,
) -> Path:
    """Place a template on a map and write its scenario, into the workspace if not elsewhere.

    Raises
    ------
    ConflictError
        If the file is there already.
    OdscenError
        As in :func:`template_scenario`.
    """
    scenario = template_scenario(workspace, template, map_name, values=values, name=name)
    check_name(scenario.name, what="scenario")
    folder = workspace.scenarios if out is None else as_path(out)
    file = folder / f"{scenario.name}{SUFFIX}"
    if file.exists():
        raise ConflictError(f"{file} is there already; give the scenario another name")
    return write_scenario(scenario, file)
