"""Junction tables that lead nowhere: what is repaired from geometry, and what is not."""

from __future__ import annotations

import pytest

from odscen.base.ids import LaneKey, RoadId
from odscen.opendrive.parse import parse
from odscen.opendrive.topology import DeadEnd, dead_ends, lane_successors
from tests.convert.legs import LENGTH, OPPOSITE, crossing, entry, junction, leg, way
from tests.opendrive.snippets import document, lane, road, section

LEGS = ("1", "2", "3", "4")


def key(road_id: str, lane_id: int = -1) -> LaneKey:
    return LaneKey(RoadId(road_id), 0, lane_id)


def text(first: str, first_entry: str, *more: str) -> str:
    """The crossing with another way straight on from leg 1, and another connection to it."""
    legs = [leg(name) for name in LEGS]
    ways = [way(name) for name in LEGS[1:]]
    entries = [entry(name) for name in LEGS[1:]]
    return document(*legs, first, *ways, *more, junction(first_entry, *entries))


SOUND = parse(text(way("1"), entry("1")))
FAULTS = {
    "a lane that is not there": (way("1"), entry("1", '<laneLink from="-4" to="-1"/>')),
    "a connecting lane that is not there": (way("1"), entry("1", '<laneLink from="-1" to="-7"/>')),
    "no lane link": (way("1"), entry("1", "")),
    "the other sign": (way("1"), entry("1", '<laneLink from="1" to="-1"/>')),
    "no connection": (way("1"), ""),
    "no lane behind": (way("1", links='<link><predecessor id="-1"/></link>'), entry("1")),
    "another sign behind": (way("1", links='<link><successor id="-1"/></link>'), entry("1")),
    "a lane behind that is not there": (
        way("1", links='<link><successor id="5"/></link>'),
        entry("1"),
    ),
    "no road behind": (way("1", successor=" "), entry("1")),
    "the wrong end of the road behind": (
        way("1", successor='<successor elementType="road" elementId="3" contactPoint="start"/>'),
        entry("1"),
    ),
    "the wrong end of the connecting road": (
        way("1"),
        entry("1").replace('contactPoint="start"', 'contactPoint="end"'),
    ),
    "the wrong end of the road before": (
        way("1").replace('elementId="1" contactPoint="end"', 'elementId="1" contactPoint="start"'),
        entry("1"),
    ),
    "a road behind that is not there": (
        way("1", successor='<successor elementType="road" elementId="77" contactPoint="end"/>'),
        entry("1"),
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_faulty_table_leads_where_the_sound_one_does(fault: str) -> None:
    odr = parse(text(*FAULTS[fault]))
    assert lane_successors(odr) == lane_successors(SOUND)
    assert dead_ends(odr) == ()
    notes = [note for note in odr.notes if "[junction-table]" in note]
    assert len(notes) == 1
    assert notes[0].startswith("road 10 > laneSection 0 > lane -1: ")
    assert "0.00 m from it" in notes[0]


def test_a_way_in_two_roads_is_joined_where_its_links_name_them() -> None:
    half = way("1", successor='<successor elementType="road" elementId="11" contactPoint="start"/>')
    half = half.replace('length="20.0"', 'length="10.0"').replace('<successor id="1"/>', "")
    plan = '<geometry s="0" x="0" y="0" hdg="0" length="10"><line/></geometry>'
    rest = road(
        "11",
        length=10.0,
        plan=plan,
        lanes=section(lane(-1, inside='<link><successor id="1"/></link>')),
        link='<predecessor elementType="road" elementId="10" contactPoint="end"/>'
        '<successor elementType="road" elementId="3" contactPoint="end"/>',
        junction="9",
    )
    odr = parse(text(half, entry("1"), rest))
    assert lane_successors(odr)[key("10")] == (key("11"),)
    assert lane_successors(odr)[key("11")] == (key("3", 1),)
    assert dead_ends(odr) == ()


def test_a_sound_map_is_left_alone() -> None:
    assert dead_ends(SOUND) == ()
    assert not any("junction-table" in note for note in SOUND.notes)
    assert lane_successors(SOUND)[key("1")] == (key("10"),)
    assert lane_successors(SOUND)[key("10")] == (key("3", 1),)


def beside(y: float, hdg: float = 0.0) -> str:
    """A road that begins where the way from leg 1 ends, ``y`` metres aside."""
    plan = f'<geometry s="0" x="10" y="{y}" hdg="{hdg}" length="{LENGTH}"><line/></geometry>'
    return road("5", length=LENGTH, plan=plan, lanes=section(lane(-1)))


@pytest.mark.parametrize(
    ("other", "joined"), [(beside(0.9), True), (beside(1.1), False), (beside(0.0, 0.4), False)]
)
def test_lanes_meet_within_a_metre_and_20_degrees(other: str, joined: bool) -> None:
    alone = way("1", successor=" ")
    odr = parse(document(leg("1"), alone, other, junction(entry("1"))))
    assert lane_successors(odr)[key("10")] == ((key("5"),) if joined else ())
    assert (DeadEnd(key("10"), "end", leads=True) in dead_ends(odr)) is not joined


def test_where_two_lanes_meet_one_nothing_is_guessed() -> None:
    odr = parse(text(way("1", successor=" "), entry("1"), beside(0.0)))
    assert dead_ends(odr) == (DeadEnd(key("10"), "end", leads=True),)
    assert not any("junction-table" in note for note in odr.notes)


def test_a_road_that_the_link_does_not_name_is_not_taken() -> None:
    other = '<successor elementType="road" elementId="2" contactPoint="end"/>'
    odr = parse(text(way("1", successor=other, links="<link/>"), entry("1")))
    assert dead_ends(odr) == (DeadEnd(key("10"), "end", leads=True),)


def test_a_lane_that_has_come_to_an_end_is_not_joined() -> None:
    narrow = way("1", links="<link/>").replace('a="3.5" b="0"', 'a="3.5" b="-0.175"')
    odr = parse(text(narrow, entry("1")))
    assert dead_ends(odr) == (DeadEnd(key("10"), "end", leads=True),)


def test_the_whole_crossing_without_any_table_is_repaired() -> None:
    sound = crossing({})
    bare = sound.replace('<laneLink from="-1" to="-1"/>', "").replace(
        '<successor id="1"/>', '<successor id="-9"/>'
    )
    odr = parse(bare)
    assert lane_successors(odr) == lane_successors(parse(sound))
    assert sum("[junction-table]" in note for note in odr.notes) == 2 * len(OPPOSITE)


@pytest.mark.parametrize("linked", [False, True])
def test_a_road_of_a_junction_is_a_plain_road_only_if_nothing_is_linked_to_it(linked: bool) -> None:
    link = '<successor elementType="junction" elementId="5"/>' if linked else ""
    alone, other = road("7", junction="5"), road("8", link=link)
    odr = parse(document(alone, other, '<junction id="5" name="none"/>'))
    assert odr.roads[RoadId("7")].junction == ("5" if linked else None)
    assert any("outside junctions" in note for note in odr.notes) is not linked
