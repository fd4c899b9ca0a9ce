"""Whatever id an edit names, it is made or refused in words: for every kind of edit."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any

import pytest
from pydantic import TypeAdapter
from starlette.testclient import TestClient

from odscen.app.maps import load_map
from odscen.app.scenarios import SUFFIX
from odscen.app.variants import apply_edit
from odscen.base.errors import InputError
from odscen.maps.store import Workspace
from odscen.scenario.document.json_form import dumps
from odscen.scenario.document.scenario_document import MapReference, Scenario
from odscen.scenario.edits.edit_messages import EDIT_MESSAGES, read_edit
from tests.signal_case import JUNCTION, one_plan, scenario
from tests.web.conftest import CROSSING

HOSTILE = (
    "",
    "x" * 10_000,
    "\ud800",
    "..",
    "7",
    "\x00",
    "r1>",
    "a.b.c.d",
)
SENT = ("", "x" * 10_000, "\ud800")
JSON = {"Content-Type": "application/json"}
OF_LIGHTS = 14
"""Kinds of edits that name a junction and answered 500 where no light is in it."""


def given(schema: Mapping[str, Any], definitions: Mapping[str, Any], text: str) -> Any:
    """A value that a schema allows, with ``text`` wherever a text may be."""
    if "$ref" in schema:
        return given(definitions[schema["$ref"].rpartition("/")[2]], definitions, text)
    if "const" in schema:
        return schema["const"]
    if "enum" in schema:
        return schema["enum"][0]
    for several in ("anyOf", "oneOf"):
        if several in schema:
            options = schema[several]
            texts = [one for one in options if one.get("type") == "string"]
            return given((texts or options)[0], definitions, text)
    if schema.get("type") == "array":
        rows = schema.get("prefixItems") or [schema.get("items", {"type": "string"})]
        return [given(one, definitions, text) for one in rows]
    if schema.get("type") == "object":
        names = schema.get("required", ())
        return {name: given(schema["properties"][name], definitions, text) for name in names}
    values = {"integer": 1, "number": 1.0, "boolean": True, "null": None}
    return values.get(schema.get("type", "string"), text)


def messages(kind: str, text: str) -> Iterator[dict[str, Any]]:
    """Edits of a kind: with what it needs, with all it may have, and with a light that there is."""
    schema = TypeAdapter(EDIT_MESSAGES[kind]).json_schema()
    definitions = schema.get("$defs", {})
    fields = {
        name: given(field, definitions, text)
        for name, field in schema["properties"].items()
        if name != "kind"
    }
    needed = {name: fields[name] for name in schema.get("required", ()) if name != "kind"}
    for chosen in (needed, fields):
        yield {"kind": kind, **chosen}
        if "junction" in chosen:
            yield {"kind": kind, **chosen, "junction": JUNCTION}


def own_program(workspace: Workspace) -> Scenario:
    """Cars and walkers on the crossing, whose light has a program of the scenario's own."""
    sha256 = workspace.map(CROSSING).info["sha256"]
    reference = MapReference(name=CROSSING, sha256=sha256)
    return scenario(one_plan()).model_copy(update={"map": reference})


@pytest.mark.slow
def test_no_id_breaks_an_edit_of_any_kind(workspace: Workspace) -> None:
    loaded, before = load_map(workspace.map(CROSSING)), own_program(workspace)
    refused = made = 0
    for kind in EDIT_MESSAGES:
        for text in HOSTILE:
            for message in messages(kind, text):
                try:
                    apply_edit(read_edit(message), before, loaded)
                    made += 1
                except InputError:
                    refused += 1
    assert made > 50
    assert refused > 700


@pytest.mark.parametrize("text", SENT, ids=["empty", "long", "surrogate"])
def test_the_server_refuses_what_is_no_id_with_its_words(
    client: TestClient, workspace: Workspace, text: str
) -> None:
    workspace.scenarios.mkdir(exist_ok=True)
    (workspace.scenarios / f"own{SUFFIX}").write_text(dumps(own_program(workspace)))
    version = client.get("/api/scenarios/own").json()["version"]
    statuses, without_light = set(), 0
    for kind in EDIT_MESSAGES:
        edit = next(messages(kind, text))
        if text not in json.loads(json.dumps(edit)).values():
            continue
        body = json.dumps({"version": version, "edits": [edit]})
        # Bytes of our own: the client would not write half of a surrogate pair.
        answer = client.post("/api/scenarios/own/edits?changes=true", content=body, headers=JSON)
        statuses.add(answer.status_code)
        if answer.status_code == 200:
            version = answer.json()["version"]
        else:
            message = answer.json()["error"]["message"]
            assert message, kind
            without_light += "there is no traffic light in junction" in message
    assert statuses <= {200, 404, 422}
    assert without_light == OF_LIGHTS
