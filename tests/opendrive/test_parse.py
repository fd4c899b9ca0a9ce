from __future__ import annotations

import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from odscen.base.errors import OpenDriveError
from odscen.opendrive.parse import parse
from odscen.opendrive.road_model import Cubic, GeometryKind, LaneSpeed
from tests.conftest import shared_map_files
from tests.opendrive.snippets import LANES, LINE, document, lane, road, section


@pytest.mark.parametrize("file", shared_map_files(), ids=lambda f: f"{f.parent.name}/{f.stem}")
def test_every_real_map_is_taken_and_its_oddities_are_noted(file: Path) -> None:
    odr = parse(file.read_bytes(), file=file.name)
    assert odr.roads
    assert all(road.geometry and road.sections for road in odr.roads.values())
    # Each note ends with the rule that was used, so that a report can group them.
    assert all(note.endswith("]") and " [" in note for note in odr.notes)
    assert len(odr.notes) < 10


def test_a_minimal_file_gives_exactly_what_it_says() -> None:
    odr = parse(document(road()))
    one = odr.roads["1"]
    assert (one.length, one.junction, one.rule) == (100.0, None, "RHT")
    assert one.geometry[0].kind is GeometryKind.LINE
    assert list(one.sections[0].lanes) == [1, 0, -1]
    assert one.sections[0].lanes[-1].widths == (Cubic(0.0, 3.5, 0.0, 0.0, 0.0),)
    assert odr.notes == ()


def test_text_and_bytes_in_any_encoding_give_the_same_model() -> None:
    text = document(road(more='name="Straße"'))
    assert parse(text) == parse(text.encode())
    latin = text.replace('version="1.0"', 'version="1.0" encoding="ISO-8859-1"')
    assert parse(latin.encode("latin-1")) == parse(text)
    assert parse(latin) == parse(text)


def test_namespaces_and_comments_make_no_difference() -> None:
    plain = document(road())
    spaced = plain.replace("<OpenDRIVE>", '<OpenDRIVE xmlns="http://example.org/odr"><!-- x -->')
    assert parse(spaced) == parse(plain)


def test_offsets_within_a_lane_section_become_road_coordinates() -> None:
    speed = '<speed sOffset="5" max="36" unit="km/h"/>'
    sections = section(lane(-1)) + section(lane(-1, inside=speed), s=40)
    found = parse(document(road(lanes=sections))).roads["1"].sections[1].lanes[-1]
    assert found.widths[0].s == 40.0
    assert found.speeds == (LaneSpeed(45.0, pytest.approx(10.0)),)


@pytest.mark.parametrize(
    ("attributes", "expected"),
    [
        ('max="50" unit="km/h"', 50 / 3.6),
        ('max="30" unit="mph"', 13.4112),
        ('max="12.5"', 12.5),
        ('max="no limit"', math.inf),
        ('max="undefined"', None),
        ('max="0"', None),
    ],
)
def test_speeds_are_converted_to_metres_per_second(attributes: str, expected: float | None) -> None:
    inside = f'<type s="0" type="town"><speed {attributes}/></type>'
    limit = parse(document(road(inside=inside))).roads["1"].types[0].speed
    assert limit == (None if expected is None else pytest.approx(expected))


def test_normalized_cubics_are_brought_to_metres() -> None:
    shape = '<paramPoly3 pRange="{}" aU="0" bU="{}" cU="0" dU="0" aV="0" bV="0" cV="{}" dV="{}"/>'
    plan = '<geometry s="0" x="0" y="0" hdg="0" length="10">{}</geometry>'
    one, other = (
        parse(document(road(length=10.0, plan=plan.format(text)))).roads["1"].geometry[0].params
        for text in (
            shape.format("normalized", 10, 2, 1),
            shape.format("arcLength", 1, 0.02, 0.001),
        )
    )
    assert one == pytest.approx(other)


@pytest.mark.parametrize(
    ("inside", "same"),
    [("10 2 1", "normalized"), ("1 0.002 0", "arcLength")],
)
def test_a_range_of_cubics_that_is_none_is_the_one_that_their_length_shows(
    inside: str, same: str
) -> None:
    shape = '<paramPoly3 pRange="{}" aU="0" bU="{}" cU="0" dU="0" aV="0" bV="0" cV="{}" dV="{}"/>'
    plan = '<geometry s="0" x="0" y="0" hdg="0" length="10.6">{}</geometry>'
    odd, right = (
        parse(document(road(length=10.6, plan=plan.format(shape.format(name, *inside.split())))))
        for name in ("curve", same)
    )
    assert odd.roads["1"].geometry == right.roads["1"].geometry
    assert any(f"pRange='curve' is read as {same}" in note for note in odd.notes)


def test_a_range_of_cubics_that_fits_no_length_is_refused() -> None:
    shape = '<paramPoly3 pRange="curve" aU="0" bU="4" cU="0" dU="0" aV="0" bV="0" cV="0" dV="0"/>'
    plan = f'<geometry s="0" x="0" y="0" hdg="0" length="10">{shape}</geometry>'
    with pytest.raises(OpenDriveError, match="is none of arcLength, normalized"):
        parse(document(road(length=10.0, plan=plan)))


def test_1_8_access_restrictions_are_read_like_older_ones() -> None:
    start = '<access sOffset="0" rule="deny"'
    new = f'{start}><restriction type="bus"/><restriction type="taxi"/></access>'
    old = f'{start} restriction="bus"/>{start} restriction="taxi"/>'
    one, other = (
        parse(document(road(lanes=section(lane(-1, inside=text))))) for text in (new, old)
    )
    assert one == other
    assert [a.restriction for a in one.roads["1"].sections[0].lanes[-1].access] == ["bus", "taxi"]


REFUSED = {
    "no XML": ("nothing", "not well-formed"),
    "nothing at all": ("", "not well-formed"),
    "another root": ("<net/>", "the root element is <net>"),
    "no road": (document(), "there is no <road>"),
    "version 2": (document(road(), version="2.0"), "header: OpenDRIVE 2.0 is not supported"),
    "two roads of one id": (
        document(road(), road(plan=LINE.replace('hdg="0"', 'hdg="1"'))),
        "road 1: there is another road",
    ),
    "two junctions of one id": (
        document(road(), '<junction id="5"/><junction id="5" type="direct"/>'),
        "junction 5: there is another junction",
    ),
    "not a number": (
        document(road(lanes=LANES.replace('a="3.5"', 'a="wide"'))),
        "road 1 > laneSection 0 > lane -1 > width 0: a='wide' is not a number",
    ),
    "a comma": (
        document(road(lanes=LANES.replace('a="3.5"', 'a="3,5"'))),
        "lane -1 > width 0: a='3,5' is not a number",
    ),
    "a number with underscores": (
        document(road(lanes=LANES.replace('a="3.5"', 'a="1_0"'))),
        "lane -1 > width 0: a='1_0' is not a number",
    ),
    "NaN": (
        document(road(lanes=LANES.replace('a="3.5"', 'a="NaN"'))),
        "lane -1 > width 0: a='NaN' is not a finite number",
    ),
    "infinity": (
        document(road(lanes=LANES.replace('d="0"', 'd="-inf"', 1))),
        "lane 1 > width 0: d='-inf' is not a finite number",
    ),
    "a missing attribute": (
        document(road(lanes=LANES.replace('a="3.5"', ""))),
        "lane -1 > width 0: attribute a is missing",
    ),
    "no length": (document(road(length=0.0)), "road 1: length='0.0' is not above zero"),
    "a huge length": (document(road(length=1e300)), "length='1e+300' is beyond the limit"),
    "a huge coordinate": (
        document(road(plan=LINE.replace('x="0"', 'x="1e12"'))),
        "road 1 > geometry 0: x='1e12' is beyond the limit",
    ),
    "a huge elevation": (
        document(
            road(
                inside='<elevationProfile><elevation s="0" a="0" b="1e5" c="0" d="0"/>'
                "</elevationProfile>"
            )
        ),
        "road 1 > elevation 0: reaches 1e+07",
    ),
    "a lane id beyond all roads": (
        document(road(lanes=LANES.replace('id="-1"', 'id="-999999999"'))),
        "id='-999999999' is beyond the limit",
    ),
    "no plan view": (document(road(plan="")), "road 1: there is no planView geometry"),
    "an unknown shape": (
        document(road(plan=LINE.replace("line", "bezier"))),
        "geometry 0: <bezier> is no known shape",
    ),
    "torn geometry": (
        document(
            road(
                plan=LINE.replace('length="100"', 'length="50"')
                + '<geometry s="50" x="90" y="0" hdg="0" length="50"><line/></geometry>'
            )
        ),
        "road 1 > geometry 0: ends 40 m away from the start of the next",
    ),
    "geometry backwards": (
        document(road(plan=LINE + LINE.replace('hdg="0"', 'hdg="1"'))),
        "road 1 > geometry 1: s=0 is not beyond the s=0 of the geometry before",
    ),
    "an arc that winds up": (
        document(road(plan=LINE.replace("<line/>", '<arc curvature="50"/>'))),
        "arc 0: turns by about 5000 rad",
    ),
    "sections backwards": (
        document(road(lanes=section(lane(-1)) + section(lane(-1), s=50) + section(lane(-1), s=20))),
        "road 1 > laneSection 2: s=20 is below the 50 of the record before",
    ),
    "a section behind the end": (
        document(road(lanes=section(lane(-1)) + section(lane(-1), s=200))),
        "laneSection 1: s=200 is beyond the road's length of 100",
    ),
    "one lane twice": (
        document(road(lanes=section(lane(-1), lane(-1, kind="biking")))),
        "road 1 > laneSection 0: there are two lanes with the id -1",
    ),
    "a lane on the wrong side": (
        document(road(lanes=LANES.replace('id="1"', 'id="0"'))),
        "lane 0: lane 0 is in <left>: whether it is the centre line is not clear",
    ),
    "widths backwards": (
        document(
            road(lanes=section(lane(-1, inside='<width sOffset="5" a="3" b="0" c="0" d="0"/>')))
        ),
        "lane -1 > width 1: sOffset=0 is below the 5 of the record before",
    ),
    "a negative width": (
        document(road(lanes=section(lane(-1, width=-0.3)))),
        "road 1 > laneSection 0 > lane -1: width at s=0 is -0.3 m",
    ),
    "an unknown rule": (document(road(more='rule="MHT"')), "road 1: rule='MHT' is none of"),
}


@pytest.mark.parametrize(("text", "message"), REFUSED.values(), ids=REFUSED)
def test_refusals_name_the_element_and_the_value(text: str, message: str) -> None:
    with pytest.raises(OpenDriveError) as caught:
        parse(text, file="map.xodr")
    assert str(caught.value).startswith("map.xodr: ")
    assert message in str(caught.value)


TOLERATED = {
    "junction-attribute": document(road(junction="")),
    "version": document(road(), version="1.9"),
    "dangling-link": document(
        road(link='<successor elementType="road" elementId="7" contactPoint="start"/>')
    ),
    "missing-contact-point": document(road(link='<successor elementType="road" elementId="1"/>')),
    "zero-length": document(road(lanes=section(lane(-1)) + section(lane(-1), s=100))),
    "late-start": document(
        road(
            inside="<elevationProfile>"
            '<elevation s="10" a="0" b="0" c="0" d="0"/></elevationProfile>'
        )
    ),
    "same-s": document(
        road(lanes=section(lane(-1, inside='<width sOffset="0" a="1" b="0" c="0" d="0"/>')))
    ),
    "no-width": document(road(lanes=section('<lane id="-1" type="driving"/>'))),
    "negative-width": document(road(lanes=section(lane(-1, width=-0.02)))),
    "lane-numbers": document(road(lanes=section(lane(-2)))),
    "no-center-lane": document(
        road(lanes=f'<laneSection s="0"><right>{lane(-1)}</right></laneSection>')
    ),
    "plan-view-s": document(road(length=100.5)),
    "plan-view-gap": document(
        road(
            plan=LINE.replace('length="100"', 'length="50"')
            + '<geometry s="50" x="50.5" y="0" hdg="0" length="50"><line/></geometry>'
        )
    ),
    "ignored": document(road(inside="<surface/>")),
    "unknown-element": document(road(inside="<wobble/>")),
    "outside-road": document(
        road(inside='<objects><object id="1" type="pole" s="105" t="0"/></objects>')
    ),
    "duplicate-id": document(
        road(inside="<objects>" + '<object id="1" type="pole" s="5" t="0"/>' * 2 + "</objects>")
    ),
}


@pytest.mark.parametrize(("rule", "text"), TOLERATED.items(), ids=TOLERATED)
def test_each_tolerance_is_noted_by_its_name(rule: str, text: str) -> None:
    assert [note.rsplit("[", 1)[1] for note in parse(text).notes] == [f"{rule}]"]


def test_entities_are_refused_and_nothing_is_fetched(tmp_path: Path) -> None:
    secret = tmp_path / "secret"
    secret.write_text("4711")
    body = document(road(more='name="&x;"')).split("?>", 1)[1]
    for declaration in (
        f'<!ENTITY x SYSTEM "{secret.as_uri()}">',
        '<!ENTITY x "y">',
        '<!ENTITY y "aaaaaaaaaa"><!ENTITY x "&y;&y;&y;&y;">',
    ):
        with pytest.raises(OpenDriveError):
            parse(f"<!DOCTYPE OpenDRIVE [{declaration}]>{body}")


def test_a_link_that_leads_nowhere_is_left_out_of_the_model() -> None:
    odr = parse(TOLERATED["dangling-link"])
    assert odr.roads["1"].successor is None
    assert "there is no road '7'" in odr.notes[0]


def test_files_beyond_the_limits_are_refused_before_they_cost_anything(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    text = document(road())
    for limit, value in (("MAX_TAGS", 5), ("MAX_BYTES", 100)):
        with monkeypatch.context() as patch:
            patch.setattr(f"odscen.opendrive.parse.{limit}", value)
            with pytest.raises(OpenDriveError, match=f"the limit is {value}"):
                parse(text)


def test_a_map_of_more_lanes_than_memory_is_refused() -> None:
    lanes = section(*(lane(-number) for number in range(1, 501)))
    long = LINE.replace('length="100"', 'length="100000"')
    with pytest.raises(OpenDriveError, match=r"all lanes together are 5e\+07 m long"):
        parse(document(road(length=1e5, plan=long, lanes=lanes)))


def test_a_lane_link_of_a_junction_that_leads_nowhere_is_left_out() -> None:
    junction = (
        '<junction id="9"><connection id="0" incomingRoad="1" connectingRoad="2" '
        'contactPoint="start"><laneLink from="-1" to="-7"/><laneLink from="-1" to="-1"/>'
        "</connection></junction>"
    )
    odr = parse(document(road("1"), road("2", junction="9"), junction))
    assert odr.junctions["9"].connections[0].lane_links == ((-1, -1),)
    assert odr.notes == (
        "junction 9 > connection 0 > laneLink -1 -7: there is no lane -7 on road 2; "
        "the link is left out [dangling-link]",
    )


def test_a_thousand_notes_of_one_kind_are_summed_up() -> None:
    objects = '<object id="1" type="pole" s="5" t="0"/>' * 1500
    odr = parse(document(road(inside=f"<objects>{objects}</objects>")))
    assert len(odr.notes) == 1001
    assert odr.notes[-1] == "499 further uses of this rule [duplicate-id]"


@pytest.mark.slow
@given(st.floats(-1e8, 1e8), st.floats(-10, 10), st.floats(0.5, 20))
def test_numbers_are_read_to_the_last_digit(x: float, hdg: float, width: float) -> None:
    plan = LINE.replace('x="0"', f'x="{x!r}"').replace('hdg="0"', f'hdg="{hdg!r}"')
    if abs(x) > 1e8 - 200:
        return
    one = parse(document(road(plan=plan, lanes=section(lane(-1, width=width))))).roads["1"]
    assert (one.geometry[0].x, one.geometry[0].hdg) == (x, hdg)
    assert one.sections[0].lanes[-1].widths[0].a == width


def test_a_reference_system_is_understood_or_noted() -> None:
    header = '<header revMajor="1" revMinor="6"><geoReference>{}</geoReference></header>'
    body = document(road()).replace('<header revMajor="1" revMinor="6"/>', header)
    known = parse(body.format("+proj=tmerc +lat_0=0 +lon_0=0"))
    assert known.header.crs is not None
    assert known.notes == ()
    for odd in ("+lat_0=49 +lon_0=8", "+proj=nonsense", "EPSG:999999"):
        odr = parse(body.format(odd))
        assert (odr.header.geo_reference, odr.header.crs) == (odd, None)
        assert len(odr.notes) == 1
