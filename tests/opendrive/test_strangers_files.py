"""Faults of files from many writers that must not cost their owner the map."""

from __future__ import annotations

import copy

import numpy as np
import pytest
from lxml import etree

from odscen.base.errors import OpenDriveError
from odscen.base.ids import JunctionId, LaneKey, RoadId
from odscen.convert.building.network import build_network
from odscen.convert.model.conversion_report import ElementOutcome, parser_entries
from odscen.lanegraph.build_graphs import build_map_graph
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.objects import crosswalks
from odscen.opendrive.parse import parse
from odscen.opendrive.road_model import OpenDrive
from odscen.opendrive.topology import lane_successors
from tests.opendrive.snippets import LANES, LINE, document, lane, road, section

LINK = '<{} elementType="road" elementId="{}" contactPoint="{}"/>'
BOTH_LINKS = '<link><predecessor id="{0}"/><successor id="{0}"/></link>'
ALONG = section(lane(1, inside=BOTH_LINKS.format(1)), lane(-1, inside=BOTH_LINKS.format(-1)))


def line(x: float, length: float, *, s: float = 0.0, y: float = 0.0) -> str:
    return f'<geometry s="{s!r}" x="{x!r}" y="{y!r}" hdg="0" length="{length!r}"><line/></geometry>'


def chain(*lengths: float, more: str = "", inside: str = "") -> list[str]:
    """Roads 1, 2, ... one behind the other along the x axis, linked both ways."""
    roads, x = [], 0.0
    for number, length in enumerate(lengths, start=1):
        link = LINK.format("predecessor", number - 1, "end") if number > 1 else ""
        if number < len(lengths):
            link += LINK.format("successor", number + 1, "start")
        plan = line(x, length)
        given = {"plan": plan, "lanes": ALONG, "link": link, "more": more, "inside": inside}
        roads.append(road(str(number), length=length, **given))
        x += length
    return roads


def rules(odr: OpenDrive) -> list[str]:
    return [note.rpartition("[")[2].removesuffix("]") for note in odr.notes]


def test_a_controller_for_each_node_of_a_joint_light_is_one_that_controls_all() -> None:
    signals = "".join(
        f'<signal id="{n}" s="9" t="0" type="1000001" dynamic="yes" orientation="+"/>'
        for n in (1, 2)
    )
    controllers = "".join(
        f'<controller id="J"><control signalId="{n}"/><control signalId="1"/></controller>'
        for n in (1, 2)
    )
    odr = parse(document(road(inside=f"<signals>{signals}</signals>"), controllers))
    assert odr.controllers["J"].controls == (("1", ""), ("2", ""))
    assert rules(odr) == ["repeated-controller"]


@pytest.mark.parametrize(
    "more", ['width="normal"', 'width=""', 'width="nan"', 'sOffset="x"', 'laneChange="maybe"']
)
def test_what_only_paints_never_refuses_a_map(more: str) -> None:
    kind = "" if "type" in more else 'type="solid"'
    mark = f"<roadMark {kind} {more}/>"
    plain = parse(document(road(lanes=section(lane(-1)))))
    odr = parse(document(road(lanes=section(lane(-1, inside=mark)))))
    assert odr.roads[RoadId("1")].geometry == plain.roads[RoadId("1")].geometry
    if more != 'width=""':
        assert len(odr.notes) == 1


def test_a_mark_without_a_type_and_bounds_that_are_no_numbers_are_noted() -> None:
    text = document(road(lanes=section(lane(-1, inside='<roadMark sOffset="0"/>'))))
    odr = parse(text.replace("<header", '<header north="far"'))
    assert odr.header.north is None
    assert rules(odr) == ["paint", "paint"]


def test_a_road_of_no_length_between_two_others_keeps_them_joined() -> None:
    first, point, last = chain(100.0, 0.0, 100.0)
    odr = parse(document(first, point, last))
    assert rules(odr) == ["point-road"]
    assert odr.roads[RoadId("2")].length == 0.001
    table = RoadTable.of(odr)
    graph = build_map_graph(odr, name="m", sha256="0", table=table)
    network = build_network(odr, table, graph.walks)
    assert network.report.figures["connections"] == 2.0


def test_one_bad_road_at_the_rim_is_left_out_and_the_others_stay() -> None:
    roads = chain(100.0, 100.0, 100.0)
    torn = roads[2].replace('a="3.5"', 'a="wide"')
    odr = parse(document(*roads[:2], torn))
    assert list(odr.roads) == ["1", "2"]
    assert odr.notes[0] == (
        "road 3 > laneSection 0 > lane 1 > width 0: a='wide' is not a number; "
        "the road is left out [road-left-out]"
    )
    (entry, *_) = parser_entries(odr.notes)
    assert entry.outcome is ElementOutcome.LOST


@pytest.mark.parametrize(
    "damage",
    [
        ('length="100.0" junction', 'length="0" junction'),
        ('a="3.5"', 'a="-3.5"'),
        ("<line/>", "<bezier/>"),
        ("<line/>", '<arc curvature="50"/>'),
    ],
)
def test_a_bad_road_that_nothing_is_linked_to_costs_only_itself(damage: tuple[str, str]) -> None:
    alone = road("9", plan=line(0.0, 100.0, y=50.0), lanes=ALONG).replace(*damage)
    odr = parse(document(*chain(100.0, 100.0), alone))
    assert list(odr.roads) == ["1", "2"]
    assert "road-left-out" in rules(odr)


def test_a_bad_road_that_joins_others_is_refused_with_the_reason() -> None:
    roads = chain(100.0, 100.0, 100.0)
    roads[1] = roads[1].replace("<line/>", "<bezier/>")
    with pytest.raises(OpenDriveError) as caught:
        parse(document(*roads))
    assert str(caught.value) == (
        "road 2 > geometry 0: <bezier> is no known shape; "
        "without this road others fall into 2 parts"
    )


def test_more_than_a_tenth_of_bad_roads_is_refused_with_their_number() -> None:
    roads = chain(*[100.0] * 12)
    bad = [*roads[:10], *(one.replace("<line/>", "<bezier/>") for one in roads[10:])]
    with pytest.raises(OpenDriveError, match="2 of 12 roads cannot be read"):
        parse(document(*bad))


def test_a_width_of_ten_centimetres_below_zero_counts_as_none() -> None:
    narrow = lane(-1, inside='<width sOffset="0" a="3.5" b="-0.036" c="0" d="0"/>').replace(
        '<width sOffset="0" a="3.5" b="0" c="0" d="0"/>', ""
    )
    odr = parse(document(road(lanes=section(narrow))))
    table = RoadTable.of(odr)
    assert (
        table.lane_width(np.array([table.lane_index[table.lane_keys[0]]]), np.array([100.0])) == 0
    )
    assert rules(odr) == ["negative-width"]


def test_links_that_name_nothing_are_left_out() -> None:
    inside = '<link><predecessor/><successor id=""/></link>'
    odr = parse(document(road(link="<predecessor/>", lanes=section(lane(-1, inside=inside)))))
    own = odr.roads[RoadId("1")]
    assert own.predecessor is None
    assert own.sections[0].lanes[-1].predecessors == own.sections[0].lanes[-1].successors == ()
    assert rules(odr) == ["dangling-link"] * 3


@pytest.mark.parametrize(
    "header", ["<header/>", '<header revMajor="1"/>', '<header revMinor="x"/>']
)
def test_a_header_without_a_revision_is_read_as_a_file_without_header_is(header: str) -> None:
    text = document(road()).replace('<header revMajor="1" revMinor="6"/>', header)
    odr = parse(text)
    assert (odr.header.rev_major, odr.header.rev_minor) == (1, 4)
    assert set(rules(odr)) == {"version"}


@pytest.mark.parametrize("space", [" ", "\n\n", "\r\n\t"])
def test_white_space_before_the_declaration_is_skipped(space: str) -> None:
    text = space + document(road())
    for given in (text, text.encode(), b"\xef\xbb\xbf" + text.encode()):
        odr = parse(given)
        assert list(odr.roads) == ["1"]
        assert rules(odr) == ["leading-space"]
    assert parse(document(road())).notes == parse("\ufeff" + document(road())).notes[1:]


def test_a_lane_on_the_wrong_side_lies_where_its_id_says() -> None:
    odr = parse(document(road(lanes=LANES.replace('id="1"', 'id="-2"'))))
    assert list(odr.roads[RoadId("1")].sections[0].lanes) == [0, -1, -2]
    assert rules(odr) == ["lane-side"]
    assert "lane -2 is in <left>; by the sign of its id it lies on the right" in odr.notes[0]


@pytest.mark.parametrize(
    ("unit", "speed"),
    [
        ("kmh", 50 / 3.6),
        ("KM/H", 50 / 3.6),
        ("KMH", 50 / 3.6),
        ("kph", 50 / 3.6),
        ("MPH", 50 * 0.44704),
        ("mi/h", 50 * 0.44704),
        ("M/S", 50.0),
        ("mps", 50.0),
    ],
)
def test_units_of_speed_are_read_in_any_spelling(unit: str, speed: float) -> None:
    kind = f'<type s="0" type="town"><speed max="50" unit="{unit}"/></type>'
    odr = parse(document(road(inside=kind)))
    assert odr.roads[RoadId("1")].types[0].speed == pytest.approx(speed)
    assert rules(odr) == ["spelling"]


@pytest.mark.parametrize("given", ['max="3" unit="knots"', 'max="fast"', 'max="-1"'])
def test_a_speed_that_is_not_understood_is_not_given(given: str) -> None:
    odr = parse(document(road(inside=f'<type s="0" type="town"><speed {given}/></type>')))
    assert odr.roads[RoadId("1")].types[0].speed is None
    assert rules(odr) == ["speed"]


def test_a_contact_point_is_that_of_the_end_that_links_back() -> None:
    first, last = chain(100.0, 100.0)
    odr = parse(document(first.replace('contactPoint="start"', ""), last))
    link = odr.roads[RoadId("1")].successor
    assert link is not None
    assert link.contact_point == "start"
    assert rules(odr) == ["missing-contact-point"]


def test_a_connection_without_contact_point_has_that_of_the_connecting_roads_link() -> None:
    inner = road(
        "7",
        length=20.0,
        plan=line(100.0, 20.0),
        lanes=ALONG,
        junction="5",
        link=LINK.format("predecessor", "1", "end") + LINK.format("successor", "2", "start"),
    )
    leg = '<{} elementType="junction" elementId="5"/>'
    first = road("1", lanes=ALONG, link=leg.format("successor"))
    last = road("2", plan=line(120.0, 100.0), lanes=ALONG, link=leg.format("predecessor"))
    table = (
        '<junction id="5"><connection id="0" incomingRoad="1" connectingRoad="7">'
        '<laneLink from="-1" to="-1"/><laneLink from="-1"/></connection>'
        '<connection id="1" incomingRoad="2" connectingRoad="7"><laneLink from="1" to="1"/>'
        '</connection><connection id="2" incomingRoad="2"/></junction>'
    )
    odr = parse(document(first, last, inner, table))
    found = odr.junctions[JunctionId("5")].connections
    assert [(one.incoming_road, one.contact_point) for one in found] == [
        ("1", "start"),
        ("2", "end"),
    ]
    assert rules(odr) == ["missing-contact-point", "connection-left-out"] * 2


def test_a_plan_view_that_ends_where_the_next_road_begins_holds_against_the_length() -> None:
    first, last = chain(100.0, 100.0)
    for wrong in (80.0, 150.0):
        odr = parse(
            document(first.replace('length="100.0" junction', f'length="{wrong}" junction'), last)
        )
        assert odr.roads[RoadId("1")].length == 100.0
        assert odr.roads[RoadId("1")].sections[-1].s_end == 100.0
        assert rules(odr) == ["road-length"]


@pytest.mark.parametrize(("drawn", "shape"), [(60.0, 2), (130.0, 1)])
def test_a_length_that_the_next_road_confirms_holds_against_the_plan_view(
    drawn: float, shape: int
) -> None:
    first, last = chain(100.0, 100.0)
    plan = line(0.0, 100.0)
    odr = parse(document(first.replace(plan, line(0.0, drawn)), last))
    own = odr.roads[RoadId("1")]
    assert own.length == 100.0
    assert len(own.geometry) == shape
    assert sum(one.length for one in own.geometry) == pytest.approx(100.0)


def test_a_lone_road_has_the_shorter_of_its_length_and_its_plan_view() -> None:
    assert parse(document(road(length=120.0))).roads[RoadId("1")].length == 100.0
    short = parse(document(road(length=70.0))).roads[RoadId("1")]
    assert (short.length, short.geometry[0].length) == (70.0, 70.0)


def test_a_road_whose_length_nothing_confirms_is_left_out_with_both_readings() -> None:
    first, last = chain(100.0, 100.0)
    first = first.replace('length="100.0" junction', 'length="160" junction')
    odr = parse(document(first, last.replace('x="100.0"', 'x="130.0"')))
    assert list(odr.roads) == ["2"]
    assert odr.notes[0] == (
        "road 1 > geometry 0: the plan view ends at s=100, but the road's length is 160; no road "
        "that is linked there shows which one holds; the road is left out [road-left-out]"
    )


def test_a_geometry_that_steps_back_by_eleven_millimetres_is_taken() -> None:
    plan = line(0.0, 50.0) + line(50.0, 0.011, s=50.0) + line(49.989, 50.011, s=49.989)
    odr = parse(document(road(plan=plan)))
    assert len(odr.roads[RoadId("1")].geometry) == 2
    assert rules(odr) == ["record-order", "plan-view-s"]


def test_a_crosswalk_whose_corners_have_no_height_lies_on_the_road() -> None:
    corners = "".join(
        f'<cornerLocal u="{u}" v="{v}"/>' for u, v in ((-2, -3), (2, -3), (2, 3), (-2, 3))
    )
    item = f'<object id="1" type="crosswalk" s="50" t="0"><outline>{corners}</outline></object>'
    odr = parse(document(road(inside=f"<objects>{item}</objects>")))
    (found,) = crosswalks(odr, RoadTable.of(odr))
    assert (found.z, found.width) == (0.0, pytest.approx(4.0))
    assert rules(odr) == ["unknown-value"] * 4


def test_a_signal_that_cannot_be_placed_is_lost_and_the_others_stay() -> None:
    signals = '<signal id="1" s="far" t="0" type="206"/><signal id="2" s="9" t="0" value="x"/>'
    odr = parse(document(road(inside=f"<signals>{signals}</signals>")))
    (signal,) = odr.roads[RoadId("1")].signals
    assert (signal.id, signal.value) == ("2", None)
    outcomes = [entry.outcome for entry in parser_entries(odr.notes)]
    assert outcomes == [ElementOutcome.LOST, ElementOutcome.REPAIRED]


def test_traffic_rules_are_read_in_any_case() -> None:
    odr = parse(document(road(more='rule="lht"')))
    assert odr.roads[RoadId("1")].rule == "LHT"
    assert rules(odr) == ["spelling"]


def test_a_plain_file_has_no_notes() -> None:
    assert parse(document(*chain(100.0, 100.0))).notes == ()
    assert LINE in document(road())


@pytest.mark.parametrize("stated", ["both", "behind", "before"])
def test_a_lane_link_that_one_side_states_is_kept_and_reported(stated: str) -> None:
    first, last = chain(100.0, 100.0)
    if stated == "behind":
        first = first.replace('<successor id="-1"/>', "").replace('<successor id="1"/>', "")
    if stated == "before":
        last = last.replace('<predecessor id="-1"/>', "").replace('<predecessor id="1"/>', "")
    odr = parse(document(first, last))
    table = RoadTable.of(odr)
    graph = build_map_graph(odr, name="m", sha256="0", table=table)
    network = build_network(odr, table, graph.walks)
    assert network.report.figures["connections"] == 2.0
    told = [
        entry.element for entry in network.report.entries if "alone states the link" in entry.reason
    ]
    assert (
        told
        == {
            "both": [],
            "behind": ["road 1 > laneSection 0 > lane -1"],
            "before": ["road 2 > laneSection 0 > lane 1"],
        }[stated]
    )


PREDECESSOR, SUCCESSOR = LINK.format("predecessor", 1, "end"), LINK.format("successor", 2, "start")
INNER = road(
    "7",
    length=20.0,
    plan=line(100.0, 20.0),
    lanes=ALONG,
    junction="5",
    link=LINK.format("predecessor", "1", "end") + LINK.format("successor", "2", "start"),
)
TO_JUNCTION = '<{} elementType="junction" elementId="5"/>'
LEGS = (
    road("1", lanes=ALONG, link=TO_JUNCTION.format("successor")),
    road("2", plan=line(120.0, 100.0), lanes=ALONG, link=TO_JUNCTION.format("predecessor")),
)


def connection(number: int, road_id: str, contact: str, links: str) -> str:
    return (
        f'<connection id="{number}" incomingRoad="{road_id}" connectingRoad="7" '
        f'contactPoint="{contact}">{links}</connection>'
    )


THERE = connection(0, "1", "start", '<laneLink from="-1" to="-1"/>')
BACK = connection(1, "2", "end", '<laneLink from="1" to="1"/>')
BARE = connection(0, "1", "start", "") + connection(1, "2", "end", "")
BOTH_WAYS = {"12", "21"}

# Roads and what is in the junction, with the ways that traffic has between roads 1 and 2.
ONE_SIDED: dict[str, tuple[tuple[str, ...], str | None, set[str]]] = {
    "both say it": (tuple(chain(100.0, 100.0)), None, BOTH_WAYS),
    "the road behind alone": (
        (chain(100.0, 100.0)[0].replace(SUCCESSOR, ""), chain(100.0, 100.0)[1]),
        None,
        BOTH_WAYS,
    ),
    "the road before alone": (
        (chain(100.0, 100.0)[0], chain(100.0, 100.0)[1].replace(PREDECESSOR, "")),
        None,
        BOTH_WAYS,
    ),
    "no road": (
        (
            chain(100.0, 100.0)[0].replace(SUCCESSOR, ""),
            chain(100.0, 100.0)[1].replace(PREDECESSOR, ""),
        ),
        None,
        set(),
    ),
    "roads, and no lane": (
        tuple(
            one.replace(BOTH_LINKS.format(1), "").replace(BOTH_LINKS.format(-1), "")
            for one in chain(100.0, 100.0)
        ),
        None,
        BOTH_WAYS,
    ),
    "a junction": ((*LEGS, INNER), THERE + BACK, BOTH_WAYS),
    "one connection of two": ((*LEGS, INNER), THERE, BOTH_WAYS),
    "connections without lanes": ((*LEGS, INNER), BARE, BOTH_WAYS),
    "a junction without connections": ((*LEGS, INNER), "", BOTH_WAYS),
    "the junction alone": (
        (*(one.replace(' elementId="5"', ' elementId="99"') for one in LEGS), INNER),
        THERE + BACK,
        BOTH_WAYS,
    ),
    "lanes of the leg's side alone": (
        (*LEGS, INNER.replace(BOTH_LINKS.format(1), "").replace(BOTH_LINKS.format(-1), "")),
        THERE + BACK,
        BOTH_WAYS,
    ),
    "the table alone": (
        (*LEGS, INNER.replace(PREDECESSOR, "").replace(SUCCESSOR, "")),
        THERE + BACK,
        BOTH_WAYS,
    ),
    "the other end": ((*LEGS, INNER), THERE.replace('"start"', '"end"') + BACK, BOTH_WAYS),
}


@pytest.mark.parametrize("stated", ONE_SIDED)
def test_ways_are_there_whichever_side_states_them(stated: str) -> None:
    roads, inside, ways = ONE_SIDED[stated]
    table = () if inside is None else (f'<junction id="5">{inside}</junction>',)
    odr = parse(document(*roads, *table))
    followers = lane_successors(odr)
    found = {
        f"{here.road}{last.road}"
        for here, nexts in followers.items()
        if here.road != "7"
        for there in nexts
        for last in ([there] if there.road != "7" else followers[there])
    }
    assert found == ways
    if stated in ("both say it", "a junction", "no road"):
        assert odr.notes == ()
    else:
        assert odr.notes


def test_a_road_end_that_two_others_link_to_is_left_as_it_is() -> None:
    first, last = chain(100.0, 100.0)
    other = last.replace('road id="2"', 'road id="3"').replace('y="0.0"', 'y="9.0"')
    odr = parse(document(first.replace(SUCCESSOR, ""), last, other))
    assert odr.roads[RoadId("1")].successor is None


def test_sections_whose_lanes_say_nothing_and_differ_are_told() -> None:
    more = section(lane(-1), lane(-2)) + section(lane(-1), s=50)
    odr = parse(document(road(lanes=more)))
    assert rules(odr) == ["connection-left-out"]
    assert "they end here" in odr.notes[0]
    same = parse(document(road(lanes=section(lane(-1)) + section(lane(-1), s=50))))
    assert rules(same) == ["silent-lanes"]
    assert same.roads[RoadId("1")].sections[0].lanes[-1].successors == (-1,)
    assert same.roads[RoadId("1")].sections[1].lanes[-1].predecessors == (-1,)


def test_a_direct_junction_that_links_no_lanes_is_told() -> None:
    after = LEGS[1].replace('x="120.0"', 'x="100.0"')
    direct = (
        '<junction id="5" type="direct"><connection id="0" incomingRoad="1" linkedRoad="2" '
        'contactPoint="start">{}</connection></junction>'
    )
    bare = parse(document(LEGS[0], after, direct.format("")))
    assert rules(bare) == ["connection-left-out"]
    full = parse(document(LEGS[0], after, direct.format('<laneLink from="-1" to="-1"/>')))
    assert rules(full) == []
    assert lane_successors(full)[LaneKey(RoadId("1"), 0, -1)] == (LaneKey(RoadId("2"), 0, -1),)


def test_a_lane_that_names_another_follower_is_taken_at_its_word() -> None:
    wide = section(lane(-1, inside='<link><predecessor id="-1"/></link>'), lane(-2), s=50)
    split = wide.replace(
        'id="-2" type="driving" >', 'id="-2" type="driving" ><link><predecessor id="-1"/></link>'
    )
    odr = parse(
        document(road(lanes=section(lane(-1, inside='<link><successor id="-1"/></link>')) + split))
    )
    keys = lane_successors(odr)
    assert [one.lane for one in keys[LaneKey(RoadId("1"), 0, -1)]] == [-1]


def doubled(text: str, tag: str, which: int = 0) -> str:
    """The text with one element, the ``which``-th of its name, a second time behind it."""
    root = etree.fromstring(text.encode())
    element = list(root.iter(tag))[which]
    element.addnext(copy.deepcopy(element))
    return etree.tostring(root, encoding="unicode")


@pytest.mark.parametrize(
    ("tag", "which"),
    [
        ("road", 0),
        ("road", 1),
        ("link", 0),
        ("link", 2),
        ("planView", 0),
        ("geometry", 0),
        ("geometry", 1),
        ("line", 0),
        ("lanes", 0),
        ("left", 0),
        ("center", 1),
        ("right", 0),
        ("lane", 0),
        ("lane", 2),
        ("elevationProfile", 0),
    ],
)
def test_an_element_that_stands_twice_in_a_row_counts_once(tag: str, which: int) -> None:
    profile = '<elevationProfile><elevation s="0" a="1" b="0" c="0" d="0"/></elevationProfile>'
    text = document(*chain(60.0, 40.0, inside=profile))
    sound, read = parse(text), parse(doubled(text, tag, which))
    assert set(rules(read)) <= {"repeated-element", "ignored"}
    assert (read.roads, read.junctions) == (sound.roads, sound.junctions)


@pytest.mark.parametrize(
    ("first", "second"),
    [
        (lane(-1, inside=BOTH_LINKS.format(-1)), lane(-1, width=2.0)),
        (lane(-1), lane(-1, kind="sidewalk")),
        (lane(-1), lane(-1, inside=BOTH_LINKS.format(-1))),
    ],
)
def test_lanes_of_one_id_that_differ_stay_refused(first: str, second: str) -> None:
    with pytest.raises(OpenDriveError, match="there are two lanes with the id -1"):
        parse(document(road(lanes=section(first, second))))


def test_a_road_that_is_read_once_more_notes_what_it_tolerates_once() -> None:
    slow = '<type s="0" type="town"><speed max="50" unit="KMH"/></type>'
    text = document(road(inside=slow))
    assert rules(parse(doubled(text, "lane"))) == ["repeated-element", "spelling"]
