"""What netconvert is given and asked for; why: ``docs/decisions/0005-two-converters.md``."""

from __future__ import annotations

import math
from typing import NamedTuple

from lxml import etree

from odscen.base.errors import InputError, LimitError, OpenDriveError
from odscen.base.xml_reading import read_xml
from odscen.convert.model.conversion_report import ElementOutcome, ReportEntry
from odscen.opendrive.road_model import DRIVABLE_TYPES, WALKABLE_TYPES

TYPES_FILE = "types.typ.xml"

_NO_CAR = (
    "pedestrian tram rail_urban rail rail_electric rail_fast ship container cable_car subway "
    "aircraft wheelchair scooter drone"
)
_MOTORWAY_TYPES = frozenset({"onRamp", "offRamp", "connectingRamp", "mwyEntry", "mwyExit", "HOV"})
_RESERVED = {"bus": "bus coach emergency", "taxi": "taxi emergency"}
_CLOSED_TYPES = frozenset(
    {"none", "shoulder", "border", "median", "curb", "stop", "restricted", "parking"}
    | {"bidirectional", "special1", "special2", "special3", "roadWorks", "tram", "rail"}
)

_SAME_S = 1e-6


class RecipeStep(NamedTuple):
    """Options, and what they give up compared with the step before."""

    gives_up: str
    options: tuple[str, ...]


def lane_types() -> str:
    """Permissions by OpenDRIVE lane type, as netconvert's type file.

    Motor vehicles and bicycles on drivable lanes, no bicycles on motorway ramps, pedestrians on
    walkable lanes, bicycles on ``biking``. All others are closed: netconvert then keeps such a lane
    only where it separates others, open to no road user.
    """
    names = sorted(DRIVABLE_TYPES | WALKABLE_TYPES | _CLOSED_TYPES | {"biking"})
    lines = (f'    <type id="{name}" {_lane_type(name)}/>' for name in names)
    return "\n".join(["<types>", *lines, "</types>", ""])


def _lane_type(name: str) -> str:
    if name in WALKABLE_TYPES:
        return 'priority="-2" speed="2.78" width="2.50" allow="pedestrian"'
    if name == "biking":
        return 'priority="-1" speed="5.56" width="1.50" allow="bicycle"'
    if name in _RESERVED:
        return f'priority="1" speed="13.89" width="3.65" allow="{_RESERVED[name]}"'
    if name in _MOTORWAY_TYPES:
        return f'priority="1" speed="22.22" width="3.65" disallow="bicycle moped {_NO_CAR}"'
    if name in DRIVABLE_TYPES:
        return f'priority="1" speed="13.89" width="3.65" disallow="{_NO_CAR}"'
    return 'priority="0" speed="1.39" width="1.00" disallow="all" discard="true"'


def recipe(*, lefthand: bool) -> tuple[RecipeStep, ...]:
    """Options to try one after the other until netconvert manages, the best first."""
    common = (
        "--precision=4",
        "--no-turnarounds",
        "--output.original-names",
        "--aggregate-warnings=5",
        "--xml-validation=never",
        *(("--lefthand",) if lefthand else ()),
    )
    lanes = ("--opendrive.import-all-lanes", f"--type-files={TYPES_FILE}")
    walks = (
        "--crossings.guess",
        "--crossings.guess.speed-threshold=100",
        "--default.crossing-width=2",
        "--junctions.endpoint-shape",
    )
    fine, coarse = "--opendrive.curve-resolution=0.5", "--opendrive.curve-resolution=2.0"
    return (
        RecipeStep("", (*common, *lanes, *walks, fine)),
        RecipeStep("curves are sampled every 2 m", (*common, *lanes, *walks, coarse)),
        RecipeStep("no crossings are made", (*common, *lanes, coarse)),
        RecipeStep("only driving lanes are converted", (*common, coarse)),
    )


def with_lane_limits(xodr: bytes) -> tuple[bytes, tuple[ReportEntry, ...]]:
    """Write the limits of road types into the lanes: netconvert reads limits of lanes only.

    Raises
    ------
    OpenDriveError
        If the text is not XML.
    """
    try:
        root = read_xml(xodr, huge=True)
    except LimitError:
        raise
    except InputError as error:
        raise OpenDriveError(error.problem) from error
    entries: list[ReportEntry] = []
    count = sum(_limit_lanes(road, entries) for road in root.iter("{*}road"))
    if not count:
        return xodr, ()
    reason = f"limits of {count} roads given to netconvert as those of their lanes"
    entries.insert(0, ReportEntry(ElementOutcome.REPAIRED, "map", reason))
    return etree.tostring(root, encoding="utf-8", xml_declaration=True), tuple(entries)


def _limit_lanes(road: etree._Element, entries: list[ReportEntry]) -> bool:
    """Give the lanes of a road its limits; whether it has any."""
    types = [
        (_read_number(kind, "s"), next(kind.iterchildren("{*}speed"), None))
        for kind in road.iterchildren("{*}type")
    ]
    limits = [
        (s, limit) for s, limit in types if limit is not None and _read_number(limit, "max") > 0
    ]
    if not limits:
        return False
    sections = list(road.iter("{*}laneSection"))
    starts = [_read_number(section, "s") for section in sections]
    for section, start in zip(sections, starts, strict=True):
        here = [limit for s, limit in limits if s <= start + _SAME_S] or [limits[0][1]]
        for lane in section.iter("{*}lane"):
            if lane.get("type") in DRIVABLE_TYPES and lane.find("{*}speed") is None:
                _insert_limit(lane, here[-1])
    for s, _ in limits:
        if s > _SAME_S and not any(abs(s - start) <= _SAME_S for start in starts):
            element = f"road {road.get('id', '?')} > type s={s:g}"
            reason = "netconvert changes limits only where a section begins"
            entries.append(ReportEntry(ElementOutcome.LOST, element, reason))
    return True


def _read_number(element: etree._Element, name: str) -> float:
    try:
        return float(element.get(name, ""))
    except ValueError:
        return math.nan


def _insert_limit(lane: etree._Element, limit: etree._Element) -> None:
    name = etree.QName(etree.QName(lane).namespace, "speed")
    attributes = {"sOffset": "0", "max": limit.get("max", ""), "unit": limit.get("unit", "m/s")}
    etree.SubElement(lane, name, attributes)
