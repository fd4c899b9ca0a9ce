"""Scenario documents as text: JSON in and out, and its schema."""

from __future__ import annotations

import json
from typing import Any

from pydantic import ValidationError
from pydantic_core import from_json

from odscen.base.errors import ScenarioError
from odscen.scenario.document.scenario_document import FORMAT, VERSION, Scenario
from odscen.scenario.document.validation import validation_problems

OPTIONAL = ("drivers", "demand", "transit", "signals", "measures", "rules")
"""Fields of a scenario that are left out where they have their default value."""
ALWAYS = ("duration", "step_length")
"""Fields of the simulation that are written always."""


def loads(text: str | bytes, *, file: str | None = None) -> Scenario:
    """Read a scenario document from JSON.

    Parameters
    ----------
    text
        The JSON; bytes are UTF-8.
    file
        Name of the file, for messages.

    Raises
    ------
    ScenarioError
        With one line per problem, each with its place, for example ``actors[3].speed: ...``.
    """
    try:
        return Scenario.model_validate_json(text, strict=True)
    except ValidationError as error:
        if foreign := _foreign(text):
            raise ScenarioError(foreign, file=file) from error
        problems = validation_problems(error)
        count = "a problem" if len(problems) == 1 else f"{error.error_count()} problems"
        msg = f"the scenario document has {count}"
        raise ScenarioError(msg, problems=problems, file=file) from error


def dumps(scenario: Scenario) -> str:
    """Write a scenario document as JSON: fields in fixed order, one actor, flow or row per line.

    Fields of actors, flows, rules, drivers and demand that have their default value are left out,
    and so are signals that are all the map's, and measures if there are none. The same scenario
    gives the same text, and :func:`loads` gives the same scenario back.
    """
    data = scenario.model_dump(mode="json", exclude={"actors", "flows", *OPTIONAL})
    for key in type(scenario).model_fields:
        if key in ("actors", "flows", *OPTIONAL):
            data[key] = without_defaults(scenario, key)
        elif key == "simulation":
            said = scenario.simulation.model_dump(mode="json", exclude_defaults=True)
            data[key] = {name: data[key][name] for name in ALWAYS} | said
    fields = [
        f"  {json.dumps(key)}: {_layout(key, data[key])}"
        for key in type(scenario).model_fields
        if key not in OPTIONAL or data[key]
    ]
    return "{\n" + ",\n".join(fields) + "\n}\n"


def without_defaults(scenario: Scenario, field: str) -> Any:
    """JSON of a field, a part or a list of parts, without what has its default value."""
    value = getattr(scenario, field)
    if isinstance(value, tuple):
        return [part.model_dump(mode="json", exclude_defaults=True) for part in value]
    return value.model_dump(mode="json", exclude_defaults=True)


def schema() -> dict[str, Any]:
    """JSON Schema (draft 2020-12) of the document, as published in docs/scenario.schema.json."""
    described = Scenario.model_json_schema()
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **described}


def _layout(key: str, value: object) -> str:
    if key in ("demand", "transit") and isinstance(value, dict):
        fields = (f"    {json.dumps(name)}: {_parts(part)}" for name, part in value.items())
        return "{\n" + ",\n".join(fields) + "\n  }"
    if key == "signals" and isinstance(value, dict) and _has_programs(value):
        fields = (f"    {json.dumps(name)}: {_lights(part)}" for name, part in value.items())
        return "{\n" + ",\n".join(fields) + "\n  }"
    if isinstance(value, list) and value:
        lines = [json.dumps(part, ensure_ascii=False) for part in value]
        if key == "roi":
            return "[" + ", ".join(lines) + "]"
        return "[\n    " + ",\n    ".join(lines) + "\n  ]"
    return json.dumps(value, ensure_ascii=False)


def _parts(value: object) -> str:
    """Lay out parts of the demand: each on a line, and each row of a table on one of its own."""
    if not isinstance(value, list) or not value:
        return json.dumps(value, ensure_ascii=False)
    lines = []
    for part in value:
        line = json.dumps(part, ensure_ascii=False)
        rows = part.get("rows") or part.get("trips")
        if isinstance(rows, list):
            whole = json.dumps(rows, ensure_ascii=False)
            split = ",\n        ".join(json.dumps(row, ensure_ascii=False) for row in rows)
            line = line.replace(whole, f"[\n        {split}\n      ]")
        lines.append(line)
    return "[\n      " + ",\n      ".join(lines) + "\n    ]"


def _has_programs(signals: dict[str, Any]) -> bool:
    return any("groups" in light for light in signals.get("junctions", ()))


def _lights(value: object) -> str:
    """Lay out lights: one on a line, or each group, stage, ... of its program on one of its own."""
    if not isinstance(value, list) or not value:
        return json.dumps(value, ensure_ascii=False)
    lights = []
    for light in value:
        text = json.dumps(light, ensure_ascii=False)
        for part in light.values():
            if isinstance(part, list) and part and isinstance(part[0], dict | list):
                whole = json.dumps(part, ensure_ascii=False)
                split = ",\n        ".join(json.dumps(one, ensure_ascii=False) for one in part)
                text = text.replace(whole, f"[\n        {split}\n      ]", 1)
        lights.append(text)
    return "[\n      " + ",\n      ".join(lights) + "\n    ]"


def _foreign(text: str | bytes) -> str | None:
    """Say why JSON is not a scenario of this version at all, or ``None``."""
    try:
        data = from_json(text)
    except ValueError:
        return None
    if not isinstance(data, dict):
        return "not a scenario: the document must be a JSON object"
    if data.get("format", FORMAT) != FORMAT:
        return f"not a scenario: format is {data['format']!r}, expected {FORMAT!r}"
    version = data.get("version", VERSION)
    if isinstance(version, int) and version > VERSION:
        return f"version {version} was written by a newer odscen; this one reads up to {VERSION}"
    return None
