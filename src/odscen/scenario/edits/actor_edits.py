"""Changes to placed road users, and the region filled at random."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Protocol

from odscen.base.errors import ScenarioError
from odscen.scenario.checks.actor_checks import Subject, goal_problems, spawn_problems, via_problems
from odscen.scenario.checks.scenario_checks import duplicate_ids, roi_problems, shared_nodes
from odscen.scenario.document.problems import refuse_errors, validated
from odscen.scenario.document.sampling_config import SamplingConfig, overridden
from odscen.scenario.document.scenario_document import Actor, Scenario
from odscen.scenario.edits.edit_registry import (
    changed_part,
    edit,
    free_id,
    index_of,
    refuse_placement,
    with_actor,
    with_fields,
    with_only_ego,
)
from odscen.scenario.placing.region import Region, on_foot
from odscen.scenario.sampling.sampler import sample_scenario

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from odscen.base.categories import Category
    from odscen.lanegraph.graphs import MapGraph
    from odscen.scenario.document.signals_document import Signals
    from odscen.scenario.placing.region import Usable
    from odscen.scenario.sampling.sampler import WantedUsers


@edit("Add {category}")
def add_actor(
    scenario: Scenario,
    graph: MapGraph,
    *,
    category: Category,
    spawn: str,
    id: str | None = None,  # noqa: A002 - the document's word
    **fields: Annotated[Any, Actor],
) -> Scenario:
    """Place an actor on a node.

    Parameters
    ----------
    id
        Its name; ``car-1``, ``car-2``, ... if not given.
    fields
        Further fields of an :class:`~odscen.scenario.document.scenario_document.Actor`, such as
        ``goal``.

    Raises
    ------
    ScenarioError
        If the node is unknown, taken, outside the region or of the wrong graph, if the goal cannot
        be reached, or if the id is taken.
    """
    fields |= {"category": category, "spawn": spawn, "id": id or free_id(scenario, str(category))}
    actor = validated(Actor, fields)
    changed = with_fields(scenario, actors=(*scenario.actors, actor))
    refuse_placement(changed, graph, Subject.actor, len(scenario.actors))
    return with_only_ego(changed, actor.id) if actor.ego else changed


@edit("Move {actor}")
def move_actor(scenario: Scenario, graph: MapGraph, actor: str, *, spawn: str) -> Scenario:
    """Place an actor on another node; a goal that cannot be reached from there is opened.

    If places that its route leads through cannot be, it leads through none.
    """
    index = index_of(scenario.actors, actor)
    moved = with_actor(scenario, index, spawn=spawn)
    region = Region.of(graph, scenario.roi)
    subject = Subject.actor(moved, region, index)
    place, problems = spawn_problems(subject)
    refuse_errors([*problems, *shared_nodes(moved)])
    if place is None:
        return moved
    last, _ = via_problems(subject, place)
    if last is None:
        moved, last = with_actor(moved, index, via=()), place
        subject = Subject.actor(moved, region, index)
    if any(p.severity == "error" for p in goal_problems(subject, last)):
        return with_actor(moved, index, goal=None)
    return moved


@edit("Goal of {actor}")
def set_goal(scenario: Scenario, graph: MapGraph, actor: str, *, goal: str | None) -> Scenario:
    """Set the goal of an actor; ``None`` leaves it to the seed.

    Raises
    ------
    ScenarioError
        If the goal is unknown, outside the region or not reachable from the spawn.
    """
    index = index_of(scenario.actors, actor)
    changed = with_actor(scenario, index, goal=goal)
    refuse_placement(changed, graph, Subject.actor, index)
    return changed


@edit("Change {actor}")
def change_actor(scenario: Scenario, actor: str, **fields: Annotated[Any, Actor]) -> Scenario:
    """Change fields of an actor that have no rule on the graph, for example ``speed`` or ``style``.

    A new category drops the model, unless one is given with it. For ``spawn``, ``goal`` and ``ego``
    there are :func:`move_actor`, :func:`set_goal` and :func:`set_ego`. Whether a route leads
    through the places of ``via`` is for the checks to say.

    Raises
    ------
    ScenarioError
        If a field is unknown or its value not possible, if the id is taken, or if the category
        belongs on the other graph.
    """
    index = index_of(scenario.actors, actor)
    old = scenario.actors[index]
    own_edit = {"spawn": "move_actor", "goal": "set_goal", "ego": "set_ego"}
    for name in sorted(own_edit.keys() & fields.keys()):
        raise ScenarioError(f"{name} of an actor is changed by {own_edit[name]}")
    if "category" in fields and fields["category"] != old.category:
        fields = {"model": None, **fields}
    changed = with_actor(scenario, index, **fields)
    new = changed.actors[index]
    if on_foot(new.category) != on_foot(old.category):
        raise ScenarioError(
            f"{actor!r} is where a {old.category} can be, not a {new.category}; add a new one"
        )
    refuse_errors(duplicate_ids(changed))
    return changed


@edit("Remove road users")
def remove_actors(scenario: Scenario, actors: Iterable[str]) -> Scenario:
    """Remove actors by id."""
    gone = {scenario.actors[index_of(scenario.actors, actor)].id for actor in actors}
    return with_fields(
        scenario, actors=tuple(actor for actor in scenario.actors if actor.id not in gone)
    )


@edit("Copy road users")
def copy_actors(scenario: Scenario, graph: MapGraph, copies: Mapping[str, str]) -> Scenario:
    """Copy actors to other nodes; ``copies`` maps the node of each copy to the actor's id.

    Copies get new ids, are not the ego, and keep the goal where they can reach it.
    """
    for spawn, actor in copies.items():
        original = scenario.actors[index_of(scenario.actors, actor)]
        changes = {"id": free_id(scenario, str(original.category)), "ego": False}
        copy = changed_part(original, changes)
        grown = with_fields(scenario, actors=(*scenario.actors, copy))
        scenario = move_actor(grown, graph, copy.id, spawn=spawn)
    return scenario


class NamedPlacer(Protocol):
    """Places actors by a generator that is known by its name."""

    def __call__(
        self, name: str, options: Mapping[str, bool | float | str], seed: int, signals: Signals
    ) -> Callable[[Region, WantedUsers], tuple[Actor, ...]]:
        """Make the function that places them in a region whose lights are run by ``signals``."""


@edit("Fill the region")
def fill_roi(
    scenario: Scenario,
    graph: MapGraph,
    usable: Usable,
    *,
    place_by: NamedPlacer | None = None,
    share: float,
    seed: int | None = None,
    generator: str | None = None,
    options: Mapping[str, bool | float | str] | None = None,
) -> Scenario:
    """Put a crowd into the region in the place of all actors (R47); flows stay.

    Parameters
    ----------
    usable
        What the simulator that will run it can use of the map.
    place_by
        The generators that are installed; none if not given.
    share
        Of the largest number of actors that fits, 0 to 1.
    seed
        Of the crowd; the scenario's if not given.
    generator
        Name of the installed one that places it; it is placed at random if not given.
    options
        Of the generator.

    Raises
    ------
    ScenarioError
        If the region is not usable, the share is not possible, or no actor fits.
    InputError
        If there is no such generator, it has no such option, or it gives no traffic.
    """
    refuse_errors(roi_problems(scenario, graph))
    seed = scenario.seed if seed is None else seed
    place = None
    if generator is not None and place_by is not None:
        place = place_by(generator, options or {}, seed, scenario.signals)
    elif generator is not None or options:
        raise ScenarioError("there is no generator here to be named, or to have options")
    crowd = sample_scenario(
        graph,
        overridden(SamplingConfig(), fill=share),
        seed=seed,
        name=scenario.name,
        usable=usable,
        roi=scenario.roi,
        place=place,
    ).actors
    nodes = {flow.spawn for flow in scenario.flows}
    ids = {flow.id for flow in scenario.flows}
    free = tuple(actor for actor in crowd if actor.spawn not in nodes and actor.id not in ids)
    return with_fields(scenario, actors=free)


@edit("Choose the vehicle under test")
def set_ego(scenario: Scenario, actor: str | None) -> Scenario:
    """Make one vehicle the ego, and no other; ``None`` leaves none (R42).

    Raises
    ------
    NotFoundError
        If there is no such actor.
    ScenarioError
        If it is a pedestrian.
    """
    if actor is None:
        return with_only_ego(scenario, None)
    chosen = scenario.actors[index_of(scenario.actors, actor)]
    if on_foot(chosen.category):
        raise ScenarioError(f"{actor!r} is a pedestrian; only a vehicle can be the ego")
    return with_only_ego(scenario, actor)
