"""Requests to a real server: from its OpenAPI schema, and made by hand."""

from __future__ import annotations

import http.client
import json
import socket
import time
import warnings
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any
from urllib.parse import quote

from bench.fuzz.damage import CSV, JSON, WORDS, damaged, json_value, pick
from bench.fuzz.limits import MEMORY, SECONDS, busy, high_water_of_tree
from bench.fuzz.map_damage import MAP
from bench.fuzz.material import CROSSING
from bench.fuzz.served import Served
from bench.fuzz.trials import Trial
from bench.fuzz.verdicts import Finding, Verdict

EXAMPLES = 10
SLOW = ("/api/maps/shipped", "/api/runs/{run}/camera")
"""Builds seven maps; a stream without end."""
KNOWN = {"name": ("done", "full", CROSSING), "run": ("done", "sliced"), "job": ("job-1",)}
BOUNDARY = "----odscen"


def schema_trial(trial: Trial, served: Served) -> str:
    """Requests that schemathesis draws for one operation."""
    served.ready()
    path, method = pick(trial.rng, _operations())
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of schemathesis itself
        _drawn(trial, served, path, method)
    settle(trial, served, f"{method} {path}")
    return f"{method} {path}"


def _drawn(trial: Trial, served: Served, path: str, method: str) -> None:
    import hypothesis
    import requests

    operation = _schema()[path][method]
    known = {key: pick(trial.rng, names) for key, names in KNOWN.items()}
    where = f"{method} {path}"

    @hypothesis.seed(trial.seed)
    @hypothesis.settings(
        max_examples=EXAMPLES,
        database=None,
        deadline=None,
        phases=[hypothesis.Phase.generate],
        suppress_health_check=list(hypothesis.HealthCheck),
    )
    @hypothesis.given(case=operation.as_strategy())
    def check(case: Any) -> None:
        if trial.rng.random() < 0.6:  # where there is something
            case.path_parameters = {
                key: known.get(key, value) for key, value in (case.path_parameters or {}).items()
            }
        try:
            answer = case.call(base_url=served.url, timeout=SECONDS * busy(), stream=False)
        except requests.Timeout:
            trial.findings.append(Finding(Verdict.HANG, f"{where}: no answer"))
        except requests.ConnectionError as error:
            trial.findings.append(Finding(Verdict.CRASH, f"{where}: {error!r}"[:300]))
        except (requests.RequestException, ValueError, UnicodeError):
            pass  # what the client itself cannot send
        else:
            _answered(trial, answer.status_code, f"{where}: {answer.text[:200]}")

    check()


@cache
def _schema() -> Any:
    import schemathesis

    return schemathesis.openapi.from_dict(_document())


@cache
def _document() -> dict[str, Any]:
    from odscen.maps.store import Workspace
    from odscen.web.application import create_app

    document: dict[str, Any] = create_app(Workspace(Path("nowhere"))).openapi()
    return document


def _operations() -> list[tuple[str, str]]:
    return [
        (path, method)
        for path, methods in sorted(_document()["paths"].items())
        for method in sorted(methods)
        if path not in SLOW
    ]


def _answered(trial: Trial, status: int, where: str) -> None:
    if status >= 500:
        trial.findings.append(Finding(Verdict.SERVER_ERROR, f"{status} {where}"[:400]))
    else:
        verdict = Verdict.FINE if status < 400 else Verdict.REFUSED
        trial.findings.append(Finding(verdict, f"{status} {where}"[:200]))


def settle(trial: Trial, served: Served, where: str) -> None:
    """What the server wrote of itself, its memory, and whether it still answers."""
    said = served.said()
    if "Traceback (most recent call last)" in said:
        last = said.strip().splitlines()[-1][:300]
        trial.findings.insert(0, Finding(Verdict.TRACEBACK, f"{where}: {last}"))
    trial.peak = max(trial.peak, high_water_of_tree(served.pid))
    if trial.peak > MEMORY:
        words = f"{where}: {trial.peak / 1e9:.2f} GB"
        trial.findings.insert(0, Finding(Verdict.MEMORY, words))
        served.stop()
    else:
        ask(trial, served, "GET", "/api/health")


def ask(
    trial: Trial,
    served: Served,
    method: str,
    target: str,
    body: bytes | None = None,
    headers: dict[str, str] | None = None,
) -> bytes:
    """One request; its answer is judged, its body given."""
    connection = http.client.HTTPConnection("127.0.0.1", served.port, timeout=SECONDS * busy())
    where = f"{method} {target[:100]}"
    try:
        connection.putrequest(method, target, skip_host="Host" in (headers or {}))
        if body is not None:
            connection.putheader("Content-Length", str(len(body)))
        for key, value in (headers or {}).items():
            connection.putheader(key, value)
        connection.endheaders(body)
        answer = connection.getresponse()
        said = answer.read()
        _answered(trial, answer.status, f"{where}: {said[:200]!r}")
    except TimeoutError:
        trial.findings.append(Finding(Verdict.HANG, f"{where}: no answer"))
    except (http.client.InvalidURL, ValueError, UnicodeError):
        pass  # what the client itself cannot send
    except (OSError, http.client.HTTPException) as error:
        trial.findings.append(Finding(Verdict.CRASH, f"{where}: {error!r}"))
    else:
        return said
    finally:
        connection.close()
    return b""


def handmade_trial(trial: Trial, served: Served) -> str:
    """Bodies, names, headers and bytes that no schema thinks of."""
    served.ready()
    kind = pick(trial.rng, sorted(_BY_HAND))
    _BY_HAND[kind](trial, served)
    settle(trial, served, kind)
    return kind


def _form(name: str, file: str, content: bytes) -> tuple[bytes, dict[str, str]]:
    head = (
        f'--{BOUNDARY}\r\nContent-Disposition: form-data; name="{name}"; filename="{file}"\r\n'
        "Content-Type: application/octet-stream\r\n\r\n"
    )
    body = head.encode("utf-8", errors="replace") + content + f"\r\n--{BOUNDARY}--\r\n".encode()
    return body, {"Content-Type": f"multipart/form-data; boundary={BOUNDARY}"}


def _upload(trial: Trial, served: Served) -> None:
    material, rng = trial.material, trial.rng
    what = pick(rng, ("map", "scenario", "table"))
    name = pick(rng, ("x.xodr", "x.json", "x.csv", *WORDS)).replace("\n", "").replace('"', "")
    if what == "map":
        content = damaged(pick(rng, material.map_files).read_bytes(), rng, MAP).data
        body, headers = _form("file", name, content)
        said = ask(trial, served, "POST", "/api/maps", body, headers)
        _await(trial, served, said)
    elif what == "scenario":
        content = damaged(material.scenario.read_bytes(), rng, JSON).data
        ask(trial, served, "POST", "/api/scenarios/upload", *_form("file", name, content))
    else:
        table = pick(rng, ("od", "counts", "zones", "profile"))
        content = damaged(material.file(f"{table}.csv").read_bytes(), rng, CSV).data
        body, headers = _form("file", name, content)
        target = f"/api/scenarios/done/demand/table?version=0&table={table}&id=a"
        ask(trial, served, "POST", target, body, headers)


def _await(trial: Trial, served: Served, said: bytes) -> None:
    """Wait for the job that an answer names."""
    try:
        name = json.loads(said)["job"]
    except (ValueError, KeyError, TypeError):
        return
    end = time.monotonic() + SECONDS * busy()
    while time.monotonic() < end:
        try:
            state = json.loads(ask(trial, served, "GET", f"/api/jobs/{name}"))["state"]
        except (ValueError, KeyError, TypeError):
            return
        if state in ("done", "failed", "cancelled"):
            return
        if high_water_of_tree(served.pid) > MEMORY:
            return
        time.sleep(0.1)
    trial.findings.insert(0, Finding(Verdict.HANG, f"job {name} is not done"))


_BODIES: tuple[tuple[str, str, dict[str, Any]], ...] = (
    ("POST", "/api/scenarios", {"map": CROSSING, "name": "new"}),
    ("POST", "/api/scenarios/done/edits", {"version": 0, "edit": {"kind": "set_seed", "seed": 4}}),
    ("POST", "/api/scenarios/done/copy", {"name": "copied"}),
    ("PUT", "/api/scenarios/full/name", {"name": "renamed"}),
    ("POST", "/api/scenarios/done/demand/day", {"version": 0, "trips": 100}),
    ("POST", "/api/runs/forecast", {"scenario": "done", "until": 60}),
    ("POST", "/api/runs", {"scenario": "done", "until": 1}),
    ("POST", "/api/runs/done/control", {"command": "stop"}),
)


def _body(trial: Trial, served: Served) -> None:
    method, target, body = pick(trial.rng, _BODIES)
    content = json.dumps(body).encode()
    for _ in range(int(pick(trial.rng, (1, 2)))):
        change = json_value if trial.rng.random() < 0.7 else pick(trial.rng, list(JSON.values()))
        content = change(content, trial.rng)
    ask(trial, served, method, target, content, {"Content-Type": "application/json"})


def _names(trial: Trial, served: Served) -> None:
    path, method = pick(trial.rng, _operations())
    word = pick(trial.rng, (*WORDS, "../workspace", "..%2f..", "%00", "x" * 5000, "%ff%fe"))
    for key in ("name", "run", "job"):
        path = path.replace("{" + key + "}", quote(word, safe="%", errors="replace"))
    query = pick(trial.rng, ("", "?", "?from=" + "9" * 400, "?start=nan&end=inf&n=-1", "?a[]=%ff"))
    ask(trial, served, method.upper(), path + query)


_HEADERS = (
    ("Origin", "http://["),
    ("Origin", "null"),
    ("Origin", "http://[::1"),
    ("Origin", "\xff"),
    ("Origin", "http://127.0.0.1:99999999"),
    ("Host", "["),
    ("Host", ""),
    ("Host", "[::1"),
    ("Host", "a:b:c"),
    ("Cookie", "odscen_token=\x7f; =;;,"),
    ("Cookie", "x" * 60_000),
    ("Content-Type", "application/json; charset=nonsense"),
    ("Content-Type", "multipart/form-data"),
    ("Content-Type", "\xff/\xff"),
    ("Range", "bytes=0-0,1-1,-1"),
    ("Range", "bytes=-1"),
    ("Range", "bytes=9999999999999999999-"),
    ("If-None-Match", '"' * 100),
    ("Accept", "\xff"),
    ("Authorization", "Bearer \xff"),
    ("Content-Length", "-1"),
    ("Content-Length", "1e3"),
    ("If-Modified-Since", "Thu, 99 Foo"),
    ("Accept-Encoding", "gzip;q=nan, br;q="),
    ("Transfer-Encoding", "chunked, nonsense"),
    ("Upgrade", "h2c"),
    ("Expect", "200-maybe"),
    ("Last-Event-ID", "-1"),
    ("X-Forwarded-For", "\x7f"),
)


def _headers(trial: Trial, served: Served) -> None:
    path, method = pick(trial.rng, _operations())
    path = path.replace("{name}", pick(trial.rng, KNOWN["name"])).replace("{run}", "done")
    chosen = dict(pick(trial.rng, _HEADERS) for _ in range(int(pick(trial.rng, (1, 2)))))
    lines = "".join(f"{key}: {value}\r\n" for key, value in chosen.items())
    host = "" if "Host" in chosen else f"Host: 127.0.0.1:{served.port}\r\n"
    extra = (
        ""
        if "Content-Length" in chosen or method in ("get", "delete")
        else "Content-Length: 2\r\n\r\n{}"
    )
    head = f"{method.upper()} {path.replace('{job}', 'job-1')} HTTP/1.1\r\n{host}{lines}"
    _raw(trial, served, (head + "Connection: close\r\n" + extra + "\r\n").encode("latin-1"), path)


def _raw(trial: Trial, served: Served, data: bytes, where: str) -> None:
    """Bytes to the socket; an answer is judged, and none is no failure: it may be no request."""
    try:
        with socket.create_connection(("127.0.0.1", served.port), timeout=5.0) as link:
            link.sendall(data)
            link.shutdown(socket.SHUT_WR)
            said = b"".join(iter(lambda: link.recv(65536), b""))
    except OSError:
        trial.findings.append(Finding(Verdict.REFUSED, f"{where}: closed"))
        return
    status = said.split(b" ", 2)[1:2]
    number = int(status[0]) if status and status[0].isdigit() else 400
    _answered(trial, number, f"{where}: {data[:150]!r}: {said[-200:]!r}")


def _garbage(trial: Trial, served: Served) -> None:
    rng = trial.rng
    request = (
        f"POST /api/scenarios HTTP/1.1\r\nHost: 127.0.0.1:{served.port}\r\n"
        "Content-Type: application/json\r\nContent-Length: 20\r\n\r\n{}"
    ).encode()
    choices = (
        lambda: rng.bytes(500),
        lambda: request[: int(rng.integers(len(request)))],
        lambda: request.replace(b"HTTP/1.1", b"HTTP/9.9"),
        lambda: b"GET /" + b"a" * 100_000 + b" HTTP/1.1\r\n\r\n",
        lambda: b"GET / HTTP/1.1\r\n" + b"A: b\r\n" * 5000 + b"\r\n",
        lambda: request.replace(b"Content-Length: 20", b"Transfer-Encoding: chunked") + b"zz\r\n",
        lambda: request.replace(b"Content-Length: 20", b"Content-Length: 99999999999999"),
        lambda: b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + rng.bytes(200),
    )
    _raw(trial, served, choices[int(rng.integers(len(choices)))](), "bytes")


def _websocket(trial: Trial, served: Served) -> None:
    rng = trial.rng
    run = quote(pick(rng, ("done", "sliced", "none", *WORDS)), safe="", errors="replace")
    origin = pick(
        rng,
        (
            "",
            "Origin: http://[\r\n",
            "Origin: null\r\n",
            "Origin: \xff\r\n",
            f"Origin: http://127.0.0.1:{served.port}\r\n",
        ),
    )
    key = pick(rng, ("dGhlIHNhbXBsZSBub25jZQ==", "", "x", "\xff"))
    head = (
        f"GET /api/runs/{run}/live HTTP/1.1\r\nHost: 127.0.0.1:{served.port}\r\n{origin}"
        f"Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Key: {key}\r\n"
        f"Sec-WebSocket-Version: {pick(rng, (13, 13, 13, 99))}\r\n\r\n"
    )
    frames = pick(
        rng,
        (
            b"",
            b"\x81\x80\x00\x00\x00\x00",
            rng.bytes(200),
            b"\x88\x00",
            b"\x82\xff\x7f\xff\xff\xff\xff\xff\xff\xff\x00\x00\x00\x00",
        ),
    )
    _raw(trial, served, head.encode("latin-1") + frames, "websocket")


_BY_HAND: dict[str, Callable[[Trial, Served], None]] = {
    "body": _body,
    "body again": _body,
    "garbage": _garbage,
    "headers": _headers,
    "names": _names,
    "upload": _upload,
    "upload again": _upload,
    "websocket": _websocket,
}
