"""All edits of a scenario, by name, and what they share: parts replaced, placements refused.

An edit is a function from a scenario and arguments to a scenario, entered by :func:`edit`. Programs
that offer edits (the server) make their messages from the entries: name and fields are those of the
function. ``**fields`` stands for the fields of a part of the document, which its annotation names:
``**fields: Annotated[Any, Actor]``.
"""

from __future__ import annotations

from itertools import count
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple, ParamSpec, Protocol, TypeVar

from odscen.base.errors import NotFoundError
from odscen.scenario.checks.actor_checks import Subject, goal_problems, spawn_problems, via_problems
from odscen.scenario.checks.scenario_checks import duplicate_ids, shared_nodes
from odscen.scenario.document.document_parts import Part
from odscen.scenario.document.problems import Problem, refuse_errors, validated
from odscen.scenario.document.scenario_document import Actor, Flow, Scenario
from odscen.scenario.placing.region import Region

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from odscen.lanegraph.graphs import MapGraph


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


PlacedOne = TypeVar("PlacedOne", bound=Actor | Flow)
DocumentPart = TypeVar("DocumentPart", bound=Part)
NamedPart = TypeVar("NamedPart", bound="HasId")


class HasId(Protocol):
    """A part of a list of the document, with an id that is its alone."""

    @property
    def id(self) -> str:
        """What it is called by."""


def with_fields(scenario: Scenario, **changes: Any) -> Scenario:
    """Copy of a scenario with some fields changed and checked."""
    return changed_part(scenario, changes)


def changed_part(part: DocumentPart, changes: Mapping[str, Any]) -> DocumentPart:
    """Copy of a part of the document with some fields changed and checked."""
    fields = {name: getattr(part, name) for name in type(part).model_fields}
    return validated(type(part), {**fields, **changes})


def with_actor(scenario: Scenario, index: int, **changes: Any) -> Scenario:
    """Copy of a scenario with some fields of its ``index``-th actor changed and checked."""
    actor = changed_part(scenario.actors[index], changes)
    return with_fields(scenario, actors=replaced_at(scenario.actors, index, actor))


def replaced_at(
    ones: tuple[PlacedOne, ...], index: int, placed_one: PlacedOne
) -> tuple[PlacedOne, ...]:
    """Copy of a tuple with another element at ``index``."""
    return (*ones[:index], placed_one, *ones[index + 1 :])


def put_part(
    parts: tuple[NamedPart, ...], part: NamedPart, *, what: str, instead_of: str | None = None
) -> tuple[tuple[NamedPart, ...], int]:
    """Copy of a tuple with a part in the place of that with its id, or at its end; and where it is.

    ``what`` it is, for the message; ``instead_of`` is the id that is replaced if it is another one.

    Raises
    ------
    NotFoundError
        If no part has the id ``instead_of``.
    """
    ids = [part.id for part in parts]
    if instead_of is not None and instead_of not in ids:
        raise NotFoundError(what, instead_of, ids)
    name = part.id if instead_of is None else instead_of
    index = ids.index(name) if name in ids else len(ids)
    return (*parts[:index], part, *parts[index + 1 :]), index


def drop_part(parts: tuple[NamedPart, ...], what: str, name: str) -> tuple[NamedPart, ...]:
    """Copy of a tuple without the part with this id; ``what`` it is, for the message.

    Raises
    ------
    NotFoundError
        If there is none.
    """
    left = tuple(part for part in parts if part.id != name)
    if len(left) == len(parts):
        raise NotFoundError(what, name, [part.id for part in parts])
    return left


def all_placed(scenario: Scenario) -> tuple[Actor | Flow, ...]:
    """All actors and flows."""
    return (*scenario.actors, *scenario.flows)


def index_of(ones: tuple[PlacedOne, ...], name: str) -> int:
    """Position of the actor or flow with this id.

    Raises
    ------
    NotFoundError
        If there is none.
    """
    ids = [placed.id for placed in ones]
    if name not in ids:
        raise NotFoundError("actor or flow", name, ids)
    return ids.index(name)


def free_id(scenario: Scenario, stem: str) -> str:
    """First of ``stem-1``, ``stem-2``, ... that no actor or flow has."""
    taken = {placed.id for placed in all_placed(scenario)}
    return next(name for k in count(1) if (name := f"{stem}-{k}") not in taken)


def with_only_ego(scenario: Scenario, ego: str | None) -> Scenario:
    """Copy of a scenario in which this actor alone is the ego, or none."""
    actors = tuple(changed_part(actor, {"ego": actor.id == ego}) for actor in scenario.actors)
    return with_fields(scenario, actors=actors)


def refuse_placement(
    scenario: Scenario,
    graph: MapGraph,
    subject_of: Callable[[Scenario, Region, int], Subject],
    index: int,
) -> None:
    """Raise if the spawn or goal of one actor or flow can never be right."""
    subject = subject_of(scenario, Region.of(graph, scenario.roi), index)
    place, problems = spawn_problems(subject)
    found: list[Problem] = [*problems, *shared_nodes(scenario), *duplicate_ids(scenario)]
    if place is not None:
        place, passing = via_problems(subject, place)
        found += passing
    if place is not None and subject.one.goal is not None:
        found += goal_problems(subject, place)
    refuse_errors(found)
