"""From lanelets to OpenDRIVE: the steps in their order, and the report."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from odscen.base.errors import InputError
from odscen.base.shown import shown_id
from odscen.convert.model.conversion_report import ElementOutcome, ReportEntry
from odscen.maps.importers.base import ImportedMap
from odscen.maps.importers.lanelet2.furniture import add_furniture
from odscen.maps.importers.lanelet2.lane_network import (
    Group,
    LaneNetwork,
    build_network,
    build_strips,
    copy_for_both_directions,
)
from odscen.maps.importers.lanelet2.lanelet_file import DRIVEN, WALKED
from odscen.maps.importers.lanelet2.lanelet_roads import LANE_TYPES, build_roads, speed_of
from odscen.opendrive.road_model import Header, OpenDrive
from odscen.opendrive.write import write_opendrive

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.maps.importers.lanelet2.lanelet_file import Lanelet, LaneletMap
    from odscen.maps.importers.lanelet2.lanelet_roads import BuiltRoads

_FOLDED = 0.05
"""``1 - curvature t`` below which lanes fold, or nearly."""


def convert_lanelets(source: LaneletMap, rule: str) -> ImportedMap:
    """Make OpenDRIVE of a map of lanelets.

    Parameters
    ----------
    rule
        ``right``, ``left`` or ``auto``: the side on which traffic keeps.

    Raises
    ------
    InputError
        If there is no lanelet for vehicles or pedestrians.
    """
    driven = [lanelet for lanelet in source.lanelets.values() if lanelet.subtype in DRIVEN]
    driven += [copy_for_both_directions(ll) for ll in driven if ll.tags.get("one_way") == "no"]
    walked = [lanelet for lanelet in source.lanelets.values() if lanelet.subtype in WALKED]
    if not driven and not walked:
        raise InputError("there is no lanelet for vehicles or pedestrians", element="osm")
    network = build_network(source, driven, rule) if driven else LaneNetwork(source, False, [])
    built = build_roads(network, build_strips(network))
    roads = list(built.roads)
    _add_walkways(source, walked, built, left_hand=network.left_hand)
    controllers, furniture = add_furniture(source, built, roads or list(built.roads))
    entries = [*source.entries, _report_traffic_side(network, rule)]
    entries += _report_lanelets(source, network, built)
    entries += furniture
    header = Header(1, 7, "", None, None, None, None, source.geo_reference, None)
    model = OpenDrive(
        header,
        {key: item.road for key, item in built.roads.items()},
        built.junctions,
        controllers,
    )
    return ImportedMap(write_opendrive(model), entries)


def _add_walkways(
    source: LaneletMap, walked: Sequence[Lanelet], built: BuiltRoads, *, left_hand: bool
) -> None:
    """Make a road with a sidewalk of each walkway; they are linked where they do not branch."""
    network = LaneNetwork(source, left_hand, [Group([lanelet]) for lanelet in walked])
    network.link()
    single = {
        (a, after[0])
        for a, after in network.following.items()
        if len(after) == 1 and len(network.preceding[after[0]]) == 1 and after[0] != a
    }
    network.following = {
        a: [b for b in after if (a, b) in single] for a, after in network.following.items()
    }
    network.preceding = {
        b: [a for a in before if (a, b) in single] for b, before in network.preceding.items()
    }
    first = 1 + max(map(int, (*built.roads, *built.junctions)), default=0)
    ways = build_roads(network, build_strips(network), first_id=first)
    built.roads.update(ways.roads)
    built.places.update(ways.places)


def _report_traffic_side(network: LaneNetwork, rule: str) -> ReportEntry:
    side = "left" if network.left_hand else "right"
    if rule != "auto":
        return ReportEntry(ElementOutcome.KEPT, "roads", f"traffic keeps {side}, as chosen")
    reason = f"traffic keeps {side}, by the lanes of oncoming traffic; the option traffic says it"
    return ReportEntry(ElementOutcome.GUESSED, "roads", reason, 0.9)


def _report_lanelets(
    source: LaneletMap, network: LaneNetwork, built: BuiltRoads
) -> list[ReportEntry]:
    """A row for each lanelet: its lanes, and what of it was guessed."""
    entries = []
    parts = Counter(ll.source for group in network.groups for ll in group.lanelets)
    lost = {network.lanelet(identity).source for identity in built.lost_parts}
    for lanelet in source.lanelets.values():
        if lanelet.subtype == "crosswalk":
            continue
        places = built.places.get(lanelet.id, [])
        if not places:
            reason = "it lies in a junction, and no path through it from road to road uses it"
            source.lose("lanelet", lanelet.id, reason)
            entries.append(source.entries.pop())
            continue
        paths = [f"road {place.road} > lane {place.lane}" for place in places]
        speed, origin = speed_of(source, lanelet)
        facts = [f"{lanelet.subtype.replace('_', ' ')}: {LANE_TYPES[lanelet.subtype]}"]
        if speed is not None:
            facts.append(f"{3.6 * speed:.4g} km/h")
        if len(set(paths)) > 1:
            facts.append(f"also {', '.join(list(dict.fromkeys(paths))[1:5])}")
        confidence = 1.0
        if origin == "usual" and speed is not None:
            facts.append("the limit is the usual one of its kind, as none is given")
            confidence = 0.6
        if lanelet.tags.get("one_way") == "no" and lanelet.subtype in DRIVEN:
            facts.append("driven both ways: a road for each direction, one on the other")
            confidence = 0.5
        if LANE_TYPES[lanelet.subtype] == "sidewalk" and lanelet.tags.get("bicycle") == "yes":
            facts.append("bicycles may use it too, which a sidewalk of OpenDRIVE does not say")
            confidence = min(confidence, 0.8)
        margins = [built.roads[place.road].fitted.margin for place in places]
        if min(margins) < _FOLDED:
            facts.append("it bends more tightly than it is wide")
            confidence = min(confidence, 0.4)
        if lanelet.id in lost and parts[lanelet.id] > 1:
            facts.append("a part of it in a junction leads nowhere and is left out")
            confidence = min(confidence, 0.5)
        outcome = ElementOutcome.KEPT if confidence == 1.0 else ElementOutcome.GUESSED
        entries.append(
            ReportEntry(
                outcome,
                paths[0],
                f"lanelet {shown_id(lanelet.id)}, {'; '.join(facts)}",
                None if confidence == 1.0 else confidence,
                lanelet.id,
            )
        )
    if built.truncated:
        entries.append(
            ReportEntry(
                ElementOutcome.LOST,
                "junctions",
                "there are more paths through junctions than are followed; some are left out",
            )
        )
    return entries
