"""Lane segments of Argoverse 2 as roads."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from odscen.base.errors import InputError
from odscen.maps.importers.argoverse import ArgoverseImporter, read_argoverse_map
from odscen.opendrive.parse import parse

SHARED = Path(__file__).parents[4] / "shared" / "recordings" / "av2"


def line(*places: tuple[float, float]) -> list[dict[str, float]]:
    return [{"x": x, "y": y, "z": 0.0} for x, y in places]


def segment(
    left: list[dict[str, float]], right: list[dict[str, float]], **more: Any
) -> dict[str, Any]:
    return {
        "lane_type": "VEHICLE", "is_intersection": False,
        "left_lane_boundary": left, "right_lane_boundary": right,
        "left_lane_mark_type": "DOUBLE_SOLID_YELLOW", "right_lane_mark_type": "NONE",
        "left_neighbor_id": None, "right_neighbor_id": None, **more,
    }  # fmt: skip


def town() -> dict[str, Any]:
    """A lane to the east, one to the west whose line has a point more, and a crosswalk."""
    return {
        "lane_segments": {
            "1": segment(line((0, 0), (50, 0)), line((0, -3), (50, -3)), id=1, left_neighbor_id=2),
            "2": segment(
                line((50, 0), (25, 0), (0, 0)), line((50, 4), (0, 4)), id=2, left_neighbor_id=1
            ),
        },
        "pedestrian_crossings": {
            "9": {"id": 9, "edge1": line((20, -3), (20, 4)), "edge2": line((23, -3), (23, 4))}
        },
        "drivable_areas": {},
    }


def test_lanes_towards_each_other_are_one_road_with_a_crosswalk() -> None:
    importer, content = ArgoverseImporter(), json.dumps(town()).encode()
    assert importer.detect(content, "log_map_archive_1.json")
    assert not importer.detect(b'{"format": "odscen-scenario"}', "a.json")
    odr = parse(importer.to_opendrive(content, {"traffic": "right"}).xodr)
    [road] = odr.roads.values()
    assert road.length == pytest.approx(50.0, abs=1e-3)
    [section] = road.sections
    widths = {
        lane_id > 0: lane.widths[0].a
        for lane_id, lane in section.lanes.items()
        if lane.type == "driving"
    }
    assert sorted(widths.values()) == pytest.approx([3.0, 4.0], abs=1e-3)
    assert any(item.type == "crosswalk" for item in road.objects)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"{", "it is no JSON"),
        (b"[" * 100_000, "it is no JSON"),
        (b'{"lane_segments": [1]}', "lane_segments: it is no object of objects"),
        (b'{"lane_segments": {}}', "lane_segments: there is no lane segment"),
        (
            json.dumps(town()).replace('"x": 25', '"x": "far"').encode(),
            r"lane_segments > 2 > left: \('far', '0'\) is no place",
        ),
    ],
)
def test_what_is_wrong_is_said(content: bytes, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read_argoverse_map(content)


@pytest.mark.skipif(not SHARED.is_dir(), reason="needs the recordings of ../shared")
def test_a_map_of_others_keeps_its_lanes() -> None:
    content = (SHARED / "log_map_archive_0a1e6f0a.json").read_bytes()
    found = read_argoverse_map(content)
    assert len([one for one in found.lanelets.values() if one.subtype != "crosswalk"]) == 71
    made = ArgoverseImporter().to_opendrive(content, {"traffic": "right"})
    assert len(parse(made.xodr).junctions) >= 3
    lost = [row.reason for row in made.entries if row.outcome == "lost"]
    assert not [reason for reason in lost if "bound" in reason]
