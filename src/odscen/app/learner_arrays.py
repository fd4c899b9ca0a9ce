"""Scenarios as arrays for programs that learn, and back."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.app.maps import map_of
from odscen.app.scenarios import given_scenario
from odscen.scenario.forms.array_form import to_arrays
from odscen.scenario.forms.array_reading import from_arrays

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.base.given_arrays import Array
    from odscen.base.given_files import GivenPath
    from odscen.maps.store import Workspace
    from odscen.scenario.document.scenario_document import Scenario


def scenario_arrays(workspace: Workspace, scenario: Scenario | GivenPath) -> dict[str, Array]:
    """Write a scenario and the graphs of its map as arrays.

    Parameters
    ----------
    workspace
        Has the map.
    scenario
        The scenario, or its file.

    Returns
    -------
    dict of str to numpy.ndarray
        Columns of actors and flows, environment, region, graphs of the map, and ``document`` with
        all the rest; shapes, units (SI) and types are in docs/learning-formats.md.

    Raises
    ------
    NotFoundError
        If the workspace has no such map.
    InputError
        If the file cannot be read, or the map of that name has other content.
    ScenarioError
        If the file is not a scenario, or the map has other nodes than it was made on.
    """
    document = given_scenario(scenario)
    return to_arrays(document, map_of(workspace, document).sumo.graph)


def scenario_from_arrays(arrays: Mapping[str, Array]) -> Scenario:
    """Make a scenario of its arrays, as they were written or as they have been changed.

    Nothing is run or placed: ``odscen.check`` says what is wrong with it on its map.

    Parameters
    ----------
    arrays
        As of :func:`scenario_arrays`, the map's included; rows may have been changed, removed and
        added.

    Returns
    -------
    Scenario
        The document; of unchanged arrays the same, byte for byte.

    Raises
    ------
    InputError
        If an array is missing, of another shape or kind, or names a node, segment or row that is
        not there.
    ScenarioError
        If a value is not possible; names each with its array and row.
    """
    return from_arrays(arrays)
