"""What the letters of a light's states are for in a network that odscen has not written.

Which links meet and who gives way is as the junctions of the network say; whether they may share
green, and how long one clears for another, as for our own networks
(:mod:`odscen.convert.signals.shared_green`).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.base.errors import InputError
from odscen.base.ids import SumoLaneId
from odscen.convert.model.net import (
    CROSSING,
    UNUSED,
    WALKING_AREA,
    LightLink,
    LinkConflict,
    Request,
)
from odscen.convert.model.right_of_way import Conflicts, Movement, Sign, Walkway, find_conflicts
from odscen.convert.signals.light_links import moving_link, walking_link
from odscen.convert.signals.shared_green import LightLinks, link_conflicts

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from odscen.base.arrays import FloatArray
    from odscen.convert.imported.net_import import (
        ImportedLane,
        ImportedLight,
        ImportedLink,
        ImportedNet,
        ImportedRights,
    )

_POINT = 0.01
"""Metres: points of a line nearer to each other are one."""

_NO_LINK = LightLink(SumoLaneId(""), SumoLaneId(""), UNUSED)


class LightLetters(NamedTuple):
    """What the letters of one light are for, and which of them meet."""

    links: tuple[LightLink, ...]
    conflicts: tuple[LinkConflict, ...]


def imported_letters(net: ImportedNet) -> dict[str, LightLetters]:
    """Return the letters of each light, by its id.

    Links with the same letter have the name of the first and the conflicts of all. Links of
    different junctions do not meet, though one light may control both.
    """
    ways = _Ways(net)
    links: dict[str, dict[int, LightLink]] = {}
    met: dict[str, dict[tuple[int, int], list[LinkConflict]]] = {}
    for rights in net.lit:
        junction = _Junction(ways, rights)
        for light, letter, link in junction.letters():
            links.setdefault(light, {}).setdefault(letter, link)
        for light, conflict in junction.conflicts():
            pair = conflict.one, conflict.other
            met.setdefault(light, {}).setdefault(pair, []).append(conflict)
    return {
        light.id: LightLetters(
            _fill_links(light, links.get(light.id, {})),
            tuple(
                merge_conflict
                for _, same in sorted(met.get(light.id, {}).items())
                for merge_conflict in _merge_conflicts(same)
            ),
        )
        for light in net.lights
    }


def _fill_links(light: ImportedLight, links: Mapping[int, LightLink]) -> tuple[LightLink, ...]:
    """Links of all letters of a light."""
    count = len(light.signals)
    if links and max(links) >= count:
        raise InputError(
            f"the SUMO network cannot be read: a connection has letter {max(links)} of light "
            f"{light.id}, whose states have {count}"
        )
    return tuple(links.get(n, _NO_LINK) for n in range(count))


def _merge_conflicts(same: Sequence[LinkConflict]) -> Iterable[LinkConflict]:
    """What holds for two letters, from all that their links say of each other.

    Where links of either give way to some of the other, there is one conflict for each way.
    """
    for yields in sorted({conflict.yields for conflict in same}):
        yield same[0]._replace(
            yields=yields,
            shares=all(conflict.shares for conflict in same),
            clearing=max(conflict.clearing for conflict in same),
            clearing_back=max(conflict.clearing_back for conflict in same),
        )


class _Ways:
    """Lanes and connections of a network, looked up by where one comes from."""

    def __init__(self, net: ImportedNet) -> None:
        self.net = net
        self._links_from: dict[SumoLaneId, list[ImportedLink]] = {}
        for link in net.links:
            self._links_from.setdefault(link.source, []).append(link)

    def links_into(self, rights: ImportedRights) -> Iterable[ImportedLink]:
        """Links of a junction in the order of its requests."""
        for lane in rights.incoming:
            for link in self._links_from.get(lane, ()):
                source, target = self.net.function(link.source), self.net.function(link.target)
                if target != WALKING_AREA and (source != WALKING_AREA or target == CROSSING):
                    yield link

    def onward(self, crossing: SumoLaneId) -> SumoLaneId:
        """Lane of the walking area that a crossing leads to; the crossing where there is none."""
        return next((link.target for link in self._links_from.get(crossing, ())), crossing)

    def movement(self, link: ImportedLink) -> Movement:
        """Way of vehicles over a connection; the straight line where it has no lane inside."""
        before, after = self.net.lanes[link.source], self.net.lanes[link.target]
        inside = [lane.shape for lane in self._internal_lanes_of(link)]
        shape = _thin_shape(np.concatenate(inside or [before.shape[-1:], after.shape[:1]]))
        return Movement(
            source=(before.edge, before.index),
            target=(after.edge, after.index),
            shape=shape,
            width=min(before.width, after.width),
            heading_in=_heading_of(before.shape, at_end=True),
            heading_out=_heading_of(after.shape, at_end=False),
            speed=before.speed,
            sign=Sign.NONE,
            in_roundabout=False,
            roads=frozenset(),
        )

    def for_bicycles(self, link: ImportedLink) -> bool:
        """Whether of cars and bicycles only these may use a connection."""
        lanes = [self.net.lanes[lane] for lane in (link.source, link.target)]
        cars, bicycles = (
            all(lane.allows(name) for lane in lanes) for name in ("passenger", "bicycle")
        )
        return bicycles and not cars

    def _internal_lanes_of(self, link: ImportedLink) -> Iterable[ImportedLane]:
        """Internal lanes of a connection, one after the other."""
        seen: set[SumoLaneId] = set()
        lane = link.via
        while lane and lane not in seen:
            seen.add(lane)
            yield self.net.lanes[lane]
            onwards = self._links_from.get(lane, ())
            lane = next(
                (onward.via for onward in onwards if onward.target == link.target), SumoLaneId("")
            )


class _Junction:
    """Links of one junction: those for vehicles, then the crossings."""

    def __init__(self, ways: _Ways, rights: ImportedRights) -> None:
        links = list(ways.links_into(rights))
        if rights.requests and len(links) != len(rights.requests):
            raise InputError(
                f"the SUMO network cannot be read: junction {rights.junction} has {len(links)} "
                f"links, but {len(rights.requests)} requests"
            )
        requests = rights.requests or (Request(frozenset(), frozenset()),) * len(links)
        net = ways.net
        self._ways = ways
        walking = [net.function(link.target) == CROSSING for link in links]
        order = sorted(range(len(links)), key=lambda n: walking[n])
        row = {n: place for place, n in enumerate(order)}
        self._links = [links[n] for n in order]
        self._count = walking.count(False)
        self._rights = [_renumber_request(requests[n], row) for n in order]
        self._movements = [ways.movement(link) for link in self._links[: self._count]]
        crossings = [net.lanes[link.target] for link in self._links[self._count :]]
        self._walkways = [Walkway(lane.shape[[0, -1]], lane.width) for lane in crossings]
        self._met = (
            _conflicts_of_requests(self._rights, self._count)
            if rights.requests
            else find_conflicts(self._movements, self._walkways)
        )

    def letters(self) -> Iterable[tuple[str, int, LightLink]]:
        """Lights, places in their states, and what the letter there is for."""
        for n, link in enumerate(self._links):
            made = self._make_link(n) if link.light else _NO_LINK
            for letter in link.letters:
                yield link.light, letter, made

    def _make_link(self, n: int) -> LightLink:
        link = self._links[n]
        if n < self._count:
            return moving_link(self._movements[n])._replace(source=link.source, target=link.target)
        net = self._ways.net
        crossing = net.lanes[link.target]
        ends = link.source, self._ways.onward(link.target)
        return walking_link(ends, self._walkways[n - self._count], net.edges[crossing.edge].crossed)

    def conflicts(self) -> Iterable[tuple[str, LinkConflict]]:
        """Letters of a light that meet, the smaller first."""
        rows = {n: n for n, link in enumerate(self._links) if link.letters}
        for found in link_conflicts(self._light_links(), rows):
            one, other = self._links[found.one], self._links[found.other]
            if one.light != other.light:
                continue
            for i in one.letters:
                for j in other.letters:
                    place = {found.one: i, found.other: j}
                    made = found._replace(one=i, other=j, yields=place.get(found.yields, -1))
                    if i != j:
                        yield one.light, made if i < j else _turn_conflict(made)

    def _light_links(self) -> LightLinks:
        ways, count = self._ways, self._count
        return LightLinks(
            movements=self._movements,
            walkways=self._walkways,
            signals=[()] * count,
            controllers=[""] * count,
            bicycles=[ways.for_bicycles(link) for link in self._links[:count]],
            conflicts=self._met,
            rights=self._rights,
            side=-1.0 if ways.net.lefthand else 1.0,
        )


def _conflicts_of_requests(rights: Sequence[Request], count: int) -> Conflicts:
    """What meets by the requests of a junction, whose first ``count`` links are for vehicles."""
    foes = [set(right.foes) for right in rights]
    for n, right in enumerate(rights):
        for other in right.foes:
            foes[other].add(n)
    pairs = ((i, j) for i in range(count) for j in sorted(foes[i]) if i < j < count)
    crossed = (tuple(n for n in sorted(own) if n < count) for own in foes[count:])
    return Conflicts(tuple(pairs), frozenset(), tuple(crossed))


def _renumber_request(request: Request, row: Mapping[int, int]) -> Request:
    yields, foes = (
        frozenset(row[n] for n in some if n in row) for some in (request.yields_to, request.foes)
    )
    return Request(yields, foes)


def _turn_conflict(conflict: LinkConflict) -> LinkConflict:
    """The same, seen from the other of the two."""
    return conflict._replace(
        one=conflict.other,
        other=conflict.one,
        clearing=conflict.clearing_back,
        clearing_back=conflict.clearing,
    )


def _thin_shape(shape: FloatArray) -> FloatArray:
    """A line without points that lie on the one before; two points at least."""
    steps = np.hypot(*np.diff(shape[:, :2], axis=0).T)
    kept = shape[np.concatenate([[True], steps > _POINT])]
    return kept if len(kept) > 1 else shape[[0, -1]]


def _heading_of(shape: FloatArray, *, at_end: bool) -> float:
    """Direction of a lane at its end or start, radians."""
    line = _thin_shape(shape)
    step = (line[-1] - line[-2]) if at_end else (line[1] - line[0])
    return math.atan2(step[1], step[0])
