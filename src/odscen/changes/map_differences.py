"""Two maps held against each other: every difference once, in words, and nothing else.

What counts is what the files mean: the order of elements, a lane section cut in two, or a profile
written in other pieces is no difference. Roads are paired by id, else by where they lie.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from odscen.changes.furniture_differences import furniture_differences
from odscen.changes.lane_differences import RoadPair, lane_differences
from odscen.changes.line_differences import road_differences
from odscen.changes.link_differences import (
    PairedRoads,
    controller_differences,
    junction_differences,
    lane_link_differences,
)
from odscen.changes.map_change import ChangePlace, MapChange, metres, of_road
from odscen.changes.paired_lanes import paired_stretches
from odscen.opendrive.lanes import RoadTable

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from odscen.base.ids import RoadId
    from odscen.opendrive.road_model import OpenDrive, Road

_SAME_PLACE = 0.1


def map_differences(before: OpenDrive, after: OpenDrive) -> tuple[MapChange, ...]:
    """Find the differences of two maps, roads in the order of the file before, then what came.

    Parameters
    ----------
    before, after
        The maps as read.
    """
    tables = RoadTable.of(before), RoadTable.of(after)
    partners = _partners(before, after, tables)
    pairs = [
        RoadPair(
            before.roads[old],
            after.roads[new],
            tables,
            tuple(paired_stretches(before.roads[old], after.roads[new])),
        )
        for old, new in partners.items()
    ]
    roads = PairedRoads(
        {str(pair.before.id): pair for pair in pairs}, {str(pair.after.id): pair for pair in pairs}
    )
    return (
        *_header(before, after),
        *_roads(before, after, partners),
        *_within_roads(pairs, {str(new): str(old) for old, new in partners.items()}),
        *lane_link_differences(before, after, roads),
        *junction_differences(before, after, roads),
        *controller_differences(before.controllers, after.controllers),
    )


def _header(before: OpenDrive, after: OpenDrive) -> Iterator[MapChange]:
    old, new = before.header, after.header
    for name, was, now in (
        ("geographic reference", old.geo_reference, new.geo_reference),
        ("offset", str(old.offset), str(new.offset)),
    ):
        if was != now:
            subject = f"{name} of the map"
            yield MapChange("changed", "header", subject, was or "none", now or "none")


def _partners(
    before: OpenDrive, after: OpenDrive, tables: tuple[RoadTable, RoadTable]
) -> dict[RoadId, RoadId]:
    """Id after of each road that both maps have."""
    partners = {road: road for road in before.roads if road in after.roads}
    alone = [road for road in before.roads if road not in partners]
    rest = [road for road in after.roads if road not in partners]
    if alone and rest:
        places = _places(tables[1], [after.roads[road] for road in rest])
        for road, place in zip(
            alone, _places(tables[0], [before.roads[one] for one in alone]), strict=True
        ):
            apart = np.abs(places - place).max(axis=1)
            nearest = int(np.argmin(apart))
            if apart[nearest] <= _SAME_PLACE:
                partners[road] = rest[nearest]
                places[nearest] = np.inf
    return {road: partners[road] for road in before.roads if road in partners}


def _places(
    table: RoadTable, roads: list[Road]
) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """Where roads begin, have their middle and end, shape ``(roads, 6)``, metres."""
    rows = np.array([table.road_index[road.id] for road in roads])
    length = np.array([road.length for road in roads])
    points = [table.reference(rows, part * length) for part in (0.0, 0.5, 1.0)]
    return np.stack([value for point in points for value in (point.x, point.y)], axis=1)


def _roads(
    before: OpenDrive, after: OpenDrive, partners: Mapping[RoadId, RoadId]
) -> Iterator[MapChange]:
    for road in before.roads.values():
        if road.id not in partners:
            yield _whole(road, "removed")
    known = set(partners.values())
    for road in after.roads.values():
        if road.id not in known:
            yield _whole(road, "added")


def _whole(road: Road, kind: str) -> MapChange:
    of = f" of junction {road.junction}" if road.junction else ""
    said = f"{metres(road.length)} m{of}"
    place = ChangePlace(road.id, 0.0, road.length)
    if kind == "added":
        return MapChange("added", "road", of_road(road.id), None, said, place)
    return MapChange("removed", "road", of_road(road.id), said, None, place)


def _within_roads(pairs: list[RoadPair], names: Mapping[str, str]) -> Iterator[MapChange]:
    for pair in pairs:
        if pair.before == pair.after:
            continue
        yield from road_differences(pair, names)
        yield from lane_differences(pair)
        yield from furniture_differences(pair.before, pair.after)
