"""Small scenarios that much is wrong with: short answers, and a server that answers meanwhile."""

from __future__ import annotations

import http.client
import json
import re
import threading
from pathlib import Path
from typing import Any

import pytest
from starlette.testclient import TestClient

from odscen.app.scenarios import SUFFIX
from odscen.cli import commands
from odscen.maps.store import Workspace
from odscen.web.routes import scenario_routes
from tests.web.conftest import serving

LIMITS = Path(__file__).parents[2] / "docs" / "limits.md"


def rules_of_one_actor(workspace: Workspace, name: str, number: int) -> bytes:
    """A scenario with so many rules that all move its first vehicle, and none of which waits."""
    path = workspace.scenarios / f"{name}{SUFFIX}"
    document: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    rules = [
        {
            "id": f"r{n}",
            "actor": document["actors"][0]["id"],
            "when": {"time": {"after": float(n)}},
            "then": [{"speed": {"to": 5.0, "over": 2.0}}],
        }
        for n in range(number)
    ]
    return json.dumps(document | {"rules": rules}).encode()


@pytest.mark.slow
def test_an_upload_of_many_rules_of_one_actor_is_answered_in_proportion(
    client: TestClient, workspace: Workspace, sampled: str
) -> None:
    content = rules_of_one_actor(workspace, sampled, 1000)
    answer = client.post("/api/scenarios/upload", files={"file": ("many.json", content)})
    assert answer.status_code == 201
    found = [one for one in answer.json()["problems"] if one["code"] == "rules_at_once"]
    assert len(found) == 201
    assert found[-1]["message"] == "and 499,300 more of this kind"
    document = json.dumps(answer.json()["document"])
    assert len(answer.content) < len(document) + 200_000


@pytest.mark.parametrize(
    ("method", "path", "body"),
    [
        ("GET", "/api/scenarios/{name}", None),
        ("GET", "/api/scenarios/{name}/problems", None),
        ("POST", "/api/scenarios/{name}/edits", {"edits": [{"kind": "set_seed", "seed": 6}]}),
    ],
)
def test_health_is_answered_while_a_scenario_is_checked(
    workspace: Workspace,
    sampled: str,
    monkeypatch: pytest.MonkeyPatch,
    method: str,
    path: str,
    body: dict[str, Any] | None,
) -> None:
    checking, healthy = threading.Event(), threading.Event()
    check = scenario_routes.check

    def waiting_check(*arguments: Any, **options: Any) -> Any:
        checking.set()
        assert healthy.wait(60), "health was not answered while the scenario was checked"
        return check(*arguments, **options)

    with serving(workspace, hosts=None) as address:

        def ask(method: str, path: str, body: dict[str, Any] | None = None) -> tuple[int, Any]:
            connection = http.client.HTTPConnection(address, timeout=60)
            sent = None if body is None else json.dumps(body)
            kind = {"Content-Type": "application/json"}
            connection.request(method, path, sent, kind)
            answer = connection.getresponse()
            status, content = answer.status, answer.read()
            connection.close()
            return status, json.loads(content)

        own = path.format(name=sampled)
        status, state = ask("GET", f"/api/scenarios/{sampled}")
        assert status == 200
        monkeypatch.setattr(scenario_routes, "check", waiting_check)
        statuses: list[int] = []
        given = None if body is None else body | {"version": state["version"]}
        asking = threading.Thread(target=lambda: statuses.append(ask(method, own, given)[0]))
        asking.start()
        assert checking.wait(60)
        assert ask("GET", "/api/health")[0] == 200
        healthy.set()
        asking.join()
    assert statuses == [200]


@pytest.mark.slow
def test_edits_of_one_request_have_so_much_time_and_are_made_all_or_none(
    client: TestClient, sampled: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each looks at the whole document: of closures 5,000 took three minutes."""
    before = client.get(f"/api/scenarios/{sampled}").json()
    place = before["document"]["roi"][0]
    closures = [{"kind": "closure", "id": f"m{n}", "places": [place]} for n in range(400)]
    edits = [{"kind": "set_measure", "measure": measure} for measure in closures]
    body = {"version": before["version"], "edits": edits}
    monkeypatch.setattr("odscen.web.routes.scenario_routes._EDIT_SECONDS", 0.01)
    answer = client.post(f"/api/scenarios/{sampled}/edits", json=body)
    assert answer.status_code == 422
    assert "these 400 edits take longer than 0.01 s" in answer.json()["error"]["message"]
    assert client.get(f"/api/scenarios/{sampled}").json() == before
    monkeypatch.undo()
    answer = client.post(f"/api/scenarios/{sampled}/edits", json=body)
    assert answer.status_code == 200
    assert len(answer.json()["document"]["measures"]) == 400


@pytest.mark.slow
def test_each_command_and_route_has_its_limits_in_the_document(client: TestClient) -> None:
    table = LIMITS.read_text("utf-8").partition("## Commands and routes")[2]
    rows = [line.split("|")[1:4] for line in table.splitlines() if line.startswith("| `")]
    assert all(limits.strip() for _, _, limits in rows)
    of_commands, of_routes = (
        {*re.findall("`([a-z-]+)`", " ".join(row[column] for row in rows))} for column in (0, 1)
    )
    assert of_commands == {*commands._COMMANDS, *commands._GROUPS}
    paths = client.get("/api/openapi.json").json()["paths"]
    assert of_routes == {path.split("/")[2] for path in paths}
