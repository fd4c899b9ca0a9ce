"""The tool server for assistants, by a dialogue of the SDK's own client."""

from __future__ import annotations

import asyncio
import json
import os
import sys
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("mcp", reason="needs odscen[assist]")

from mcp import Client
from mcp.client.stdio import StdioServerParameters

from odscen.assistants import make_server
from odscen.maps.store import Workspace

MAP = "motorway_weave"


async def ask(client: Client, tool: str, **arguments: Any) -> dict[str, Any]:
    """Answer of a tool, which is small; what it refuses fails the test."""
    result = await client.call_tool(tool, arguments)
    assert not result.is_error, result.content
    assert len(json.dumps(result.structured_content)) < 30_000
    return dict(result.structured_content or {})


async def refused(client: Client, tool: str, **arguments: Any) -> str:
    """Words of a refusal."""
    result = await client.call_tool(tool, arguments)
    assert result.is_error, result.structured_content
    return str(result.content[0].text)


async def cut_in_dialogue(client: Client) -> None:
    """A van cuts in; then its gap is varied: which cases are unsafe?"""
    found = await ask(client, "find_maps", words="motorway")
    assert (found["maps"], found["shipped_maps_to_add"]) == ([], [MAP])
    assert (await ask(client, "add_shipped_map", map_name=MAP))["lane_metres"] > 1000
    listed = await ask(client, "list_templates")
    assert "cut-in" in [row["template"] for row in listed["templates"]]

    made = await ask(client, "place_template", template="cut-in", map_name=MAP, name="cut-in")
    assert [actor["id"] for actor in made["actors"]] == ["ego", "challenger"]
    assert made["problems"] == []
    van = {"kind": "change_actor", "actor": "challenger", "category": "van"}
    parameter = {"kind": "set_parameter", "parameter": "gap", "value": 2.0, "min": 0.5, "max": 6.0}
    below = {"kind": "set_formula", "place": "rules/cut-in/when/ttc/below", "formula": "$gap"}
    schema = await ask(client, "list_edits", kind="set_formula")
    assert set(schema["arguments"]["properties"]) == {"kind", "place", "formula"}
    edited = await ask(client, "edit_scenario", scenario="cut-in", edits=[van, parameter, below])
    assert edited["actors"][1]["category"] == "van"
    assert edited["parameters"] == {"gap": 2.0}
    undone = await ask(client, "undo_edit", scenario="cut-in")
    assert (undone["actors"][1]["category"], undone["parameters"]) == ("car", {})
    await ask(client, "edit_scenario", scenario="cut-in", edits=[van, parameter, below])

    expect = ["min_ttc >= 2.5 s", "collided == 0"]
    run = await ask(client, "run_scenario", scenario="cut-in", run="first", expect=expect)
    assert run["status"] == "completed"
    measured = {row["expectation"]: row for row in run["verdicts"]}
    assert not measured["min_ttc >= 2.5 s"]["passed"]
    assert measured["min_ttc >= 2.5 s"]["value"] < 2.5
    judged = await ask(client, "judge_run", run="first", expect=["min_ttc >= 0.1 s"])
    assert judged["verdicts"][0]["passed"]
    told = await ask(client, "explain_run", run="first")
    assert "cut-in" in [event["rule"] for event in told["events"]]
    drawn = await client.call_tool("draw_run", {"run": "first"})
    assert drawn.content[0].type in ("image", "text")

    varied = await ask(
        client, "vary_scenario", scenario="cut-in", name="gaps", parameter="gap",
        low=1.0, high=5.0, steps=2, safe=["min_ttc >= 2.5"],
    )  # fmt: skip
    assert [case["gap"] for case in varied["cases"]] == [1.0, 5.0]
    assert 1.0 in varied["not_safe"]
    assert varied["not_safe"] == [c["gap"] for c in varied["cases"] if c["safe"] is False]


@pytest.mark.slow
def test_a_dialogue_from_a_map_to_the_unsafe_cases(tmp_path: Path) -> None:
    """Over standard input and output, with the process that an assistant starts."""
    command = ["-m", "odscen", "assist", "--workspace", str(tmp_path / "workspace")]
    server = StdioServerParameters(command=sys.executable, args=command, env=dict(os.environ))

    async def talk() -> None:
        async with Client(server) as client:
            await cut_in_dialogue(client)

    asyncio.run(talk())
    assert [path.name for path in tmp_path.iterdir()] == ["workspace"]


def test_hostile_arguments_get_nowhere(tmp_path: Path) -> None:
    """Paths for names, endless runs, unknown edits: refused in words, and nothing is written."""
    workspace = Workspace.open(tmp_path / "workspace")
    (tmp_path / "secret.scenario.json").write_text("{}")
    before = sorted(tmp_path.rglob("*"))

    async def talk() -> None:
        async with Client(make_server(workspace)) as client:
            for name in ("../secret", "/etc/passwd", "a/b", "..", "", "a\x00b", "x" * 300):
                for tool, key in (("show_scenario", "scenario"), ("explain_run", "run")):
                    assert "name" in await refused(client, tool, **{key: name})
                words = await refused(
                    client, "place_template", template="cut-in", map_name=name, name="x"
                )
                assert "name" in words
                await refused(client, "add_shipped_map", map_name=name)
                await refused(client, "draw_map", map_name=name)
            edit = {"kind": "import_module", "module": "os"}
            await refused(client, "edit_scenario", scenario="none", edits=[edit])
            assert "no edit named" in await refused(client, "list_edits", kind="__class__")
            assert "steps must lie between 2 and 50" in await refused(
                client, "vary_scenario", scenario="none", name="n", parameter="p",
                low=0.0, high=1.0, steps=10**9,
            )  # fmt: skip
            resources = await client.list_resources()
            assert [str(one.uri) for one in resources.resources] == [
                "odscen://schemas/scenario",
                "odscen://schemas/edits",
            ]

    asyncio.run(talk())
    assert sorted(tmp_path.rglob("*")) == before
