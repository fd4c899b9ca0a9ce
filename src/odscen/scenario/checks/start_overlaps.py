"""Whether bodies share ground where they start (R37); oriented boxes in plan view."""

from __future__ import annotations

from math import floor
from typing import TYPE_CHECKING, NamedTuple

from odscen.scenario.checks.actor_checks import AssetLookup, body_of
from odscen.scenario.document.problems import Problem, error
from odscen.scenario.placing.bodies import Box, Crowd, box_at

if TYPE_CHECKING:
    from collections.abc import Iterator

    from odscen.base.categories import Body
    from odscen.scenario.document.scenario_document import Actor, Scenario
    from odscen.scenario.placing.region import Region

SAME_TIME = 1.0
"""Actors that depart within this many seconds of each other are on the road together."""
MOST = 1000
"""Overlaps that are reported; nobody reads more, and there may be billions."""


class _Start(NamedTuple):
    """Where and how large; actors with the same start in a window of time are one box."""

    spawn: str
    lateral_offset: float
    body: Body


class _Window(NamedTuple):
    """Who departs within one stretch of :data:`SAME_TIME`."""

    crowd: Crowd
    known: dict[_Start, int]
    spawns: list[str]
    actors: list[list[int]]

    def add(self, start: _Start, box: Box, actor: int) -> None:
        label = self.known.setdefault(start, len(self.spawns))
        if label == len(self.spawns):
            self.spawns.append(start.spawn)
            self.actors.append([])
            self.crowd.add(label, box)
        self.actors[label].append(actor)

    def beside(self, spawn: str, box: Box) -> Iterator[int]:
        """Actors whose boxes overlap this one, but for those that wait at the same place."""
        for label in self.crowd.touching(box):
            if self.spawns[label] != spawn:
                yield from self.actors[label]


def start_overlaps(
    scenario: Scenario, region: Region, assets: AssetLookup | None
) -> Iterator[Problem]:
    """Find bodies that share ground while both have just departed, the first thousand of them.

    Takes time in proportion to the actors and to what is found, however many start at one place.
    """
    found = 0
    for index, others in _overlapping(scenario, region, assets):
        actor = scenario.actors[index]
        for other in (scenario.actors[one] for one in others[: MOST - found]):
            yield error(
                "bodies_overlap",
                f"actors[{index}].spawn",
                f"{actor.id!r} and {other.id!r} overlap where they start; move one of them or "
                "let it depart later",
                nodes=[actor.spawn, other.spawn],
            )
        found += len(others)
        if found >= MOST:
            return


def _overlapping(
    scenario: Scenario, region: Region, assets: AssetLookup | None
) -> Iterator[tuple[int, list[int]]]:
    """Each actor with those before it in the document that it overlaps."""
    bodies = [body_of(actor, assets) for actor in scenario.actors]
    reach = 2 * max((body.length + body.width for body in bodies), default=0.0)
    windows: dict[int, _Window] = {}
    boxes: dict[_Start, Box] = {}
    for index, (actor, body) in enumerate(zip(scenario.actors, bodies, strict=True)):
        start = _Start(actor.spawn, actor.lateral_offset, body)
        if start not in boxes:
            place = region.place(actor.spawn)
            if place is None:
                continue
            nodes, aside = region.nodes_of(place), actor.lateral_offset
            boxes[start] = box_at(nodes, place.node, body, lateral_offset=aside)
        own = floor(actor.depart / SAME_TIME)
        near = [
            other
            for window in (own - 1, own, own + 1)
            if window in windows
            for other in windows[window].beside(actor.spawn, boxes[start])
            if _together(actor, scenario.actors[other])
        ]
        yield index, sorted(near)
        windows.setdefault(own, _Window(Crowd(reach), {}, [], [])).add(start, boxes[start], index)


def _together(one: Actor, other: Actor) -> bool:
    return abs(one.depart - other.depart) < SAME_TIME
