"""Every change to a scenario, as a pure function from document to document.

The one door for changes: an interface or a script calls these and nothing else. Each returns a new
document and leaves the old one as it was; an edit that a rule forbids raises
:class:`~odscen.base.errors.ScenarioError` with the reason. Edits refuse what can never be right (an
unknown node, a taken node, a region in two pieces); what may be on its way to right, such as bodies
that overlap, is left to :func:`odscen.scenario.checks.scenario_checks.check`.
"""

from __future__ import annotations

from itertools import count
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

from odscen.base.errors import NotFoundError, ScenarioError
from odscen.base.ids import SegmentId
from odscen.lanegraph.query import neighbours, removable
from odscen.scenario.checks.actor_checks import Subject, goal_problems, spawn_problems
from odscen.scenario.checks.scenario_checks import duplicate_ids, roi_problems, shared_nodes
from odscen.scenario.checks.signal_timing import find_light, signal_problems
from odscen.scenario.document.problems import Problem, refuse_errors
from odscen.scenario.document.sampling_config import SamplingConfig, overridden
from odscen.scenario.document.scenario_document import (
    Actor,
    Environment,
    Flow,
    JunctionTiming,
    MapReference,
    Part,
    Scenario,
)
from odscen.scenario.document.validation import validated
from odscen.scenario.edits.edit_registry import edit
from odscen.scenario.placing.region import Region, on_foot
from odscen.scenario.sampling.sampler import sample_scenario

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from odscen.base.categories import Category
    from odscen.lanegraph.graphs import MapGraph
    from odscen.scenario.checks.signal_timing import Light
    from odscen.scenario.document.scenario_document import Control, Simulation
    from odscen.scenario.placing.usable_nodes import Usable

_One = TypeVar("_One", bound=Actor | Flow)
_Document = TypeVar("_Document", bound=Part)


def new_scenario(
    graph: MapGraph, *, name: str, roi: Iterable[str] = (), seed: int = 0, description: str = ""
) -> Scenario:
    """Start an empty scenario on a map.

    Parameters
    ----------
    roi
        Segments of the region of interest, connected; may be left empty and grown later.

    Raises
    ------
    ScenarioError
        If a segment is unknown or the region is in several pieces.
    """
    fields = {
        "name": name,
        "description": description,
        "seed": seed,
        "map": MapReference(
            name=graph.map_name, sha256=graph.map_sha256, spacing=graph.lanes.spacing
        ),
        "roi": tuple(roi),
    }
    scenario = validated(Scenario, fields)
    if scenario.roi:
        refuse_errors(roi_problems(scenario, graph))
    return scenario


@edit("Rename to {name}")
def rename(scenario: Scenario, *, name: str, description: str | None = None) -> Scenario:
    """Give the scenario another name and, if given, another description."""
    changes = {"name": name} if description is None else {"name": name, "description": description}
    return _with(scenario, **changes)


@edit("Change the seed")
def set_seed(scenario: Scenario, *, seed: int) -> Scenario:
    """Set the random seed of the open goals and of the run."""
    return _with(scenario, seed=seed)


@edit("Change the run's settings")
def set_simulation(scenario: Scenario, **fields: Annotated[Any, Simulation]) -> Scenario:
    """Change fields of :class:`~odscen.scenario.document.scenario_document.Simulation`."""
    return _with(scenario, simulation=_changed(scenario.simulation, fields))


@edit("Change weather and time")
def set_environment(
    scenario: Scenario,
    *,
    preset: str | None = None,
    parameters: Mapping[str, float] | None = None,
    affects_driving: bool | None = None,
) -> Scenario:
    """Change weather and time of day; a new preset drops the old parameters (R33)."""
    fields: dict[str, Any] = {}
    if preset is not None:
        fields = {"preset": preset, "parameters": {}}
    if parameters is not None:
        fields["parameters"] = dict(parameters)
    if affects_driving is not None:
        fields["affects_driving"] = affects_driving
    environment: Environment = _changed(scenario.environment, fields)
    return _with(scenario, environment=environment)


@edit("Traffic lights {control}")
def set_signal_control(scenario: Scenario, *, control: Control) -> Scenario:
    """Say how all traffic lights are run that have no control of their own."""
    return _with(scenario, signals=_changed(scenario.signals, {"control": control}))


@edit("Timing of light {junction}")
def set_timing(
    scenario: Scenario,
    lights: Sequence[Light],
    junction: str,
    **fields: Annotated[Any, JunctionTiming],
) -> Scenario:
    """Change how the traffic light of one junction is timed.

    Parameters
    ----------
    lights
        Traffic lights of the map.
    fields
        Fields of a :class:`~odscen.scenario.document.scenario_document.JunctionTiming`,
        such as ``green``; those not given stay as they are.

    Raises
    ------
    ScenarioError
        If no light is in the junction, or if it cannot be timed so.
    """
    timings = scenario.signals.junctions
    light = find_light(lights, junction)
    own = [n for n, one in enumerate(timings) if light and one.junction in light.names]
    old = timings[own[0]] if own else JunctionTiming(junction=junction)
    new = _changed(old, fields)
    changed = (*timings[: own[0]], new, *timings[own[0] + 1 :]) if own else (*timings, new)
    signals = _changed(scenario.signals, {"junctions": changed})
    refuse_errors(signal_problems(signals, lights))
    return _with(scenario, signals=signals)


@edit("Timing of light {junction} as in the map")
def clear_timing(scenario: Scenario, junction: str) -> Scenario:
    """Give the traffic light of one junction back to the map's program.

    Raises
    ------
    NotFoundError
        If the scenario has no timing for it.
    """
    timings = scenario.signals.junctions
    names = [one.junction for one in timings]
    if junction not in names:
        what = "timing of junction"
        raise NotFoundError(what, junction, names)
    left = tuple(one for one in timings if one.junction != junction)
    return _with(scenario, signals=_changed(scenario.signals, {"junctions": left}))


def eligible_segments(scenario: Scenario, graph: MapGraph) -> tuple[SegmentId, ...]:
    """Segments that :func:`grow_roi` accepts now: every one for the first, then all neighbours."""
    if not scenario.roi:
        return graph.segments.ids
    return tuple(neighbours(graph.segments, [SegmentId(name) for name in scenario.roi]))


def removable_segments(scenario: Scenario, graph: MapGraph) -> tuple[SegmentId, ...]:
    """Segments without which the region stays in one piece: no other can be taken out."""
    return removable(graph.segments, scenario.roi)


@edit("Add segment {segment}")
def grow_roi(scenario: Scenario, graph: MapGraph, segment: str) -> Scenario:
    """Add a segment to the region of interest (R29).

    Raises
    ------
    ScenarioError
        If the segment is inside already, or touches no segment of the region.
    NotFoundError
        If the map has no such segment.
    """
    _known_segment(graph, segment)
    if segment in scenario.roi:
        msg = f"segment {segment!r} is in the region of interest already"
        raise ScenarioError(msg)
    if segment not in eligible_segments(scenario, graph):
        msg = f"segment {segment!r} does not touch the region of interest; add one between first"
        raise ScenarioError(msg)
    return _with(scenario, roi=(*scenario.roi, segment))


@edit("Remove segment {segment}")
def shrink_roi(
    scenario: Scenario, graph: MapGraph, segment: str, *, with_actors: bool = False
) -> Scenario:
    """Take a segment out of the region of interest (R29).

    Parameters
    ----------
    with_actors
        Also remove the actors and flows that start in the segment, and open goals that lie in it
        (they are then drawn). Without, the segment must be free of both.

    Raises
    ------
    ScenarioError
        If the segment is not inside, if the rest would be in several pieces, or if actors or flows
        use it.
    """
    _known_segment(graph, segment)
    if segment not in scenario.roi:
        msg = f"segment {segment!r} is not in the region of interest"
        raise ScenarioError(msg)
    if segment not in removable_segments(scenario, graph):
        msg = f"without segment {segment!r} the region of interest would be in several pieces"
        raise ScenarioError(msg)
    region = Region.of(graph, [segment])
    users = [one for one in _everyone(scenario) if _uses(region, one)]
    if users and not with_actors:
        names = ", ".join(repr(one.id) for one in users)
        msg = f"segment {segment!r} is where {names} start or go; remove or move them first"
        raise ScenarioError(msg)
    return _with(
        scenario,
        roi=tuple(name for name in scenario.roi if name != segment),
        actors=_clear(region, scenario.actors),
        flows=_clear(region, scenario.flows),
    )


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
    fields |= {"category": category, "spawn": spawn, "id": id or _free_id(scenario, str(category))}
    actor = validated(Actor, fields)
    changed = _with(scenario, actors=(*scenario.actors, actor))
    _refuse_placement(changed, graph, Subject.actor, len(scenario.actors))
    return _only_ego(changed, actor.id) if actor.ego else changed


@edit("Move {actor}")
def move_actor(scenario: Scenario, graph: MapGraph, actor: str, *, spawn: str) -> Scenario:
    """Place an actor on another node; a goal that cannot be reached from there is opened."""
    index = _index(scenario.actors, actor)
    moved = _put(scenario, index, spawn=spawn)
    region = Region.of(graph, scenario.roi)
    subject = Subject.actor(moved, region, index)
    place, problems = spawn_problems(subject)
    refuse_errors([*problems, *shared_nodes(moved)])
    if place is not None and any(p.severity == "error" for p in goal_problems(subject, place)):
        return _put(moved, index, goal=None)
    return moved


@edit("Goal of {actor}")
def set_goal(scenario: Scenario, graph: MapGraph, actor: str, *, goal: str | None) -> Scenario:
    """Set the goal of an actor; ``None`` leaves it to the seed.

    Raises
    ------
    ScenarioError
        If the goal is unknown, outside the region or not reachable from the spawn.
    """
    index = _index(scenario.actors, actor)
    changed = _put(scenario, index, goal=goal)
    _refuse_placement(changed, graph, Subject.actor, index)
    return changed


@edit("Change {actor}")
def change_actor(scenario: Scenario, actor: str, **fields: Annotated[Any, Actor]) -> Scenario:
    """Change fields of an actor that have no rule on the graph, for example ``speed`` or ``style``.

    A new category drops the model, unless one is given with it. For ``spawn``, ``goal`` and ``ego``
    there are :func:`move_actor`, :func:`set_goal` and :func:`set_ego`.

    Raises
    ------
    ScenarioError
        If a field is unknown or its value not possible, if the id is taken, or if the category
        belongs on the other graph.
    """
    index = _index(scenario.actors, actor)
    old = scenario.actors[index]
    own_edit = {"spawn": "move_actor", "goal": "set_goal", "ego": "set_ego"}
    for name in sorted(own_edit.keys() & fields.keys()):
        msg = f"{name} of an actor is changed by {own_edit[name]}"
        raise ScenarioError(msg)
    if "category" in fields and fields["category"] != old.category:
        fields = {"model": None, **fields}
    changed = _put(scenario, index, **fields)
    new = changed.actors[index]
    if on_foot(new.category) != on_foot(old.category):
        msg = f"{actor!r} is where a {old.category} can be, not a {new.category}; add a new one"
        raise ScenarioError(msg)
    refuse_errors(duplicate_ids(changed))
    return changed


@edit("Remove road users")
def remove_actors(scenario: Scenario, actors: Iterable[str]) -> Scenario:
    """Remove actors by id."""
    gone = {scenario.actors[_index(scenario.actors, actor)].id for actor in actors}
    return _with(scenario, actors=tuple(one for one in scenario.actors if one.id not in gone))


@edit("Copy road users")
def copy_actors(scenario: Scenario, graph: MapGraph, copies: Mapping[str, str]) -> Scenario:
    """Copy actors to other nodes; ``copies`` maps the node of each copy to the actor's id.

    Copies get new ids, are not the ego, and keep the goal where they can reach it.
    """
    for spawn, actor in copies.items():
        original = scenario.actors[_index(scenario.actors, actor)]
        changes = {"id": _free_id(scenario, str(original.category)), "ego": False}
        copy = _changed(original, changes)
        grown = _with(scenario, actors=(*scenario.actors, copy))
        scenario = move_actor(grown, graph, copy.id, spawn=spawn)
    return scenario


@edit("Fill the region at random")
def fill_roi(
    scenario: Scenario, graph: MapGraph, usable: Usable, *, share: float, seed: int | None = None
) -> Scenario:
    """Put a random crowd into the region in the place of all actors (R47); flows stay.

    Parameters
    ----------
    usable
        What the simulator that will run it can use of the map.
    share
        Of the largest number of actors that fits, 0 to 1.
    seed
        Of the crowd; the scenario's if not given.

    Raises
    ------
    ScenarioError
        If the region is not usable, the share is not possible, or no actor fits.
    """
    refuse_errors(roi_problems(scenario, graph))
    crowd = sample_scenario(
        graph,
        overridden(SamplingConfig(), fill=share),
        seed=scenario.seed if seed is None else seed,
        name=scenario.name,
        usable=usable,
        roi=scenario.roi,
    ).actors
    nodes = {flow.spawn for flow in scenario.flows}
    ids = {flow.id for flow in scenario.flows}
    free = tuple(one for one in crowd if one.spawn not in nodes and one.id not in ids)
    return _with(scenario, actors=free)


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
        return _only_ego(scenario, None)
    chosen = scenario.actors[_index(scenario.actors, actor)]
    if on_foot(chosen.category):
        msg = f"{actor!r} is a pedestrian; only a vehicle can be the ego"
        raise ScenarioError(msg)
    return _only_ego(scenario, actor)


@edit("Add a stream")
def add_flow(
    scenario: Scenario,
    graph: MapGraph,
    *,
    spawn: str,
    per_hour: float,
    id: str | None = None,  # noqa: A002 - the document's word
    **fields: Annotated[Any, Flow],
) -> Scenario:
    """Put a flow on a node (R44); ``fields`` are further fields of ``Flow``."""
    fields |= {"spawn": spawn, "per_hour": per_hour, "id": id or _free_id(scenario, "flow")}
    flow = validated(Flow, fields)
    changed = _with(scenario, flows=(*scenario.flows, flow))
    _refuse_placement(changed, graph, Subject.flow, len(scenario.flows))
    return changed


@edit("Change {flow}")
def change_flow(
    scenario: Scenario, graph: MapGraph, flow: str, **fields: Annotated[Any, Flow]
) -> Scenario:
    """Change any fields of a flow."""
    index = _index(scenario.flows, flow)
    new = _changed(scenario.flows[index], fields)
    changed = _with(scenario, flows=_replaced(scenario.flows, index, new))
    _refuse_placement(changed, graph, Subject.flow, index)
    return changed


@edit("Remove {flow}")
def remove_flow(scenario: Scenario, flow: str) -> Scenario:
    """Remove a flow."""
    index = _index(scenario.flows, flow)
    return _with(scenario, flows=scenario.flows[:index] + scenario.flows[index + 1 :])


def _with(scenario: Scenario, **changes: Any) -> Scenario:
    return _changed(scenario, changes)


def _changed(part: _Document, changes: Mapping[str, Any]) -> _Document:
    """Copy of a part of the document with some fields changed and checked."""
    fields = {name: getattr(part, name) for name in type(part).model_fields}
    return validated(type(part), {**fields, **changes})


def _put(scenario: Scenario, index: int, **changes: Any) -> Scenario:
    actor = _changed(scenario.actors[index], changes)
    return _with(scenario, actors=_replaced(scenario.actors, index, actor))


def _replaced(ones: tuple[_One, ...], index: int, one: _One) -> tuple[_One, ...]:
    return (*ones[:index], one, *ones[index + 1 :])


def _everyone(scenario: Scenario) -> tuple[Actor | Flow, ...]:
    return (*scenario.actors, *scenario.flows)


def _index(ones: tuple[_One, ...], name: str) -> int:
    ids = [one.id for one in ones]
    if name not in ids:
        what = "actor or flow"
        raise NotFoundError(what, name, ids)
    return ids.index(name)


def _free_id(scenario: Scenario, stem: str) -> str:
    taken = {one.id for one in _everyone(scenario)}
    return next(name for k in count(1) if (name := f"{stem}-{k}") not in taken)


def _only_ego(scenario: Scenario, ego: str | None) -> Scenario:
    actors = tuple(_changed(one, {"ego": one.id == ego}) for one in scenario.actors)
    return _with(scenario, actors=actors)


def _known_segment(graph: MapGraph, segment: str) -> None:
    if segment not in graph.segments.ids:
        what = "segment"
        raise NotFoundError(what, segment, graph.segments.ids)


def _refuse_placement(
    scenario: Scenario,
    graph: MapGraph,
    subject_of: Callable[[Scenario, Region, int], Subject],
    index: int,
) -> None:
    """Raise if the spawn or goal of one actor or flow can never be right."""
    subject = subject_of(scenario, Region.of(graph, scenario.roi), index)
    place, problems = spawn_problems(subject)
    found: list[Problem] = [*problems, *shared_nodes(scenario), *duplicate_ids(scenario)]
    if place is not None and subject.one.goal is not None:
        found += goal_problems(subject, place)
    refuse_errors(found)


def _inside(region: Region, node: str | None) -> bool:
    place = None if node is None else region.place(node)
    return place is not None and region.holds(place)


def _uses(region: Region, one: Actor | Flow) -> bool:
    return _inside(region, one.spawn) or _inside(region, one.goal)


def _clear(region: Region, ones: tuple[_One, ...]) -> tuple[_One, ...]:
    """Those that do not start in the region, with goals in it opened."""
    return tuple(
        _changed(one, {"goal": None}) if _inside(region, one.goal) else one
        for one in ones
        if not _inside(region, one.spawn)
    )
