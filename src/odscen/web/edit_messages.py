"""Edits by name: every entry of :mod:`odscen.scenario.edits.edit_registry` as a message.

The messages are made from the functions' signatures, so that there is no second list to keep: kind
is the function's name, the other fields are its arguments. What the server knows itself (the
scenario, the graph, the lights) is not among them.
"""

from __future__ import annotations

import inspect
import operator
from functools import reduce
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args, get_type_hints

from pydantic import BaseModel, ConfigDict, Field, create_model

from odscen.scenario.document import document_parts, scenario_document, signals_document
from odscen.scenario.edits.edit_registry import EDIT_ENTRIES

if TYPE_CHECKING:
    from collections.abc import Callable

    from odscen.app.maps import LoadedMap
    from odscen.scenario.document.document_parts import Part
    from odscen.scenario.document.scenario_document import Scenario

_KNOWN = {"scenario": "Scenario", "graph": "MapGraph", "lights": "Light", "usable": "Usable"}
"""Arguments that the server has itself, and the names of their types, which need no message."""
_JSON = {"Iterable": list, "Sequence": list, "Mapping": dict}
"""JSON has lists and objects; an Iterable would be read only when it is used."""

MOST_EDITS = 5000
"""Edits in one request."""


class EditBase(BaseModel):
    """Base of all edits; ``kind`` is the name of the function."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    kind: str

    @property
    def arguments(self) -> dict[str, Any]:
        """Arguments that were given; those that were not keep the function's defaults."""
        return {name: getattr(self, name) for name in self.model_fields_set - {"kind"}}

    @property
    def label(self) -> str:
        """The edit in words, for undo and redo."""
        return EDIT_ENTRIES[self.kind].label.format(**self.arguments)


def apply_edit(edit: EditBase, scenario: Scenario, loaded: LoadedMap) -> Scenario:
    """Return the scenario that the edit makes of another.

    Raises
    ------
    InputError
        If a rule forbids it.
    """
    function = EDIT_ENTRIES[edit.kind].function
    known = {"graph": loaded.sumo.graph, "lights": loaded.lights, "usable": loaded.usable}
    ours = {name: known[name] for name in inspect.signature(function).parameters if name in known}
    return function(scenario, **ours, **edit.arguments)


def _message(name: str, function: Callable[..., Scenario]) -> type[EditBase]:
    documents = (document_parts, signals_document, scenario_document)
    known = {name: one for document in documents for name, one in vars(document).items()}
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

    Whether a value is possible is for the edit to say, in its own words.
    """
    left_out = Field(default=None, json_schema_extra=_without_default)
    return {name: (field.annotation, left_out) for name, field in part.model_fields.items()}


def _without_default(schema: dict[str, Any]) -> None:
    """A field that is left out keeps its value; there is nothing that stands in for it."""
    schema.pop("default", None)


MESSAGES = tuple(_message(name, entry.function) for name, entry in EDIT_ENTRIES.items())

if TYPE_CHECKING:
    AnyEdit = EditBase
else:
    AnyEdit = Annotated[reduce(operator.or_, MESSAGES), Field(discriminator="kind")]


class EditRequest(BaseModel):
    """Edits of one version: all of them or none, and one step for undo.

    ``label`` says in words what they do together; needed only where there are several.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    version: Annotated[int, Field(ge=0, lt=2**53)]
    edits: Annotated[list[AnyEdit], Field(min_length=1, max_length=MOST_EDITS)]
    label: Annotated[str, Field(min_length=1, max_length=80)] | None = None

    @property
    def words(self) -> str:
        """What undo and redo call this."""
        if self.label is not None:
            return self.label
        first = self.edits[0].label
        more = len(self.edits) - 1
        return f"{first} and {more} more" if more else first
