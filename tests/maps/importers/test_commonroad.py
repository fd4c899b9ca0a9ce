"""Lanelets of CommonRoad scenarios as roads."""

from __future__ import annotations

from pathlib import Path

import pytest

from odscen.base.errors import InputError
from odscen.maps.importers.commonroad import CommonRoadImporter, read_commonroad_lanelets
from odscen.opendrive.parse import parse

SHARED = Path(__file__).parents[4] / "shared" / "recordings" / "commonroad"


def bound(side: str, places: list[tuple[float, float]], mark: str = "") -> str:
    points = "".join(f"<point><x>{x}</x><y>{y}</y></point>" for x, y in places)
    marking = f"<lineMarking>{mark}</lineMarking>" if mark else ""
    return f"<{side}Bound>{points}{marking}</{side}Bound>"


def scenario(beside: str = '<adjacentLeft ref="1" drivingDir="same"/>') -> bytes:
    """Two lanes to the east; the line between them has a point more in one of them."""
    left = bound("left", [(0, 3), (50, 3)]) + bound("right", [(0, 0), (25, 0), (50, 0)], "dashed")
    right = bound("left", [(0, 0), (50, 0)]) + bound("right", [(0, -4), (50, -4)])
    return f"""<commonRoad timeStepSize="0.1" commonRoadVersion="2020a">
        <lanelet id="1">{left}<adjacentRight ref="2" drivingDir="same"/>
        <trafficSignRef ref="9"/></lanelet>
        <lanelet id="2">{right}{beside}<laneletType>highway</laneletType></lanelet>
        <trafficSign id="9"><trafficSignElement><trafficSignID>274</trafficSignID>
        <additionalValue>25</additionalValue></trafficSignElement></trafficSign>
        </commonRoad>""".encode()


def test_lanes_beside_each_other_are_one_road_with_their_widths_and_limits() -> None:
    importer = CommonRoadImporter()
    assert importer.detect(scenario(), "scene.xml")
    made = importer.to_opendrive(scenario(), {"traffic": "auto"})
    [road] = parse(made.xodr).roads.values()
    assert road.length == pytest.approx(50.0, abs=1e-3)
    [section] = road.sections
    widths = [lane.widths[0].a for lane in section.lanes.values() if lane.type == "driving"]
    assert sorted(widths) == pytest.approx([3.0, 4.0], abs=1e-3)
    speeds = [speed.max for lane in section.lanes.values() for speed in lane.speeds]
    assert 25.0 in speeds
    apart = importer.to_opendrive(scenario(""), {"traffic": "auto"})
    assert len(parse(apart.xodr).roads) == 2


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (scenario().replace(b"<x>25</x>", b"<x>far</x>"), r"lanelet 1 > rightBound: .*'far'"),
        (b"<commonRoad/>", "no lanelet of the file can be read"),
    ],
)
def test_what_is_wrong_is_said(content: bytes, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read_commonroad_lanelets(content)


@pytest.mark.slow
@pytest.mark.skipif(not SHARED.is_dir(), reason="needs the recordings of ../shared")
@pytest.mark.parametrize(
    ("name", "lanelets"), [("USA_US101-3_3_T-1", 12), ("USA_Lanker-1_1_T-1", 91)]
)
def test_scenarios_of_others_keep_all_lanelets(name: str, lanelets: int) -> None:
    content = (SHARED / f"{name}.xml").read_bytes()
    found = read_commonroad_lanelets(content)
    assert len(found.lanelets) == lanelets
    made = CommonRoadImporter().to_opendrive(
        (SHARED / f"{name}.xml").read_bytes(), {"traffic": "auto"}
    )
    assert [row for row in made.entries if row.outcome == "lost"] == []
    assert parse(made.xodr).roads
