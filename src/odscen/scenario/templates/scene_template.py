"""What a template is, and the actors and rules that it makes of a map."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from odscen.base.categories import Category
from odscen.base.errors import InputError
from odscen.lanegraph.query import node_id
from odscen.scenario.templates.scene_sites import LaneStretch, UnfitPlaceError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from odscen.scenario.placing.region import Region, Usable
    from odscen.scenario.signals.light import Light
    from odscen.scenario.templates.scene_sites import LaneStretches, RoadCrossing, WalkSides


NO_COLLISION = "collided(ego) == 0"
"""Criterion of scenes in which the ego is to avoid a collision."""


class TemplateParameter(NamedTuple):
    """A number of a template; ``default`` ``None`` follows from the others, as ``meaning`` says.

    ``title`` is what forms call it.
    """

    name: str
    default: float | None
    low: float
    high: float
    unit: str
    meaning: str
    title: str


class TemplateSite(NamedTuple):
    """A map as templates look at it."""

    region: Region
    usable: Usable
    lights: Sequence[Light]
    stretches: LaneStretches
    sides: WalkSides


@dataclass(frozen=True)
class TemplateScene:
    """What a template has placed, as parts of a document.

    Attributes
    ----------
    actors, rules
        As in the document.
    duration
        Of the run, s.
    wanted
        The geometry that follows from the parameters, in words with numbers.
    criteria
        What must come out of a run for it to pass, as in the document.
    formulas
        Where a scene is left open: formula of the numbers that follow from parameters, by its place
        (``"actors"`` or ``"rules"``, id, keys).
    """

    actors: tuple[dict[str, Any], ...]
    rules: tuple[dict[str, Any], ...]
    duration: float
    wanted: str
    criteria: tuple[str, ...] = (NO_COLLISION,)
    formulas: Mapping[tuple[str | int, ...], str] = field(default_factory=dict)


@dataclass(frozen=True)
class SceneTemplate:
    """A scene that can be placed on maps.

    Attributes
    ----------
    name, title, summary
        How it is called, and what happens in it.
    source
        Where its numbers come from.
    needs
        What a map must have.
    parameters
        Its numbers.
    place
        Places it, or raises :class:`~odscen.scenario.templates.scene_sites.NoPlaceError`.
    place_open
        Places it with room for each of several sets of numbers, all of which are complete, and with
        formulas, so that a sweep can vary them; ``None`` if where it begins depends on them.
    """

    name: str
    title: str
    summary: str
    source: str
    needs: str
    parameters: tuple[TemplateParameter, ...]
    place: Callable[[TemplateSite, Mapping[str, float]], TemplateScene]
    place_open: Callable[[TemplateSite, Sequence[Mapping[str, float]]], TemplateScene] | None = None

    def values(self, given: Mapping[str, float]) -> dict[str, float]:
        """Numbers to place it with; those that follow from others are left out.

        Raises
        ------
        InputError
            If a name is unknown or a number out of its range.
        """
        known = {parameter.name: parameter for parameter in self.parameters}
        for name, value in given.items():
            number = known.get(name)
            if number is None:
                raise InputError(
                    f"template {self.name!r} has no parameter {name!r}; it has {', '.join(known)}"
                )
            if not (math.isfinite(value) and number.low <= value <= number.high):
                raise InputError(
                    f"{name} must be {number.low:g} to {number.high:g} {number.unit}, not {value:g}"
                )
        usual = {
            parameter.name: parameter.default
            for parameter in self.parameters
            if parameter.default is not None
        }
        return usual | dict(given)


STEADY = "steady"
"""Id of the driver set of scenes: constant speed, no change of lane of one's own accord."""
STEADY_DRIVER = {
    "id": STEADY,
    "parameters": {
        "sigma": 0.0,
        "lcSpeedGain": 0.0,
        "lcKeepRight": 0.0,
        "lcCooperative": 0.0,
        "lcOvertakeRight": 1.0,
    },
}
LEFT, RIGHT = 1, -1
CHILD = 5.0 / 3.6
"""Walking speed of the pedestrians of Euro NCAP's crossing tests, m/s (5 km/h)."""


def kmh(speed: float) -> str:
    """A speed (m/s) in words."""
    return f"{speed * 3.6:.0f} km/h"


def body_length(site: TemplateSite, category: Category) -> float:
    """Metres of a vehicle of the category."""
    return site.usable.bodies[category].length


def near_side(site: TemplateSite, stretch: LaneStretch) -> int:
    """Side of the road on which the lane lies: right where traffic keeps right."""
    lanes = site.region.graph.lanes
    row = int(lanes.lane[stretch.nodes[0]])
    keeps_right = bool(lanes.lanes.forward[row]) == (lanes.lanes.keys[row].lane < 0)
    return RIGHT if keeps_right else LEFT


def node_near(site: TemplateSite, stretch: LaneStretch, along: float) -> int:
    """Node of a stretch about so many metres on, on which a vehicle can be placed.

    Raises
    ------
    UnfitPlaceError
        If there is none within a node's spacing.
    """
    spacing = site.region.graph.lanes.spacing
    order = np.argsort(np.abs(stretch.along - along), kind="stable")
    for place in order[:3].tolist():
        if abs(stretch.along[place] - along) > 1.5 * spacing:
            break
        if site.stretches.spawnable[stretch.nodes[place]]:
            return int(stretch.nodes[place])
    raise UnfitPlaceError("have no node for a vehicle where it is to start")


def exact_start(site: TemplateSite, stretch: LaneStretch, along: float) -> tuple[int, float]:
    """Node of a stretch, and metres from it to the place so many metres on.

    Raises
    ------
    UnfitPlaceError
        As for :func:`node_near`.
    """
    node = node_near(site, stretch, along)
    return node, round(along - metres_at(stretch, node), 3)


def metres_at(stretch: LaneStretch, node: int) -> float:
    """Metres of a node along its stretch."""
    return float(stretch.along[np.flatnonzero(stretch.nodes == node)[0]])


def beside(site: TemplateSite, stretch: LaneStretch, side: int) -> LaneStretch:
    """The nodes of the next lane of the same direction, abreast of those of a stretch.

    Raises
    ------
    UnfitPlaceError
        If there is none all along, or it is not for all vehicles.
    """
    lanes = site.region.graph.lanes
    rows = (lanes.left_lane if side == LEFT else lanes.right_lane)[stretch.nodes]
    name = "left" if side == LEFT else "right"
    if (rows < 0).any():
        raise UnfitPlaceError(f"have no lane to the {name} all along")
    first = lanes.lanes.first_node
    found = np.empty(len(rows), dtype=np.int64)
    for row in np.unique(rows).tolist():
        mine = np.flatnonzero(rows == row)
        its = np.arange(first[row], first[row + 1])
        away = np.abs(lanes.s[stretch.nodes[mine]][:, None] - lanes.s[its][None, :])
        found[mine] = its[np.argmin(away, axis=1)]
    if not site.stretches.plain[found].all():
        raise UnfitPlaceError(f"have a lane to the {name} that is not for all vehicles")
    return LaneStretch(found, stretch.along, stretch.bend)


def apart(site: TemplateSite, one: int, other: int) -> float:
    """Metres between the centre lines of two lanes at two nodes abreast."""
    lanes = site.region.graph.lanes
    dx, dy = lanes.x[other] - lanes.x[one], lanes.y[other] - lanes.y[one]
    hdg = lanes.hdg[one]
    return float(abs(dy * np.cos(hdg) - dx * np.sin(hdg)))


def vehicle(
    site: TemplateSite,
    name: str,
    spawn: int,
    by: int,
    *,
    speed: float,
    category: Category = Category.CAR,
    moving: bool = True,
    **fields: Any,
) -> dict[str, Any]:
    """Make a vehicle that drives from ``spawn`` by the node ``by`` at a constant speed (m/s)."""
    graph = site.region.graph
    start = {"initial_speed": round(speed, 4)} if moving else {}
    return {
        "id": name,
        "category": str(category),
        "spawn": node_id(graph, spawn),
        "goal": node_id(graph, site.stretches.goal(spawn, by)),
        "speed": round(speed, 4),
        "style": STEADY,
        **start,
        **fields,
    }


def pedestrian(name: str, crossing: RoadCrossing) -> dict[str, Any]:
    """Make a pedestrian who stands at the beginning of a crossing line."""
    return {
        "id": name,
        "category": str(Category.PEDESTRIAN),
        "spawn": crossing.start,
        "goal": crossing.goal,
    }


def rule(name: str, actor: str, when: dict[str, Any], *then: dict[str, Any]) -> dict[str, Any]:
    """Make a rule."""
    return {"id": name, "actor": actor, "when": when, "then": list(then)}


def at_once(name: str, actor: str, *then: dict[str, Any]) -> dict[str, Any]:
    """Make a rule that fires at the start."""
    return rule(name, actor, {"time": {"after": 0}}, *then)


def driven(name: str, actor: str, speed: float) -> dict[str, Any]:
    """Make a rule that keeps an actor at a speed (m/s) from the start."""
    return at_once(name, actor, {"speed": {"to": round(speed, 4), "shape": "step"}})
