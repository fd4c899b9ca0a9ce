"""Trifles of other writers, each of which reads as the same file without it, and is said."""

from __future__ import annotations

import pytest

from odscen.base.ids import JunctionId, RoadId
from odscen.opendrive.parse import parse
from odscen.opendrive.road_model import LaneAccess, OpenDrive
from tests.opendrive.snippets import document, lane, road, section
from tests.opendrive.test_strangers_files import chain, rules

LIGHT = '<signal id="1" s="50" t="0" type="1000001" dynamic="yes" orientation="+"/>'
TYPES = '<type s="0" type="town"><speed max="14"/></type><type s="50" type="rural"/>'
JUNCTION = (
    '<junction id="5"><connection id="0" incomingRoad="1" connectingRoad="2" contactPoint="start">'
    '<laneLink from="-1" to="-1"/></connection></junction>'
)
SOUND = document(*chain(100.0, 100.0, 100.0, inside=f"{TYPES}<signals>{LIGHT}</signals>"), JUNCTION)
HEADER = '<header revMajor="1" revMinor="6"/>'
FIRST = 'length="100.0" junction="-1"'


def replaced(old: str, new: str, text: str = SOUND, count: int = 1) -> str:
    assert old in text
    return text.replace(old, new, count)


# What stands for what, in all places or the first, and the rule of the note; none: no note.
TRIFLES: dict[str, tuple[str, str, str | None]] = {
    "elementType in capitals": ('elementType="road"', 'elementType="ROAD"', "spelling"),
    "no elementType": ('elementType="road" ', "", "unknown-value"),
    "contactPoint in capitals": ('contactPoint="start"/>', 'contactPoint="START"/>', "spelling"),
    "a contactPoint that is none": (
        'contactPoint="start"/>',
        'contactPoint="begin"/>',
        "missing-contact-point",
    ),
    "a lane id with decimals": ('lane id="-1"', 'lane id="-1.0"', None),
    "a lane type in capitals": ('type="driving"', 'type="Driving"', "spelling"),
    "a lane type with spaces": ('type="driving"', 'type=" driving "', "spelling"),
    "no b, c, d of a width": (' b="0" c="0" d="0"', "", "missing-number"),
    "no sOffset of the first width": ('<width sOffset="0" ', "<width ", "missing-number"),
    "no s of the first section": ('<laneSection s="0.0"', "<laneSection", "missing-number"),
    "no s of the first geometry": ('<geometry s="0.0" ', "<geometry ", "missing-number"),
    "no length of a road": (FIRST, 'junction="-1"', "missing-number"),
    "no length of a geometry": ('hdg="0" length="100.0"', 'hdg="0"', "missing-number"),
    "a width from 1 cm on": ('width sOffset="0"', 'width sOffset="0.01"', "record-order"),
    "a section from 1 cm on": ('laneSection s="0.0"', 'laneSection s="0.01"', "record-order"),
    "a plan view from 1 cm on": ('geometry s="0.0"', 'geometry s="0.01"', "record-order"),
    "two headers": (HEADER, f'{HEADER}<header revMajor="1" revMinor="4"/>', "paint"),
    "no type of traffic rule": (FIRST, f'{FIRST} rule=""', None),
    "a junction of spaces": ('junction="-1"', 'junction=" -1 "', None),
    "an empty list beside a full one": ("<planView>", "<planView/><planView>", None),
    "an empty link beside a full one": ("<link>", "<link/><link>", None),
    "signals in two lists": ("<signals>", "<signals/><signals>", None),
    "a light without t": ('s="50" t="0"', 's="50"', "paint"),
    "a light of no size": ('s="50" t="0"', 's="50" t="0" height="x"', "paint"),
    "a validity of no lane": (
        'orientation="+"/>',
        'orientation="+"><validity fromLane="a" toLane="b"/></signal>',
        "unknown-value",
    ),
    "a dependency on nothing": (
        'orientation="+"/>',
        'orientation="+"><dependency type="limitline"/></signal>',
        None,
    ),
    "types of a road out of order": (
        TYPES,
        '<type s="50" type="rural"/><type s="0" type="town"><speed max="14"/></type>',
        "mark-order",
    ),
    "a type without a place": (TYPES, f'{TYPES}<type type="motorway"/>', "unknown-value"),
    "a controller without a name": (
        '<junction id="5">',
        '<junction id="5"><controller/>',
        "dangling-link",
    ),
    "namespaces": ("<OpenDRIVE>", '<OpenDRIVE xmlns="http://code.asam.net/x">', None),
    "comments anywhere": ("<lanes>", "<!-- a --><lanes><!-- b -->", None),
}


def same_map(one: OpenDrive, other: OpenDrive) -> bool:
    return (one.roads, one.junctions, one.controllers) == (
        other.roads,
        other.junctions,
        other.controllers,
    )


@pytest.mark.parametrize("everywhere", [False, True])
@pytest.mark.parametrize("trifle", TRIFLES)
def test_a_trifle_reads_as_the_file_without_it(trifle: str, everywhere: bool) -> None:
    old, new, rule = TRIFLES[trifle]
    odr = parse(replaced(old, new, count=-1 if everywhere else 1))
    sound = parse(SOUND)
    if everywhere and trifle == "a contactPoint that is none":
        return  # then no end links back, and no link is left
    assert same_map(odr, sound)
    noted = set(rules(odr)) - set(rules(sound))
    assert (rule in noted) if rule else not noted


@pytest.mark.parametrize(
    ("data", "noted"),
    [
        (SOUND.encode(), []),
        (SOUND.replace("?>", ' encoding="utf-8"?>', 1).encode(), []),
        (b"\xef\xbb\xbf" + SOUND.encode(), []),
        (SOUND.encode("utf-16"), []),
        (SOUND.replace("?>", ' encoding="UTF-16"?>', 1).encode(), ["encoding"]),
        (SOUND.replace("?>", " encoding='utf-16' standalone='yes'?>", 1).encode(), ["encoding"]),
        (b"\xef\xbb\xbf" + SOUND.replace("?>", ' encoding="utf-16"?>', 1).encode(), ["encoding"]),
        (SOUND.replace("?>", ' encoding="windows-1252"?>', 1).encode("cp1252"), []),
        (SOUND.replace('<?xml version="1.0"?>', "").encode(), []),
        (b"\r\n" + SOUND.encode(), ["leading-space"]),
        (b"<!-- a licence -->\n" + SOUND.encode(), ["leading-space"]),
        (b"\xef\xbb\xbf<!-- a\n<?xml -->\n <!----> " + SOUND.encode(), ["leading-space"]),
        (SOUND.encode().replace(b"?>", b"?><!-- a licence -->", 1), []),
    ],
)
def test_a_file_is_read_whatever_its_declaration_says(data: bytes, noted: list[str]) -> None:
    odr = parse(data)
    assert same_map(odr, parse(SOUND))
    assert [rule for rule in rules(odr) if rule not in rules(parse(SOUND))] == noted


@pytest.mark.parametrize("declared", ["", ' encoding="UTF-8"', ' encoding="utf8"'])
def test_names_in_the_letters_of_windows_are_read(declared: str) -> None:
    named = replaced(FIRST, f'{FIRST} name="Straße"').replace("?>", f"{declared}?>", 1)
    odr = parse(named.encode("cp1252"))
    assert odr.roads[RoadId("1")].name == "Straße"
    assert rules(odr)[0] == "encoding"


@pytest.mark.parametrize("link", ['id="x"', 'id="4711"', 'id="1.5"', 'id=" "'])
def test_a_link_to_no_lane_costs_only_itself(link: str) -> None:
    odr = parse(replaced('<successor id="-1"/>', f"<successor {link}/>"))
    assert list(odr.roads) == ["1", "2", "3"]
    assert odr.roads[RoadId("1")].sections[0].lanes[-1].successors == ()
    assert "dangling-link" in rules(odr)


def test_two_junctions_of_one_id_are_one_with_the_connections_of_both() -> None:
    more = JUNCTION.replace('from="-1" to="-1"', 'from="1" to="1"')
    odr = parse(SOUND.replace("</OpenDRIVE>", f"{more}</OpenDRIVE>"))
    found = odr.junctions[JunctionId("5")].connections
    assert [one.lane_links for one in found] == [((-1, -1),), ((1, 1),)]
    assert "repeated-element" in rules(odr)


def test_a_junction_without_an_id_costs_its_connections() -> None:
    odr = parse(replaced('<junction id="5">', "<junction>"))
    assert (len(odr.roads), odr.junctions) == (3, {})
    assert "connection-left-out" in rules(odr)


def test_speeds_that_contradict_each_other_are_not_given() -> None:
    odr = parse(replaced('<speed max="14"/>', '<speed max="14"/><speed max="20"/>'))
    assert odr.roads[RoadId("1")].types[0].speed is None
    assert "speed" in rules(odr)


def own_access(inside: str) -> tuple[tuple[tuple[float, str, str], ...], list[str]]:
    odr = parse(document(road(lanes=section(lane(-1, inside=inside)))))
    found = odr.roads[RoadId("1")].sections[0].lanes[-1].access
    assert all(isinstance(one, LaneAccess) for one in found)
    return tuple(tuple(one) for one in found), rules(odr)


@pytest.mark.parametrize(
    ("inside", "found", "noted"),
    [
        ('<access sOffset="0" rule="Allow" restriction="bus"/>', "allow bus", ["spelling"]),
        ('<access restriction="BUS" rule="allow" sOffset="0"/>', "allow bus", ["spelling"]),
        ('<access rule="deny" restriction="trucks"/>', "deny trucks", []),
        (
            '<access sOffset="0" rule="allow" restriction="bus taxi"/>',
            "allow bus, allow taxi",
            ["spelling"],
        ),
        (
            '<access sOffset="0" rule="allow" restriction="bus,HOV;bicycle"/>',
            "allow bus, allow HOV, allow bicycle",
            ["spelling"],
        ),
        (
            '<access sOffset="0" rule="deny" restriction="autonomous traffic"/>',
            "deny autonomousTraffic",
            ["spelling"],
        ),
        (
            '<access sOffset="0" rule="allow" restriction="passenger_car"/>',
            "allow passengerCar",
            ["spelling"],
        ),
        ('<access sOffset="0" rule="allow" restriction="my bus"/>', "allow my bus", []),
        ('<access sOffset="0" rule="maybe" restriction="bus"/>', " bus", ["unknown-value"]),
        ('<access sOffset="0" rule="allow"/>', "", ["access-left-out"]),
        ('<access sOffset="x" rule="allow" restriction="bus"/>', "", ["access-left-out"]),
        (
            '<access sOffset="0" rule="allow"><restriction type="Taxi"/><restriction type="bus"/>'
            "</access>",
            "allow taxi, allow bus",
            ["spelling"],
        ),
    ],
)
def test_access_is_read_in_the_forms_that_writers_have(
    inside: str, found: str, noted: list[str]
) -> None:
    records, told = own_access(inside)
    assert ", ".join(f"{rule} {name}" for _, rule, name in records) == found
    assert told == noted


def test_access_out_of_order_holds_from_its_place_to_the_next() -> None:
    later = '<access sOffset="50" rule="allow" restriction="bus"/>'
    first = '<access sOffset="0" rule="deny" restriction="truck"/>'
    records, told = own_access(later + first)
    assert records == ((0.0, "deny", "truck"), (50.0, "allow", "bus"))
    assert told == ["mark-order"]


@pytest.mark.parametrize("tag", ["speed", "height"])
def test_speeds_and_heights_of_a_lane_are_put_in_order(tag: str) -> None:
    value = {"speed": 'max="{}"', "height": 'inner="{}" outer="0"'}[tag]
    inside = "".join(
        f'<{tag} sOffset="{s}" {value.format(given)}/>' for s, given in ((40, 10), (0, 20))
    )
    odr = parse(document(road(lanes=section(lane(-1, inside=inside)))))
    own = odr.roads[RoadId("1")].sections[0].lanes[-1]
    found = own.speeds if tag == "speed" else own.heights
    assert [tuple(one)[:2] for one in found] == [(0.0, 20.0), (40.0, 10.0)]
    assert rules(odr) == ["mark-order"]
