"""How much of the map's lanes has a lane in SUMO, by the lane table."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.convert.model.access import BICYCLE_TYPES, TRACK_TYPES, is_used
from odscen.convert.model.conversion_report import ElementOutcome, ReportEntry
from odscen.opendrive.road_model import DRIVABLE_TYPES

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from odscen.base.ids import LaneKey, Roadside
    from odscen.convert.lane_table.table import LaneTable
    from odscen.opendrive.lanes import RoadTable
    from odscen.opendrive.road_model import OpenDrive


def covered_metres(lanes: LaneTable) -> dict[LaneKey | Roadside, float]:
    """Metres of s of each lane that have a SUMO lane."""
    covered: dict[LaneKey | Roadside, float] = {}
    for span in lanes.spans:
        key = lanes.lane_keys[span.lane]
        covered[key] = covered.get(key, 0.0) + span.high - span.low
    return covered


def lane_lengths(odr: OpenDrive, table: RoadTable, lanes: LaneTable) -> dict[str, float]:
    """Metres of lanes by kind and place: in all (``..._length``) and covered (``..._covered``)."""
    covered = covered_metres(lanes)
    figures: dict[str, float] = {}
    for row, key in enumerate(table.lane_keys):
        lane_type = table.lane_type[row]
        if not is_used(lane_type):
            continue
        kind = "driving" if lane_type in DRIVABLE_TYPES else "walking"
        kind = "biking" if lane_type in BICYCLE_TYPES else kind
        kind = "rail" if lane_type in TRACK_TYPES else kind
        where = "road" if odr.roads[key.road].junction is None else "junction"
        length = float(table.lane_s1[row] - table.lane_s0[row])
        for name, value in (("length", length), ("covered", covered.get(key, 0.0))):
            full = f"{kind}_{where}_{name}"
            figures[full] = figures.get(full, 0.0) + value
    return {name: round(value, 2) for name, value in sorted(figures.items())}


def kept_lanes(lengths: Mapping[str, float]) -> Iterator[ReportEntry]:
    """One line of the report for each kind of lanes, of which there are thousands."""
    for name, length in lengths.items():
        if name.endswith("_length") and length > 0.0:
            covered = lengths[name.replace("_length", "_covered")]
            kind, where = name.removesuffix("_length").split("_")
            reason = f"{covered:.0f} of {length:.0f} m of {kind} lanes lie on their centre lines"
            place = "junctions" if where == "junction" else "roads"
            yield ReportEntry(ElementOutcome.KEPT, place, reason)
