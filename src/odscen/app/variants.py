"""Edits of a scenario by name, and variants: scenarios that know what they were made of."""

from __future__ import annotations

import inspect
import json
from typing import TYPE_CHECKING, Any

from pydantic_core import from_json

from odscen.app.generators import placer_of
from odscen.app.maps import map_of
from odscen.app.scenarios import read_scenario, scenario_name
from odscen.base.errors import InputError, ScenarioError, in_file
from odscen.base.given_files import as_path, read_given_text
from odscen.scenario.document.json_form import content_sha256
from odscen.scenario.document.scenario_document import Variant
from odscen.scenario.edits.edit_messages import read_edit
from odscen.scenario.edits.edit_registry import EDIT_ENTRIES

if TYPE_CHECKING:
    from collections.abc import Iterable

    from odscen.app.maps import LoadedMap
    from odscen.base.given_files import GivenPath
    from odscen.maps.store import Workspace
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.edits.edit_messages import EditBase


def apply_edit(edit: EditBase, scenario: Scenario, loaded: LoadedMap) -> Scenario:
    """Return the scenario that the edit makes of another.

    Raises
    ------
    InputError
        If a rule forbids it.
    """
    function = EDIT_ENTRIES[edit.kind].function
    known: dict[str, Any] = {
        "graph": loaded.sumo.graph,
        "lights": loaded.lights,
        "usable": loaded.usable,
        "place_by": placer_of(loaded),
    }
    ours = {name: known[name] for name in inspect.signature(function).parameters if name in known}
    return function(scenario, **ours, **edit.arguments)


def read_edits(path: GivenPath) -> list[EditBase]:
    """Read edits from a JSON file: a list of them, or one.

    Raises
    ------
    InputError
        If the file cannot be read, or is not JSON.
    ScenarioError
        If an edit cannot be read; names its place in the list.
    """
    path = as_path(path)
    try:
        data = from_json(read_given_text(path))
    except ValueError as error:
        raise InputError(f"this is not JSON: {error}", file=str(path)) from error
    with in_file(str(path)):
        ones = data if isinstance(data, list) else [data]
        if len(ones) > MOST_EDITS:
            raise InputError(
                f"this has {len(ones):,} edits; the limit is {MOST_EDITS:,}. Make a variant of the "
                "variant, or edit from Python"
            )
        return [_read_edit(edit, place=f"edits[{index}]") for index, edit in enumerate(ones)]


def edits_of_settings(settings: Iterable[str]) -> list[EditBase]:
    """Read edits from ``KIND.FIELD=VALUE``; fields of one kind that follow each other are one edit.

    A value is JSON, or else plain text. A field that is given again begins another edit.

    Raises
    ------
    InputError
        If a setting is not of that form.
    ScenarioError
        If an edit cannot be read.
    """
    found: list[dict[str, Any]] = []
    for setting in settings:
        name, equals, text = setting.partition("=")
        kind, dot, field = name.strip().partition(".")
        if not (equals and dot and kind and field):
            raise InputError(
                f"--set {setting!r}: write KIND.FIELD=VALUE, such as set_simulation.duration=900"
            )
        if not found or found[-1]["kind"] != kind or field in found[-1]:
            found.append({"kind": kind})
        found[-1][field] = _read_value(text)
    return [_read_edit(row, place=f"--set {row['kind']}") for row in found]


def make_variant(
    workspace: Workspace, parent: GivenPath, edits: Iterable[EditBase], *, name: str
) -> Scenario:
    """Make a scenario of another one by edits, all of them or none.

    Parameters
    ----------
    parent
        Scenario file.
    name
        Of the new scenario, unless an edit names it.

    Returns
    -------
    Scenario
        The variant; its ``variant`` names parent and edits.

    Raises
    ------
    InputError
        If there are no edits, or the parent cannot be read.
    ScenarioError
        If an edit is not possible; names it.
    """
    old = read_scenario(parent)
    ones = list(edits)
    if not ones:
        raise InputError("a variant differs from its parent; give a file of edits, or --set")
    new = edited(
        old.model_copy(update={"name": name, "variant": None}), ones, map_of(workspace, old)
    )
    variant = Variant(
        parent=scenario_name(parent),
        parent_sha256=content_sha256(old),
        sha256=content_sha256(new),
        edits=tuple(base.data for base in ones),
    )
    return new.model_copy(update={"variant": variant})


MOST_EDITS = 1000
"""In a file. Each edit looks at the whole document: the work is that of edits times parts."""


def edited(scenario: Scenario, edits: Iterable[EditBase], loaded: LoadedMap) -> Scenario:
    """Return a scenario with edits, one after the other.

    Raises
    ------
    ScenarioError
        If an edit is not possible; names it.
    """
    for index, edit in enumerate(edits):
        try:
            scenario = apply_edit(edit, scenario, loaded)
        except ScenarioError as error:
            raise ScenarioError(f"edit {index + 1}, {edit.label!r}: {error}") from error
    return scenario


def _read_edit(data: Any, *, place: str) -> EditBase:
    if not isinstance(data, dict):
        raise ScenarioError(
            f"{place}: an edit is an object with its kind, such as {json.dumps(_EXAMPLE)}"
        )
    try:
        return read_edit(data)
    except ScenarioError as error:
        raise ScenarioError(f"{place}: {error}", problems=error.problems) from error


_EXAMPLE = {"kind": "set_seed", "seed": 3}


def _read_value(text: str) -> Any:
    try:
        return from_json(text)
    except ValueError:
        return text
