"""What ``<priority>`` and signs of a map become: the right of way in the file."""

from __future__ import annotations

import os
import re
import subprocess
from functools import cache
from pathlib import Path
from xml.etree import ElementTree as ET
from xml.etree.ElementTree import Element

import pytest
import sumo

from odscen.opendrive.parse import parse
from tests.convert.maps import Converted, named, of_model

SUMO = Path(sumo.SUMO_HOME) / "bin" / "sumo"
SIGNALS = re.compile(r"<signals>.*?</signals>", re.DOTALL)
OBJECTS = re.compile(r"<objects>.*?</objects>", re.DOTALL)
PRIORITY = re.compile(r"<priority [^>]*>")
SLOW = re.compile(r'(?<=<speed max=")30(?=")')


@cache
def stripped(*what: re.Pattern[str]) -> Converted:
    """The T junctions without their signs, crosswalks or priorities."""
    text = named("t_junction_signs").read_text(encoding="utf-8")
    for pattern in what:
        text = pattern.sub("", text)
    return of_model(parse(text))


def seen_from(name: str) -> dict[tuple[str, str], str | None]:
    """Metres before the line from which one sees, by edge and direction, of given connections."""
    links = of_model(parse(named(name).read_bytes())).xml.iter("connection")
    return {
        (link.get("from", ""), link.get("dir", "")): link.get("visibility")
        for link in links
        if link.get("via") and not link.get("from", "").startswith(":")
    }


def test_at_a_yield_sign_one_sees_others_late_and_who_only_merges_earlier() -> None:
    seen = seen_from("t_junction_signs")
    assert (seen["5.1.f", "l"], seen["5.1.f", "r"]) == ("0.3", "1.25")
    assert {seen["3.1.f", "l"], seen["1.0.b", "s"]} == {None}, "SUMO's own"
    entries = seen_from("roundabout")
    assert entries["1.1.f", "r"] == "1.25"
    assert {entries["5.0.f", "l"], entries["5.0.f", "r"]} == {None}


def test_who_gives_way_without_a_sign_sees_others_45_m_before_at_50_kmh() -> None:
    assert seen_from("t_junction_signs")["1.0.b", "l"] == "45"
    crossing = of_model(parse(named("signal_crossing").read_bytes())).xml
    links = [link for link in crossing.iter("connection") if link.get("via")]
    waiting = [link for link in links if link.get("from", "").startswith(":")]
    assert [link.get("visibility") for link in waiting] == ["45"] * 4
    assert {link.get("visibility") for link in links if link.get("state") == "O"} == {None}


@pytest.mark.slow
def test_who_turns_across_an_empty_road_does_not_slow_down_to_look(tmp_path: Path) -> None:
    """A car from 50 km/h: 7.1 m/s is comfortable in the curve, 6.4 m/s what it had to be."""
    net, routes, out = (tmp_path / name for name in ("net.xml", "routes.xml", "fcd.xml"))
    net.write_bytes(of_model(parse(named("t_junction_signs").read_bytes())).network.net_xml)
    routes.write_text(
        '<routes><vType id="car" sigma="0" speedDev="0"/>'
        '<vehicle id="one" type="car" depart="0" departSpeed="max">'
        '<route edges="4.0.f 4.1.f 1.0.f 1.1.f 1.2.f 3.1.b 3.0.b"/></vehicle></routes>'
    )
    subprocess.run(
        [SUMO, "-n", net, "-r", routes, "--fcd-output", out, "--step-length", "0.1"],
        check=True,
        capture_output=True,
        env={**os.environ, "SUMO_HOME": sumo.SUMO_HOME},
    )
    seen = [one.attrib for one in ET.parse(out).iter("vehicle")]
    before = [float(one["speed"]) for one in seen if one["lane"].startswith("1.2.f")]
    assert min(before) > 6.7


def _last(made: Converted, link: Element) -> str:
    """The last internal lane of a connection: who turns across waits between two of them."""
    via = link.get("via", "")
    onwards = [
        other.get("via")
        for other in made.xml.iter("connection")
        if f"{other.get('from')}_{other.get('fromLane')}" == via and other.get("via")
    ]
    return onwards[0] if onwards else via


def waits(made: Converted, one: tuple[str, str], other: tuple[str, str]) -> bool:
    """Whether the connection between two roads waits for another one; one of both does."""
    links = [link for link in made.xml.iter("connection") if link.get("via")]
    roads = [(link.get("from").split(".")[0], link.get("to").split(".")[0]) for link in links]
    via, via2 = (_last(made, links[roads.index(pair)]) for pair in (one, other))
    for junction in made.xml.iter("junction"):
        inner = junction.get("intLanes").split()
        if via in inner:
            requests = [request.get("response")[::-1] for request in junction.iter("request")]
            first, second = inner.index(via), inner.index(via2)
            assert requests[first][second] != requests[second][first]
            return requests[first][second] == "1"
    raise AssertionError


YIELDS = [
    (("5", "4"), ("1", "4")),
    (("5", "4"), ("4", "1")),
    (("5", "4"), ("1", "5")),
    (("5", "1"), ("4", "1")),
    (("3", "2"), ("2", "1")),
    (("3", "2"), ("1", "3")),
    (("3", "1"), ("2", "1")),
]
"""Connections from the side streets, and those on the main road that they let pass."""


@pytest.mark.parametrize(("side", "main"), YIELDS)
@pytest.mark.parametrize(
    "without",
    [(), (SIGNALS,), (SIGNALS, OBJECTS), (PRIORITY,), (PRIORITY, OBJECTS)],
    ids=["all", "no signs", "priorities only", "no priorities", "signs only"],
)
def test_side_streets_yield_by_sign_or_by_priority(
    without: tuple[re.Pattern[str], ...], side: tuple[str, str], main: tuple[str, str]
) -> None:
    assert waits(stripped(*without), side, main)


def test_without_both_the_faster_road_goes_first() -> None:
    bare = stripped(SIGNALS, PRIORITY)
    for side, main in YIELDS[:4]:
        assert waits(bare, side, main)


def test_of_equally_fast_roads_right_goes_before_left() -> None:
    text = named("t_junction_signs").read_text(encoding="utf-8")
    for pattern in (SIGNALS, PRIORITY):
        text = pattern.sub("", text)
    bare = of_model(parse(SLOW.sub("50", text)))
    assert waits(bare, ("4", "1"), ("5", "4")), "the side street is on the right"
    assert waits(bare, ("5", "4"), ("1", "4"))
    assert {j.get("type") for j in bare.xml.iter("junction")} >= {"right_before_left"}


def test_a_priority_may_name_connecting_roads_instead() -> None:
    text = SIGNALS.sub("", named("t_junction_signs").read_text(encoding="utf-8"))
    turn, straight = "15", "13"
    first = '<priority high="{}" low="{}"/></junction>'
    for high, low in ((straight, turn), (turn, straight)):
        made = of_model(
            parse(PRIORITY.sub("", text).replace("</junction>", first.format(high, low)))
        )
        assert waits(made, ("5", "4"), ("4", "1")) is (low == turn)
