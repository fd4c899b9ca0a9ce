"""All edits of a scenario: each is one function with the words that name it.

An edit is a function from a scenario and arguments to a scenario, entered by :func:`edit`. Programs
that offer edits (the server) make their messages from the entries: name and fields are those of the
function. ``**fields`` stands for the fields of a part of the document, which its annotation names:
``**fields: Annotated[Any, Actor]``.
"""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple, ParamSpec

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from odscen.scenario.document.scenario_document import Scenario

_Arguments = ParamSpec("_Arguments")


class EditEntry(NamedTuple):
    """An edit, and what undo and redo call it; braces hold arguments that it always has."""

    function: Callable[..., Scenario]
    label: str


_ENTRIES: dict[str, EditEntry] = {}
EDIT_ENTRIES: Mapping[str, EditEntry] = MappingProxyType(_ENTRIES)
"""By the function's name; complete when the modules of edits have been imported."""


def edit(
    label: str,
) -> Callable[[Callable[_Arguments, Scenario]], Callable[_Arguments, Scenario]]:
    """Enter a function as an edit, ``label`` as in :class:`EditEntry`."""

    def enter(function: Callable[_Arguments, Scenario]) -> Callable[_Arguments, Scenario]:
        _ENTRIES[function.__name__] = EditEntry(function, label)
        return function

    return enter
