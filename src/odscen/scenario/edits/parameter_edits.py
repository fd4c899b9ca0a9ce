"""Changes to the parameters of a scenario, and to the numbers that are computed from them."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Annotated, Any

from pydantic_core import from_json

from odscen.base.errors import NotFoundError, ScenarioError
from odscen.scenario.document.expressions import evaluate, names_in
from odscen.scenario.document.formulas import put_formula
from odscen.scenario.document.json_form import dumps, loads
from odscen.scenario.document.parameters_document import Parameter
from odscen.scenario.edits.edit_registry import edit

if TYPE_CHECKING:
    from odscen.scenario.document.scenario_document import Scenario

_WHAT = "parameter"


@edit("Parameter {parameter}")
def set_parameter(
    scenario: Scenario,
    *,
    parameter: str,
    instead_of: str | None = None,
    **fields: Annotated[Any, Parameter],
) -> Scenario:
    """Add a parameter, or change one; every number that is computed from it follows.

    Parameters
    ----------
    parameter
        Its name.
    instead_of
        Name that it has now, if it is renamed; formulas then use the new one.
    fields
        Fields of :class:`~odscen.scenario.document.parameters_document.Parameter`; those not given
        stay as they are, ``None`` takes a bound away. A new one needs a ``value``.

    Raises
    ------
    NotFoundError
        If there is no parameter ``instead_of``.
    ScenarioError
        If the name is taken, the value is outside the bounds, or what follows from it is not
        possible; names each place.
    """
    if instead_of is not None and instead_of != parameter:
        scenario = _renamed(scenario, instead_of, parameter)
    data = from_json(dumps(scenario))
    one = data.setdefault("parameters", {}).setdefault(parameter, {})
    one |= {name: value for name, value in fields.items() if value is not None}
    for name, value in fields.items():
        if value is None:
            one.pop(name, None)
    return loads(json.dumps(data))


@edit("Remove parameter {parameter}")
def remove_parameter(scenario: Scenario, *, parameter: str) -> Scenario:
    """Remove a parameter; numbers that were computed from it stay as they are, without formulas.

    Raises
    ------
    NotFoundError
        If there is none of that name.
    """
    _refuse_unknown(scenario, parameter)
    left = {name: one for name, one in scenario.parameters.items() if name != parameter}
    kept = {
        place: text
        for place, text in scenario.formulas.items()
        if parameter not in names_in(text) and place != _value_of(parameter)
    }
    return loads(dumps(scenario.model_copy(update={"parameters": left, "formulas": kept})))


@edit("Formula of {place}")
def set_formula(scenario: Scenario, *, place: str, formula: str | None) -> Scenario:
    """Compute a number of the document from parameters, or let it be a number again.

    Parameters
    ----------
    place
        Of the number, as in ``formulas`` of the document: ``rules/cut-in/when/ttc/below``.
    formula
        Arithmetic with parameters, ``2 * $gap``; ``None`` keeps the number that there is.

    Raises
    ------
    NotFoundError
        If the document has no such place.
    ScenarioError
        If the formula has no value, or one that is not possible there.
    InputError
        If the formula names what is no parameter.
    """
    others = {where: text for where, text in scenario.formulas.items() if where != place}
    alone = scenario.model_copy(update={"formulas": others})
    data = from_json(dumps(alone))
    if formula is None:
        return loads(json.dumps(data))
    evaluate(formula, {name: one.value for name, one in scenario.parameters.items()})
    if not names_in(formula):
        raise ScenarioError(
            f"{place}: the formula {formula!r} names no parameter; write $gap for one called gap"
        )
    put_formula(data, scenario.model_dump(mode="json"), place, formula)
    return loads(json.dumps(data))


def _renamed(scenario: Scenario, old: str, new: str) -> Scenario:
    _refuse_unknown(scenario, old)
    if new in scenario.parameters:
        raise ScenarioError(f"there is a parameter {new!r} already")
    parameters = {new if name == old else name: p for name, p in scenario.parameters.items()}
    named = re.compile(rf"\${re.escape(old)}(?![A-Za-z0-9_])")
    formulas = {
        _value_of(new) if place == _value_of(old) else place: named.sub(f"${new}", text)
        for place, text in scenario.formulas.items()
    }
    return scenario.model_copy(update={"parameters": parameters, "formulas": formulas})


def _value_of(parameter: str) -> str:
    """Place of its value."""
    return f"parameters/{parameter}/value"


def _refuse_unknown(scenario: Scenario, name: str) -> None:
    if name not in scenario.parameters:
        raise NotFoundError(_WHAT, name, list(scenario.parameters))
