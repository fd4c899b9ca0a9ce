"""Values that a JSON Schema allows, with names of a real scenario in them, some of them odd."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from bench.fuzz.damage import WORDS, Generator, pick

ODD = 0.04
"""Share of values that the schema may not allow."""
_DEEPEST = 5
_NUMBERS = (0.0, 1.0, 0.1, 2.5, 5.0, 10.0, 13.9, 30.0, 60.0, 900.0, 3600.0, 1e-6, 1e5, -1.0, 1e9)
_ODD_NUMBERS = (-1, 0, 2**63, 10**30, 1e308, 0.5, True, "1", None, [], -0.0, 1e-320)


def drawn(
    schema: Mapping[str, Any],
    definitions: Mapping[str, Any],
    names: Sequence[str],
    rng: Generator,
    depth: int = 0,
) -> Any:
    """One value of a schema; texts are of ``names``, such as ids, segments and nodes."""
    if "$ref" in schema:
        target = definitions[schema["$ref"].rpartition("/")[2]]
        return drawn(target, definitions, names, rng, depth)
    if "const" in schema:
        return schema["const"]
    if "enum" in schema:
        return pick(rng, schema["enum"])
    for several in ("anyOf", "oneOf"):
        if several in schema:
            options = schema[several]
            if depth > _DEEPEST:
                options = [one for one in options if one.get("type") == "null"] or options[:1]
            return drawn(pick(rng, options), definitions, names, rng, depth)
    kind = schema.get("type", "string")
    if depth and rng.random() < ODD:
        odd = WORDS if kind == "string" else _ODD_NUMBERS
        return _sendable(pick(rng, odd))
    if kind == "array":
        if "prefixItems" in schema:
            return [drawn(one, definitions, names, rng, depth + 1) for one in schema["prefixItems"]]
        number = int(pick(rng, (0, 1, 1, 2, 3))) if depth <= _DEEPEST else 0
        number = max(number, min(schema.get("minItems", 0), 8))
        items = schema.get("items", {"type": "string"})
        return [drawn(items, definitions, names, rng, depth + 1) for _ in range(number)]
    if kind == "object":
        return _object(schema, definitions, names, rng, depth)
    if kind in ("number", "integer"):
        return _number(schema, rng, whole=kind == "integer")
    if kind == "boolean":
        return bool(rng.random() < 0.5)
    return None if kind == "null" else pick(rng, names)


def _object(
    schema: Mapping[str, Any],
    definitions: Mapping[str, Any],
    names: Sequence[str],
    rng: Generator,
    depth: int,
) -> dict[str, Any]:
    known = schema.get("properties", {})
    needed = set(schema.get("required", ()))
    optional = [name for name in known if name not in needed]
    if optional and (len(optional) > 8 or rng.random() < 0.7):
        # One kind of a condition or an action, or a few fields of a part.
        number = min(len(optional), int(pick(rng, (1, 1, 2))))
        optional = [pick(rng, optional) for _ in range(number)]
    chosen = needed | set(optional if depth <= _DEEPEST else [])
    found = {
        name: drawn(field, definitions, names, rng, depth + 1)
        for name, field in known.items()
        if name in chosen
    }
    more = schema.get("additionalProperties")
    if isinstance(more, Mapping) and not known:
        found |= {
            pick(rng, names): drawn(more, definitions, names, rng, depth + 1) for _ in range(2)
        }
    return found


def _number(schema: Mapping[str, Any], rng: Generator, *, whole: bool) -> Any:
    low = schema.get("minimum", schema.get("exclusiveMinimum", -10.0))
    high = schema.get("maximum", schema.get("exclusiveMaximum", 100.0))
    value = pick(rng, (*_NUMBERS, low, high, float(rng.uniform(0, 100))))
    if rng.random() < 0.7:
        value = min(max(value, low), high)
    return int(value) if whole else value


def _sendable(value: Any) -> Any:
    """The value, if it can be written as UTF-8."""
    if isinstance(value, str):
        return value.encode("utf-8", errors="replace").decode()
    return value
