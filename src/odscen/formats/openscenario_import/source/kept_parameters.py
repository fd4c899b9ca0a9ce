"""Parameters of a file as parameters of the scenario, with the formulas that use them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from odscen.formats.openscenario_import.traced_numbers import with_formulas
from odscen.scenario.document.formulas import computed, names_in

if TYPE_CHECKING:
    from collections.abc import Mapping

    from lxml.etree import _Element

    from odscen.formats.openscenario_import.import_report import ImportReport
    from odscen.formats.openscenario_import.traced_numbers import Source

Made = dict[str, Any]
_BOUNDS: Final = {
    "greaterThan": "min",
    "greaterOrEqual": "min",
    "lessThan": "max",
    "lessOrEqual": "max",
}
_MENTIONED: Final = frozenset({"ParameterDeclaration", "ParameterAssignment", "ValueConstraint"})
"""Elements that only hand the value of a parameter on."""


def with_parameters(
    report: ImportReport, declared: Mapping[str, _Element], data: Made
) -> dict[str, Any]:
    """Document with its parameters and formulas, computed.

    A parameter is kept if a number of the document comes from it. The others keep their declared
    values where they are named, and so does a kept one where its value settles something else,
    such as a place on a lane; the report says where.

    Parameters
    ----------
    declared
        Declarations of parameters that are numbers, by name, in the order of the file.
    data
        The document as JSON, with traced numbers.
    """
    reached: set[Source] = set()
    document = with_formulas(data, reached)
    made: dict[str, Made] = {}
    for name, declaration in declared.items():
        made[name] = _read_parameter(report, declaration, frozenset(made))
    used = frozenset().union(*(names_in(report.formulas[place]) for place in reached))
    kept = _with_needed(made, used)
    document["parameters"] = {name: parameter for name, parameter in made.items() if name in kept}
    for name, element in declared.items():
        _report_kept_value(report, name, element, reached, kept=name in kept)
    return computed(document) if kept else document


def _with_needed(made: Mapping[str, Made], used: frozenset[str]) -> frozenset[str]:
    """Names of parameters in use, with those that their own formulas need."""
    found: frozenset[str] = frozenset()
    left = used & made.keys()
    while left:
        found |= left
        texts = [str(formula) for name in left for formula in made[name].values()]
        left = frozenset().union(*map(names_in, texts)) & (made.keys() - found)
    return found


def _read_parameter(report: ImportReport, element: _Element, earlier: frozenset[str]) -> Made:
    value = report.number(element, "value")
    found: Made = {"value": report.formulas.get((element, "value"), float(value))}
    groups = list(report.children(element, "ConstraintGroup"))
    for bound in element.iterfind("ConstraintGroup/ValueConstraint"):
        report.mark(bound, "taken")
        why = "one of several alternatives" if len(groups) > 1 else ""
        if not report.uses.get((bound, "value"), frozenset()) <= earlier:
            why = "it depends on a parameter that is declared later"
        _read_bound(report, bound, found, value=value, why=why)
    return found


def _read_bound(
    report: ImportReport, bound: _Element, found: Made, *, value: float, why: str
) -> None:
    rule, limit = bound.get("rule", ""), report.number(bound, "value")
    side = _BOUNDS.get(rule)
    holds = value >= limit if side == "min" else value <= limit
    if not why and (side is None or side in found):
        why = "a parameter has a least and a greatest value, and no other constraint"
    elif not why and not holds:
        why = f"the declared value {value:g} does not keep it"
    if why or side is None:
        report.mark(bound, "approximated", f"constraint not enforced: {why}")
        return
    found[side] = report.formulas.get((bound, "value"), float(limit))
    if rule in ("greaterThan", "lessThan"):
        report.mark(bound, "approximated", "the bound itself is possible too")


def _report_kept_value(
    report: ImportReport, name: str, element: _Element, reached: set[Source], *, kept: bool
) -> None:
    """Say where a parameter keeps its declared value."""
    fixed = [
        f"{report.place(element)} ({key})"
        for (element, key), names in report.uses.items()
        if name in names
        and (element, key) not in reached
        and element.tag not in _MENTIONED
        and report.verdict(element) in ("taken", "approximated")
    ]
    if fixed:
        words = f"its declared value stays, whatever a sweep gives it: {', '.join(fixed)}"
        report.mark(element, "approximated", words)
    elif not kept:
        report.mark(element, "ignored", "nothing that is read needs it")
