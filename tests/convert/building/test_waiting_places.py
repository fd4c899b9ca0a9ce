"""Where those who turn across oncoming traffic wait inside a junction."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path
from xml.etree import ElementTree as ET
from xml.etree.ElementTree import Element

import numpy as np
import pytest
import shapely
import sumo

from odscen.base.arrays import FloatArray
from odscen.convert.building.junctions import inner_junctions
from odscen.convert.model.net import NetLane, Request
from odscen.convert.model.net_ids import internal_edge_id, lane_id
from tests.convert.maps import Converted, converted, each_map, named
from tests.convert.turns import turn_left

SUMO = Path(sumo.SUMO_HOME) / "bin" / "sumo"


def waiting(made: Converted) -> dict[str, list[str]]:
    """Lanes up to waiting places, with the internal lanes of the paths that cross beyond."""
    return {
        junction.get("incLanes", "").split()[0]: junction.get("intLanes", "").split()
        for junction in made.xml.iter("junction")
        if junction.get("type") == "internal"
    }


def test_all_four_left_turns_of_a_crossing_wait_inside() -> None:
    assert len(waiting(converted(named("signal_crossing")))) == 4
    assert len(waiting(converted(named("left_hand_crossing")))) >= 2


@each_map()
def test_who_waits_is_out_of_the_way_of_those_it_waits_for(path: Path) -> None:
    made = converted(path)
    requests = {
        lane: (junction.get("intLanes", "").split(), request.get("response", "")[::-1])
        for junction in made.xml.iter("junction")
        for lane, request in zip(
            junction.get("intLanes", "").split(), junction.iter("request"), strict=False
        )
    }
    onwards = {
        f"{link.get('from')}_{link.get('fromLane')}": link.get("via")
        for link in made.xml.iter("connection")
        if link.get("via")
    }
    for lane in waiting(made):
        line = shapely.LineString(made.shapes[lane][:, :2])
        assert line.length >= 4.0
        inner, response = requests[onwards[lane] or ""]
        front = shapely.Point(made.shapes[lane][-1][:2])
        for other, yields in zip(inner, response, strict=True):
            if yields == "1" and "_c" not in other:
                assert front.distance(shapely.LineString(made.shapes[other][:, :2])) > 2.0


@each_map()
def test_who_waits_inside_lets_all_go_who_have_the_right_of_way(path: Path) -> None:
    """Without a light only those wait there who have nobody from the sides to let go first."""
    made = converted(path)
    links = {link.get("via", ""): link for link in made.xml.iter("connection") if link.get("via")}
    sources = {via: f"{link.get('from')}_{link.get('fromLane')}" for via, link in links.items()}
    for junction in made.xml.iter("junction"):
        inner = junction.get("intLanes", "").split()
        for lane, request in zip(inner, junction.iter("request"), strict=False):
            if request.get("cont") != "1":
                continue
            first = sources[lane]
            seen = inner_junction(made, lane).get("incLanes", "").split()
            assert seen[0] == first
            before = [
                sources.get(sources[other], sources[other])
                for other, yields in zip(inner, request.get("response", "")[::-1], strict=True)
                if yields == "1" and "_c" not in other
            ]
            assert set(before) <= set(seen)
            if not links[first].get("tl"):
                own = last_step(made, sources[first])
                along = [abs(own @ last_step(made, one)) for one in {sources[first], *before}]
                assert min(along) > 0.55, "nobody from the sides"


def test_of_turns_that_pass_beside_each_other_one_sees_the_other_until_it_is_out() -> None:
    """SUMO sees vehicles on the internal lane of another path only where centre lines cross."""
    north = turn_left("s", "w", [(1.8, -12.0), (1.8, -6.0), (-1.0, 0.6), (-12.0, 1.8)])
    south = turn_left("n", "e", [(-1.0, 12.0), (-1.0, 6.0), (1.0, -0.4), (12.0, -1.8)])
    across = turn_left("n", "e", [(-1.8, 12.0), (-1.8, -1.0), (1.0, -3.0), (12.0, -4.0)])
    rights = [Request(frozenset(), frozenset({1})), Request(frozenset({0}), frozenset({0}))]
    seen = []
    for other in (south, across):
        rest = {
            n: NetLane(lane_id(internal_edge_id("j", 2 + n)), 0, 10.0, 8.0, 3.5, (), one.shape)
            for n, one in enumerate((north, other))
        }
        first, second = inner_junctions("j", (north, other), rights, rest)
        assert first.incoming == (":j_0_0",)
        seen.append(second.incoming)
    assert seen == [(":j_1_0", "s_0", ":j_2_0"), (":j_1_0", "s_0")]


CAR = '<vType id="car" length="4.6" width="1.8" sigma="0"/>'
BUS = '<vType id="bus" vClass="bus" length="12" width="2.5" sigma="0" accel="1.2" decel="4"/>'


def pairs_on_town07(
    folder: Path, first: tuple[str, str], second: tuple[str, str], *delays: float, lit: bool
) -> dict[str, dict[str, str]]:
    """Run pairs of vehicles, each (type, edges), the second so many seconds after the first.

    Returns
    -------
    SUMO's statistics.
    """
    net, routes, out = (folder / name for name in ("net.xml", "routes.xml", "out.xml"))
    net.write_bytes(converted(named("carla-2020/Town07")).network.net_xml)
    departs = [
        (60.0 * n + late, f"{n}{name}", vtype, edges)
        for n, delay in enumerate(delays)
        for name, (vtype, edges), late in (("a", first, 10.0), ("b", second, 10.0 + delay))
    ]
    vehicles = "".join(
        f'<vehicle id="{name}" type="{vtype}" depart="{depart:.1f}" departSpeed="5">'
        f'<route edges="{edges}"/></vehicle>'
        for depart, name, vtype, edges in sorted(departs)
    )
    routes.write_text(f"<routes>{CAR}{BUS}{vehicles}</routes>")
    options = ["--step-length", "0.5", "--collision.check-junctions"]
    options += ["--collision.mingap-factor", "0", *([] if lit else ["--tls.all-off"])]
    subprocess.run(
        [SUMO, "-n", net, "-r", routes, "--statistic-output", out, *options],
        check=True,
        capture_output=True,
        env={**os.environ, "SUMO_HOME": sumo.SUMO_HOME},
    )
    counts = {one.tag: one.attrib for one in ET.parse(out).getroot()}
    assert counts["vehicles"]["inserted"] == str(2 * len(delays))
    assert counts["teleports"]["total"] == "0"
    return counts


@pytest.mark.parametrize("lit", [False, True], ids=["lights off", "green together"])
def test_two_who_turn_past_each_other_never_touch(tmp_path: Path, lit: bool) -> None:
    """80 pairs that arrive from 4 s before to 4 s after each other; 13 of them touched."""
    delays = [-4.0 + 0.1 * n for n in range(80)]
    turns = ("car", "45.0.b 0.0.f"), ("car", "44.0.f 55.0.f")
    assert pairs_on_town07(tmp_path, *turns, *delays, lit=lit)["safety"]["collisions"] == "0"


def test_opposing_turns_beside_each_other_share_a_stage_where_one_waits_for_the_other() -> None:
    light = converted(named("carla-2020/Town07")).xml.find("tlLogic[@id='J68']")
    assert light is not None
    stages = [one.get("state", "") for one in light if one.get("name", "").startswith("stage")]
    assert stages == ["gGGrrrrrrGGg", "rrrGGggGGrrr"]


def test_nobody_enters_a_junction_so_far_that_the_flank_of_a_bus_touches_it(tmp_path: Path) -> None:
    """A bus turns left, and a car enters where it came to: 26 of these 80 pairs touched."""
    delays = [-6.0 + 0.15 * n for n in range(80)]
    paths = ("bus", "47.0.f 42.0.b"), ("car", "42.0.f 43.0.f")
    assert pairs_on_town07(tmp_path, *paths, *delays, lit=True)["safety"]["collisions"] == "0"


@pytest.mark.parametrize("waiting", ["car", "bus"])
def test_nobody_waits_where_a_bus_comes_to_that_goes_straight_on_in_an_s(
    tmp_path: Path, waiting: str
) -> None:
    """A bus swings out to where others waited: 49 of these 80 pairs of buses touched."""
    delays = [-6.0 + 0.15 * n for n in range(80)]
    paths = ("bus", "0.0.b 55.0.f"), (waiting, "55.0.b 45.0.f")
    assert pairs_on_town07(tmp_path, *paths, *delays, lit=True)["safety"]["collisions"] == "0"


@each_map()
def test_only_lanes_beside_the_own_path_are_seen_besides_those_that_lead_in(path: Path) -> None:
    made = converted(path)
    for lane in waiting(made):
        beyond = made.xml.find(f"connection[@from='{lane[:-2]}']")
        assert beyond is not None
        own = beyond.get("via", "")
        path_beyond = shapely.LineString(made.shapes[own][:, :2])
        for other in inner_junction(made, own).get("incLanes", "").split()[1:]:
            if other.startswith(":"):
                distance = path_beyond.distance(shapely.LineString(made.shapes[other][:, :2]))
                assert 0.0 < distance < 2.5


def last_step(made: Converted, lane: str) -> FloatArray:
    """Direction in which a lane ends, length 1."""
    step: FloatArray = made.shapes[lane][-1][:2] - made.shapes[lane][-2][:2]
    return step / np.hypot(*step)


def inner_junction(made: Converted, lane: str) -> Element:
    """SUMO's internal junction where the lane begins."""
    found = made.xml.find(f"junction[@id='{lane}']")
    assert found is not None
    return found
