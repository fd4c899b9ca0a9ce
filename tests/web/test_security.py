from __future__ import annotations

import base64
import hashlib
import re
from collections.abc import Iterator
from urllib.parse import quote

import pytest
from starlette.testclient import TestClient
from starlette.websockets import WebSocketDisconnect

from odscen.maps.store import Workspace
from odscen.web.application import create_app

TRAVERSALS = (
    "..", "../x", "..%2fx", "%2e%2e%2fmaps", "..%5cx", "/etc/passwd", ".history", "a%00b", "a%0ab",
    "%2fetc%2fpasswd", "C:x", "x" * 65,
)  # fmt: skip


@pytest.fixture
def guarded(workspace: Workspace) -> Iterator[TestClient]:
    app = create_app(workspace, token="s3cret", hosts=None, max_upload=1000)
    with TestClient(app, base_url="http://box") as client:
        yield client


@pytest.mark.parametrize("name", TRAVERSALS)
def test_names_never_become_paths(client: TestClient, workspace: Workspace, name: str) -> None:
    before = sorted(path for path in workspace.root.rglob("*"))
    new = {"map": "signal_crossing", "name": name}
    answers = [
        client.get(f"/api/scenarios/{name}"),
        client.delete(f"/api/scenarios/{name}"),
        client.get(f"/api/maps/{name}"),
        client.delete(f"/api/maps/{name}"),
        client.get(f"/api/runs/{name}/report.html"),
        client.delete(f"/api/runs/{name}"),
        client.post("/api/scenarios", json=new),
        client.post("/api/maps", files={"file": ("m.xodr", b"x")}, data={"name": name}),
    ]
    assert all(answer.status_code in (404, 405, 422) for answer in answers), answers
    assert sorted(path for path in workspace.root.rglob("*")) == before


@pytest.mark.slow
def test_a_file_name_never_becomes_a_path(client: TestClient, workspace: Workspace) -> None:
    document = client.post("/api/scenarios", json={"map": "signal_crossing"}).json()["document"]
    import json

    for name in ("../../evil.scenario.json", "/etc/evil.json", "..", ".history"):
        files = {"file": (name, json.dumps(document))}
        saved = client.post("/api/scenarios/upload", files=files)
        assert saved.status_code == 201, saved.text
        assert (workspace.scenarios / f"{saved.json()['name']}.scenario.json").is_file()


@pytest.mark.parametrize(
    "origin",
    [
        "http://evil.example",
        "null",
        "http://127.0.0.1:9999",
        "http://[",
        "http://testserver:x]",
        "",
    ],
)
def test_a_foreign_page_is_refused_also_where_it_opens_a_socket(
    client: TestClient, origin: str
) -> None:
    answer = client.post("/api/maps/shipped", headers={"Origin": origin})
    assert answer.status_code == 403
    assert answer.json()["error"]["kind"] == "ForeignRequest"
    with (
        pytest.raises(WebSocketDisconnect),
        client.websocket_connect("/api/runs/a-1/live", headers={"Origin": origin}),
    ):
        pass


def test_the_own_page_is_served(client: TestClient) -> None:
    assert client.get("/api/maps", headers={"Origin": "http://testserver"}).status_code == 200
    headers = {"Host": "localhost:8420", "Origin": "http://localhost:8420"}
    assert client.get("/api/maps", headers=headers).status_code == 200


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1.evil.example", "", "localhost.evil"])
def test_another_host_name_is_refused(client: TestClient, host: str) -> None:
    assert client.get("/api/maps", headers={"Host": host}).status_code == 403


def test_a_token_is_asked_for_and_kept_in_a_cookie_that_scripts_cannot_read(
    guarded: TestClient,
) -> None:
    assert guarded.get("/api/maps").status_code == 401
    assert guarded.get("/api/maps?token=wrong").status_code == 401
    assert guarded.get("/api/maps", headers={"Authorization": "Bearer s3cret"}).status_code == 200
    assert guarded.get("/api/maps").status_code == 401
    first = guarded.get("/?token=s3cret&x=1", follow_redirects=False)
    assert (first.status_code, first.headers["location"]) == (303, "/?x=1")
    cookie = first.headers["set-cookie"].lower()
    assert "httponly" in cookie
    assert "samesite=strict" in cookie
    assert guarded.get("/api/maps").status_code == 200


def test_a_browser_is_led_on_from_the_link_to_an_address_without_the_token(
    guarded: TestClient,
) -> None:
    headers = {"Accept": "text/html,*/*;q=0.8"}
    first = guarded.get("/?token=s3cret&x=1&y=%22%3E%3Cb", headers=headers)
    assert first.status_code == 200
    assert 'content="0;url=/?x=1&amp;y=%22%3E%3Cb"' in first.text
    assert "s3cret" not in first.text
    assert first.headers["referrer-policy"] == "no-referrer"
    assert first.headers["cache-control"] == "no-store"
    assert "httponly" in first.headers["set-cookie"].lower()
    assert guarded.get("/", headers=headers).status_code == 200


def test_a_browser_without_the_token_is_told_what_to_do(guarded: TestClient) -> None:
    headers = {"Accept": "text/html,*/*;q=0.8"}
    page = guarded.get("/", headers=headers)
    assert (page.status_code, page.headers["content-type"][:9]) == (401, "text/html")
    assert "odscen serve" in page.text
    assert "not the token" not in page.text
    assert "not the token" in guarded.get("/?token=<b>wrong", headers=headers).text
    told = guarded.get("/api/maps").json()["error"]
    assert told["kind"] == "TokenNeeded"
    assert "Authorization: Bearer" in told["message"]


def test_the_question_for_the_token_keeps_the_place(guarded: TestClient) -> None:
    headers = {"Accept": "text/html", "Sec-Fetch-Site": "same-origin"}
    asked = guarded.get("/?x=1&y=%22%3E&token=wrong-one", headers=headers).text
    assert '<form method="get">' in asked
    assert '<input type="hidden" name="y" value="&quot;&gt;">' in asked
    assert "wrong-one" not in asked
    # From the form a redirect, which keeps what is behind the #.
    led = guarded.get("/?x=1&token=s3cret", headers=headers, follow_redirects=False)
    assert (led.status_code, led.headers["location"]) == (303, "/?x=1")


def test_the_script_behind_the_link_is_the_only_one_allowed(guarded: TestClient) -> None:
    page = guarded.get("/?token=s3cret", headers={"Accept": "text/html"})
    (script,) = re.findall(r"<script>(.*?)</script>", page.text)
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    policy = page.headers["content-security-policy"]
    assert f"script-src 'sha256-{digest}'" in policy
    assert "default-src 'none'" in policy


def test_a_socket_needs_the_token_too(guarded: TestClient) -> None:
    with pytest.raises(WebSocketDisconnect), guarded.websocket_connect("/api/runs/a-1/live"):
        pass
    headers = {"Authorization": "Bearer s3cret"}
    with (
        pytest.raises(WebSocketDisconnect) as known,
        guarded.websocket_connect("/api/runs/a-1/live", headers=headers),
    ):
        pass
    assert "no run of this server" in known.value.reason


def test_servers_on_two_ports_keep_their_cookies_apart(workspace: Workspace) -> None:
    for port, token in ((8001, "one"), (8002, "two")):
        app = create_app(workspace, token=token, hosts=None)
        with TestClient(app, base_url=f"http://box:{port}") as client:
            cookie = client.get(f"/?token={token}", follow_redirects=False).headers["set-cookie"]
            assert cookie.startswith(f"odscen_token_{port}={token};")


@pytest.mark.parametrize("token", ["", "é", "s3cre", "s3crett", "\ud800", "s3cret\0"])
def test_what_is_nearly_the_token_is_not_enough(guarded: TestClient, token: str) -> None:
    shown = token.encode("utf-8", "surrogatepass")
    headers = {"Authorization": b"Bearer " + shown, "Cookie": b"odscen_token_80=" + shown}
    assert guarded.get("/api/maps", headers=headers).status_code == 401
    assert guarded.get(f"/api/maps?token={quote(shown)}").status_code == 401


def test_a_token_is_not_a_way_to_be_sent_elsewhere(guarded: TestClient) -> None:
    away = guarded.get("//evil.example/?token=s3cret", follow_redirects=False)
    assert away.headers.get("location", "/").startswith("/")
    assert not away.headers.get("location", "/").startswith("//")


def test_an_oversized_upload_is_refused_announced_or_not(guarded: TestClient) -> None:
    headers = {"Authorization": "Bearer s3cret"}
    announced = guarded.post("/api/maps", files={"file": ("m.xodr", b"x" * 2000)}, headers=headers)
    assert announced.status_code == 413
    assert "1,000 bytes" in announced.json()["error"]["message"]

    def endless() -> Iterator[bytes]:
        yield b'--b\r\nContent-Disposition: form-data; name="file"; filename="m"\r\n\r\n'
        for _ in range(1000):
            yield b"x" * 1000

    for content_type in ("multipart/form-data; boundary=b", "application/json"):
        typed = {**headers, "Content-Type": content_type}
        for path in ("/api/maps", "/api/scenarios"):
            answer = guarded.post(path, content=endless(), headers=typed)
            assert answer.status_code in (413, 422), answer.text
            if content_type.startswith("multipart") == (path == "/api/maps"):
                assert answer.status_code == 413


@pytest.mark.parametrize("body", [b"[" * 100_000, b"{", b"\xff", b"null", b'{"map": 1e999}'])
def test_broken_json_is_an_error_in_the_usual_shape(client: TestClient, body: bytes) -> None:
    answer = client.post(
        "/api/scenarios", content=body, headers={"Content-Type": "application/json"}
    )
    assert answer.status_code in (400, 422)
    assert answer.json()["error"]["message"]


def test_an_entity_bomb_as_scenario_is_refused(client: TestClient) -> None:
    entities = '<!ENTITY a0 "x">' + "".join(
        f'<!ENTITY a{i} "{f"&a{i - 1};" * 10}">' for i in range(1, 10)
    )
    bomb = f'<?xml version="1.0"?><!DOCTYPE g [{entities}]><graphml>&a9;</graphml>'
    for content in (bomb, "<a>" * 100_000, "[" * 100_000, "\x00"):
        answer = client.post("/api/scenarios/upload", files={"file": ("s.graphml", content)})
        assert answer.status_code == 422, answer.text
        assert answer.json()["error"]["kind"] == "ScenarioError"


@pytest.mark.slow
def test_the_list_of_the_interface_runs_no_script_and_loads_nothing(client: TestClient) -> None:
    page = client.get("/api/docs")
    assert page.status_code == 200
    assert page.headers["content-security-policy"].startswith("default-src 'none'; style-src")
    assert "<script" not in page.text
    assert "//" not in page.text
    assert "<code>POST /api/scenarios</code>" in page.text
    schema = client.get("/api/openapi.json").json()
    operations = sum(len(methods) for methods in schema["paths"].values())
    assert page.text.count("<h2>") == operations > 100
