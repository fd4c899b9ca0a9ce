"""netconvert's network of a map with what netconvert does not read: limits and stop signs.

Limits of roads, or by their type, are written into the lanes of the map, where netconvert reads
them. In junctions it takes none: there each lane is held to the limit of the connecting road that
it runs over, and to the speed at which drivers take the same turn in odscen's network: its own lets
them corner with 5.5 m/s2. A connection of netconvert's that is one with a stop sign in odscen's
network gets it, too. Right of way stays netconvert's.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple
from xml.etree import ElementTree as ET

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from odscen.base.arrays import FloatArray
    from odscen.opendrive.lanes import RoadTable

APART = 25.0
"""Metres between both ends of two connections, in sum, up to which they are one."""


class _Path(NamedTuple):
    """A connection with its internal lanes, first and last point in the OpenDRIVE frame."""

    link: ET.Element
    lanes: list[ET.Element]
    first: FloatArray
    last: FloatArray


def map_with_limits(path: Path, target: Path) -> None:
    """Write the map with a limit in each lane outside junctions, and where else it has one."""
    from odscen.convert.model.access import speed
    from odscen.opendrive.lanes import RoadTable
    from odscen.opendrive.parse import parse

    table = RoadTable.of(parse(path.read_bytes(), file=path.name))
    rows = {(str(k.road), k.section, k.lane): row for row, k in enumerate(table.lane_keys)}
    root = ET.fromstring(path.read_bytes())
    for road in root.iter("road"):
        kinds = [(float(t.get("s", 0)), t.get("type", "")) for t in road.findall("type")]
        for number, section in enumerate(road.iter("laneSection")):
            for lane in section.iter("lane"):
                row = rows.get((road.get("id", ""), number, int(lane.get("id", 0))))
                if row is None or lane.find("speed") is not None:
                    continue
                limit, middle = _limit(table, row)
                if math.isnan(limit) and road.get("junction", "-1") != "-1":
                    continue
                kind = ([kind for s, kind in sorted(kinds) if s <= middle] or [""])[-1]
                value = speed(limit, lane.get("type", ""), kind)
                lane.append(ET.Element("speed", sOffset="0", max=f"{value:.4f}", unit="m/s"))
    target.write_bytes(ET.tostring(root))


def add_signs_and_inner_limits(path: Path, ours: Path, net: Path) -> None:
    """Give stop signs, and limits on connecting roads, to a network of netconvert's."""
    from odscen.opendrive.lanes import RoadTable
    from odscen.opendrive.parse import parse

    odr = parse(path.read_bytes(), file=path.name)
    table = RoadTable.of(odr)
    limits: dict[str, float] = {}
    for row, key in enumerate(table.lane_keys):
        limit = _limit(table, row)[0] if odr.roads[key.road].junction is not None else math.nan
        if not math.isnan(limit):
            name = f"{key.road}_{key.lane}"
            limits[name] = min(limit, limits.get(name, math.inf))
    own = list(_paths(ET.parse(ours).getroot()))
    tree = ET.parse(net)
    for peer in _paths(tree.getroot()):
        same = min(own, key=lambda one: _apart(one, peer), default=None)
        if same is None or _apart(same, peer) > APART:
            continue
        if same.link.get("state") in ("s", "w") and not peer.link.get("tl"):
            peer.link.set("state", "s")
        over = [param.get("value", "").split() for lane in same.lanes for param in lane]
        held = min((limits.get(one, math.inf) for some in over for one in some), default=math.inf)
        held = min(held, *(float(lane.get("speed", math.inf)) for lane in same.lanes))
        for lane in peer.lanes:
            lane.set("speed", f"{min(float(lane.get('speed', 0)), held):.2f}")
    tree.write(net)


def _limit(table: RoadTable, row: int) -> tuple[float, float]:
    middle = float(table.lane_s0[row] + table.lane_s1[row]) / 2.0
    return float(table.speed_limit(np.array([row]), np.array([middle]))[0]), middle


def _apart(one: _Path, other: _Path) -> float:
    return math.dist(one.first, other.first) + math.dist(one.last, other.last)


def _paths(root: ET.Element) -> Iterator[_Path]:
    location = root.find("location")
    offset = _point(location.get("netOffset", "0,0") if location is not None else "0,0")
    lanes = {lane.get("id", ""): lane for lane in root.iter("lane")}
    links = [link for link in root.iter("connection") if link.get("via")]
    beyond = {f"{link.get('from')}_{link.get('fromLane')}": link.get("via", "") for link in links}
    for link in links:
        if link.get("from", "").startswith(":"):
            continue
        way = [link.get("via", "")]
        while way[-1] in beyond:
            way.append(beyond[way[-1]])
        own = [lanes[one] for one in way]
        shapes = [lane.get("shape", "").split() for lane in own]
        yield _Path(link, own, _point(shapes[0][0]) - offset, _point(shapes[-1][-1]) - offset)


def _point(text: str) -> FloatArray:
    return np.array([float(value) for value in text.split(",")[:2]])
