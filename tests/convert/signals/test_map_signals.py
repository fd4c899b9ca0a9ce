"""Which movements the signals of a map control, in the habits of several writers."""

from __future__ import annotations

import re

import pytest

from odscen.convert.model.conversion_report import ElementOutcome
from odscen.convert.signals.map_signals import (
    AWAY_FROM_HOME,
    AWAY_THROUGHOUT,
    FAR_SIDE,
    WHOLE_JUNCTION,
)
from odscen.convert.verify.fidelity import verify
from odscen.opendrive.parse import parse
from odscen.opendrive.road_model import OpenDrive
from tests.convert.legs import (
    controller,
    crossing,
    entry,
    junction,
    leg,
    listed,
    signal,
    way,
)
from tests.convert.maps import Converted, named, of_model
from tests.opendrive.snippets import document, lane, road, section

LEGS = ("1", "2", "3", "4")
LIGHT = "1000001"


def read(text: str) -> OpenDrive:
    return parse(text)


def made(text: str) -> Converted:
    return of_model(read(text))


def entries(network: Converted, outcome: ElementOutcome) -> dict[str, str]:
    """Reasons by signal, without the road."""
    return {
        e.element.rsplit(" ", 1)[1]: e.reason
        for e in network.network.report.entries
        if e.outcome is outcome and "> signal " in e.element
    }


def lit(network: Converted) -> set[str]:
    """Roads whose vehicles obey a light."""
    return {
        link.get("from").split(".")[0]
        for link in network.xml.iter("connection")
        if link.get("tl") and link.get("via")
    }


def lights(kind: str, orientation: str) -> dict[str, str]:
    return {name: signal(int(name), kind, orientation) for name in LEGS}


CONTROLLERS = (controller("a", 1, 3), controller("b", 2, 4))


def test_lights_that_all_face_the_wrong_way_control_what_they_would_the_right_way() -> None:
    right = made(crossing(lights(LIGHT, "+"), *CONTROLLERS, controllers=("a", "b")))
    wrong = made(crossing(lights(LIGHT, "-"), *CONTROLLERS, controllers=("a", "b")))
    assert lit(right) == set(LEGS)
    assert wrong.network.net_xml == right.network.net_xml
    assert entries(right, ElementOutcome.GUESSED) == {}
    assert entries(wrong, ElementOutcome.GUESSED) == dict.fromkeys(LEGS, AWAY_FROM_HOME)
    assert wrong.network.report.figures["signals_guessed"] == 4
    assert wrong.network.report.figures["signals_unplaced"] == 0


def test_verify_finds_the_lights_of_both_habits() -> None:
    for text in (
        crossing(lights(LIGHT, "-"), *CONTROLLERS, controllers=("a", "b")),
        crossing(lights("traffic_light", "+")),
    ):
        network = made(text)
        signals = verify(network.network.net_xml, network.odr, network.roads).signals
        assert (signals.lights, signals.lost, signals.lost_lights, signals.invented) == (
            4, (), (), ()
        )  # fmt: skip


@pytest.mark.parametrize("kind", ["206", "205", LIGHT])
def test_signals_without_controller_are_reversed_where_all_of_the_file_are(kind: str) -> None:
    right, wrong = (made(crossing(lights(kind, facing))) for facing in "+-")
    assert right.network.net_xml != made(crossing({})).network.net_xml
    assert wrong.network.net_xml == right.network.net_xml
    assert entries(wrong, ElementOutcome.GUESSED) == dict.fromkeys(LEGS, AWAY_THROUGHOUT)


def test_one_signal_that_faces_away_among_others_is_believed_and_lost() -> None:
    mixed = {**lights("206", "+"), "2": signal(2, "206", "-")}
    network = made(crossing(mixed))
    assert entries(network, ElementOutcome.GUESSED) == {}
    assert set(entries(network, ElementOutcome.LOST)) == {"2"}


def two_junctions(*on_leg: str) -> str:
    """The crossing with signals on leg 1, whose other end, 60 m back, is at a junction as well."""
    behind = '<link><predecessor elementType="junction" elementId="8"/>'
    west = '<geometry s="0" x="{}" y="0" hdg="3.141592653589793" length="{}"><line/></geometry>'
    on = '<link><predecessor id="1"/><successor id="-1"/></link>'
    through = road(
        "80",
        length=20.0,
        plan=west.format(-70, 20),
        lanes=section(lane(-1, inside=on)),
        link='<predecessor elementType="road" elementId="1" contactPoint="start"/>'
        '<successor elementType="road" elementId="5" contactPoint="start"/>',
        junction="8",
    )
    beyond = road("5", length=60.0, plan=west.format(-90, 60), lanes=section(lane(-1)))
    table = (
        '<junction id="8" name=""><connection id="0" incomingRoad="1" connectingRoad="80" '
        'contactPoint="start"><laneLink from="1" to="-1"/></connection></junction>'
    )
    others = [leg(name, signal(int(name), "206", "-")) for name in ("2", "3", "4")]
    first = leg("1", *on_leg).replace("<link>", behind, 1)
    ways = [way(name) for name in LEGS]
    parts = (first, *others, *ways, through, beyond, table)
    return document(*parts, junction(*(entry(name) for name in LEGS)))


@pytest.mark.parametrize("orientation", ["-", "+"])
def test_a_sign_is_for_the_junction_at_which_it_stands_and_not_the_other(orientation: str) -> None:
    network = made(two_junctions(signal(1, "206", orientation), signal(6, "206", "-")))
    kinds = {j.get("id"): j.get("type") for j in network.xml.iter("junction")}
    assert kinds["J9"] == "allway_stop"
    assert kinds["J8"] == "priority"
    guesses = set(entries(network, ElementOutcome.GUESSED))
    assert guesses == {"2", "3", "4", "6"} | ({"1"} if orientation == "-" else set())


def test_a_light_beyond_its_junction_is_for_the_approach_before_it() -> None:
    text = document(
        leg("1"),
        leg("3", signal(1, LIGHT, "+"), lanes=(1,)),
        way("1"),
        controller("a", 1),
        junction(entry("1"), listed("a")),
    )
    network = made(text)
    assert lit(network) == {"1"}
    assert entries(network, ElementOutcome.GUESSED) == {"1": FAR_SIDE}


def test_a_light_that_stands_anywhere_is_at_least_for_the_junction_of_its_controller() -> None:
    text = document(
        *(leg(name) for name in LEGS),
        *(way(name) for name in LEGS),
        road("7", inside=f"<signals>{signal(1, LIGHT)}</signals>", plan=(
            '<geometry s="0" x="0" y="200" hdg="0" length="100"><line/></geometry>'
        )),
        controller("a", 1),
        junction(*(entry(name) for name in LEGS), listed("a")),
    )  # fmt: skip
    network = made(text)
    assert lit(network) == set(LEGS)
    assert entries(network, ElementOutcome.GUESSED) == {"1": WHOLE_JUNCTION}


@pytest.mark.parametrize(
    ("word", "number"), [("traffic_light", LIGHT), ("give_way", "205"), ("stop", "206")]
)
def test_types_in_words_make_the_same_network_as_numbers(word: str, number: str) -> None:
    words, numbers = (made(crossing(lights(kind, "+"))) for kind in (word, number))
    assert words.network.net_xml == numbers.network.net_xml
    assert set(entries(words, ElementOutcome.KEPT)) == set(LEGS)


def test_what_is_no_known_light_or_leads_to_no_junction_is_lost_with_its_reason() -> None:
    alone = road("7", inside=f"<signals>{signal(2, '206', '+', 50.0)}</signals>", plan=(
        '<geometry s="0" x="0" y="200" hdg="0" length="100"><line/></geometry>'
    ))  # fmt: skip
    network = made(crossing({"1": signal(1, "vms")}, alone))
    lost = entries(network, ElementOutcome.LOST)
    assert set(lost) == {"1", "2"}
    assert "'vms'" in lost["1"]
    assert "no lane" in lost["2"]


@pytest.mark.slow
def test_a_pedestrian_light_without_a_crossing_is_lost() -> None:
    network = made(crossing({"1": signal(1, "1000002")}))
    assert "no crossing" in entries(network, ElementOutcome.LOST)["1"]
    crossed = entries(of_model(read(named("signal_crossing").read_text("utf-8"))),
                      ElementOutcome.GUESSED)  # fmt: skip
    assert set(crossed) == {"3", "4", "7", "8", "11", "12", "15", "16"}


def test_a_junction_whose_controller_names_nothing_is_lost() -> None:
    network = made(crossing({}, '<controller id="a"/>', controllers=("a",)))
    lost = {e.element: e.reason for e in network.network.report.entries if e.outcome == "lost"}
    assert "controller a names no signal" in lost["junction 9"]


def test_signals_with_one_id_are_each_kept_or_lost() -> None:
    text = crossing({"1": signal(1, LIGHT), "2": signal(1, "206", "-", 2.0)})
    network = made(text)
    elements = {
        (e.outcome, e.element)
        for e in network.network.report.entries
        if "> signal " in e.element and e.outcome is not ElementOutcome.REPAIRED
    }
    assert elements == {
        (ElementOutcome.KEPT, "road 1 > signal 1"),
        (ElementOutcome.LOST, "road 2 > signal 1"),
    }


def test_a_signal_on_a_connecting_road_may_face_away_as_well() -> None:
    text = document(
        *(leg(name) for name in LEGS),
        *(
            way(name, inside=f"<signals>{signal(int(name), LIGHT, '-', 0.0)}</signals>")
            for name in LEGS
        ),
        *CONTROLLERS,
        junction(*(entry(name) for name in LEGS), listed("a", "b")),
    )
    network = made(text)
    assert lit(network) == set(LEGS)
    assert set(entries(network, ElementOutcome.GUESSED)) == set(LEGS)


def test_stop_signs_of_a_shipped_map_may_be_reversed_without_another_network() -> None:
    text = named("t_junction_signs").read_text(encoding="utf-8")
    bare = re.sub(r"(<signal [^>]*)>\s*<validity [^>]*/>\s*</signal>", r"\1/>", text)
    flip = {"+": "-", "-": "+"}
    turned = re.sub(r'(<signal [^>]*orientation=")([+-])', lambda m: m[1] + flip[m[2]], bare)
    assert turned != bare != text
    assert made(turned).network.net_xml == made(bare).network.net_xml == made(text).network.net_xml


def test_a_sign_on_a_road_without_junctions_is_lost() -> None:
    lone = road("8", lanes=section(lane(-1)), inside=f"<signals>{signal(5, '206', '-')}</signals>")
    assert entries(made(document(lone)), ElementOutcome.LOST).keys() == {"5"}


def priority_sign(number: int, country: str = "DE", code: str = "306") -> str:
    return signal(number, code, more=f'country="{country}"').replace('dynamic="yes"', "")


def yielding(network: Converted) -> set[str]:
    """Roads whose vehicles wait for others at the junction."""
    return {
        link.get("from").split(".")[0]
        for link in network.xml.iter("connection")
        if link.get("via") and link.get("state") == "m" and not link.get("from").startswith(":")
    }


@pytest.mark.parametrize(
    ("country", "code"),
    [("DE", "306"), ("DE", "301"), ("SE", "B4"), ("FR", "AB6"), ("FR", "AB2"), ("RU", "2.1")],
)
def test_priority_signs_of_a_junction_let_the_other_roads_wait(country: str, code: str) -> None:
    signs = {name: priority_sign(int(name), country, code) for name in ("2", "4")}
    network = made(crossing(signs))
    assert yielding(network) == {"1", "3"}
    kept = entries(network, ElementOutcome.KEPT)
    assert kept == dict.fromkeys(
        ("2", "4"), "priority sign, as right of way in SUMO: the other approaches give way"
    )
    assert not any("priority" in e.reason for e in network.network.report.entries
                   if e.outcome is ElementOutcome.GUESSED)  # fmt: skip


def test_a_priority_sign_holds_for_the_approach_straight_opposite() -> None:
    assert yielding(made(crossing({"2": priority_sign(2)}))) == {"1", "3"}


def test_signs_to_give_way_go_before_priority_signs() -> None:
    signs = {"2": priority_sign(2), "4": signal(4, "205")}
    network = made(crossing(signs))
    assert network.network.net_xml == made(crossing({"4": signs["4"]})).network.net_xml
    told = {e.element: e.outcome for e in network.network.report.entries}
    assert told["signals of type DE 306"] is ElementOutcome.GUESSED


def test_priority_signs_on_all_approaches_distinguish_none() -> None:
    signs = {name: priority_sign(int(name)) for name in LEGS}
    network = made(crossing(signs))
    assert network.network.net_xml == made(crossing({})).network.net_xml
