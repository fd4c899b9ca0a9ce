"""Parameters and catalogs put in: a tree in which each attribute has its value."""

from __future__ import annotations

import math
import re
from copy import deepcopy
from typing import TYPE_CHECKING, Final

from odscen.base.errors import InputError
from odscen.formats.openscenario_import.traced_numbers import TracedText
from odscen.scenario.document.formulas import evaluate, names_in

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from lxml.etree import _Element

    from odscen.formats.openscenario_import.import_report import ImportReport

_EXPRESSION: Final = re.compile(r"\$\{([^{}]*)\}")
_NAME: Final = re.compile(r"\$([A-Za-z_][A-Za-z0-9_]*)")
_LITERAL: Final = frozenset({"name", "parameterRef", "variableRef"})
"""Attributes that name something, a parameter perhaps, and are never computed."""
_BODIES: Final = {"pedestrian": "Pedestrian", "misc": "MiscObject"}
"""Words in names of catalogs, and what their entries are."""
_USUAL_BODY: Final = {"Vehicle": "a car", "Pedestrian": "a pedestrian", "MiscObject": "an object"}
_TRUTH: Final = {"true": "1", "false": "0"}


class TreeResolver:
    """Resolves a tree in place.

    Parameters
    ----------
    report
        Where elements of catalogs are added.
    catalog
        Gives the root of a catalog and its file, by folders and name of the catalog.

    Attributes
    ----------
    parameters
        Declarations of the parameters of the file that are numbers, by name.
    """

    def __init__(
        self,
        report: ImportReport,
        catalog: Callable[[tuple[str, ...], str], tuple[_Element, str] | None],
    ) -> None:
        self._report = report
        self._catalog = catalog
        self._folders: tuple[str, ...] = ()
        self.parameters: dict[str, _Element] = {}

    def resolve(self, root: _Element) -> dict[str, str]:
        """Put values in for names; returns the parameters of the file.

        Raises
        ------
        InputError
            If a name is unknown, an expression has no value, or a catalog is missing.
        """
        values = self._declared_values(root, {}, named=True)
        for element in root.iterfind("CatalogLocations/*/Directory"):
            self._put_values(element, values)
            self._report.mark(element, "taken")
        places = root.iterfind("CatalogLocations//Directory")
        self._folders = tuple(element.get("path", "") for element in places)
        for element in (*root.iterfind("CatalogLocations"), *root.iterfind("CatalogLocations/*")):
            self._report.mark(element, "taken")
        for parameter in self.parameters.values():
            for bound in parameter.iterfind("ConstraintGroup/ValueConstraint"):
                self._put_values(bound, values)
        self._resolve_inside(root, values, depth=0)
        return values

    def _resolve_inside(self, element: _Element, values: Mapping[str, str], *, depth: int) -> None:
        if depth > 8:
            raise self._report.wrong(element, "catalogs refer to each other without end")
        try:
            self._put_values(element, values)
        except InputError as error:
            if next(element.iterancestors("Event"), None) is None:
                raise
            # Its event alone is refused, where the value is read.
            self._report.mark(element, "refused", error.problem)
        if element.tag == "CatalogReference":
            self._expand_catalog_reference(element, values, depth=depth)
            return
        own = values if element.tag == "OpenSCENARIO" else self._declared_values(element, values)
        for child in list(element.iterchildren("*")):
            if child.tag != "ParameterDeclarations":
                self._resolve_inside(child, own, depth=depth)

    def _declared_values(
        self, element: _Element, values: Mapping[str, str], *, named: bool = False
    ) -> dict[str, str]:
        """Names in force inside an element; those of the file itself are parameters of scenarios.

        Parameters
        ----------
        named
            Whether the element is the file itself.
        """
        found = dict(values)
        for group in element.iterchildren("ParameterDeclarations", "VariableDeclarations"):
            self._report.mark(group, "taken")
            for declaration in group.iterchildren("ParameterDeclaration", "VariableDeclaration"):
                self._put_values(declaration, found)
                name, text = (
                    declaration.get("name", "").lstrip("$"),
                    str(declaration.get("value", "")),
                )
                formula = self._report.formulas.get((declaration, "value"))
                if named and declaration.tag == "ParameterDeclaration" and is_parameter(name, text):
                    formula = f"${name}"
                    self.parameters[name] = declaration
                elif formula is None:
                    self._report.mark(
                        declaration, "approximated", "its value is put in where it is named"
                    )
                self._report.mark(declaration, "taken")
                found[name] = text if formula is None else TracedText.of(text, formula)
        return found

    def _put_values(self, element: _Element, values: Mapping[str, str]) -> None:
        for key, text in element.attrib.items():
            if "$" in text and key not in _LITERAL:
                self._trace_parameters(element, str(key), str(text), values)
                element.set(key, self._value_of_text(element, str(text), values))
            elif key == "parameterRef" and element.tag == "ParameterCondition":
                self._trace_parameters(element, str(key), "$" + str(text).lstrip("$"), values)

    def _trace_parameters(
        self, element: _Element, key: str, text: str, values: Mapping[str, str]
    ) -> None:
        """Note which parameters an attribute comes from, and by which formula if it has one."""
        named = [values.get(name) for name in _NAME.findall(text)]
        used = [
            names_in(text_part.formula) for text_part in named if isinstance(text_part, TracedText)
        ]
        if not used:
            return
        self._report.uses[element, key] = frozenset().union(*used)
        formula = _formula_of(text, values)
        if formula is not None:
            self._report.formulas[element, key] = formula

    def _value_of_text(self, element: _Element, text: str, values: Mapping[str, str]) -> str:
        numbers = {}
        for name, value in values.items():
            try:
                numbers[name] = float(_TRUTH.get(value, value))
            except ValueError:
                continue
        try:
            text = _EXPRESSION.sub(lambda found: f"{evaluate(found[1], numbers):.12g}", text)
        except InputError as error:
            raise self._report.wrong(element, error.problem) from error
        whole = _NAME.fullmatch(text)
        if whole is None:
            return text
        if whole[1] not in values:
            raise self._report.wrong(element, f"{text!r} is no parameter of the file")
        return values[whole[1]]

    def _expand_catalog_reference(
        self, element: _Element, values: Mapping[str, str], *, depth: int
    ) -> None:
        """Put the entry of a catalog in the place of its reference."""
        name, entry = element.get("catalogName", ""), element.get("entryName", "")
        found = self._catalog(self._folders, name)
        where = None if found is None else _find_entry(found[0], entry)
        if found is None or where is None:
            self._replace_missing_entry(element, f"no catalog has {name!r} with {entry!r}")
            return
        self._report.mark(element, "taken")
        given = self._assigned_values(element, values)
        whole = deepcopy(found[0])
        copy = _find_entry(whole, entry)
        if copy is None:
            return
        self._report.add(copy, found[1])
        for group in copy.iterchildren("ParameterDeclarations"):
            for constraint in group:
                if constraint.get("name") in given:
                    text = given[str(constraint.get("name"))]
                    constraint.set("value", str(text))
                    if isinstance(text, TracedText):
                        self._report.formulas[constraint, "value"] = text.formula
        # An entry should declare all that it names; esmini's use parameters of the file too.
        self._resolve_inside(copy, values, depth=depth + 1)
        parent = element.getparent()
        if parent is not None:
            parent.replace(element, copy)

    def _replace_missing_entry(self, element: _Element, words: str) -> None:
        """Put a usual body in the place of one that no catalog has."""
        parent = element.getparent()
        tag = "" if parent is None else str(parent.tag)
        if parent is None or tag not in ("ScenarioObject", "ObjectController", "EnvironmentAction"):
            self._report.mark(element, "refused", words)
        elif tag != "ScenarioObject":
            self._report.ignore(element, words)
        else:
            name = element.get("catalogName", "").lower()
            tags = (tag for word, tag in _BODIES.items() if word in name)
            body = parent.makeelement(next(tags, "Vehicle"), name=element.get("entryName", ""))
            parent.replace(element, body)
            what = _USUAL_BODY[str(body.tag)]
            self._report.mark(element, "approximated", f"{words}: {what} of the usual size")

    def _assigned_values(self, element: _Element, values: Mapping[str, str]) -> dict[str, str]:
        found = {}
        for group in element.iterchildren("ParameterAssignments"):
            self._report.mark(group, "taken")
            for assignment in group.iterchildren("ParameterAssignment"):
                self._put_values(assignment, values)
                self._report.mark(assignment, "taken")
                text, formula = (
                    str(assignment.get("value", "")),
                    self._report.formulas.get((assignment, "value")),
                )
                name = assignment.get("parameterRef", "").lstrip("$")
                found[name] = text if formula is None else TracedText.of(text, formula)
        return found


def _find_entry(root: _Element, name: str) -> _Element | None:
    """Entry of a catalog of that name."""
    return next(
        (element for element in root.iterfind("Catalog/*") if element.get("name") == name), None
    )


def is_parameter(name: str, text: str) -> bool:
    """Whether a scenario can have a parameter of this name and value."""
    try:
        value = float(text)
    except ValueError:
        return False
    return math.isfinite(value) and len(name) <= 64 and _NAME.fullmatch(f"${name}") is not None


def _formula_of(text: str, values: Mapping[str, str]) -> str | None:
    """Formula of parameters that an attribute is, if it is a single one of numbers."""
    whole = _EXPRESSION.fullmatch(text) or _NAME.fullmatch(text)
    if whole is None:
        return None
    alone = values.get(whole[1]) if _NAME.fullmatch(text) else None
    if isinstance(alone, TracedText):
        return alone.formula
    bare = whole[1]

    def said(match: re.Match[str]) -> str:
        value = values.get(match[1], "")
        if isinstance(value, TracedText):
            return value.formula if _NAME.fullmatch(value.formula) else f"({value.formula})"
        return f"({_TRUTH.get(value, value)})"

    return _NAME.sub(said, bare).strip()
