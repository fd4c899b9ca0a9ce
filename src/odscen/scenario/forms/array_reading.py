"""Scenarios read from their array form, as it was written or as somebody has changed it."""

from __future__ import annotations

import json
from itertools import count
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import ValidationError

from odscen.base.errors import InputError, ScenarioError
from odscen.base.given_arrays import arrays_from_npz
from odscen.lanegraph.graph_npz import graph_from_arrays
from odscen.scenario.document.drivers_document import DRIVING_STYLES
from odscen.scenario.document.json_form import dumps, loads
from odscen.scenario.document.problems import validation_problems
from odscen.scenario.document.scenario_document import Scenario
from odscen.scenario.forms.array_form import (
    ACTOR_COLUMNS,
    CATEGORIES,
    FLOW_COLUMNS,
    FORMAT,
    NO_NODE,
    OTHER_STYLE,
    REAL,
    RUN_NUMBERS,
    TRUTH,
    VERSION,
    WHOLE,
    node_name,
)
from odscen.scenario.placing.region import on_foot

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.base.given_arrays import Array
    from odscen.lanegraph.graphs import MapGraph

_ACCEPTED = {WHOLE: "iu", REAL: "fiu", TRUTH: "b"}
_CALLED = {WHOLE: "whole numbers", REAL: "numbers", TRUTH: "true or false"}
_TEXT = "U"


def from_npz(data: bytes, *, file: str | None = None) -> Scenario:
    """Read a scenario from an .npz file of its array form.

    Raises
    ------
    InputError
        If it is no such file; names the array and its value.
    ScenarioError
        If the scenario that it gives has problems.
    """
    return from_arrays(arrays_from_npz(data, file=file), file=file)


def from_arrays(arrays: Mapping[str, Array], *, file: str | None = None) -> Scenario:
    """Read a scenario from its array form.

    Inverse of :func:`~odscen.scenario.forms.array_form.to_arrays`.

    Parameters
    ----------
    arrays
        Those of ``docs/learning-formats.md``, the map's included.
    file
        For messages.

    Raises
    ------
    InputError
        If an array is missing, of another shape or kind, or names a row that is not there.
    ScenarioError
        If a value is not possible; names each with its array and row.
    """
    try:
        reading = _ArrayReading({name: np.asarray(values) for name, values in arrays.items()})
        scenario = _validate_scenario(reading.fields(), reading.rows)
        return loads(dumps(scenario)) if scenario.formulas else scenario
    except InputError as error:
        error.file = error.file or file
        raise


def _validate_scenario(fields: Mapping[str, Any], tables: Mapping[str, frozenset[str]]) -> Scenario:
    try:
        return Scenario.model_validate(fields)
    except ValidationError as error:
        problems = [
            _name_array_place(validation_problem, tables)
            for validation_problem in validation_problems(error)
        ]
        what = "a problem" if len(problems) == 1 else f"{len(problems)} problems"
        raise ScenarioError(
            f"the scenario of these arrays has {what}", problems=problems
        ) from error


def _name_array_place(problem: str, tables: Mapping[str, frozenset[str]]) -> str:
    """Say the array and row in place of the field of the document, where it has a column."""
    place, colon, reason = problem.partition(": ")
    table, _, rest = place.partition("s[")
    row, _, field = rest.partition("].")
    if colon and field in tables.get(table, ()):
        return f"array {table}_{field}, row {row}: {reason}"
    return problem


class _ArrayReading:
    """Reads the parts of one scenario; errors name the array.

    Attributes
    ----------
    rows
        Columns of each table, for messages.
    """

    def __init__(self, arrays: Mapping[str, Array]) -> None:
        self._arrays = arrays
        self._refuse_others()
        self.rows = {"actor": frozenset(ACTOR_COLUMNS), "flow": frozenset(FLOW_COLUMNS)}
        self._document = self._read_json()
        self._graph: MapGraph = graph_from_arrays(arrays)
        map_fields = self._document.get("map")
        if isinstance(map_fields, dict) and map_fields.get("sha256") != self._graph.map_sha256:
            raise InputError(
                f"its graph is of {self._graph.map_sha256[:12]}..., the document of another map",
                element="array map",
            )

    def fields(self) -> dict[str, Any]:
        """The document, as its model takes it."""
        whole = {name: value for name, value in self._document.items() if value is not None}
        simulation = whole.get("simulation", {})
        if not isinstance(simulation, dict):
            raise _array_error("document", "its simulation is not an object")
        numbers = {name: float(self._read_single(name, REAL)) for name in RUN_NUMBERS}
        return {
            **whole,
            "seed": int(self._read_single("seed", WHOLE)),
            "simulation": {**simulation, **numbers},
            "environment": self._read_environment(),
            "roi": self._read_roi(),
            "actors": self._read_actors(),
            "flows": self._read_flows(),
        }

    def _refuse_others(self) -> None:
        try:
            about = json.loads(str(self._read_text("about")))
            known = (about["format"], about["version"])
        except (ValueError, KeyError, TypeError, RecursionError) as error:
            raise _array_error("about", "it does not say which arrays these are") from error
        if known != (FORMAT, VERSION):
            raise _array_error("about", f"these are {known[0]} {known[1]}, not {FORMAT} {VERSION}")

    def _read_json(self) -> dict[str, Any]:
        data = self._read_column("document", "u", "bytes")
        try:
            document = json.loads(data.astype(np.uint8).tobytes())
        except (ValueError, RecursionError) as error:
            raise _array_error("document", f"it is not JSON: {error}") from error
        if not isinstance(document, dict):
            raise _array_error("document", "it is not a JSON object")
        return document

    # ------------------------------------------------------------------ parts of the document
    def _read_environment(self) -> dict[str, Any]:
        names = self._read_column("environment_parameter", _TEXT, "texts")
        values = self._read_numbers("environment_value", REAL, len(names))
        return {
            "preset": str(self._read_text("environment_preset")),
            "affects_driving": bool(self._read_single("environment_affects_driving", TRUTH)),
            "parameters": dict(zip(names.tolist(), values.tolist(), strict=True)),
        }

    def _read_roi(self) -> list[str]:
        rows = self._read_column("roi", _ACCEPTED[WHOLE], _CALLED[WHOLE])
        named, known = self._document.get("roi"), self._graph.segments.ids
        found = []
        for place, row in enumerate(rows.tolist()):
            if 0 <= row < len(known):
                found.append(str(known[row]))
            elif row == -1 and isinstance(named, list) and place < len(named):
                found.append(named[place])
            else:
                raise _array_error("roi", f"row {place}: there is no segment {row}")
        return found

    def _read_actors(self) -> list[dict[str, Any]]:
        ids = self._read_ids("actor")
        size = len(ids)
        kinds = self._read_indices("actor_category", size, len(CATEGORIES))
        styles = self._read_indices("actor_style", size, len(DRIVING_STYLES), but=OTHER_STYLE)
        via = self._read_matrix("actor_via", _ACCEPTED[WHOLE], size)
        walks = [on_foot(CATEGORIES[kind]) for kind in kinds]
        ends = self._read_ends("actor", walks)
        found = self._read_columns("actor", ACTOR_COLUMNS, self._written_of("actor", size))
        for row, fields in enumerate(found):
            fields.update(ends[row])
            if passed := [node for node in via[row].tolist() if node != NO_NODE]:
                walk = walks[row]
                fields["via"] = [
                    self._name_of_node("actor_via", row, node, walk=walk) for node in passed
                ]
            if styles[row] != OTHER_STYLE:
                fields["style"] = DRIVING_STYLES[styles[row]]
            fields["id"], fields["category"] = ids[row], CATEGORIES[kinds[row]]
        return _with_ids(found, "actor")

    def _read_flows(self) -> list[dict[str, Any]]:
        ids = self._read_ids("flow")
        size = len(ids)
        walks = self._read_numbers("flow_on_foot", TRUTH, size).tolist()
        mixes = self._read_matrix("flow_mix", _ACCEPTED[REAL], size, len(CATEGORIES))
        ends = self._read_ends("flow", walks)
        found = self._read_columns("flow", FLOW_COLUMNS, self._written_of("flow", size))
        for row, fields in enumerate(found):
            fields.update(ends[row])
            order = fields.get("mix")
            shares = {
                str(category): share
                for category, share in zip(CATEGORIES, mixes[row].tolist(), strict=True)
                if share != 0
            }
            first = (
                [category for category in order if category in shares]
                if isinstance(order, list)
                else []
            )
            fields["mix"] = {name: shares[name] for name in [*first, *shares]}
            fields["id"] = ids[row]
        return _with_ids(found, "flow")

    def _written_of(self, table: str, size: int) -> list[dict[str, Any]]:
        """What the document has of each row without a column; a new row has nothing."""
        held = self._document.get(f"{table}s", [])
        if not (isinstance(held, list) and all(isinstance(item, dict) for item in held)):
            raise _array_error("document", f"its {table}s are not a list of objects")
        rows = self._read_indices(f"{table}_row", size, len(held), but=-1)
        return [dict(held[row]) if row >= 0 else {} for row in rows]

    def _read_ids(self, table: str) -> list[str]:
        ids: list[str] = self._read_column(f"{table}_id", _TEXT, "texts").tolist()
        return ids

    def _read_columns(
        self, table: str, columns: Mapping[str, str], found: list[dict[str, Any]]
    ) -> list[dict[str, Any]]:
        """Put the values of columns into the fields of each row; NaN leaves the default."""
        for name, kind in columns.items():
            values = self._read_numbers(f"{table}_{name}", kind, len(found))
            for fields, value, no_value in zip(
                found, values.tolist(), np.isnan(values).tolist(), strict=True
            ):
                if not no_value:
                    fields[name] = value
        return found

    # ------------------------------------------------------------------ arrays
    def _read_ends(self, table: str, walks: list[bool]) -> list[dict[str, str]]:
        """Start and goal of each row of which the arrays have a node."""
        found: list[dict[str, str]] = [{} for _ in walks]
        for field, array in (("spawn", f"{table}_node"), ("goal", f"{table}_goal")):
            nodes = self._read_numbers(array, WHOLE, len(walks)).tolist()
            for row, node in enumerate(nodes):
                if node != NO_NODE:
                    found[row][field] = self._name_of_node(array, row, node, walk=walks[row])
        return found

    def _name_of_node(self, array: str, row: int, node: int, *, walk: bool) -> str:
        number = len(self._graph.walks.x if walk else self._graph.lanes.x)
        if not 0 <= node < number:
            graph = "pedestrian graph" if walk else "lane graph"
            raise _array_error(
                array, f"row {row}: there is no node {node}; the {graph} has {number}"
            )
        return node_name(self._graph, node, walk=walk)

    def _read_indices(
        self, array: str, size: int, end: int, *, but: int | None = None
    ) -> list[int]:
        found: list[int] = self._read_numbers(array, WHOLE, size).tolist()
        for row, value in enumerate(found):
            if not 0 <= value < end and value != but:
                other = "" if but is None else f" or {but}"
                raise _array_error(array, f"row {row}: {value} is not 0 to {end - 1}{other}")
        return found

    def _read_numbers(self, array: str, kind: str, size: int) -> Array:
        values = self._read_column(array, _ACCEPTED[kind], _CALLED[kind])
        if len(values) != size:
            raise _array_error(array, f"it has {len(values)} rows; its table has {size}")
        return values.astype(np.float64) if kind == REAL else values

    def _read_matrix(self, array: str, kinds: str, size: int, wide: int | None = None) -> Array:
        values = self._required_array(array)
        fits = values.ndim == 2 and len(values) == size and wide in (None, values.shape[1])
        if not fits or values.dtype.kind not in kinds:
            columns = "any number of" if wide is None else wide
            raise _array_error(
                array,
                f"it is {values.shape} of {values.dtype}, not {size} rows of {columns} numbers",
            )
        return values

    def _read_column(self, array: str, kinds: str, called: str) -> Array:
        values = self._required_array(array)
        empty = values.ndim == 1 and not len(values)  # a list without values has any kind
        if values.ndim != 1 or (values.dtype.kind not in kinds and not empty):
            raise _array_error(
                array, f"it is {values.shape} of {values.dtype}, not a column of {called}"
            )
        return values

    def _read_single(self, array: str, kind: str) -> Any:
        values = self._required_array(array)
        if values.size != 1 or values.dtype.kind not in _ACCEPTED[kind]:
            raise _array_error(
                array, f"it is {values.shape} of {values.dtype}, not one value: {_CALLED[kind]}"
            )
        return values.item()

    def _read_text(self, array: str) -> str:
        values = self._required_array(array)
        if values.size != 1 or values.dtype.kind != _TEXT:
            raise _array_error(array, f"it is {values.shape} of {values.dtype}, not one text")
        return str(values.item())

    def _required_array(self, array: str) -> Array:
        if array not in self._arrays:
            raise _array_error(array, "it is missing")
        return self._arrays[array]


def _with_ids(rows: list[dict[str, Any]], table: str) -> list[dict[str, Any]]:
    """Give rows without an id one that is free."""
    taken = {fields["id"] for fields in rows}
    numbers: dict[str, count[int]] = {}
    for fields in rows:
        if fields["id"]:
            continue
        stem = str(fields.get("category", table))
        free = (f"{stem}-{k}" for k in numbers.setdefault(stem, count(1)))
        fields["id"] = next(name for name in free if name not in taken)
        taken.add(fields["id"])
    return rows


def _array_error(array: str, problem: str) -> InputError:
    return InputError(problem, element=f"array {array}")
