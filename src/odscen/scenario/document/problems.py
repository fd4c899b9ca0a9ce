"""What checks and pydantic find in documents: problems as data, so that all show at once."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal, TypeVar

from pydantic import BaseModel, ValidationError

from odscen.base.errors import ScenarioError
from odscen.base.shown import printable

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

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
    listed = tuple(_describe_problem(details) for details in found[:_LISTED])
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


def _describe_problem(details: ErrorDetails) -> str:
    place = _format_location(details["loc"])
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


def _format_location(location: Iterable[str | int]) -> str:
    place = ""
    for step in location:
        # Names of fields that are not known are those of the file, however long.
        if isinstance(step, int):
            place += f"[{step}]"
        else:
            place += f".{printable(step[:_SHOWN])}" if place else printable(step[:_SHOWN])
    return place


Severity = Literal["error", "warning"]


@dataclass(frozen=True, slots=True)
class Problem:
    """One thing that is wrong, or odd, in a scenario.

    Attributes
    ----------
    severity
        ``error``: the scenario cannot run as it is; ``warning``: it runs, but look at this.
    code
        Short fixed name of the rule, for example ``goal_unreachable``.
    where
        Place in the document, for example ``actors[3].goal``.
    message
        What is wrong and what to do, for a person.
    nodes, segments
        Ids that an interface can highlight.
    """

    severity: Severity
    code: str
    where: str
    message: str
    nodes: tuple[str, ...] = ()
    segments: tuple[str, ...] = ()

    def __str__(self) -> str:
        return f"{self.severity} {self.code}: {self.where}: {self.message}"


def error(
    code: str, where: str, message: str, *, nodes: Iterable[str] = (), segments: Iterable[str] = ()
) -> Problem:
    """Make a problem that keeps the scenario from running."""
    return Problem("error", code, where, message, tuple(nodes), tuple(segments))


def warning(
    code: str, where: str, message: str, *, nodes: Iterable[str] = (), segments: Iterable[str] = ()
) -> Problem:
    """Make a problem that the scenario runs with."""
    return Problem("warning", code, where, message, tuple(nodes), tuple(segments))


MOST_OF_KIND = 1000
"""Problems of one kind that are listed; nobody reads more."""
MOST_PAIRS = 200
"""Of a kind of which there is one for each two parts of a scenario."""


def more_of_kind(like: Problem, number: int) -> Problem:
    """Stand in for ``number`` more problems of the severity and code of one that is listed.

    Its place is the list that all of them are in, ``rules`` of ``rules[7].id``.
    """
    return Problem(
        like.severity, like.code, like.where.partition("[")[0], f"and {number:,} more of this kind"
    )


def limited(
    problems: Iterable[Problem], *, most: int = MOST_OF_KIND, where: str | None = None
) -> Iterator[Problem]:
    """Yield the first problems of each kind, and behind all of them how many more there are.

    Parameters
    ----------
    most
        Problems of a kind, which is a severity and a code.
    where
        Place of what stands for the others, if not :func:`more_of_kind` finds it.
    """
    seen: Counter[tuple[Severity, str]] = Counter()
    first: dict[tuple[Severity, str], Problem] = {}
    for problem in problems:
        kind = problem.severity, problem.code
        seen[kind] += 1
        first.setdefault(kind, problem)
        if seen[kind] <= most:
            yield problem
    for kind, number in seen.items():
        if number > most:
            more = more_of_kind(first[kind], number - most)
            yield more if where is None else replace(more, where=where)


def refuse_errors(problems: Iterable[Problem], *, file: str | None = None) -> tuple[Problem, ...]:
    """Raise :class:`ScenarioError` with the errors among ``problems``; warnings are given back.

    Of each kind as many are listed as :func:`limited` does.
    """
    problems = tuple(problems)
    errors = [problem for problem in problems if problem.severity == "error"]
    if not errors:
        return problems
    if len(errors) == 1:
        raise ScenarioError(errors[0].message, element=errors[0].where, file=file)
    raise ScenarioError(
        f"the scenario has {len(errors)} errors",
        problems=[f"{problem.where}: {problem.message}" for problem in limited(errors)],
        file=file,
    )
