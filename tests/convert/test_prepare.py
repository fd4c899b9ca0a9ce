from __future__ import annotations

import pytest
from lxml import etree

from odscen.convert.prepare import prepare_for_netconvert
from odscen.convert.report import Fate
from odscen.errors import OpenDriveError
from tests.opendrive.snippets import document, lane, road, section


def prepared(text: str) -> tuple[etree._Element, list[str]]:
    content, entries = prepare_for_netconvert(text.encode())
    return etree.fromstring(content), [f"{entry.element}: {entry.reason}" for entry in entries]


def test_a_file_that_needs_nothing_is_passed_on_byte_by_byte() -> None:
    text = document(road()).encode()
    assert prepare_for_netconvert(text) == (text, ())


def test_an_empty_signal_type_gets_the_code_for_none() -> None:
    signals = '<signals><signal id="3" s="1" t="0" type="" subtype=""/></signals>'
    text = document(road(inside=signals))
    root, notes = prepared(text)
    assert [signal.attrib["type"] for signal in root.iter("signal")] == ["-1"]
    assert notes == ["road 1 > signal 3: empty type given to netconvert as -1"]


def test_an_arc_of_curvature_zero_becomes_a_line() -> None:
    plan = '<geometry s="0" x="0" y="0" hdg="0" length="100"><arc curvature="0.0"/></geometry>'
    root, notes = prepared(document(road(plan=plan)))
    assert [child.tag for child in root.find("road/planView/geometry")] == ["line"]  # type: ignore[union-attr]
    assert notes[0].startswith("road 1 > planView > geometry s=0: ")


def test_a_curved_arc_stays() -> None:
    plan = '<geometry s="0" x="0" y="0" hdg="0" length="9"><arc curvature="0.01"/></geometry>'
    text = document(road(plan=plan)).encode()
    assert prepare_for_netconvert(text) == (text, ())


def test_limits_of_road_types_are_written_into_drivable_lanes() -> None:
    kind = '<type s="0" type="town"><speed max="25" unit="mph"/></type>'
    lanes = section(lane(-1), lane(-2, kind="sidewalk"), s=0.0) + section(lane(-1), s=50.0)
    root, notes = prepared(document(road(inside=kind, lanes=lanes)))
    speeds = {
        (found.getparent().get("id"), found.get("max"), found.get("unit"))  # type: ignore[union-attr]
        for found in root.iterfind("road/lanes//speed")
    }
    assert speeds == {("-1", "25", "mph")}
    assert len(root.findall("road/lanes//speed")) == 2
    assert notes == [
        "map: limits of the types of 1 roads given to netconvert as those of the lanes"
    ]


def test_a_limit_of_the_lane_itself_stays() -> None:
    kind = '<type s="0" type="town"><speed max="25" unit="mph"/></type>'
    own = lane(-1, inside='<speed sOffset="0" max="7" unit="m/s"/>')
    root, _ = prepared(document(road(inside=kind, lanes=section(own))))
    assert [speed.get("max") for speed in root.iterfind("road/lanes//speed")] == ["7"]


def test_a_limit_that_changes_inside_a_section_is_reported_as_lost() -> None:
    kinds = (
        '<type s="0" type="town"><speed max="10"/></type>'
        '<type s="40" type="town"><speed max="5"/></type>'
    )
    _, entries = prepare_for_netconvert(document(road(inside=kinds)).encode())
    assert (Fate.LOST, "road 1 > type s=40") in [entry[:2] for entry in entries]


def direct_junction() -> str:
    junction = (
        '<junction id="9" name="" type="direct">'
        '<connection id="0" incomingRoad="1" linkedRoad="2" contactPoint="start">'
        '<laneLink from="1" to="1"/><laneLink from="-1" to="-1"/></connection></junction>'
    )
    leads_in = '<successor elementType="junction" elementId="9"/>'
    leads_out = '<predecessor elementType="junction" elementId="9"/>'
    return document(road("1", link=leads_in), road("2", link=leads_out), junction)


def test_a_direct_junction_gets_one_connecting_road_per_connection() -> None:
    root, notes = prepared(direct_junction())
    made = root.find("road[@junction='9']")
    assert made is not None
    links = [(link.tag, link.get("elementId"), link.get("contactPoint")) for link in made[0]]
    assert links == [("predecessor", "1", "end"), ("successor", "2", "start")]
    assert [found.get("id") for found in made.iter("lane")] == ["1", "0", "-1"]
    connection = root.find("junction/connection")
    assert connection is not None
    assert connection.get("connectingRoad") == made.get("id")
    assert connection.get("linkedRoad") is None
    assert notes == [
        "junction 9: direct junction given to netconvert with 1 connecting roads of 0.01 m"
    ]


def test_a_made_road_takes_no_id_that_is_there() -> None:
    text = direct_junction().replace("</OpenDRIVE>", f"{road('9.0')}</OpenDRIVE>")
    root, _ = prepared(text)
    ids = [found.get("id") for found in root.iter("road")]
    assert len(ids) == len(set(ids)) == 4


def test_what_is_not_xml_is_refused() -> None:
    with pytest.raises(OpenDriveError, match="not XML"):
        prepare_for_netconvert(b"<OpenDRIVE>")


def test_entities_are_not_expanded() -> None:
    text = '<!DOCTYPE O [<!ENTITY a "boom">]>' + document(road()).split("?>", 1)[1].replace(
        "<link>", "<link>&a;"
    )
    content, _ = prepare_for_netconvert(text.encode())
    assert b"&a;" in content
