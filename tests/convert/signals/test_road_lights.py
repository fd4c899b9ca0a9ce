"""Lights on plain roads: what they control, where vehicles stop, and what is said of it."""

from __future__ import annotations

import pytest

from odscen.convert.model.conversion_report import ElementOutcome
from odscen.convert.signals.road_lights import (
    BEHIND_JUNCTION,
    NO_LANE_FACED,
    NO_LANE_VALID,
)
from odscen.convert.verify.fidelity import verify
from odscen.opendrive.parse import parse
from tests.convert.legs import crossing, signal, way
from tests.convert.maps import Converted, of_model
from tests.opendrive.snippets import document, lane, road, section

LIGHT = "1000001"
TWO_WAY = section(lane(1), lane(-1))
LINK = '<link><predecessor id="{0}"/><successor id="{0}"/></link>'
LINKED = section(*(lane(one, inside=LINK.format(one)) for one in (1, -1)))


def light(
    number: int, s: float, orientation: str = "+", valid: tuple[int, int] | None = None
) -> str:
    inside = "" if valid is None else f'<validity fromLane="{valid[0]}" toLane="{valid[1]}"/>'
    return (
        f'<signal id="{number}" s="{s}" t="-4" name="" type="{LIGHT}" subtype="-1" '
        f'orientation="{orientation}" dynamic="yes">{inside}</signal>'
    )


def straight(
    name: str,
    *lights: str,
    start: float = 0.0,
    length: float = 200.0,
    lanes: str = TWO_WAY,
    link: str = "",
    inside: str = "",
) -> str:
    plan = f'<geometry s="0" x="{start}" y="0" hdg="0" length="{length}"><line/></geometry>'
    furniture = f"<signals>{''.join(lights)}</signals>" if lights else ""
    return road(name, length=length, plan=plan, lanes=lanes, link=link, inside=inside + furniture)


def to(road_id: str, contact: str, *, after: bool = True) -> str:
    tag = "successor" if after else "predecessor"
    return f'<{tag} elementType="road" elementId="{road_id}" contactPoint="{contact}"/>'


def made(*roads: str) -> Converted:
    return of_model(parse(document(*roads)))


def lit_links(network: Converted) -> list[tuple[str, str, int]]:
    """Edge, next edge and lane of each connection that a light controls."""
    return sorted(
        (link.get("from"), link.get("to"), int(link.get("fromLane")))
        for link in network.xml.iter("connection")
        if link.get("tl") and link.get("via")
    )


def reasons(network: Converted, outcome: ElementOutcome) -> dict[str, str]:
    return {
        entry.element.rsplit(" ", 1)[1]: entry.reason
        for entry in network.network.report.entries
        if entry.outcome is outcome and "> signal " in entry.element
    }


def lights_found(network: Converted) -> tuple[int, int]:
    """Lights of the map, and those that SUMO has lost, by the network's own text."""
    signals = verify(network.network.net_xml, network.odr, network.roads).signals
    return signals.lights, len(signals.lost_lights)


@pytest.mark.slow
def test_a_light_on_a_plain_road_stops_those_who_come_towards_it() -> None:
    network = made(straight("1", light(7, 80.0)))
    assert lit_links(network) == [("1.0.f", "1.1.f", 0)]
    assert reasons(network, ElementOutcome.KEPT) == {
        "7": "traffic light on a plain road: vehicles stop there, as before a junction"
    }
    (own,) = network.network.table.lights
    assert own.signals == (("7",),)
    assert own.junctions == ()
    assert [phase.state for phase in own.phases] == ["G", "y", "r", "r"][: len(own.phases)]
    end = network.shapes["1.0.f_0"][-1]
    assert end[0] == pytest.approx(79.5, abs=0.01)
    assert lights_found(network) == (1, 0)


def test_the_other_direction_passes_a_light_without_slowing_down() -> None:
    network = made(straight("1", light(7, 80.0)))
    (free,) = [
        link
        for link in network.xml.iter("connection")
        if link.get("from") == "1.1.b" and link.get("via")
    ]
    assert free.get("tl") is None
    assert free.get("state") == "M"


def test_lights_of_both_directions_at_a_crossing_are_one_light() -> None:
    network = made(straight("1", light(7, 78.0), light(8, 84.0, "-")))
    assert lit_links(network) == [("1.0.f", "1.1.f", 0), ("1.1.b", "1.0.b", 0)]
    (own,) = network.network.table.lights
    assert sorted(own.signals) == [("7",), ("8",)]
    states = [phase.state for phase in own.phases]
    assert "GG" in states
    assert "rr" in states


def test_lights_far_apart_are_lights_of_their_own() -> None:
    network = made(straight("1", light(7, 60.0), light(8, 140.0)))
    assert len(network.network.table.lights) == 2
    assert lit_links(network) == [("1.0.f", "1.1.f", 0), ("1.1.f", "1.2.f", 0)]


def test_a_light_for_one_lane_leaves_the_lane_beside_it_free() -> None:
    lanes = section(lane(-1), lane(-2))
    network = made(straight("1", light(7, 80.0, valid=(-2, -2)), lanes=lanes))
    assert lit_links(network) == [("1.0.f", "1.1.f", 0)]
    assert reasons(network, ElementOutcome.GUESSED) == {}


def test_a_light_valid_for_no_lane_for_vehicles_is_for_those_that_it_faces() -> None:
    network = made(straight("1", light(7, 80.0, "-", valid=(0, 0))))
    assert lit_links(network) == [("1.1.b", "1.0.b", 0)]
    assert reasons(network, ElementOutcome.GUESSED) == {"7": NO_LANE_VALID}


def test_a_light_that_faces_no_traffic_of_a_one_way_road_is_taken_reversed() -> None:
    network = made(straight("1", light(7, 80.0, "-"), lanes=section(lane(-1))))
    assert lit_links(network) == [("1.0.f", "1.1.f", 0)]
    assert reasons(network, ElementOutcome.GUESSED) == {"7": NO_LANE_FACED}


@pytest.mark.parametrize(
    ("s", "orientation", "expected"),
    [
        (199.0, "+", ("1.0.f", "2.0.f", 0)),
        (200.0, "-", ("2.0.b", "1.0.b", 0)),
        (200.0, "+", ("1.0.f", "2.0.f", 0)),
    ],
)
def test_a_light_where_two_roads_meet_acts_there(
    s: float, orientation: str, expected: tuple[str, str, int]
) -> None:
    network = made(
        straight("1", light(7, s, orientation), link=to("2", "start"), lanes=LINKED),
        straight("2", start=200.0, link=to("1", "end", after=False), lanes=LINKED),
    )
    assert lit_links(network) == [expected]
    assert len(network.edges()) == 4
    assert lights_found(network) == (1, 0)


def test_a_light_at_the_start_of_a_road_holds_those_of_the_road_before() -> None:
    network = made(
        straight("1", link=to("2", "start"), lanes=LINKED),
        straight("2", light(7, 0.0), start=200.0, link=to("1", "end", after=False), lanes=LINKED),
    )
    assert lit_links(network) == [("1.0.f", "2.0.f", 0)]


@pytest.mark.parametrize("s", [0.2, 199.8])
def test_a_light_at_a_dead_end_leaves_a_metre_of_road(s: float) -> None:
    network = made(straight("1", light(7, s)))
    assert lit_links(network) == [("1.0.f", "1.1.f", 0)]
    lengths = [float(edge[0].get("length")) for edge in network.edges().values()]
    assert min(lengths) >= 1.0


def test_a_road_too_short_for_a_junction_of_its_own_says_so() -> None:
    network = made(straight("1", light(7, 1.0), length=2.0))
    assert lit_links(network) == []
    assert "controls no movement" in reasons(network, ElementOutcome.LOST)["7"]


@pytest.mark.parametrize(
    ("length", "link"), [(2.0, ("1.0.f", "2.0.f", 0)), (0.8, ("1.0.f", "3.0.f", 0))]
)
def test_a_road_of_some_metres_between_others_has_its_light(
    length: float, link: tuple[str, str, int]
) -> None:
    between = to("1", "end", after=False) + to("3", "start")
    network = made(
        straight("1", link=to("2", "start"), lanes=LINKED),
        straight("2", light(7, 0.5), start=200.0, length=length, lanes=LINKED, link=between),
        straight("3", start=200.0 + length, link=to("2", "end", after=False), lanes=LINKED),
    )
    assert lit_links(network) == [link]
    assert verify(network.network.net_xml, network.odr, network.roads).passed


def test_lights_every_few_metres_do_not_swallow_their_road() -> None:
    network = made(straight("1", *(light(number, 2.0 * number) for number in range(5, 95))))
    lengths = [lane.length for lane in network.network.table.lanes.values() if lane.id[0] != ":"]
    assert len(network.network.table.lights) >= 5
    assert sum(lengths) > 0.0
    assert lights_found(network) == (90, 0)


@pytest.mark.parametrize("more", ['rule="LHT"', 'rule="RHT"'])
def test_lights_act_on_either_side_of_the_road(more: str) -> None:
    text = document(straight("1", light(7, 80.0))).replace(
        'junction="-1" ', f'junction="-1" {more}'
    )
    assert lit_links(of_model(parse(text))) == [("1.0.f", "1.1.f", 0)]


def test_a_light_where_no_vehicle_drives_is_lost_and_breaks_no_limit() -> None:
    network = made(straight("1", light(7, 80.0), lanes=section(lane(-1, kind="sidewalk"))))
    assert "controls no movement" in reasons(network, ElementOutcome.LOST)["7"]
    assert lights_found(network) == (0, 0)
    assert verify(network.network.net_xml, network.odr, network.roads).passed


def test_a_reference_to_a_light_acts_where_it_is() -> None:
    reference = '<signalReference id="7" s="120" t="0" orientation="-"/></signals>'
    network = made(straight("1", light(7, 80.0)).replace("</signals>", reference))
    assert lit_links(network) == [("1.0.f", "1.1.f", 0), ("1.2.b", "1.1.b", 0)]


def before_junction(*lights: str, length: float, own: str = "") -> str:
    """A crossing whose leg 1 begins with a road of its own that has lights."""
    text = crossing({"1": own} if own else {})
    more = straight(
        "5", *lights, start=-70.0 - length, length=length, link=to("1", "start"), lanes=LINKED
    )
    text = text.replace(
        '<road id="1" length="60.0" junction="-1" ><link>',
        f'<road id="1" length="60.0" junction="-1" ><link>{to("5", "end", after=False)}',
    )
    leg = text[text.index('<road id="1"') : text.index("</road>")]
    text = text.replace(leg, leg[: leg.index("<lanes>")] + f"<lanes>{LINKED}</lanes>", 1)
    assert to("5", "end", after=False) in text
    return text.replace("<junction id", f"{more}<junction id", 1)


def test_a_light_on_the_road_before_is_for_the_junction_that_it_leads_to() -> None:
    network = of_model(parse(before_junction(light(7, 95.0), length=100.0)))
    assert lit_links(network) == [("1.0.f", "3.0.b", 0)]
    assert reasons(network, ElementOutcome.GUESSED) == {}


def test_a_light_more_than_80_m_before_a_junction_is_one_of_its_own() -> None:
    network = of_model(parse(before_junction(light(7, 70.0), length=100.0)))
    assert lit_links(network) == [("5.0.f", "5.1.f", 0)]


def test_a_light_before_one_that_has_lights_is_one_of_its_own() -> None:
    text = before_junction(light(7, 95.0), length=100.0, own=signal(8, LIGHT))
    network = of_model(parse(text))
    assert {link[0] for link in lit_links(network)} == {"1.0.f", "5.0.f"}
    assert len(network.network.table.lights) == 2


def test_a_light_just_behind_a_junction_is_for_those_who_come_straight() -> None:
    # Leg 3 leaves the junction with falling s, from s = 60.
    lights = {"2": signal(8, LIGHT), "3": signal(7, LIGHT, "-", s=55.0)}
    network = of_model(parse(crossing(lights)))
    assert lit_links(network) == [("1.0.f", "3.0.b", 0), ("2.0.f", "4.0.b", 0)]
    assert reasons(network, ElementOutcome.GUESSED) == {"7": BEHIND_JUNCTION}


def test_a_light_30_m_behind_a_junction_is_one_of_its_own() -> None:
    network = of_model(parse(crossing({"3": signal(7, LIGHT, "-", s=30.0)})))
    assert lit_links(network) == [("3.1.b", "3.0.b", 0)]


def test_a_light_that_faces_against_a_connecting_road_is_taken_reversed() -> None:
    own = f"<signals>{signal(7, LIGHT, '-', s=1.0)}</signals>"
    text = crossing({}).replace(way("1"), way("1", inside=own))
    network = of_model(parse(text))
    assert lit_links(network) == [("1.0.f", "3.0.b", 0)]
    assert reasons(network, ElementOutcome.GUESSED) == {"7": NO_LANE_FACED}


def test_a_network_without_such_lights_is_the_one_it_was() -> None:
    """The roads are cut for lights alone: a sign on a plain road cuts nothing."""
    stop = '<signal id="7" s="80" t="-4" name="" type="206" orientation="+" dynamic="no"/>'
    with_sign = made(straight("1", stop))
    assert with_sign.network.net_xml == made(straight("1")).network.net_xml
    assert "controls no movement" in reasons(with_sign, ElementOutcome.LOST)["7"]


CROSSWALK = (
    '<objects><object id="1" type="crosswalk" s="80" t="0" hdg="0" width="9" length="4"/></objects>'
)
WALKS = section(lane(2, kind="sidewalk", width=2.0), lane(1), lane(-1), lane(-2, kind="sidewalk"))


def walk_light(number: int, s: float) -> str:
    return light(number, s).replace(LIGHT, "1000002")


def test_a_pedestrian_light_alone_makes_a_crosswalk_of_a_plain_road_one_with_lights() -> None:
    network = made(straight("1", walk_light(7, 78.0), lanes=WALKS, inside=CROSSWALK))
    (own,) = network.network.table.lights
    assert own.signals.count(("7",)) == 1
    assert [phase.state for phase in own.phases if phase.is_stage] == ["GGr", "rrG"]
    assert "vehicles have one there" in reasons(network, ElementOutcome.GUESSED)["7"]
    (row,) = [n for n, signals in enumerate(own.signals) if signals]
    assert own.links[row].crossed


def test_a_pedestrian_light_far_from_a_crosswalk_lights_nothing() -> None:
    network = made(straight("1", walk_light(7, 120.0), lanes=WALKS, inside=CROSSWALK))
    assert network.network.table.lights == ()
    assert "within 20 m" in reasons(network, ElementOutcome.LOST)["7"]


@pytest.mark.parametrize("s", [78.0, 83.0, 95.0])
def test_a_light_at_a_crosswalk_rules_it_on_either_side(s: float) -> None:
    network = made(straight("1", light(7, s), light(8, 84.0, "-"), lanes=WALKS, inside=CROSSWALK))
    assert lit_links(network) == [("1.0.f", "1.1.f", 0), ("1.1.b", "1.0.b", 0)]
    assert len(network.network.table.lights) == 1
    assert network.network.report.figures["crossings"] == 1
