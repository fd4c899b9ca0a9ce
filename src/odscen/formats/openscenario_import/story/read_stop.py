"""The storyboard's stop trigger: a duration, and rules that end the run."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from odscen.base.errors import InputError
from odscen.formats.openscenario.xosc_triggers import after_story_of
from odscen.formats.openscenario_import.import_report import RefusedError
from odscen.formats.openscenario_import.story.read_conditions import ALWAYS, NEVER

if TYPE_CHECKING:
    from lxml.etree import _Element

    from odscen.formats.openscenario_import.import_report import ImportReport
    from odscen.formats.openscenario_import.story.read_conditions import ConditionReader
    from odscen.formats.openscenario_import.story.read_storyboard import StoryReader

Made = dict[str, Any]
_USUAL_DURATION: Final = 60.0
_CRITERION: Final = "criteria_"
"""How ScenarioRunner's names of conditions begin that are no triggers but judge a run."""


def read_stop(report: ImportReport, board: _Element, story: StoryReader) -> Made:
    """When the storyboard ends, as fields of ``simulation``; other triggers become rules.

    A file that names a time runs until then, whether or not anything is left to happen.
    """
    stop = report.child(board, "StopTrigger")
    found: list[tuple[float, str]] = []
    latest, ends = 0.0, False
    for group in () if stop is None else report.children(stop, "ConditionGroup"):
        times = group.findall(".//SimulationTimeCondition")
        seconds = [report.number(time, "value") for time in times]
        if times and len(times) == len(group.findall("Condition")):
            found.append(_take_stop_time(report, times, board))
        elif story.actions is not None and (
            when := _stop_condition(report, group, story.actions.conditions)
        ):
            story.end(when)
            latest, ends = max([latest, *seconds]), True
        elif times:
            found.append(_take_stop_time(report, times, board))
            report.mark(group, "approximated", "the run ends by time alone")
    if found := [end for end in found if end[0] > 0]:
        duration, name = min(found)
        return {"duration": duration, "after_story": after_story_of(name)}
    duration = _USUAL_DURATION + latest
    if stop is not None:
        words = f"the run ends after {duration:g} s{' at the latest' if ends else ''}"
        report.mark(stop, "approximated", words)
    return {"duration": duration}


def _stop_condition(
    report: ImportReport, group: _Element, conditions: ConditionReader
) -> Made | None:
    """Condition on which the run ends, if that can happen and is known."""
    if any(condition.get("name", "").startswith(_CRITERION) for condition in group):
        return None
    try:
        when = conditions.group(group)
    except RefusedError as error:
        report.mark(error.element, "approximated", f"the run does not end with it: {error.reason}")
        return None
    except InputError as error:
        words = f"the run does not end with it: {error.element}: {error.problem}"
        report.mark(group, "approximated", words)
        return None
    return None if when in ({}, ALWAYS, NEVER) else when


def _take_stop_time(
    report: ImportReport, times: list[_Element], board: _Element
) -> tuple[float, str]:
    """The earliest of these times, and the name of its condition."""
    found = []
    for condition in times:
        above: _Element | None = condition
        while above is not None and above is not board:
            report.mark(above, "taken")
            if above.tag == "Condition":
                found.append((report.number(condition, "value"), above.get("name", "")))
            above = above.getparent()
    return min(found)
