"""Edits by name: every function of :mod:`odscen.scenario.edits` and its kin as a message.

The messages are made from the functions' signatures, so that there is no second list to keep: kind
is the function's name, the other fields are its arguments. What the server knows itself (the
scenario, the graph, the lights) is not among them.
"""

from __future__ import annotations

import inspect
import operator
from functools import reduce
from typing import TYPE_CHECKING, Annotated, Any, Literal, Optional, get_type_hints

from pydantic import BaseModel, ConfigDict, Field, create_model

from odscen.categories import Category
from odscen.lanegraph.model import MapGraph
from odscen.scenario import demand_edits, edits
from odscen.scenario.document import (
    Actor,
    Background,
    Control,
    Counts,
    Flow,
    Identifier,
    JunctionTiming,
    Matrix,
    Part,
    Scenario,
    Simulation,
)
from odscen.scenario.signals import Light
from odscen.scenario.supply import Usable

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from odscen.app.maps import LoadedMap

_KNOWN = {"scenario", "graph", "lights", "usable"}
_FIELDS_OF: Mapping[str, type[Part]] = {
    "add_actor": Actor,
    "change_actor": Actor,
    "add_flow": Flow,
    "change_flow": Flow,
    "set_timing": JunctionTiming,
    "set_simulation": Simulation,
    "set_matrix": Matrix,
    "set_counts": Counts,
    "set_background": Background,
}
"""Whose fields an edit with ``**fields`` takes."""
_WORDS: Mapping[str, str] = {
    "add_actor": "Add {category}",
    "add_flow": "Add a stream",
    "change_actor": "Change {actor}",
    "change_flow": "Change {flow}",
    "clear_timing": "Timing of light {junction} as in the map",
    "copy_actors": "Copy road users",
    "fill_roi": "Fill the region at random",
    "grow_roi": "Add segment {segment}",
    "move_actor": "Move {actor}",
    "remove_actors": "Remove road users",
    "remove_demand": "Remove {part}",
    "remove_flow": "Remove {flow}",
    "rename": "Rename to {name}",
    "set_background": "Background traffic {background}",
    "set_clock": "Change the time of day at the start",
    "set_counts": "Counts {counts}",
    "set_ego": "Choose the vehicle under test",
    "set_environment": "Change weather and time",
    "set_goal": "Goal of {actor}",
    "set_matrix": "Trips {matrix}",
    "set_profile": "Day profile {profile}",
    "set_seed": "Change the seed",
    "set_signal_control": "Traffic lights {control}",
    "set_simulation": "Change the run's settings",
    "set_timing": "Timing of light {junction}",
    "set_zone": "Zone {zone}",
    "shrink_roi": "Remove segment {segment}",
}
"""What undo and redo call an edit; in braces what the edit always has."""


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
        return _WORDS[self.kind].format(**self.arguments)


def apply_edit(edit: EditBase, scenario: Scenario, loaded: LoadedMap) -> Scenario:
    """Return the scenario that the edit makes of another.

    Raises
    ------
    InputError
        If a rule forbids it.
    """
    function = FUNCTIONS[edit.kind]
    known = {"graph": loaded.sumo.graph, "lights": loaded.lights, "usable": loaded.usable}
    ours = {name: known[name] for name in inspect.signature(function).parameters if name in known}
    return function(scenario, **ours, **edit.arguments)


def _functions() -> dict[str, Callable[..., Scenario]]:
    found: dict[str, Callable[..., Scenario]] = {}
    members = (
        (module, *member)
        for module in (edits, demand_edits)
        for member in inspect.getmembers(module, inspect.isfunction)
    )
    for module, name, function in members:
        if name.startswith("_") or function.__module__ != module.__name__:
            continue
        signature = inspect.signature(function)
        if next(iter(signature.parameters)) == "scenario" and (
            signature.return_annotation == "Scenario"
        ):
            found[name] = function
    return found


def _message(name: str, function: Callable[..., Scenario]) -> type[EditBase]:
    # JSON has lists and objects; an Iterable would be read only when it is used.
    types = {"Iterable": list, "Sequence": list, "Mapping": dict, "MapGraph": MapGraph}
    hints = get_type_hints(
        function,
        localns={
            **types,
            "Light": Light,
            "Usable": Usable,
            "Category": Category,
            "Control": Control,
            "Identifier": Identifier,
        },
    )
    fields: dict[str, Any] = {"kind": (Literal[name], ...)}
    for parameter in inspect.signature(function).parameters.values():
        if parameter.name in _KNOWN:
            continue
        if parameter.kind is parameter.VAR_KEYWORD:
            for key, field in _FIELDS_OF[name].model_fields.items():
                fields.setdefault(key, (Optional[field.annotation], None))  # noqa: UP045
            continue
        default = ... if parameter.default is parameter.empty else parameter.default
        fields[parameter.name] = (hints[parameter.name], default)
    doc = inspect.getdoc(function) or name
    title = "".join(word.capitalize() for word in name.split("_"))
    model: type[EditBase] = create_model(
        f"{title}Edit", __base__=EditBase, __doc__=doc.split("\n")[0], **fields
    )
    return model


FUNCTIONS = _functions()
MESSAGES = tuple(_message(name, function) for name, function in FUNCTIONS.items())

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
