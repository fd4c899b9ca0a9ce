"""What lights, signs and access of maps say, and what SUMO's networks of them have.

All maps at hand (shipped, those of ``ODSCEN_TEST_MAPS`` with the folders ``osc`` and ``cases``
beside it, and any folders named), each once. A light is controlled if its network's own text has
it behind a link; the others are told with the reason of the import report. Signs are counted by
country and type as the table of signs understands them, and the counts of the report must add up
to those of the file. Permissions of each lane with ``<access>`` are computed here from the file
alone, place by place, and held against ``allow`` of the network.

    python -m bench map_meaning --folders FOLDER ...
"""

from __future__ import annotations

import argparse
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple
from xml.etree import ElementTree as ET

from bench.common import shared_maps
from odscen.base.errors import OdscenError
from odscen.base.ids import LaneKey
from odscen.base.shown import shown_id
from odscen.convert.building.network import build_network
from odscen.convert.model.access import allowed
from odscen.convert.model.conversion_report import ElementOutcome
from odscen.convert.verify.fidelity import verify
from odscen.lanegraph.build_graphs import build_map_graph
from odscen.maps.shipped import shipped_maps
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.objects import signal_kind
from odscen.opendrive.parse import parse
from odscen.opendrive.sign_catalogue import sign_meaning

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from odscen.convert.lane_table.sumo_network import SumoNetwork
    from odscen.opendrive.road_model import LaneAccess, OpenDrive, Signal

LIGHTS = ("traffic_light", "pedestrian_light")

WHO = {
    "passengerCar": {"passenger", "hov"},
    "bus": {"bus"},
    "delivery": {"delivery"},
    "emergency": {"emergency"},
    "taxi": {"taxi"},
    "truck": {"truck"},
    "trucks": {"truck"},
    "bicycle": {"bicycle"},
    "motorcycle": {"motorcycle"},
    "HOV": {"hov"},
}
"""Classes of SUMO for each road user of ``<access>`` that has some; cars of many are cars."""

LEAST_STRETCH = 0.01
"""Metres: nobody is on what is shorter, as where one edge is cut into two."""

BESIDE = 0.5
"""Metres before and behind a lane inside a junction, on those that it joins."""

EVERYBODY = set[str]().union(*WHO.values())


class Counts(NamedTuple):
    """What one map has, and what its network has of it."""

    lights: Counter[str]
    reasons: Counter[str]
    signs: Counter[str]
    unknown: Counter[str]
    untold: int
    places: int
    wrong: tuple[str, ...]
    unclassed: Counter[str]


def main() -> None:
    parser = argparse.ArgumentParser(prog="bench map_meaning", description=__doc__)
    parser.add_argument("--folders", nargs="*", type=Path, default=[])
    real = shared_maps()
    beside = [] if real is None else [real, real.parent / "osc", real.parent / "cases"]
    files = list(_distinct_files([*beside, *parser.parse_args().folders]))
    totals = Counter[str]()
    reasons, unknown, unclassed = Counter[str](), Counter[str](), Counter[str]()
    print(f"{'map':34} {'lights':>6} {'acting':>6} {'lost':>4} {'signs':>5} {'act':>4} "
          f"{'known':>5} {'not':>4} {'untold':>6} {'access':>6} {'wrong':>5}")  # fmt: skip
    for path in files:
        try:
            own = _count_map(path)
        except OdscenError as error:
            print(f"{path.stem[:34]:34} refused: {error}")
            totals["refused"] += 1
            continue
        row = {
            **{key: own.lights[key] for key in ("lights", "acting", "lost")},
            **{key: own.signs[key] for key in ("signs", "act", "known", "not")},
            "untold": own.untold,
            "places": own.places,
            "wrong": len(own.wrong),
        }
        totals.update(row)
        reasons += own.reasons
        unknown += own.unknown
        unclassed += own.unclassed
        if any(row.values()):
            print(f"{_name(path):34} " + _figures(row))
        for place in own.wrong[:5]:
            print(f"    {place}")
    print(f"{len(files)} maps, {totals['refused']} refused".ljust(34) + " " + _figures(totals))
    for title, counts in (
        ("lights lost", reasons),
        ("signs not understood", unknown),
        ("access without a vehicle class in SUMO", unclassed),
    ):
        print(f"{title}: {counts.total()}")
        for what, count in counts.most_common():
            print(f"  {count:5} {what}")


def _name(path: Path) -> str:
    return f"{path.parent.name}/{path.stem}"[-34:]


def _figures(row: dict[str, int] | Counter[str]) -> str:
    widths = {"lights": 6, "acting": 6, "lost": 4, "signs": 5, "act": 4, "known": 5, "not": 4}
    widths |= {"untold": 6, "places": 6, "wrong": 5}
    return " ".join(f"{row[key]:{width}}" for key, width in widths.items())


def _distinct_files(folders: Sequence[Path]) -> Iterator[Path]:
    """Maps of folders, each content once."""
    seen: set[bytes] = set()
    found = [path for folder in folders for path in sorted(folder.rglob("*.xodr"))]
    for path in [*shipped_maps(), *found]:
        content = path.read_bytes()
        if content not in seen:
            seen.add(content)
            yield path


def _count_map(path: Path) -> Counts:
    odr = parse(path.read_bytes(), file=path.name)
    table = RoadTable.of(odr)
    graph = build_map_graph(odr, name="m", sha256="0", table=table)
    network = build_network(odr, table, graph.walks)
    lights, reasons = _count_lights(odr, table, network)
    signs, unknown, untold = _count_signs(odr, network)
    places, wrong, unclassed = _compare_access(odr, network)
    return Counts(lights, reasons, signs, unknown, untold, places, wrong, unclassed)


def _signals(odr: OpenDrive) -> Iterator[tuple[str, Signal]]:
    for road in odr.roads.values():
        for signal in road.signals:
            yield f"road {shown_id(road.id)} > signal {shown_id(signal.id)}", signal


def _count_lights(
    odr: OpenDrive, table: RoadTable, network: SumoNetwork
) -> tuple[Counter[str], Counter[str]]:
    """Lights of the file, those behind a link of the network's text, and why others are not."""
    lost = set(verify(network.net_xml, odr, table).signals.lost_lights)
    rows = {row.element: row for row in network.report.entries if "> signal " in row.element}
    counts, reasons = Counter[str](), Counter[str]()
    for place, signal in _signals(odr):
        if signal_kind(signal) not in LIGHTS:
            continue
        counts["lights"] += 1
        row = rows.get(place)
        told = row is not None and row.outcome is ElementOutcome.LOST
        if place in lost and not told:
            reasons["not behind a link, and not told"] += 1
        elif told and row is not None:
            reasons[row.reason] += 1
        counts["lost" if place in lost or told else "acting"] += 1
    return counts, reasons


def _count_signs(odr: OpenDrive, network: SumoNetwork) -> tuple[Counter[str], Counter[str], int]:
    """Signs by what is made of them, the types not understood, and how many no row counts."""
    rows = [
        row.element
        for row in network.report.entries
        if "> signal " in row.element and not row.reason.endswith("]")
    ]
    single = set(rows)
    summed = sum(
        int(row.reason.partition(" ")[0])
        for row in network.report.entries
        if row.element.startswith("signals of type")
    )
    counts, unknown = Counter[str](), Counter[str]()
    lights = {place for place, signal in _signals(odr) if signal_kind(signal) in LIGHTS}
    for place, signal in _signals(odr):
        kind = signal_kind(signal)
        if kind in LIGHTS:
            continue
        counts["signs"] += 1
        if kind in ("stop", "yield") or (sign_meaning(signal) == "priority" and place in single):
            counts["act"] += 1
        elif kind == "speed_limit" or sign_meaning(signal):
            counts["known"] += 1
        else:
            counts["not"] += 1
            unknown[f"{signal.country} {signal.type} {signal.subtype}".strip() or "no type"] += 1
    alone = sum(element not in lights for element in rows)
    return counts, unknown, counts["signs"] - alone - summed


def _compare_access(
    odr: OpenDrive, network: SumoNetwork
) -> tuple[int, tuple[str, ...], Counter[str]]:
    """Places on lanes with access, those where SUMO permits others, and access without a class."""
    permitted = {
        str(lane.get("id")): set(str(lane.get("allow")).split())
        for lane in ET.fromstring(network.net_xml).iter("lane")
    }
    lanes, unclassed = network.table, Counter[str]()
    for key in {lanes.lane_keys[interval.lane] for interval in lanes.intervals}:
        if isinstance(key, LaneKey):
            for record in odr.roads[key.road].sections[key.section].lanes[key.lane].access:
                if record.restriction not in WHO and record.restriction != "none":
                    unclassed[f"{record.rule} {record.restriction}"] += 1
    places, wrong = 0, []
    for interval in lanes.intervals:
        key, own = lanes.lane_keys[interval.lane], lanes.lane_list[interval.sumo]
        if not isinstance(key, LaneKey) or own.allowed == {"pedestrian"}:
            continue
        section = odr.roads[key.road].sections[key.section]
        lane = section.lanes[key.lane]
        low, high = sorted((float(interval.s[0]), float(interval.s[-1])))
        if not lane.access or high - low < LEAST_STRETCH:
            continue
        places_beside = (max(low - BESIDE, section.s), min(high + BESIDE, section.s_end))
        ends = [_stated_classes(lane.type, lane.access, s) for s in places_beside]
        for share in (0.02, 0.5, 0.98):
            s = low + share * (high - low)
            places += 1
            stated = _stated_classes(lane.type, lane.access, s)
            if lanes.edges[own.edge].function == "internal":
                # Who passes a junction of SUMO may use the lanes before and behind it.
                stated = stated & ends[0] & ends[1]
            if {name for name in stated if name in permitted[own.id]} != stated or any(
                name in permitted[own.id] for name in EVERYBODY - stated
            ):
                wrong.append(
                    f"road {key.road} > lane {key.lane} at s={s:.1f}: the file has "
                    f"{' '.join(sorted(stated))}, SUMO {' '.join(sorted(permitted[own.id]))}"
                )
    return places, tuple(wrong), unclassed


def _stated_classes(kind: str, access: Sequence[LaneAccess], s: float) -> set[str]:
    """Who may use a lane at s by the file: allowed by name or all, and not denied by name."""
    begun = [record for record in access if record.s <= s + 1e-6]
    holding = [record for record in begun if record.s == begun[-1].s and record.restriction in WHO]
    named = _classes_named(holding, "allow")
    usual = EVERYBODY & (allowed("driving") if kind == "restricted" else allowed(kind))
    if named:
        # Whoever may drive there at all does not keep emergency vehicles out.
        usual = named | ({"emergency"} if named != {"bicycle"} else set())
        usual |= EVERYBODY & allowed(kind) if kind in ("bus", "taxi", "HOV") else set()
    return usual - _classes_named(holding, "deny")


def _classes_named(records: Sequence[LaneAccess], rule: str) -> set[str]:
    return {name for one in records if one.rule == rule for name in WHO[one.restriction]}


if __name__ == "__main__":
    main()
