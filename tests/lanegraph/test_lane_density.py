"""What a map may cost: lanes in one place, lengths of lanes, numbers of nodes."""

from __future__ import annotations

import re

import pytest

from odscen.base.errors import OpenDriveError
from odscen.lanegraph.build_graphs import build_map_graph
from odscen.lanegraph.graphs import MapGraph
from odscen.lanegraph.lane_density import MOST_ENDS, MOST_TOGETHER
from odscen.opendrive.parse import parse
from tests.opendrive.snippets import LINE, document, lane, road, section


def built(text: str, spacing: float = 2.0) -> MapGraph:
    return build_map_graph(parse(text), name="m", sha256="0", spacing=spacing)


def overlapping(count: int) -> str:
    """Roads in the same place, each with a speed limit of its own, so that none is merged."""
    return document(
        *(
            road(
                str(number),
                lanes=section(lane(-1, inside=f'<speed sOffset="0" max="{number}"/>')),
            )
            for number in range(1, count + 1)
        )
    )


def test_as_many_lanes_as_may_lie_together_are_taken() -> None:
    assert len(built(overlapping(MOST_TOGETHER)).lanes.x) == 50 * MOST_TOGETHER


def test_more_lanes_in_one_place_are_refused_with_the_place_and_two_roads() -> None:
    with pytest.raises(OpenDriveError) as caught:
        built(overlapping(MOST_TOGETHER + 1))
    assert re.fullmatch(
        r"road 1 > laneSection 0 > lane -1: 65 lanes lie on each other at \(\d+, -2\), the last of "
        r"them lane -1 of road 65, laneSection 0; the limit is 64",
        str(caught.value),
    )


def test_lane_sections_that_lie_on_each_other_are_refused() -> None:
    sections = section(lane(-1)) + "".join(section(lane(-1), s=50) for _ in range(100))
    with pytest.raises(OpenDriveError, match=r"road 1 > .* lanes lie on each other at \(50, -2\)"):
        built(document(road(lanes=sections)))


def test_walks_that_lie_on_each_other_are_refused_as_lanes_are() -> None:
    walk = section(lane(-1, kind="sidewalk"))
    offset = '<laneOffset s="0" a="{}" b="0" c="0" d="0"/>'
    roads = [road(str(k), lanes=offset.format(k / 1000) + walk) for k in range(200)]
    with pytest.raises(OpenDriveError, match=r"\d+ lanes lie on each other at"):
        built(document(*roads))


def test_lanes_above_each_other_do_not_lie_together() -> None:
    height = "<elevationProfile><elevation s='0' a='{}' b='0' c='0' d='0'/></elevationProfile>"
    roads = [road(str(k), lanes=section(lane(-1)), inside=height.format(5 * k)) for k in range(80)]
    assert len(built(document(*roads)).lanes.x) == 50 * 80


def test_lanes_that_wind_to_more_than_all_lanes_may_have_are_refused() -> None:
    jumps = "".join(
        f'<laneOffset s="{s}" a="{900 * (s % 2)}" b="0" c="0" d="0"/>' for s in range(2000)
    )
    text = road(
        length=2000.0, plan=LINE.replace('"100"', '"2000"'), lanes=jumps + section(lane(-1))
    )
    with pytest.raises(OpenDriveError, match=r"lane -1: is 1\.\d+e\+06 m long on 2e\+03 m of its"):
        built(document(text))


def test_more_nodes_than_memory_can_hold_are_refused_before_they_are_made() -> None:
    long = road(length=3e5, plan=LINE.replace('"100"', '"300000"'), lanes=section(lane(-1)))
    with pytest.raises(OpenDriveError, match=r"3e\+06 nodes at a spacing of 0\.1 m; the limit is"):
        built(document(long), spacing=0.1)


def test_a_row_of_lane_sections_of_centimetres_is_refused_with_the_place() -> None:
    sections = "".join(section(lane(-1), s=k / 10) for k in range(1000))
    with pytest.raises(OpenDriveError) as caught:
        built(document(road(lanes=sections)))
    assert re.fullmatch(
        r"road 1 > laneSection \d+ > lane -1: \d+ ends of lanes or lane sections with a walk "
        rf"beside or on them lie within 3 m of \(.*\); the limit is {MOST_ENDS}",
        str(caught.value),
    )


def test_lane_sections_of_half_a_metre_are_taken() -> None:
    sections = "".join(section(lane(-1), s=k / 2) for k in range(200))
    assert len(built(document(road(lanes=sections))).lanes.x) == 200
