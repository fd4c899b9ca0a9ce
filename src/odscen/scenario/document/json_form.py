"""Scenario documents as text: JSON in and out, and its schema."""

from __future__ import annotations

import hashlib
import json
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError
from pydantic_core import from_json

from odscen.base.errors import ScenarioError
from odscen.scenario.document.formulas import computed, put_back
from odscen.scenario.document.problems import validation_problems
from odscen.scenario.document.scenario_document import FORMAT, VERSION, Scenario

if TYPE_CHECKING:
    from collections.abc import Mapping

OPTIONAL = (
    "variant", "drivers", "demand", "transit", "signals", "measures", "study", "rules",
    "criteria", "sumo", "parameters", "formulas",
)  # fmt: skip
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
        return Scenario.model_validate_json(_with_numbers(text, file), strict=True)
    except ValidationError as error:
        if foreign := _explain_foreign(text):
            raise ScenarioError(foreign, file=file) from error
        problems = validation_problems(error)
        count = "a problem" if len(problems) == 1 else f"{error.error_count()} problems"
        raise ScenarioError(
            f"the scenario document has {count}", problems=problems, file=file
        ) from error


def with_values(scenario: Scenario, values: Mapping[str, float]) -> Scenario:
    """Give parameters other values; what is computed from them follows.

    Raises
    ------
    ScenarioError
        If there is no such parameter, a value is outside its bounds, or what follows from it is
        not possible.
    """
    data = from_json(dumps(scenario))
    for name, value in values.items():
        if name not in scenario.parameters:
            known = ", ".join(scenario.parameters) or "none"
            raise ScenarioError(f"no parameter {name!r}; there are {known}")
        data["parameters"][name]["value"] = value
    return loads(json.dumps(data))


def dumps(scenario: Scenario) -> str:
    """Write a scenario document as JSON: fields in fixed order, one actor, flow or row per line.

    Fields of actors, flows, rules, drivers and demand that have their default value are left out,
    and so are signals that are all the map's, and measures and a study if there are none.
    Numbers that are computed from parameters are written as their formulas. The same scenario gives
    the same text, and :func:`loads` gives the same scenario back.
    """
    data = scenario.model_dump(mode="json", exclude={"actors", "flows", *OPTIONAL})
    for key in type(scenario).model_fields:
        if key in ("actors", "flows", *OPTIONAL):
            data[key] = without_defaults(scenario, key)
        elif key == "simulation":
            simulation = scenario.simulation.model_dump(mode="json", exclude_defaults=True)
            data[key] = {name: data[key][name] for name in ALWAYS} | simulation
    if scenario.formulas:
        put_back(data, scenario.model_dump(mode="json"), scenario.formulas)
    fields = [
        f"  {json.dumps(key)}: {_lay_out_field(key, data[key])}"
        for key in type(scenario).model_fields
        if key != "formulas" and (key not in OPTIONAL or data[key])
    ]
    return "{\n" + ",\n".join(fields) + "\n}\n"


def without_defaults(scenario: Scenario, field: str) -> Any:
    """JSON of a field, a part or a list of parts, without what has its default value."""
    value = getattr(scenario, field)
    if isinstance(value, dict):
        return scenario.model_dump(mode="json", include={field}, exclude_defaults=True).get(
            field, {}
        )
    if value is None:
        return None
    if isinstance(value, tuple):
        return [
            part if isinstance(part, str) else part.model_dump(mode="json", exclude_defaults=True)
            for part in value
        ]
    return value.model_dump(mode="json", exclude_defaults=True)


def content_sha256(scenario: Scenario) -> str:
    """SHA-256 of the content of a scenario: all but its seed, its name, and its parent."""
    same = {"seed": 0, "name": "content", "variant": None}
    return hashlib.sha256(dumps(scenario.model_copy(update=same)).encode()).hexdigest()


def schema() -> dict[str, Any]:
    """JSON Schema (draft 2020-12) of the document, as published in docs/scenario.schema.json."""
    described = _formulas_too(Scenario.model_json_schema())
    described["properties"].pop("formulas")  # which stand where the numbers do
    described["$defs"]["Formula"] = {
        "description": "Arithmetic with parameters, in place of a number.",
        "type": "string",
        "pattern": r"\$[A-Za-z_]",
    }
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **described}


def _formulas_too(node: Any) -> Any:
    """Let a formula be given wherever a number may."""
    if isinstance(node, list):
        return [_formulas_too(inner) for inner in node]
    if not isinstance(node, dict):
        return node
    if node.get("type") in ("number", "integer"):
        outer = {key: node[key] for key in ("title", "default", "description") if key in node}
        inner = {key: value for key, value in node.items() if key not in outer}
        return {"anyOf": [inner, {"$ref": "#/$defs/Formula"}], **outer}
    return {key: _formulas_too(part) for key, part in node.items()}


def _with_numbers(text: str | bytes, file: str | None) -> str | bytes:
    """Compute the formulas of a document, if it has any."""
    if ("$" not in text) if isinstance(text, str) else (b"$" not in text):
        return text
    try:
        data = from_json(text)
    except ValueError:
        return text  # which validation says
    if not isinstance(data, dict) or not isinstance(data.get("parameters"), dict):
        return text
    return json.dumps(computed(data, file=file))


def _lay_out_field(key: str, value: object) -> str:
    if key == "parameters" and isinstance(value, dict):
        fields = (
            f"    {json.dumps(name)}: {json.dumps(part, ensure_ascii=False)}"
            for name, part in value.items()
        )
        return "{\n" + ",\n".join(fields) + "\n  }"
    if key in ("demand", "transit", "study", "variant") and isinstance(value, dict):
        fields = (f"    {json.dumps(name)}: {_lay_out_parts(part)}" for name, part in value.items())
        return "{\n" + ",\n".join(fields) + "\n  }"
    if key == "signals" and isinstance(value, dict) and _has_programs(value):
        fields = (
            f"    {json.dumps(name)}: {_lay_out_lights(part)}" for name, part in value.items()
        )
        return "{\n" + ",\n".join(fields) + "\n  }"
    if isinstance(value, list) and value:
        lines = [json.dumps(part, ensure_ascii=False) for part in value]
        if key == "roi":
            return "[" + ", ".join(lines) + "]"
        return "[\n    " + ",\n    ".join(lines) + "\n  ]"
    return json.dumps(value, ensure_ascii=False)


def _lay_out_parts(value: object) -> str:
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


def _lay_out_lights(value: object) -> str:
    """Lay out lights: one on a line, or each group, stage, ... of its program on one of its own."""
    if not isinstance(value, list) or not value:
        return json.dumps(value, ensure_ascii=False)
    lights = []
    for light in value:
        text = json.dumps(light, ensure_ascii=False)
        for part in light.values():
            if isinstance(part, list) and part and isinstance(part[0], dict | list):
                whole = json.dumps(part, ensure_ascii=False)
                split = ",\n        ".join(json.dumps(item, ensure_ascii=False) for item in part)
                text = text.replace(whole, f"[\n        {split}\n      ]", 1)
        lights.append(text)
    return "[\n      " + ",\n      ".join(lights) + "\n    ]"


def _explain_foreign(text: str | bytes) -> str | None:
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
