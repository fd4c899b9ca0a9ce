"""Parameters and variables that actions of the file set: their values at first, and later."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

    from lxml.etree import _Element

    from odscen.formats.openscenario_import.import_report import ImportReport

_ACTIONS = ("VariableAction", "ParameterAction")


def first_values(report: ImportReport, root: _Element, values: dict[str, str]) -> None:
    """Give parameters and variables the values that actions of ``Init`` set."""
    for kind, name in _actions_in(root, "Storyboard/Init/Actions/GlobalAction"):
        for element in (kind.getparent(), kind, *kind.iter("*")):
            if element is not None:
                report.mark(element, "taken")
        values[name] = new_value(kind, values.get(name, "0"))


def sets_in_story(root: _Element, name: str) -> list[_Element]:
    """Actions of the story that set a parameter or variable."""
    paths = "Storyboard/Story//Action/GlobalAction"
    return [kind for kind, found in _actions_in(root, paths) if found == name]


def new_value(kind: _Element, have: str) -> str:
    """Value after an action; one that cannot be changed by a number stays."""
    sets = kind.find("SetAction")
    if sets is not None:
        return sets.get("value", "")
    by = next(kind.iter("AddValue", "MultiplyByValue"), None)
    if by is None:
        return have
    try:
        one, other = float(have), float(by.get("value", ""))
    except ValueError:
        return have
    return f"{one + other if by.tag == 'AddValue' else one * other:.12g}"


def _actions_in(root: _Element, path: str) -> Iterator[tuple[_Element, str]]:
    for action in root.iterfind(path):
        for kind in action.iterchildren(*_ACTIONS):
            name = kind.get("variableRef") or kind.get("parameterRef") or ""
            yield kind, name.lstrip("$")
