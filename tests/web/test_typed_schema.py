"""No message of the OpenAPI schema is untyped, and the types are those of real data."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path
from typing import Any, get_type_hints

import pytest
from pydantic import BaseModel, TypeAdapter
from starlette.testclient import TestClient

from odscen.app.scenarios import SUFFIX
from odscen.base.checksums import SUMS_FILE
from odscen.figures.measures.registry import COUNTS
from odscen.lanegraph.map_statistics import MapStatistics
from odscen.maps.store import Workspace
from odscen.records.run_events import Event, EventKind, event_row
from odscen.runs import layout
from odscen.web.wire.live_messages import LiveMessage
from odscen.web.wire.map_messages import (
    ConversionInfo,
    DrawingColumns,
    GraphColumns,
    MapDetails,
    SemanticsInfo,
)
from odscen.web.wire.run_messages import IncidentInfo, ReplayColumns
from odscen.web.wire.summary_messages import RunSummary, SummaryCounts
from tests.cli.conftest import odscen
from tests.web.conftest import CROSSING, finished, openapi_schema

NAMES_ONLY = {"properties", "patternProperties", "schemas"}
"""Their keys are names and not words of JSON Schema."""
WORDS = {"default", "example", "examples", "enum", "const", "required", "discriminator"}
"""What lies below is no schema."""


def schemas(value: Any, place: str) -> Iterator[tuple[str, dict[str, Any]]]:
    """Every schema within a schema, with its place."""
    if isinstance(value, list):
        for number, one in enumerate(value):
            yield from schemas(one, f"{place}[{number}]")
    if not isinstance(value, dict):
        return
    yield place, value
    for word, below in value.items():
        if word in NAMES_ONLY:
            for name, one in below.items():
                yield from schemas(one, f"{place}.{name}")
        elif word not in WORDS:
            yield from schemas(below, place)


def untyped(schema: dict[str, Any]) -> bool:
    """Whether a schema allows anything, or an object of which nothing is known."""
    says = schema.keys() - {"title", "description", "default"}
    if not says:
        return True
    if schema.get("additionalProperties") is True or schema.get("additionalProperties") == {}:
        return True
    inside = {"properties", "additionalProperties", "patternProperties", "allOf", "oneOf", "anyOf"}
    return schema.get("type") == "object" and not inside & schema.keys()


def test_no_message_has_an_untyped_part() -> None:
    found = [
        place
        for name, component in openapi_schema()["components"]["schemas"].items()
        for place, schema in schemas(component, name)
        if untyped(schema)
    ]
    assert found == []


def test_every_answer_and_argument_has_a_schema() -> None:
    found = []
    errors = {"#/components/responses/Error": openapi_schema()["components"]["responses"]["Error"]}
    for path, methods in openapi_schema()["paths"].items():
        for method, operation in methods.items():
            where = f"{method} {path}"
            contents = {
                f"{where} {status}": errors.get(answer.get("$ref"), answer).get("content", {})
                for status, answer in operation["responses"].items()
                if status not in ("204", "304")  # have no body
            }
            if "requestBody" in operation:
                contents[f"{where} body"] = operation["requestBody"]["content"]
            found += [place for place, content in contents.items() if not content]
            parts = {
                f"{place} {kind}": part["schema"]
                for place, content in contents.items()
                for kind, part in content.items()
            }
            for argument in operation.get("parameters", ()):
                parts[f"{where} {argument['name']}"] = argument["schema"]
            for place, part in parts.items():
                found += [inner for inner, one in schemas(part, place) if untyped(one)]
    assert found == []


def test_an_untyped_part_would_be_found() -> None:
    class Loose(BaseModel):
        anything: Any
        mapping: dict[str, Any]
        bare: dict
        rows: list[dict[str, Any]]
        good: dict[str, float]

    found = {place for place, one in schemas(Loose.model_json_schema(), "Loose") if untyped(one)}
    assert found == {"Loose.anything", "Loose.mapping", "Loose.bare", "Loose.rows"}


def same(model: Any, data: Any) -> None:
    """Nothing is lost and nothing refused when a message is made of real data."""
    adapter = TypeAdapter(model)
    text = json.dumps(data)
    made = adapter.validate_json(text, extra="forbid")
    assert adapter.dump_python(made, mode="json", by_alias=True, exclude_unset=True) == data


def test_what_the_catalogue_has_of_a_map_is_what_the_schema_says(
    client: TestClient, workspace: Workspace
) -> None:
    info = workspace.map(CROSSING).info
    same(SemanticsInfo, info["semantics"])
    same(ConversionInfo, info["report"])
    assert set(info["statistics"]) == {field.name for field in fields(MapStatistics)}
    details = client.get(f"/api/maps/{CROSSING}").json()
    for part in ("statistics", "graph", "sumo", "opendrive", "semantics"):
        assert details[part] == json.loads(json.dumps(info[part])), part
    same(MapDetails, details)


@pytest.mark.slow
def test_columns_that_are_sent_unchecked_are_what_the_schema_says(
    client: TestClient, sampled: str
) -> None:
    same(GraphColumns, client.get(f"/api/maps/{CROSSING}/graph").json())
    same(DrawingColumns, client.get(f"/api/maps/{CROSSING}/drawing").json())
    run = client.post("/api/runs", json={"scenario": sampled, "until": 5}).json()["run"]
    finished(client, run)
    replay = client.get(f"/api/runs/{run}/trajectories").json()
    assert len(replay["times"]) > 0
    same(ReplayColumns, replay)


@pytest.mark.slow
def test_the_summary_of_a_run_is_what_the_schema_says(
    client: TestClient, workspace: Workspace, sampled: str
) -> None:
    run = client.post("/api/runs", json={"scenario": sampled, "until": 20}).json()["run"]
    finished(client, run)
    file = workspace.runs / run / layout.SUMMARY_FILE
    written = json.loads(file.read_text(encoding="utf-8"))
    same(RunSummary, written)
    answered = client.get(f"/api/runs/{run}/summary").json()
    assert {name: answered[name] for name in written} == written
    assert written["figures"]["mean_speed"] > 0


@pytest.mark.slow
def test_the_summary_of_a_long_run_with_expectations_and_one_that_failed_too(
    workspace: Workspace, sampled: str, tmp_path: Path
) -> None:
    path = workspace.scenarios / f"{sampled}{SUFFIX}"
    common = ["run", str(path), "--workspace", str(workspace.root)]
    long = ["--until", "20", "--slice", "10", "--criticality", "--expect", "arrived>=0"]
    failed = ["--until", "5h", "--step-length", "0.01", "--time-limit", "1"]
    assert odscen(*common, *long, "--out", str(tmp_path / "long")).code == 0
    document = json.loads(path.read_text(encoding="utf-8"))
    document["demand"] = {"background": [{"id": "some", "per_km": 5}]}
    path.write_text(json.dumps(document), encoding="utf-8")
    assert odscen(*common, *failed, "--out", str(tmp_path / "failed")).code == 3
    summaries = {}
    for name in ("long", "failed"):
        (file,) = (tmp_path / name).rglob(layout.SUMMARY_FILE)
        summaries[name] = json.loads(file.read_text(encoding="utf-8"))
        same(RunSummary, summaries[name])
    assert len(summaries["long"]["slices"]["done"]) == 2
    assert summaries["long"]["expectations"][0]["passed"]
    assert "min_ttc" in summaries["long"]["figures"]
    assert summaries["failed"]["actors"]["arrived"] is None


def test_counts_of_actors_and_events_are_those_of_the_results() -> None:
    assert set(SummaryCounts.model_fields) == set(COUNTS)
    assert tuple(IncidentInfo.model_fields) == Event._fields
    hints = get_type_hints(IncidentInfo)
    for name, hint in get_type_hints(Event).items():
        assert hints[name] == hint, name
        assert IncidentInfo.model_fields[name].is_required() == (name not in Event._field_defaults)


def test_an_incident_is_sent_as_it_stands_in_the_file_of_events() -> None:
    row = event_row(
        Event(time=1.5, kind=EventKind.COLLISION, actor="car-1", partner="car-2", x=3.0, y=-2.25)
    )
    assert IncidentInfo(**row).model_dump(mode="json") == row
    assert set(row) == {"time", "kind", "actor", "partner", "x", "y"}


@pytest.mark.parametrize("kind", ["hello", "state", "lights", "detectors", "events", "end"])
def test_the_schema_has_the_texts_of_the_live_view(kind: str) -> None:
    told = openapi_schema()["components"]["schemas"]["LiveMessage"]
    assert (
        told["discriminator"]["mapping"][kind].removeprefix("#/components/schemas/")
        in (openapi_schema()["components"]["schemas"])
    )


@pytest.mark.slow
def test_every_text_of_the_live_view_is_of_the_schema(client: TestClient, sampled: str) -> None:
    wish = {"scenario": sampled, "until": 10, "paused": True}
    run = client.post("/api/runs", json=wish).json()["run"]
    texts = []
    with client.websocket_connect(f"/api/runs/{run}/live") as socket:
        while True:
            message = socket.receive()
            if message["type"] == "websocket.close":
                break
            if message.get("text") is None:
                socket.send_text("ack")
                client.post(f"/api/runs/{run}/control", json={"action": "resume"})
            else:
                texts.append(json.loads(message["text"]))
    assert {"hello", "state", "lights", "end"} <= {text["type"] for text in texts}
    for text in texts:
        same(LiveMessage, text)


@pytest.mark.slow
def test_a_run_of_an_earlier_version_still_opens_and_one_that_cannot_be_read_is_failed(
    client: TestClient, workspace: Workspace, sampled: str
) -> None:
    run = client.post("/api/runs", json={"scenario": sampled, "until": 5}).json()["run"]
    finished(client, run)
    old, broken = (shutil.copytree(workspace.runs / run, workspace.runs / n) for n in ("a", "b"))
    for copied in (old, broken):
        (copied / SUMS_FILE).unlink()  # earlier versions kept no checksums
    summary = json.loads((old / layout.SUMMARY_FILE).read_text(encoding="utf-8"))
    for name in ("gridlock", "expectations", "notes", "meso"):
        del summary[name]
    summary["of_a_later_version"] = {"kept": True}
    (old / layout.SUMMARY_FILE).write_text(json.dumps(summary), encoding="utf-8")
    (broken / layout.SUMMARY_FILE).write_text("{}", encoding="utf-8")
    rows = {row["run"]: row for row in client.get("/api/runs").json()}
    assert rows["a"]["state"] == rows[run]["state"] == "completed"
    assert rows["b"]["state"] == "failed"
    assert "summary.json: not the summary of a run" in rows["b"]["error"]
    told = client.get("/api/runs/a").json()["summary"]
    assert (told["gridlock"], told["notes"]) == (None, [])
    assert client.get("/api/runs/b/summary").status_code == 404
