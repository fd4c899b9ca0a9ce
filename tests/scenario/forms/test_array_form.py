from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from odscen.base.categories import Category
from odscen.base.errors import InputError, ScenarioError
from odscen.base.given_arrays import Array, npz_bytes
from odscen.lanegraph.graph_npz import from_npz_bytes, to_npz_bytes
from odscen.lanegraph.query import node_ids, walk_node_ids
from odscen.scenario.checks.scenario_checks import check
from odscen.scenario.document.json_form import dumps, loads
from odscen.scenario.document.scenario_document import Actor, Flow, MapReference, Scenario
from odscen.scenario.forms.any_form import read_any
from odscen.scenario.forms.array_form import to_arrays
from odscen.scenario.forms.array_reading import from_arrays
from odscen.workspace.store import Workspace
from tests.graphs import SHA256, fork
from tests.scenario.strategies import scenarios

GRAPH = fork()
HERE = MapReference(name="toy", sha256=SHA256)
NODES = [*node_ids(GRAPH), *walk_node_ids(GRAPH)]


@st.composite
def on_the_map(draw: st.DrawFn) -> Scenario:
    """A scenario of which some names are places of the map, of whichever graph, and some not."""
    scenario = draw(scenarios)
    place = st.sampled_from(NODES)

    def placed(one: Actor | Flow) -> Actor | Flow:
        fields = {"spawn": draw(place), "goal": draw(st.none() | place)}
        if isinstance(one, Actor) and draw(st.booleans()):
            fields["via"] = tuple(draw(st.lists(place, max_size=3)))
        return one.model_copy(update=fields) if draw(st.booleans()) else one

    return scenario.model_copy(
        update={
            "actors": tuple(placed(one) for one in scenario.actors),
            "flows": tuple(placed(one) for one in scenario.flows),
            "roi": (*scenario.roi, *draw(st.lists(st.sampled_from(GRAPH.segments.ids)))),
        }
    )


@settings(deadline=None)
@given(on_the_map())
def test_any_document_comes_back_from_its_arrays_byte_for_byte(scenario: Scenario) -> None:
    arrays = to_arrays(scenario, GRAPH)
    assert from_arrays(arrays) == scenario
    data = npz_bytes(arrays)
    assert dumps(read_any(data)) == dumps(scenario)
    assert npz_bytes(to_arrays(read_any(data), GRAPH)) == data
