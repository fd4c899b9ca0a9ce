"""Global and user-defined actions that rules have no counterpart of: what becomes of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from odscen.formats.openscenario_import.world.read_environment import STAYS

if TYPE_CHECKING:
    from lxml.etree import _Element

    from odscen.formats.openscenario_import.import_report import ImportReport

READ: Final = frozenset(
    {"EntityAction", "InfrastructureAction", "VariableAction", "ParameterAction"}
)
"""Global actions that are read where their event is, or where their values are asked for."""
_MAKES: Final = ("TrafficSourceAction", "TrafficSwarmAction", "TrafficAreaAction")
_WHY: Final = {
    "EnvironmentAction": STAYS,
    "TrafficAction": "there is no traffic of the file",
    "UserDefinedAction": "commands of a program beside the file",
    "SetMonitorAction": "monitors are not read",
}
_OTHER: Final = "odscen has no counterpart of this global action"
_LIGHTS: Final = "at first lights have the program of the map; rules can switch them later"


def tell_unread(report: ImportReport, content: _Element, *, story: bool) -> None:
    """Say why a global or user-defined action does nothing, if it is not read elsewhere.

    Parameters
    ----------
    story
        Whether it is in an event, and not in ``Init``.
    """
    kind = content if content.tag == "UserDefinedAction" else content.find("*")
    if kind is None or (story and kind.tag in READ):
        return
    makes = [element for element in kind.iterchildren(*_MAKES) if kind.tag == "TrafficAction"]
    if makes:
        for make in (content, kind, *makes):
            words = "it puts traffic of its own on the road; give the scenario flows or demand"
            report.mark(make, "refused", words)
    elif kind.tag == "InfrastructureAction":
        report.ignore(content, _LIGHTS)
    elif story or kind.tag not in READ | {"EnvironmentAction"}:
        report.ignore(content, _WHY.get(str(kind.tag), _OTHER))
