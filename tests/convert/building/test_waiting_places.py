"""Where those who turn across oncoming traffic wait inside a junction."""

from __future__ import annotations

from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
import shapely

from odscen.base.arrays import FloatArray
from tests.convert.maps import Converted, converted, each_map, named


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


def last_step(made: Converted, lane: str) -> FloatArray:
    """Direction in which a lane ends, length 1."""
    step: FloatArray = made.shapes[lane][-1][:2] - made.shapes[lane][-2][:2]
    return step / np.hypot(*step)


def inner_junction(made: Converted, lane: str) -> Element:
    """SUMO's internal junction where the lane begins."""
    found = made.xml.find(f"junction[@id='{lane}']")
    assert found is not None
    return found
