"""Roads whose length and plan view disagree (:attr:`Rule.ROAD_LENGTH`).

Which of both ends of such a road is the true one is shown by the roads that are linked there: they
meet it at one of them. Where nothing is linked, the shorter one holds, for neither a road without
lanes nor lanes without a plan view are there.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.base.errors import OpenDriveError
from odscen.base.ids import RoadId
from odscen.base.shown import shown_id
from odscen.opendrive.geometry import PlanView
from odscen.opendrive.parse_left_out import RoadFault
from odscen.opendrive.parse_rules import MAX_S_GAP, MEETING, Notes, Rule
from odscen.opendrive.road_model import Geometry, GeometryKind

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from odscen.opendrive.road_model import Road, RoadLink

MOST_ASIDE = 50.0
"""Metres across the road at which a linked road may meet it."""


class _RoadEnd(NamedTuple):
    """A point at s of a road, and the heading there."""

    s: float
    x: float
    y: float
    hdg: float


def fit_lengths(
    roads: dict[RoadId, Road], notes: Notes
) -> tuple[dict[RoadId, Road], list[RoadFault]]:
    """Make length and plan view of each road agree, and note each that did not.

    Returns
    -------
    tuple
        The roads, and those at which nothing shows which of both holds.
    """
    astray = {
        road.id: _plan_end(road)
        for road in roads.values()
        if not abs(_plan_end(road) - road.length) <= MAX_S_GAP
    }
    if not astray:
        return roads, []
    fitted, faults = dict(roads), []
    for road_id, end in astray.items():
        road = roads[road_id]
        what = f"the plan view ends at s={end:.6g}, but the road's length is {road.length:.6g}"
        length = _true_length(road, end, roads, astray)
        if length is None or not road.sections[-1].s < length:
            path = f"road {shown_id(road.id)} > geometry {len(road.geometry) - 1}"
            problem = f"{what}; no road that is linked there shows which one holds"
            faults.append(RoadFault(road.id, OpenDriveError(problem, element=path)))
            continue
        fitted[road_id] = _fit_road(road, length)
        notes.add(Rule.ROAD_LENGTH, f"road {shown_id(road.id)}", f"{what}; {length:.6g} holds")
    return fitted, faults


def _plan_end(road: Road) -> float:
    last = road.geometry[-1]
    return last.s + last.length


def _true_length(
    road: Road, end: float, roads: Mapping[RoadId, Road], astray: Mapping[RoadId, float]
) -> float | None:
    """The one of both lengths at which linked roads meet it; the shorter if none is linked."""
    lengths = sorted((end, road.length))
    votes: set[float] = set()
    linked = False
    for x, y in _meeting_points(road, roads, astray):
        linked = True
        votes |= {length for length in lengths if _meets_neighbour(_end_at(road, length), x, y)}
    if not linked:
        return lengths[0]
    return votes.pop() if len(votes) == 1 else None


def _end_at(road: Road, s: float) -> _RoadEnd:
    points = PlanView.of([road.geometry]).at(np.array([0]), np.array([s]))
    return _RoadEnd(s, float(points.x[0]), float(points.y[0]), float(points.hdg[0]))


def _meets_neighbour(end: _RoadEnd, x: float, y: float) -> bool:
    """Whether a point lies at the end of a road or beside it, not before or behind it."""
    dx, dy = x - end.x, y - end.y
    cos, sin = math.cos(end.hdg), math.sin(end.hdg)
    return abs(dx * cos + dy * sin) <= MEETING and abs(dy * cos - dx * sin) <= MOST_ASIDE


def _meeting_points(
    road: Road, roads: Mapping[RoadId, Road], astray: Mapping[RoadId, float]
) -> Iterator[tuple[float, float]]:
    """Where roads that are linked to the end of a road begin or end."""
    places = {_place_at_end(road.successor)} if road.successor else set()
    for other in roads.values():
        for end, link in (("start", other.predecessor), ("end", other.successor)):
            if link is not None and _place_at_end(link) == (road.id, "end"):
                places.add((other.id, end))
    for name, end in sorted(places - {("", "")}):
        other = roads.get(RoadId(name), road)
        if other is road:
            continue
        if end == "start":
            yield other.geometry[0].x, other.geometry[0].y
        elif other.id not in astray:
            at = _end_at(other, other.length)
            yield at.x, at.y


def _place_at_end(link: RoadLink | None) -> tuple[str, str]:
    """Road and end that a link leads to; empty if it leads to none."""
    if link is None or link.element_type != "road" or link.contact_point is None:
        return "", ""
    return link.element_id, link.contact_point


def _fit_road(road: Road, length: float) -> Road:
    """The road with a length, its plan view cut there or led straight on to there."""
    geometry = [geometry for geometry in road.geometry if geometry.s < length]
    last = geometry[-1]
    if last.s + last.length > length:
        geometry[-1] = _shorten_line(last, length - last.s)
    elif last.s + last.length < length:
        end = _end_at(road, last.s + last.length)
        rest = length - end.s
        geometry.append(Geometry(end.s, end.x, end.y, end.hdg, rest, GeometryKind.LINE, ()))
    sections = list(road.sections)
    sections[-1] = replace(sections[-1], s_end=length)
    return replace(road, length=length, geometry=tuple(geometry), sections=tuple(sections))


def _shorten_line(geometry: Geometry, length: float) -> Geometry:
    if geometry.kind is GeometryKind.SPIRAL:
        start, end = geometry.params
        params = start, start + (end - start) * length / geometry.length
        return geometry._replace(length=length, params=params)
    return geometry._replace(length=length)
