"""The rules that parts of the demand have in common: when they are, and who they are."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.scenario.document.problems import Problem, error, warning
from odscen.scenario.placing.region import on_foot

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from odscen.base.categories import Category
    from odscen.scenario.document.scenario_document import Scenario, Window


def window_problems(scenario: Scenario, part: Window, where: str) -> Iterator[Problem]:
    """Yield what is wrong with begin and end of a part of the demand."""
    duration = scenario.simulation.duration
    if part.end is not None and part.end <= part.begin:
        message = f"{part.id!r} ends at {part.end:g} s, not after it begins ({part.begin:g} s)"
        yield error("flow_window_empty", f"{where}.end", message)
    elif part.begin >= duration:
        message = (
            f"{part.id!r} begins at {part.begin:g} s, but the run ends at {duration:g} s; begin "
            "earlier or run longer"
        )
        severity = error if part.end is None else warning
        yield severity("departs_too_late", f"{where}.begin", message)


def foot_problems(mix: Iterable[Category], name: str, where: str, what: str) -> Iterator[Problem]:
    """Yield an error if a mix of vehicles has pedestrians."""
    if any(on_foot(category) for category in mix):
        message = f"{name!r} has pedestrians; {what} are of vehicles: use a matrix for them"
        yield error("wrong_graph", f"{where}.mix", message)
