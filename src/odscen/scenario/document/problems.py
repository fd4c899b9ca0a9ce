"""What a check reports: problems as data, so that an interface shows all of them at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from odscen.base.errors import ScenarioError

if TYPE_CHECKING:
    from collections.abc import Iterable

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


def refuse_errors(problems: Iterable[Problem], *, file: str | None = None) -> None:
    """Raise :class:`ScenarioError` with all errors among ``problems``; warnings pass."""
    errors = [problem for problem in problems if problem.severity == "error"]
    if not errors:
        return
    if len(errors) == 1:
        raise ScenarioError(errors[0].message, element=errors[0].where, file=file)
    raise ScenarioError(
        f"the scenario has {len(errors)} errors",
        problems=[f"{p.where}: {p.message}" for p in errors],
        file=file,
    )
