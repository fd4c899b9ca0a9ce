"""Faults of real files that have one meaning only: what is read, what is reported, what refused."""

from __future__ import annotations

import numpy as np
import pytest

from odscen.base.errors import OpenDriveError
from odscen.base.ids import LaneKey, RoadId
from odscen.lanegraph.build_graphs import build_map_graph
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.parse import parse
from odscen.opendrive.road_model import Cubic, LaneHeight, OpenDrive
from tests.opendrive.snippets import LANES, LINE, document, lane, road, section


def geometry(s: float, length: float, shape: str = "<line/>", *, x: float | None = None) -> str:
    """One geometry along the x axis."""
    at = s if x is None else x
    return f'<geometry s="{s!r}" x="{at!r}" y="0" hdg="0" length="{length!r}">{shape}</geometry>'


def width(s: float, a: float, *more: float) -> str:
    b, c, d = (*more, 0.0, 0.0, 0.0)[:3]
    return f'<width sOffset="{s!r}" a="{a!r}" b="{b!r}" c="{c!r}" d="{d!r}"/>'


def one_lane(inside: str) -> str:
    """A section whose lane -1 has nothing but what is ``inside``."""
    return section(f'<lane id="-1" type="driving">{inside}</lane>')


def end_of_road(odr: OpenDrive, s: float) -> tuple[float, float]:
    table = RoadTable.of(odr)
    line = table.reference(np.array([0]), np.array([s]))
    return float(line.x[0]), float(line.y[0])


def width_at(odr: OpenDrive, s: float) -> float:
    table = RoadTable.of(odr)
    row = table.lane_index[LaneKey(RoadId("1"), 0, -1)]
    return float(table.lane_width(np.array([row]), np.array([s]))[0])


def test_a_file_without_header_is_read() -> None:
    text = document(road()).replace('<header revMajor="1" revMinor="6"/>', "")
    odr = parse(text)
    assert odr.roads == parse(document(road())).roads
    assert (odr.header.rev_major, odr.header.rev_minor, odr.header.crs) == (1, 4, None)
    assert odr.notes == (
        "there is no <header>; the file is read by the rules of 1.4 to 1.8 [missing-header]",
    )


def test_a_width_record_that_steps_back_by_less_than_a_millimetre_starts_where_the_last_did() -> (
    None
):
    records = width(0, 3.0) + width(40.0004, 3.2) + width(40.0, 3.5)
    odr = parse(document(road(lanes=one_lane(records))))
    assert width_at(odr, 39.0) == pytest.approx(3.0)
    assert width_at(odr, 41.0) == pytest.approx(3.5)
    assert odr.notes[0] == (
        "road 1 > laneSection 0 > lane -1 > width 2: sOffset=40 is below the 40.0004 of the record "
        "before; it starts there [record-order]"
    )


def test_a_lane_section_that_steps_back_by_less_than_a_millimetre_is_taken() -> None:
    sections = section(lane(-1)) + section(lane(-1), s=50.0002) + section(lane(-1), s=50.0)
    odr = parse(document(road(lanes=sections)))
    assert [(one.s, one.s_end) for one in odr.roads[RoadId("1")].sections] == [
        (0.0, 50.0002),
        (50.0002, 50.0002),
        (50.0002, 100.0),
    ]
    assert "[record-order]" in odr.notes[0]


def test_a_lane_section_a_hair_behind_the_end_of_the_road_starts_at_the_end() -> None:
    odr = parse(document(road(lanes=section(lane(-1)) + section(lane(-1), s=100.0005))))
    assert odr.roads[RoadId("1")].sections[1].s == 100.0
    assert (
        "s=100.0005 is beyond the road's length of 100; it starts there [record-order]"
        in (odr.notes[0])
    )


@pytest.mark.parametrize("what", ["width", "section", "elevation"])
def test_records_out_of_order_by_more_stay_refused(what: str) -> None:
    inside = {"width": width(0, 3.0) + width(40.0, 3.2) + width(39.9, 3.5)}
    sections = {"section": section(lane(-1)) + section(lane(-1), s=50) + section(lane(-1), s=49.9)}
    profile = "".join(f'<elevation s="{s}" a="0" b="0" c="0" d="0"/>' for s in (0, 40, 39.9))
    text = road(
        lanes=sections.get(what, one_lane(inside.get(what, "") or width(0, 3.0))),
        inside=f"<elevationProfile>{profile}</elevationProfile>" if what == "elevation" else "",
    )
    with pytest.raises(OpenDriveError, match=r"is below the (40|50) of the record before"):
        parse(document(text))


def test_the_message_on_order_names_the_value_of_the_file() -> None:
    records = width(0, 3.0) + width(8, 3.2) + width(5, 3.5)
    text = document(road(lanes=section(lane(-1)) + one_lane(records).replace('s="0.0"', 's="50"')))
    with pytest.raises(OpenDriveError, match=r"width 2: sOffset=5 is below the 8"):
        parse(text)


ABSURD = (
    '<paramPoly3 pRange="arcLength" aU="0" bU="1" cU="0" dU="0" '
    'aV="0" bV="0" cV="7e11" dV="-3e17"/>'
)


@pytest.mark.parametrize(
    ("plan", "rule"),
    [
        (geometry(0, 50) + geometry(50, 0.0) + geometry(50, 50), "zero-length"),
        (geometry(0, 50) + geometry(50, -1e-17) + geometry(50, 50), "zero-length"),
        # 4.4e-16 m behind 50 m is 50 m still
        (geometry(0, 50) + geometry(50, 4.4e-16) + geometry(50, 50), "same-s"),
        (geometry(0, 50) + geometry(50, 2e-6, ABSURD) + geometry(50.000002, 49.999998), "sliver"),
        (geometry(0, 50) + geometry(50.0003, 1e-4) + geometry(50.0001, 49.9999), "record-order"),
        (geometry(0, 100) + geometry(100, 1e-6, ABSURD), "sliver"),
        (geometry(0, 1e-6, ABSURD) + geometry(1e-6, 100), "sliver"),
    ],
)
def test_a_geometry_too_short_to_matter_leaves_the_road_where_it_is(plan: str, rule: str) -> None:
    odr = parse(document(road(plan=plan)))
    assert end_of_road(odr, 75.0) == pytest.approx((75.0, 0.0), abs=1e-3)
    assert end_of_road(odr, 100.0) == pytest.approx((100.0, 0.0), abs=1e-3)
    assert [note.rsplit("[", 1)[1] for note in odr.notes] == [f"{rule}]"]
    assert "left out" in odr.notes[0]


def test_geometries_that_single_precision_does_not_tell_apart_are_one() -> None:
    # At 20 km numbers of single precision are 2 mm apart.
    plan = geometry(0, 20000) + geometry(20000, 0.0015) + geometry(20000, 100)
    odr = parse(document(road(plan=plan, length=20100.0)))
    assert [one.length for one in odr.roads[RoadId("1")].geometry] == [20000.0, 100.0]
    assert "of 0.0015 m, is left out [same-s]" in odr.notes[0]
    near = geometry(0, 50) + geometry(50, 0.15) + geometry(50, 50)
    with pytest.raises(OpenDriveError, match="s=50 is not beyond the s=50"):
        parse(document(road(plan=near)))


def test_absurd_numbers_on_a_geometry_of_some_length_stay_refused() -> None:
    plan = geometry(0, 50) + geometry(50, 0.01, ABSURD) + geometry(50.01, 49.99)
    with pytest.raises(OpenDriveError, match="cV='7e11' is beyond the limit"):
        parse(document(road(plan=plan)))


def test_absurd_coefficients_of_a_record_of_a_micrometre_leave_its_first() -> None:
    records = width(0, 3.5) + width(40, 3.5, 2e5, -6e11, 4e17) + width(40.000001, 3.0)
    odr = parse(document(road(lanes=one_lane(records))))
    assert odr.roads[RoadId("1")].sections[0].lanes[-1].widths[1] == Cubic(40.0, 3.5, 0, 0, 0)
    assert width_at(odr, 39.0) == pytest.approx(3.5)
    assert width_at(odr, 41.0) == pytest.approx(3.0)
    assert odr.notes[0] == (
        "road 1 > laneSection 0 > lane -1 > width 1: b=200000, c=-6e+11, d=4e+17 on 1e-06 m "
        "count as 0 [sliver]"
    )


def test_a_sliver_at_the_end_of_a_road_or_section_is_one_too() -> None:
    offset = '<laneOffset s="{}" a="{}" b="0" c="{}" d="0"/>'
    offsets = offset.format(0, 0, 0) + offset.format(99.999999, 0, 5e11)
    odr = parse(document(road(lanes=offsets + LANES)))
    assert odr.roads[RoadId("1")].lane_offset[1] == Cubic(99.999999, 0, 0, 0, 0)
    long = offset.format(0, 0, 0) + offset.format(99.99, 0, 5e11)
    with pytest.raises(OpenDriveError, match=r"laneOffset 1: c='500000000000\.0' is beyond"):
        parse(document(road(lanes=long + LANES)))


def mark(s: float, kind: str) -> str:
    return f'<roadMark sOffset="{s!r}" type="{kind}" laneChange="none"/>'


def test_road_marks_in_any_order_hold_from_their_offset_to_the_next() -> None:
    marks = mark(60, "solid") + mark(0, "broken") + mark(30, "none")
    behind = '<link><predecessor id="-1"/></link>'
    lanes = section(lane(-1)) + section(lane(-1, inside=behind + marks), s=10)
    odr = parse(document(road(lanes=lanes)))
    found = odr.roads[RoadId("1")].sections[1].lanes[-1].road_marks
    assert [(one.s, one.type) for one in found] == [(10, "broken"), (40, "none"), (70, "solid")]
    assert odr.notes == (
        "road 1 > laneSection 1 > lane -1 > roadMark 1: sOffset=0 is below that of the roadMark "
        "before; they are put in order [mark-order]",
    )


def test_the_older_names_of_a_lanes_heights_are_read() -> None:
    height = '<height sOffset="0" heightInner="0.1" heightOuter="0.2"/>'
    odr = parse(document(road(lanes=section(lane(-1, inside=height)))))
    assert odr.roads[RoadId("1")].sections[0].lanes[-1].heights == (LaneHeight(0.0, 0.1, 0.2),)
    assert "[old-names]" in odr.notes[0]
    bare = parse(document(road(lanes=section(lane(-1, inside='<height sOffset="0"/>')))))
    assert "attribute inner is missing; the height is left out [paint]" in bare.notes[0]


POLE = '<object id="{}" type="pole" s="5" t="0"/>'
FAULTY_OBJECTS = {
    "an empty id": ('<object id="" type="pole" s="5" t="0"/>', "attribute id is empty"),
    "no id": ('<object type="pole" s="5" t="0"/>', "attribute id is missing"),
    "a complex number": (
        '<object id="3" type="pole" s="5" t="0" width="1.5+0.2i"/>',
        "width='1.5+0.2i' is not a number",
    ),
    "a repeat without s": (
        '<object id="3" type="pole" s="5" t="0"><repeat length="9" distance="3"/></object>',
        "attribute s is missing",
    ),
    "a corner without u": (
        '<object id="3" type="crosswalk" s="5" t="0"><outline><cornerLocal v="1"/></outline>'
        "</object>",
        "attribute u is missing",
    ),
}


@pytest.mark.parametrize("fault", FAULTY_OBJECTS)
def test_an_object_that_cannot_be_read_is_left_out_and_the_others_stay(fault: str) -> None:
    text, reason = FAULTY_OBJECTS[fault]
    objects = f"<objects>{POLE.format(1)}{text}{POLE.format(2)}</objects>"
    odr = parse(document(road(inside=objects)))
    assert [one.id for one in odr.roads[RoadId("1")].objects] == ["1", "2"]
    (note,) = odr.notes
    assert note.startswith("road 1 > object ")
    assert note.endswith(f"{reason}; the object is left out [object-left-out]")


def test_any_number_of_faulty_objects_is_left_out() -> None:
    odr = parse(document(road(inside=f"<objects>{'<object/>' * 1001}</objects>")))
    assert odr.roads[RoadId("1")].objects == ()
    assert "1 further uses of this rule [object-left-out]" in odr.notes


@pytest.mark.parametrize("kind", ['elementType="fiddleyard"', ""])
def test_a_link_to_something_that_is_neither_road_nor_junction_is_left_out(kind: str) -> None:
    odr = parse(document(road(link=f'<successor {kind} elementId="fy1"/>')))
    assert odr.roads[RoadId("1")].successor is None
    (note,) = odr.notes
    assert note.startswith("road 1 > successor: elementType=")
    assert note.endswith("is neither road nor junction; the link is left out [dangling-link]")


def test_the_only_lane_layer_of_a_road_holds() -> None:
    layer = f'<laneLayer id="0"><laneOffset s="0" a="1" b="0" c="0" d="0"/>{LANES}</laneLayer>'
    odr = parse(document(road(lanes=layer), version="1.9"))
    plain = f'<laneOffset s="0" a="1" b="0" c="0" d="0"/>{LANES}'
    assert odr.roads == parse(document(road(lanes=plain))).roads
    assert odr.notes[-1].endswith("the only lane layer, as OpenDRIVE 1.9 has them, holds [version]")


LINKED = (
    '<link><successor id="-1"/><successor id="-1" layer="permanent"/>'
    '<successor id="-2" layer="temporary"/></link>'
)


def two_layers(permanent: str, temporary: str, first: str = ' layer="permanent"') -> str:
    lanes = f"<lanes{first}>{permanent}</lanes>"
    text = road(lanes="@").replace("<lanes>@</lanes>", "@")
    return text.replace("@", f'{lanes}<lanes layer="temporary">{temporary}</lanes>')


@pytest.mark.parametrize("first", [' layer="permanent"', "", ' layer=""'])
def test_of_two_lane_layers_the_permanent_one_holds(first: str) -> None:
    works = section(lane(-1, width=2.5), lane(-2, width=2.5)).replace(
        ' s="0.0"', ' s="20" length="5"'
    )
    odr = parse(document(two_layers(LANES, works, first), version="1.9"))
    assert odr.roads == parse(document(road())).roads
    assert odr.notes[-1] == (
        "road 1: the temporary lane layer is left out: traffic keeps to the permanent lanes "
        "[temporary-lanes]"
    )


def test_links_to_the_temporary_layer_are_not_followed() -> None:
    permanent = section(lane(-1, inside=LINKED)) + section(lane(-1), s=50.0)
    odr = parse(document(two_layers(permanent, section(lane(-1))), version="1.9"))
    first = odr.roads[RoadId("1")].sections[0]
    assert set(first.lanes[-1].successors) == {-1}


def test_a_road_of_two_permanent_lane_layers_is_refused() -> None:
    text = road(lanes="@").replace("<lanes>@</lanes>", f"<lanes>{LANES}</lanes>" * 2)
    with pytest.raises(OpenDriveError, match="lanes"):
        parse(document(text.replace(LANES, LANES.replace("3.5", "3.0"), 1), version="1.9"))


def test_several_lane_layers_are_refused_as_which_holds_is_not_clear() -> None:
    layers = "".join(f'<laneLayer id="{number}">{LANES}</laneLayer>' for number in (0, 1))
    with pytest.raises(OpenDriveError) as caught:
        parse(document(road(lanes=layers), version="1.9"))
    assert str(caught.value) == (
        "road 1: the lanes are in several <laneLayer> elements: which of the lane layers of "
        "OpenDRIVE 1.9 traffic keeps to is not clear; save the map with one, or as 1.8 or older"
    )


def test_roads_that_are_in_a_file_several_times_are_merged() -> None:
    ahead = geometry(0, 100, x=100.0)
    link = '<{} elementType="road" elementId="{}" contactPoint="{}"/>'
    on = section(lane(-1, inside='<link><successor id="-1"/></link>'))
    twins = [
        road(name, lanes=on, link=link.format("successor", "3", "start"), more=f'name="n{name}"')
        for name in ("1", "2")
    ]
    last = road("3", plan=ahead, lanes=on, link=link.format("predecessor", "2", "end"))
    odr = parse(document(*twins, last))
    assert list(odr.roads) == ["1", "3"]
    back = odr.roads[RoadId("3")].predecessor
    assert back is not None
    assert back.element_id == "1"
    assert odr.notes[0] == (
        "road 2: is as road 1 in all but id and name; it is merged with it [coincident-road]"
    )


def test_roads_in_the_same_place_with_other_lanes_both_stay() -> None:
    odr = parse(document(road("1"), road("2", lanes=section(lane(-1)))))
    assert list(odr.roads) == ["1", "2"]
    assert odr.notes == ()


def test_five_hundred_identical_roads_have_the_graph_of_one() -> None:
    many = parse(document(*(road(str(number)) for number in range(1, 501))))
    one = parse(document(road("1")))
    graphs = [build_map_graph(odr, name="m", sha256="0") for odr in (many, one)]
    assert len(graphs[0].lanes.x) == len(graphs[1].lanes.x) == 100
    assert len([note for note in many.notes if "[coincident-road]" in note]) == 499


@pytest.mark.parametrize("shape", ['a="0" b="0" c="1e9" d="0"', 'a="0" b="0" c="-900" d="0"'])
def test_a_curve_that_bends_too_sharply_to_be_followed_is_refused(shape: str) -> None:
    text = document(road(plan=LINE.replace("<line/>", f"<poly3 {shape}/>")))
    with pytest.raises(OpenDriveError, match="road 1 > geometry 0: the curve bends too sharply"):
        parse(text)


def test_a_steep_poly3_that_can_be_followed_is_as_long_as_it_says() -> None:
    odr = parse(document(road(plan=LINE.replace("<line/>", '<poly3 a="0" b="0" c="0.05" d="0"/>'))))
    table = RoadTable.of(odr)
    line = table.reference(np.zeros(10001, dtype=np.int64), np.linspace(0, 100, 10001))
    assert np.hypot(np.diff(line.x), np.diff(line.y)).sum() == pytest.approx(100.0, abs=1e-3)


ODD_ID = "a>b \u202e'1\"&<: \u200b é"


def xml(text: str) -> str:
    return "".join(f"&#{ord(letter)};" for letter in text)


def test_odd_ids_are_quoted_and_escaped_in_messages() -> None:
    objects = '<objects><object id="1" type="pole" s="105" t="0"/></objects>'
    odr = parse(document(road(xml(ODD_ID), inside=objects)))
    assert RoadId(ODD_ID) in odr.roads
    shown = "'a>b \\u202e\\'1\"&<:\\x20\\u200b é'"
    assert odr.notes == (
        f"road {shown} > object 1: s=105 is outside the road of 100 m [outside-road]",
    )
    with pytest.raises(OpenDriveError) as caught:
        parse(document(road(xml(ODD_ID), length=-1)))
    assert str(caught.value) == f"road {shown}: length='-1' is not above zero"


def test_control_characters_of_ids_are_spaces_wherever_they_are_named() -> None:
    ahead = geometry(0, 100, x=100.0)
    link = '<{} elementType="road" elementId="{}" contactPoint="{}"/>'
    odd = xml("a\tb\n\x85")
    alone = {"lanes": section(lane(-1, inside='<link><predecessor id="-1"/></link>'))}
    first = road(odd, link=link.format("successor", "2", "start"), **alone)
    last = road("2", plan=ahead, link=link.format("predecessor", odd, "end"), **alone)
    odr = parse(document(first, last))
    assert list(odr.roads) == ["a b  ", "2"]
    back = odr.roads[RoadId("2")].predecessor
    assert back is not None
    assert back.element_id == "a b  "
    assert [note.rsplit("[", 1)[1] for note in odr.notes] == ["control-character]"] * 2
    assert "id='a\\tb\\n\\x85' has control characters; they are spaces" in odr.notes[0]
