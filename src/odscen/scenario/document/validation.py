"""pydantic's findings as ours: one line per problem, with its place."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeVar

from pydantic import BaseModel, ValidationError

from odscen.base.errors import ScenarioError

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from pydantic_core import ErrorDetails

_Model = TypeVar("_Model", bound=BaseModel)

_LISTED = 1000
"""Problems of one document that are listed."""
_SHOWN = 60
"""Longest piece of a wrong value that is quoted in a message."""


def validation_problems(error: ValidationError) -> tuple[str, ...]:
    """One line per problem of a pydantic error: the place, what is wrong, and the value.

    Of very many the first thousand, and a line with how many more there are.
    """
    found = error.errors(include_url=False)
    listed = tuple(_problem(details) for details in found[:_LISTED])
    return listed if len(found) <= _LISTED else (*listed, f"and {len(found) - _LISTED} more")


def validated(model: type[_Model], fields: Mapping[str, Any]) -> _Model:
    """Make a pydantic model, with :class:`ScenarioError` for pydantic's own error."""
    try:
        return model.model_validate(fields)
    except ValidationError as error:
        problems = validation_problems(error)
        raise ScenarioError(
            f"{model.__name__.lower()}: {problems[0]}", problems=problems[1:]
        ) from error


def _problem(details: ErrorDetails) -> str:
    place = _place(details["loc"])
    message = details["msg"]
    value = details["input"]
    if details["type"] == "missing" or isinstance(value, (dict, list, bytes)):
        shown = ""
    else:
        quoted = repr(value)
        shown = f", not {quoted[:_SHOWN]}{'...' if len(quoted) > _SHOWN else ''}"
    if details["type"] == "json_invalid":
        return message
    return f"{place}: {message}{shown}" if place else f"{message}{shown}"


def _place(location: Iterable[str | int]) -> str:
    place = ""
    for step in location:
        place += f"[{step}]" if isinstance(step, int) else f".{step}" if place else step
    return place
