"""Formulas in a document as JSON: numbers come in for them when it is read, and they when written.

A formula is a text with the ``$name`` of a parameter where a number is expected. In memory every
number is a number, and ``formulas`` says where in the document one was computed: keys are places as
in a JSON Pointer, except that parts with an id are named by it, ``rules/cut-in/when/ttc/below``.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from odscen.base.errors import InputError, NotFoundError, ScenarioError
from odscen.scenario.document.expressions import evaluate, names_in

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

_TEXTS = frozenset({"name", "description", "unit", "id", "formulas"})
"""Keys of texts that are for people, or name something: no formulas."""


def computed(data: dict[str, Any], *, file: str | None = None) -> dict[str, Any]:
    """Replace formulas by their values.

    Parameters
    ----------
    data
        A document with ``parameters``, as JSON; it is not changed.

    Returns
    -------
    dict
        The document with numbers only, and ``formulas`` with where they come from.

    Raises
    ------
    ScenarioError
        With every formula that has no value, with its place.
    """
    reading = _Reading({}, {}, [])
    parameters: dict[str, Any] = {}
    for name, said in data["parameters"].items():
        parameters[name] = reading.walked(said, f"parameters/{_escaped(name)}", name)
        number = parameters[name].get("value") if isinstance(parameters[name], dict) else None
        if isinstance(number, int | float):
            reading.values[name] = float(number)
    result = {
        key: parameters if key == "parameters" else reading.walked(node, _escaped(key), key)
        for key, node in data.items()
    }
    if reading.problems:
        count = len(reading.problems)
        what = "a formula" if count == 1 else f"{count} formulas"
        raise ScenarioError(
            f"the scenario document has {what} without a value",
            problems=reading.problems,
            file=file,
        )
    if reading.found:
        result["formulas"] = reading.found
    return result


@dataclass(frozen=True, slots=True)
class _Reading:
    """Formulas found so far, by place; the parameters known so far; and what has no value."""

    found: dict[str, str]
    values: dict[str, float]
    problems: list[str]

    def walked(self, node: Any, place: str, key: str) -> Any:
        """Copy a part of the document with numbers in place of formulas."""
        if isinstance(node, str):
            return self._value(node, place) if _is_formula(node, key, self.values) else node
        if isinstance(node, dict):
            return {name: self.walked(one, _at(place, name), name) for name, one in node.items()}
        if isinstance(node, list):
            return [self.walked(one, _at(place, part), key) for part, one in _parts(node)]
        return node

    def _value(self, text: str, place: str) -> float:
        try:
            value = evaluate(text, self.values)
        except InputError as error:
            self.problems.append(f"{place}: {error}")
            return 0
        self.found[place] = text
        return int(value) if value.is_integer() else value


def put_back(
    written: dict[str, Any], whole: Mapping[str, Any], formulas: Mapping[str, str]
) -> None:
    """Put formulas into a document that is to be written, in place of the numbers they give.

    A number that is another one by now has been set since, and stays; a formula of a part that is
    gone is dropped.

    Parameters
    ----------
    written
        The document, perhaps without what has its default value; it is changed.
    whole
        The same with all of its fields.
    """
    values = {name: float(one["value"]) for name, one in whole["parameters"].items()}
    for place, text in formulas.items():
        keys = [_unescaped(key) for key in place.split("/")]
        try:
            if _looked_up(whole, keys) == evaluate(text, values):
                _set(written, keys, text)
        except (LookupError, TypeError, InputError):
            continue


def put_formula(written: dict[str, Any], whole: Mapping[str, Any], place: str, text: str) -> None:
    """Put a formula in the place of a number of a document that is to be written.

    Parameters
    ----------
    written
        The document, perhaps without what has its default value; it is changed.
    whole
        The same with all of its fields.
    place
        As in ``formulas``; it may hold nothing yet, where a number is optional.

    Raises
    ------
    NotFoundError
        If there is no such place.
    ScenarioError
        If it holds something else than a number.
    """
    keys = [_unescaped(key) for key in place.split("/")]
    try:
        there = _looked_up(whole, keys)
    except (LookupError, TypeError) as error:
        raise NotFoundError("number", place, []) from error
    if isinstance(there, bool) or not (there is None or isinstance(there, int | float)):
        raise ScenarioError(
            f"{place}: only a number can be computed, and this is {json.dumps(there):.60}"
        )
    _set(written, keys, text)


def _is_formula(text: str, key: str, values: Mapping[str, float]) -> bool:
    if "$" not in text or key in _TEXTS:
        return False
    return text.startswith("$") or not names_in(text).isdisjoint(values)


def _parts(node: list[Any]) -> Iterator[tuple[str, Any]]:
    """Each part of a list with its id, or its index if it has none of its own."""
    ids = [one.get("id") if isinstance(one, dict) else None for one in node]
    for index, (name, one) in enumerate(zip(ids, node, strict=True)):
        own = isinstance(name, str) and ids.count(name) == 1
        yield name if own and name is not None else str(index), one


def _looked_up(node: Any, keys: list[str]) -> Any:
    for key in keys:
        node = node[key] if isinstance(node, dict) else dict(_parts(node))[key]
    return node


def _set(node: Any, keys: list[str], text: str) -> None:
    for key in keys[:-1]:
        node = node.setdefault(key, {}) if isinstance(node, dict) else dict(_parts(node))[key]
    if isinstance(node, dict):
        node[keys[-1]] = text
    else:
        node[[part for part, _ in _parts(node)].index(keys[-1])] = text


def _at(place: str, key: str) -> str:
    return f"{place}/{_escaped(key)}"


def _escaped(key: str) -> str:
    return key.replace("~", "~0").replace("/", "~1")


def _unescaped(key: str) -> str:
    return key.replace("~1", "/").replace("~0", "~")
