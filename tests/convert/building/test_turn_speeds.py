"""How fast turns are taken: as drivers feel comfortable, and never above what the map says."""

from __future__ import annotations

import math

import pytest

from odscen.opendrive.parse import parse
from tests.convert.legs import GAP, LENGTH, junction, leg
from tests.convert.maps import of_model
from tests.opendrive.snippets import document, lane, road, section

WIDTH = 3.5
LINKS = '<link><predecessor id="-1"/><successor id="1"/></link>'
CROSSWALK = (
    '<objects><object id="c" type="crosswalk" s="{s}" t="0" zOffset="0" hdg="1.5708" length="7" '
    'width="3"/></objects>'
)


def _right_turn(*, limit: str = "", crosswalk: bool = False) -> tuple[float, float]:
    """Speed and length of the internal lane of a quarter circle from leg 1 into leg 2."""
    speed = f'<type s="0" type="town"><speed max="{limit}" unit="km/h"/></type>' if limit else ""
    turn = road(
        "20",
        length=GAP * math.pi / 2.0,
        plan=f'<geometry s="0" x="{-GAP}" y="0" hdg="0" length="{GAP * math.pi / 2.0}">'
        f'<arc curvature="{-1.0 / GAP}"/></geometry>',
        lanes=section(lane(-1, width=WIDTH, inside=LINKS)),
        link='<predecessor elementType="road" elementId="1" contactPoint="end"/>'
        '<successor elementType="road" elementId="2" contactPoint="end"/>',
        junction="9",
        inside=speed,
    )
    connection = (
        '<connection id="0" incomingRoad="1" connectingRoad="20" contactPoint="start">'
        '<laneLink from="-1" to="-1"/></connection>'
    )
    first = leg("1")
    if crosswalk:
        first = first.replace("</lanes>", "</lanes>" + CROSSWALK.format(s=LENGTH - 5.0))
    made = of_model(parse(document(first, leg("2"), turn, junction(connection))))
    [link] = [
        one for one in made.xml.iter("connection") if one.get("dir") == "r" and one.get("via")
    ]
    inner = next(one for one in made.xml.iter("lane") if one.get("id") == link.get("via"))
    return float(inner.get("speed", 0)), float(inner.get("length", 0))


def test_a_turn_is_held_to_the_lateral_acceleration_that_drivers_choose() -> None:
    speed, length = _right_turn()
    radius = GAP - WIDTH / 2.0
    assert length == pytest.approx((GAP - WIDTH / 2.0) * math.pi / 2.0, abs=0.1)
    assert speed == pytest.approx(math.sqrt(0.93 * 3.1 * radius), rel=0.05)


def test_a_crosswalk_before_a_turn_does_not_make_it_faster() -> None:
    speed, length = _right_turn()
    with_crosswalk, longer = _right_turn(crosswalk=True)
    assert longer > length + 5.0
    assert with_crosswalk == pytest.approx(speed, abs=0.1)


def test_a_limit_on_the_connecting_road_holds_in_a_turn() -> None:
    assert _right_turn(limit="15")[0] == pytest.approx(15.0 / 3.6, abs=0.01)
