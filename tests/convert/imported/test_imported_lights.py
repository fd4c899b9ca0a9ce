"""What the letters of lights are for in networks that odscen has not written."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from odscen.base.errors import InputError
from odscen.convert.building.network import build_network
from odscen.convert.imported.imported_lights import LightLetters, imported_letters
from odscen.convert.imported.net_import import read_network
from odscen.lanegraph.build_graphs import build_map_graph
from odscen.maps.netconvert import NetconvertLimits, run_netconvert
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.parse import parse

if TYPE_CHECKING:
    from odscen.convert.lane_table.table import SumoLight

MAPS = Path(__file__).parents[3] / "maps"
LIMITS = NetconvertLimits(20.0, 1 << 30)

NODES = """<nodes>
  <node id="w" x="0" y="0"/> <node id="e" x="230" y="0"/>
  <node id="n" x="100" y="100"/> <node id="m" x="130" y="100"/>
  <node id="a" x="100" y="0" type="traffic_light" tl="both"/>
  <node id="b" x="130" y="0" type="traffic_light" tl="both"/>
</nodes>"""
WAYS = ("wa", "aw", "ab", "ba", "be", "eb", "na", "an", "mb", "bm")


@cache
def two_junctions(*options: str) -> bytes:
    """A road that two others meet from the left, 30 m apart, with one light for both."""
    edges = (f'<edge id="{way}" from="{way[0]}" to="{way[1]}" speed="13.9"/>' for way in WAYS)
    files = {"n.nod.xml": NODES.encode(), "e.edg.xml": f"<edges>{''.join(edges)}</edges>".encode()}
    plain = ("--node-files=n.nod.xml", "--edge-files=e.edg.xml", "--no-turnarounds")
    return run_netconvert([*plain, *options], files=files, limits=LIMITS).net_xml


def letters_of(net: bytes) -> LightLetters:
    (letters,) = imported_letters(read_network(net)).values()
    return letters


def ways(letters: LightLetters) -> list[str]:
    """Edges and turn of each letter."""
    return [f"{one.source[:-2]}>{one.target[:-2]} {one.turn}" for one in letters.links]


@cache
def ours(name: str) -> tuple[bytes, tuple[SumoLight, ...]]:
    """A shipped map's network and its lights."""
    odr = parse((MAPS / f"{name}.xodr").read_bytes(), file=name)
    roads = RoadTable.of(odr)
    walks = build_map_graph(odr, name=name, sha256="0" * 64, table=roads).walks
    network = build_network(odr, roads, walks)
    return network.net_xml, network.table.lights


@pytest.mark.slow
@pytest.mark.parametrize("name", ["signal_crossing", "left_hand_crossing", "town_5x5"])
def test_a_network_of_ours_has_the_links_and_conflicts_that_it_was_written_with(name: str) -> None:
    net, lights = ours(name)
    found = imported_letters(read_network(net))
    for light in lights:
        links, conflicts = found[light.id]
        assert [one[:5] for one in links] == [one[:5] for one in light.links]
        assert [one[:4] for one in conflicts] == [one[:4] for one in light.conflicts]
        # The file rounds places where paths meet, and clearing times are whole seconds.
        for one, other in zip(conflicts, light.conflicts, strict=True):
            assert one[4:] == pytest.approx(other[4:], abs=1.0)


def test_links_of_one_light_in_two_junctions_meet_only_in_their_own() -> None:
    letters = letters_of(two_junctions())
    names = ways(letters)
    assert sorted(names) == [
        "ab>be s", "ab>bm l", "ba>an r", "ba>aw s", "eb>ba s", "eb>bm r",
        "mb>ba r", "mb>be l", "na>ab l", "na>aw r", "wa>ab s", "wa>an l",
    ]  # fmt: skip
    met = {frozenset((names[one.one], names[one.other])) for one in letters.conflicts}
    assert frozenset(("na>ab l", "wa>ab s")) in met
    assert {"".join(sorted({name[1] for name in pair})) for pair in met} == {"a", "b"}


def test_who_turns_across_gives_way_and_may_share_green_with_oncoming_traffic() -> None:
    letters = letters_of(two_junctions())
    names = ways(letters)
    found = {(names[one.one], names[one.other]): one for one in letters.conflicts}
    left = found["ba>aw s", "wa>an l"]
    assert names[left.yields] == "wa>an l"
    assert left.shares
    crossing = found["na>ab l", "ba>aw s"]
    assert not crossing.shares
    assert (crossing.clearing, crossing.clearing_back) == (1.0, 1.0)


def test_connections_with_one_letter_have_the_name_of_the_first_and_conflicts_of_all() -> None:
    letters = letters_of(two_junctions("--tls.group-signals=true"))
    names = ways(letters)
    assert len(names) == 10
    assert all(one.one != one.other for one in letters.conflicts)
    single = letters_of(two_junctions())
    own = {frozenset((ways(single)[one.one], ways(single)[one.other])) for one in single.conflicts}
    grouped = {frozenset((names[one.one], names[one.other])) for one in letters.conflicts}
    assert {pair for pair in own if pair <= set(names)} <= grouped


def test_a_letter_without_a_connection_stays_and_is_for_nothing() -> None:
    net, (light,) = ours("signal_crossing")
    uncontrolled, count = re.subn(rb' tl="J10001" linkIndex="4"', b"", net)
    assert count == 1
    links, conflicts = letters_of(uncontrolled)
    assert links[4] == ("", "", "", 0.0, (), ())
    assert [one[:5] for one in links[:4] + links[5:]] == [
        one[:5] for one in light.links[:4] + light.links[5:]
    ]
    assert conflicts == tuple(one for one in light.conflicts if 4 not in one[:2])


def test_a_turn_that_is_forbidden_in_netedit_leaves_the_names_of_the_others() -> None:
    net, (light,) = ours("signal_crossing")
    patch = b"""<connections>
      <delete from="1.1.f" fromLane="2" to="4.1.b" toLane="1"/>
    </connections>"""
    done = run_netconvert(
        ["--sumo-net-file=n.net.xml", "--connection-files=p.con.xml", "--precision=4"],
        files={"n.net.xml": net, "p.con.xml": patch},
        limits=LIMITS,
    )
    links, conflicts = letters_of(done.net_xml)
    kept = [one for one in light.links if one[:2] != ("1.1.f_2", "4.1.b_1")]
    assert len(links) == len(kept) == 23
    assert [one[:4] for one in links[:19]] == [one[:4] for one in kept[:19]]
    assert [set(one.crossed) for one in links] == [set(one.crossed) for one in kept]
    place = {n: n - (n > 4) for n in range(24) if n != 4}
    assert {one[:2] for one in conflicts} == {
        (place[one.one], place[one.other]) for one in light.conflicts if 4 not in one[:2]
    }


def test_a_junction_with_other_links_than_it_has_rows_for_is_refused() -> None:
    net, count = re.subn(rb'<connection from="mb" to="be"[^>]*/>', b"", two_junctions())
    assert count == 1
    with pytest.raises(InputError, match="junction b has 5 links, but 6 requests"):
        letters_of(net)


def test_a_letter_that_the_states_do_not_have_is_refused() -> None:
    net = two_junctions().replace(b'linkIndex="3"', b'linkIndex="33"')
    with pytest.raises(InputError, match="letter 33 of light both, whose states have 12"):
        letters_of(net)
