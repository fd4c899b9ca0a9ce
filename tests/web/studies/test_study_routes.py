"""Studies as the page asks for them: begun, stopped, resumed, and what has come of them."""

from __future__ import annotations

from typing import Any

import polars as pl
import pytest
from starlette.testclient import TestClient

from odscen.experiments.study_page import study_groups
from odscen.maps.store import Workspace
from tests.web.conftest import wait_for

WET = "HardRainNoon"


def asked(client: TestClient, path: str, body: Any = None, *, status: int = 202) -> Any:
    answer = client.post(f"/api/studies{path}", json=body)
    assert answer.status_code == status, answer.text
    return answer.json()


def ended(client: TestClient, study: str) -> dict[str, Any]:
    def over() -> dict[str, Any] | None:
        info: dict[str, Any] = client.get(f"/api/studies/{study}").json()
        return info if info["state"] != "running" else None

    found: dict[str, Any] = wait_for(over, seconds=120)
    return found


def table_of(workspace: Workspace, study: str) -> bytes:
    return (workspace.studies / study / "results.parquet").read_bytes()


@pytest.mark.slow
def test_scenarios_run_with_every_weather_and_seed(
    client: TestClient, workspace: Workspace, sampled: str
) -> None:
    wish = {"scenarios": [sampled], "weather": [WET], "seeds": 2, "until": 20, "processes": 2}
    begun = asked(client, "", wish)
    assert (begun["state"], begun["runs"], begun["study"]) == ("running", 4, f"{sampled}-1")
    done = ended(client, begun["study"])
    assert (done["state"], done["ended"], done["completed"]) == ("done", 4, 4)
    assert (done["variants"], done["problems"]) == (["as-designed", WET], [])
    assert client.get("/api/studies").json() == [done]

    path = f"/api/studies/{done['study']}"
    found = client.get(f"{path}/results", params={"figure": "mean_speed"}).json()
    groups, (difference,) = study_groups(workspace.studies / done["study"], ["mean_speed"])
    assert [one["variant"] for one in found["groups"]] == ["as-designed", WET]
    assert [one["mean"] for one in found["groups"]] == [
        one.figures["mean_speed"].mean for one in groups
    ]
    table = pl.read_parquet(workspace.studies / done["study"] / "results.parquet")
    assert [v for one in found["groups"] for v in one["values"]] == table["mean_speed"].to_list()
    assert found["differences"][0]["mean"] == difference.figures["mean_speed"].mean
    speed = {"name": "mean_speed", "label": "mean speed", "unit": "m/s", "better": "higher"}
    assert speed in found["figures"]
    assert found["between"] == []

    page = client.get(f"{path}/files/study.html")
    assert "All runs completed" in page.text
    assert client.get(f"{path}/files/results.parquet").content == table_of(workspace, done["study"])
    for name in ("study.json", "journal.jsonl", "..%2Fstudy.json"):
        assert client.get(f"{path}/files/{name}").status_code == 404
    refused = client.get(f"{path}/results", params={"figure": "speediness"})
    assert "no figure of runs is called 'speediness'" in refused.json()["error"]["message"]
    again = client.post(f"{path}/resume", json={})
    assert (again.status_code, client.post(f"{path}/stop").status_code) == (409, 409)
    assert client.delete(path).status_code == 204
    assert client.get(path).status_code == 404


@pytest.mark.slow
def test_two_scenarios_are_compared_run_by_run_of_the_same_seed(
    client: TestClient, workspace: Workspace, sampled: str
) -> None:
    other = client.post(f"/api/scenarios/{sampled}/copy", json={"name": "slower"}).json()
    edits = [
        {"kind": "change_actor", "actor": one["id"], "speed": 4.0}
        for one in other["document"]["actors"]
        if one["category"] != "pedestrian"
    ]
    wish = {"version": other["version"], "edits": edits}
    assert client.post("/api/scenarios/slower/edits", json=wish).status_code == 200
    study = asked(client, "", {"scenarios": [sampled, "slower"], "seeds": 3, "until": 20})["study"]
    ended(client, study)
    path = f"/api/studies/{study}/results"
    assert client.get(path).json()["figure"] == "mean_delay"
    (found,) = client.get(path, params={"figure": "mean_speed"}).json()["between"]
    table = pl.read_parquet(workspace.studies / study / "results.parquet")
    of = {
        name: part.sort("seed")["mean_speed"]
        for (name,), part in table.group_by("scenario", maintain_order=True)
    }
    differences = of["slower"] - of[sampled]
    assert found["scenario"] == "slower"
    assert found["values"] == pytest.approx(differences.to_list())
    assert found["mean"] == pytest.approx(differences.mean())
    # Student's t of two degrees of freedom, 95 %.
    assert found["half_width"] == pytest.approx(4.3027 * differences.std() / 3**0.5, rel=1e-4)
    assert found["mean"] + found["half_width"] < 0


@pytest.mark.slow
def test_a_study_that_was_stopped_and_resumed_has_the_same_table(
    client: TestClient, workspace: Workspace, sampled: str
) -> None:
    wish = {"scenarios": [sampled], "seeds": 4, "until": 20}
    whole, parted = {**wish, "name": "whole", "processes": 2}, {**wish, "name": "parted"}
    asked(client, "", whole)
    assert ended(client, "whole")["state"] == "done"
    asked(client, "", parted)
    refused = client.post("/api/studies", json={**wish, "name": "third"})
    assert "study 'parted' is under way" in refused.json()["error"]["message"]
    wait_for(lambda: client.get("/api/studies/parted").json()["ended"] >= 1, seconds=60)
    asked(client, "/parted/stop")
    stopped = ended(client, "parted")
    assert stopped["state"] == "stopped"
    assert 1 <= stopped["ended"] < 4
    partly = client.get("/api/studies/parted/results").json()
    assert partly["groups"][0]["runs"] == stopped["ended"]
    asked(client, "/parted/resume", {"processes": 2})
    assert ended(client, "parted")["state"] == "done"
    assert table_of(workspace, "parted") == table_of(workspace, "whole")


@pytest.mark.slow
def test_runs_that_are_not_possible_are_told_with_their_words(
    client: TestClient, sampled: str
) -> None:
    wish = {"name": "none", "scenarios": [sampled], "seeds": 2, "weather": ["Hail"], "until": 1}
    asked(client, "", wish)
    done = ended(client, "none")
    assert (done["state"], done["ended"], done["completed"]) == ("done", 4, 2)
    (problem,) = done["problems"]
    assert problem["runs"] == 2
    assert "Hail" in problem["words"]


@pytest.mark.parametrize(
    ("changes", "status", "words"),
    [
        ({"scenarios": ["other"]}, 404, "no scenario named 'other'"),
        ({"scenarios": ["../other"]}, 404, "no scenario named '../other'"),
        ({"name": "../x"}, 422, "study name '../x' cannot be used"),
        ({"seeds": 0}, 422, "greater than or equal to 1"),
        ({"seeds": 10_000, "weather": [WET]}, 422, "these are 20,000 runs"),
        ({"weather": [WET, WET]}, 422, "each needs a name of its own"),
    ],
)
def test_what_cannot_be_studied_is_refused_and_leaves_nothing(
    client: TestClient,
    workspace: Workspace,
    sampled: str,
    changes: dict[str, Any],
    status: int,
    words: str,
) -> None:
    answer = client.post("/api/studies", json={"scenarios": [sampled], **changes})
    assert answer.status_code == status
    assert words in answer.text
    assert not workspace.studies.exists() or not list(workspace.studies.iterdir())


def test_two_studies_have_two_names(client: TestClient, workspace: Workspace, sampled: str) -> None:
    (workspace.studies / "mine").mkdir(parents=True)
    answer = client.post("/api/studies", json={"scenarios": [sampled], "name": "mine"})
    assert answer.status_code == 409
    assert "give this one another name" in answer.text
