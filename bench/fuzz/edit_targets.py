"""Edits of the newest version, of every kind, one after the other; undone and done again."""

from __future__ import annotations

import json
from functools import cache
from typing import Any

from pydantic import TypeAdapter

from bench.fuzz.damage import JSON, json_value, pick
from bench.fuzz.drawn import drawn
from bench.fuzz.request_targets import ask, settle
from bench.fuzz.served import Served
from bench.fuzz.trials import Trial

EDITS = 3
"""Of one trial."""
_JSON_HEADERS = {"Content-Type": "application/json"}


@cache
def _schemas() -> dict[str, dict[str, Any]]:
    from odscen.scenario.edits.edit_messages import EDIT_MESSAGES

    return {kind: TypeAdapter(message).json_schema() for kind, message in EDIT_MESSAGES.items()}


def edit_trial(trial: Trial, served: Served) -> str:
    """Edits with the right version; what an edit has changed can be undone and done again."""
    served.ready()
    rng = trial.rng
    name = pick(rng, ("done", "full", "turned"))
    own = f"/api/scenarios/{name}"
    state = _state(ask(trial, served, "GET", own))
    if state is None:
        said = ask(trial, served, "GET", "/api/scenarios")
        if f'"{name}"'.encode() in said:
            trial.wrong(f"{name} is not read after the edits before: {said[:200]!r}")
        served.stop()
        return "no scenario"
    names = _names(state["document"])
    kinds = []
    for _ in range(EDITS):
        made = []
        for _ in range(int(pick(rng, (1, 1, 1, 2)))):
            kind = pick(rng, sorted(_schemas()))
            kinds.append(kind)
            schema = _schemas()[kind]
            made.append(drawn(schema, schema.get("$defs", {}), names, rng) | {"kind": kind})
        body = json.dumps({"version": state["version"], "edits": made}).encode()
        if rng.random() < 0.1:
            body = (json_value if rng.random() < 0.7 else pick(rng, list(JSON.values())))(body, rng)
        said = ask(trial, served, "POST", f"{own}/edits", body, _JSON_HEADERS)
        after = _state(said)
        whole = _state(ask(trial, served, "GET", own))
        if whole is None:
            trial.wrong(f"{name} is not read after {body[:300]!r}")
            served.stop()
            break
        if after is None:
            if (whole["version"], whole["document"]) != (state["version"], state["document"]):
                trial.wrong(f"a refused edit has changed {name}: {body[:300]!r}")
            continue
        if after["document"] != whole["document"]:
            trial.wrong(f"the answer to an edit is not the scenario: {body[:300]!r}")
        state = _undone(trial, served, own, state, whole, body) if rng.random() < 0.5 else whole
    if rng.random() < 0.3:
        for route in ("plan", "problems", "download?as=graphml", "download"):
            ask(trial, served, "GET", f"{own}/{route}")
    settle(trial, served, f"edits {kinds}")
    return ", ".join(kinds)


def _undone(
    trial: Trial,
    served: Served,
    own: str,
    before: dict[str, Any],
    after: dict[str, Any],
    body: bytes,
) -> dict[str, Any]:
    state = after
    for step, expected in (("undo", before), ("redo", after)):
        version = json.dumps({"version": state["version"]}).encode()
        answer = _state(ask(trial, served, "POST", f"{own}/{step}", version, _JSON_HEADERS))
        if answer is None:
            if after["version"] != before["version"]:
                trial.wrong(f"no {step} of {body[:300]!r}")
            return state
        state = answer
        if state["document"] != expected["document"]:
            trial.wrong(f"{step} gives another scenario: {body[:300]!r}")
    return state


def _state(said: bytes) -> dict[str, Any] | None:
    try:
        found = json.loads(said)
    except ValueError:
        return None
    known = isinstance(found, dict) and "document" in found and "version" in found
    return found if known else None


def _names(document: dict[str, Any]) -> list[str]:
    """Ids of all that there is, and places."""
    found = [*document["roi"], "10001", "j10001", "new", "new-2", "stage 1", "r2>j10001>r1"]
    for part in ("actors", "flows", "rules", "measures"):
        found += [one["id"] for one in document.get(part) or ()][:6]
    for actor in document["actors"][:8]:
        found += [actor["spawn"], *([actor["goal"]] if actor.get("goal") else [])]
    found += list(document.get("parameters") or ())
    found += ["$gap", "2 * $speed", "07:00", "sporty", "ClearNoon", "car"]
    for table in ("zones", "matrices", "counts", "inputs", "profiles"):
        found += [one["id"] for one in (document.get("demand") or {}).get(table) or ()][:3]
    return found
