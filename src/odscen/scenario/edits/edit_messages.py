"""Edits by name: every entry of :mod:`odscen.scenario.edits.edit_registry` as a message.

The messages are made from the functions' signatures, so that there is no second list to keep: kind
is the function's name, the other fields are its arguments. What is known from the scenario's map
(the graph, the lights) is not among them. The server and variants take them.
"""

from __future__ import annotations

import inspect
import json
import operator
from functools import reduce
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args, get_type_hints

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    TypeAdapter,
    ValidationError,
    create_model,
)

from odscen.base.errors import ScenarioError
from odscen.base.shown import shown
from odscen.scenario.document import document_parts, scenario_document, signals_document
from odscen.scenario.document.problems import validation_problems
from odscen.scenario.edits.edit_registry import EDIT_ENTRIES

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from odscen.scenario.document.document_parts import Part
    from odscen.scenario.document.scenario_document import Scenario

_KNOWN = {
    "scenario": "Scenario", "graph": "MapGraph", "lights": "Light", "usable": "Usable",
    "place_by": "NamedPlacer",
}  # fmt: skip
"""Arguments that come with the map, and the names of their types, which need no message."""
_JSON = {"Iterable": list, "Sequence": list, "Mapping": dict}
"""JSON has lists and objects; an Iterable would be read only when it is used."""
_LONGEST = 160
"""Characters of the arguments of an edit that are shown."""


class EditBase(BaseModel):
    """Base of all edits; ``kind`` is the name of the function."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    kind: str

    @property
    def arguments(self) -> dict[str, Any]:
        """Arguments that were given; those that were not keep the function's defaults."""
        return {name: getattr(self, name) for name in self.model_fields_set - {"kind"}}

    @property
    def data(self) -> dict[str, Any]:
        """The edit as JSON data, with what was given; :func:`read_edit` reads it."""
        return self.model_dump(mode="json", exclude_unset=True)

    @property
    def words(self) -> str:
        """The edit in one line: what undo calls it, and its arguments."""
        given = json.dumps(
            {name: value for name, value in self.data.items() if name != "kind"}, ensure_ascii=False
        )
        shown = given if len(given) <= _LONGEST else given[:_LONGEST] + "..."
        return f"{self.label} ({self.kind} {shown})"

    @property
    def label(self) -> str:
        """The edit in words, for undo and redo."""
        return EDIT_ENTRIES[self.kind].label.format(**self.arguments)


def _message_model(name: str, function: Callable[..., Scenario]) -> type[EditBase]:
    documents = (document_parts, signals_document, scenario_document)
    known = {name: value for document in documents for name, value in vars(document).items()}
    names = {**known, **dict.fromkeys(_KNOWN.values(), object), **_JSON}
    hints = get_type_hints(function, localns=names, include_extras=True)
    fields: dict[str, Any] = {"kind": (Literal[name], ...)}
    for parameter in inspect.signature(function).parameters.values():
        if parameter.name in _KNOWN:
            continue
        hint = hints[parameter.name]
        if parameter.kind is parameter.VAR_KEYWORD:
            _, part = get_args(hint)
            fields = {**_optional_fields(part), **fields}
        else:
            default = ... if parameter.default is parameter.empty else parameter.default
            fields[parameter.name] = (hint, default)
    doc = inspect.getdoc(function) or name
    title = "".join(word.capitalize() for word in name.split("_"))
    model: type[EditBase] = create_model(
        f"{title}Edit", __base__=EditBase, __doc__=doc.split("\n")[0], **fields
    )
    return model


def _optional_fields(part: type[Part]) -> dict[str, Any]:
    """Fields of a part of the document, none of which must be given.

    Whether a value is possible is for the edit to say, in its own words. Where the document has a
    short form of a value, such as a number for a distribution, so does the message.
    """
    left_out = Field(default=None, json_schema_extra=_without_default)
    fields: dict[str, Any] = {}
    for name, field in part.model_fields.items():
        read: Any = field.annotation
        for validator in field.metadata:
            if isinstance(validator, BeforeValidator):
                read = Annotated[read, validator]
        fields[name] = (read, left_out)
    return fields


def _without_default(schema: dict[str, Any]) -> None:
    """A field that is left out keeps its value; there is nothing that stands in for it."""
    schema.pop("default", None)


EDIT_MESSAGES = {name: _message_model(name, entry.function) for name, entry in EDIT_ENTRIES.items()}
"""Messages of all edits, by the name of the edit."""

if TYPE_CHECKING:
    AnyEdit = EditBase
else:
    AnyEdit = Annotated[reduce(operator.or_, EDIT_MESSAGES.values()), Field(discriminator="kind")]


_READER: TypeAdapter[EditBase] = TypeAdapter(AnyEdit)


def read_edit(data: Mapping[str, Any]) -> EditBase:
    """Read an edit from JSON data: ``kind`` and its arguments.

    Raises
    ------
    ScenarioError
        If there is no such kind, or an argument is not possible.
    """
    try:
        return _READER.validate_python({"kind": None, **data})
    except ValidationError as err:
        problems = validation_problems(err)
        kind = data.get("kind")
        if not isinstance(kind, str) or kind not in EDIT_ENTRIES:
            problems = (f"kind: {shown(str(kind))} is none of {', '.join(EDIT_ENTRIES)}",)
        raise ScenarioError(
            f"this edit cannot be read: {problems[0]}", problems=problems[1:]
        ) from err


def edits_label(edits: Sequence[EditBase]) -> str:
    """What undo calls several edits that are one step."""
    more = len(edits) - 1
    return f"{edits[0].label} and {more} more" if more else edits[0].label
