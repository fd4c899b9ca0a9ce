"""Edits that mend a map: what each does, that places find it again, and what does not fit."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from lxml import etree

from odscen.base.errors import InputError
from odscen.base.ids import LaneKey, RoadId
from odscen.maps.map_edits import MendedMap, check_edits, mend_map, read_edits
from odscen.maps.shipped import shipped_maps
from odscen.maps.store import Workspace
from odscen.opendrive import parse as parse_module
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.objects import crosswalks, is_crosswalk, is_stop_line, stop_lines
from odscen.opendrive.parse import ReadRoads, parse
from odscen.opendrive.topology import lane_successors

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.opendrive.road_model import OpenDrive

CROSSING = next(path for path in shipped_maps() if path.stem == "signal_crossing").read_bytes()
BEFORE = parse(CROSSING)
TABLE = RoadTable.of(BEFORE)


def place(road: str, lane: int, s: float, at: float = 0.5) -> dict[str, float]:
    """A place on a lane of the map as it was."""
    key = next(k for k in TABLE.lane_keys if (k.road, k.lane) == (road, lane))
    row = np.array([TABLE.lane_index[key]])
    points = TABLE.lane_points(row, np.array([s]), at=at)
    turn = 0.0 if TABLE.lane_forward[row[0]] else np.pi
    return {"x": float(points.x[0]), "y": float(points.y[0]), "hdg": float(points.hdg[0]) + turn}


def mended(*edits: dict[str, Any], content: bytes = CROSSING) -> tuple[OpenDrive, MendedMap]:
    result = mend_map(content, check_edits(list(edits)))
    model = parse(result.xodr)
    assert model.notes == BEFORE.notes
    return model, result


def done(result: MendedMap) -> list[tuple[str, str]]:
    return [(str(row.outcome), row.reason) for row in result.entries]


def lane_widths(model: OpenDrive, road: str, lane: int, s: list[float]) -> list[float]:
    table = RoadTable.of(model)
    row = table.lane_index[LaneKey(RoadId(road), 0, lane)]
    return table.lane_width(np.full(len(s), row), np.array(s)).tolist()


def test_a_lane_is_widened_with_tapers_and_what_is_outside_moves_along() -> None:
    model, result = mended({"kind": "lane_width", "at": place("1", -1, 60.0), "width": 4.0})
    assert done(result) == [("repaired", "4 m wide, was 3.25 m")]
    assert lane_widths(model, "1", -1, [0.0, 30.0, 60.0, 109.0, 130.0]) == pytest.approx(
        [3.25, 4.0, 4.0, 4.0, 3.25], abs=0.01
    )
    assert lane_widths(model, "1", -2, [60.0]) == [3.25]
    # Lights stand at s of about 120 m, outside of the lane, where it is wider by a part of 0.75 m.
    was = {s.id: s.t for s in BEFORE.roads[RoadId("1")].signals}
    now = {s.id: s.t for s in model.roads[RoadId("1")].signals}
    moved = {key: round(now[key] - was[key], 2) for key in was if now[key] != was[key]}
    assert moved
    assert all(-0.75 < by < 0 for by in moved.values())


def test_limit_access_and_road_marks_hold_on_the_lanes_that_were_meant() -> None:
    model, result = mended(
        {"kind": "speed_limit", "at": place("2", 1, 60.0), "limit": 30},
        {"kind": "access", "at": place("2", -2, 60.0), "type": "bus"},
        {"kind": "road_mark", "at": place("2", -1, 60.0, at=0.95), "mark": "solid"},
        {"kind": "road_mark", "at": place("2", -1, 60.0, at=0.05), "mark": "solid solid"},
    )
    assert [row[0] for row in done(result)] == ["repaired"] * 4
    lanes = model.roads[RoadId("2")].sections[0].lanes
    assert [s.max * 3.6 for s in lanes[1].speeds] == pytest.approx([30.0])
    assert lanes[-1].speeds == BEFORE.roads[RoadId("2")].sections[0].lanes[-1].speeds
    assert lanes[-2].type == "bus"
    assert (lanes[-1].road_marks[0].type, lanes[-1].road_marks[0].lane_change) == ("solid", "none")
    assert lanes[0].road_marks[0].type == "solid solid"


def test_stop_lines_and_crosswalks_are_moved_added_and_removed() -> None:
    (line,) = [o for o in BEFORE.roads[RoadId("3")].objects if is_stop_line(o)]
    (old,) = [o for o in BEFORE.roads[RoadId("3")].objects if is_crosswalk(o)]
    model, result = mended(
        {"kind": "move_stop_line", "at": place("3", -1, line.s), "by": -5.0},
        {"kind": "remove_crosswalk", "at": place("3", -1, old.s)},
        {"kind": "add_crosswalk", "at": place("3", -1, 60.0), "width": 5.0},
        {"kind": "add_stop_line", "at": place("3", 1, 50.0)},
        {"kind": "add_island", "at": place("3", -1, 60.0, at=0.0), "length": 8, "width": 1.5},
    )
    assert [row[0] for row in done(result)] == ["repaired"] * 5
    table = RoadTable.of(model)
    (walk,) = [c for c in crosswalks(model, table) if c.road == "3"]
    # 2 x 1.75 m for bicycles, 3 x 3.25 m for cars, half a metre on either sidewalk.
    assert np.hypot(*(walk.axis[1] - walk.axis[0])) == pytest.approx(14.25, abs=0.01)
    assert walk.width == pytest.approx(5.0, abs=0.01)
    lines = {round(x.s, 1): x.orientation for x in stop_lines(model, table) if x.road == "3"}
    assert lines == {round(line.s - 5.0, 1): line.orientation, 50.0: "-"}
    assert [o.type for o in model.roads[RoadId("3")].objects].count("trafficIsland") == 1


def test_lights_leave_their_controllers_and_new_ones_are_the_junction_s() -> None:
    lights = {s.id: s for s in BEFORE.roads[RoadId("1")].signals}
    s, t = (np.array([getattr(lights[key], name) for key in ("1", "2")]) for name in "st")
    x, y, _ = TABLE.points(np.array([0, 0]), s, t)
    poles = [{"x": a, "y": b} for a, b in zip(x.tolist(), y.tolist(), strict=True)]
    model, result = mended(
        *({"kind": "remove_light", "at": pole} for pole in poles),
        {"kind": "add_light", "at": place("1", -1, 118.0)},
        {"kind": "add_sign", "at": place("1", 1, 40.0), "type": "274", "value": 30, "unit": "km/h"},
    )
    assert [row[0] for row in done(result)] == ["repaired"] * 4
    signals = {s.id: s for s in model.roads[RoadId("1")].signals}
    assert not {"1", "2"} & set(signals)
    controlled = {key: [c[0] for c in x.controls] for key, x in model.controllers.items()}
    assert controlled["1"] == ["10"]
    assert "1" not in controlled["2"]
    (light,) = [s for s in signals.values() if s.dynamic and s.id not in lights]
    (own,) = [key for key, names in controlled.items() if names == [light.id]]
    assert own in next(iter(model.junctions.values())).controllers
    assert {v.from_lane for v in light.validities} == {-1, -2}
    (sign,) = [s for s in signals.values() if s.type == "274"]
    assert sign.value == pytest.approx(30 / 3.6)
    assert {v.from_lane for v in sign.validities} == {1}


def test_turns_of_lanes_are_removed_with_their_connecting_roads_and_drawn_anew() -> None:
    # Road 6 leads straight on from lane -2 of road 1 to lane 1 of road 3.
    turn = {"at": place("1", -2, 110.0), "to": place("3", 1, 110.0)}
    model, result = mended({"kind": "remove_turn", **turn})
    assert done(result)[0][0] == "repaired"
    assert RoadId("6") not in model.roads
    start, end = LaneKey(RoadId("1"), 0, -2), LaneKey(RoadId("3"), 0, 1)
    after = lane_successors(model)
    assert end not in {key for through in after[start] for key in after[through]}
    # The lane that only turns left leads straight on, too.
    model, result = mended({"kind": "add_turn", **turn, "at": place("1", -1, 110.0)})
    assert done(result)[0][0] == "repaired"
    after = lane_successors(model)
    begin = LaneKey(RoadId("1"), 0, -1)
    (through,) = [key for key in after[begin] if end in after[key]]
    table = RoadTable.of(model)
    rows = np.array([table.lane_index[through]])
    length = model.roads[through.road].length
    ends = [
        (table.lane_points(rows, np.array([0.0])), begin, 130.0),
        (table.lane_points(rows, np.array([length])), end, 130.0),
    ]
    for here, key, s in ends:
        there = table.lane_points(np.array([table.lane_index[key]]), np.array([s]))
        assert np.hypot(here.x - there.x, here.y - there.y)[0] < 0.01


def test_what_does_not_fit_is_listed_with_its_reason_and_the_rest_is_done() -> None:
    far = {"x": 900.0, "y": 900.0}
    only = {"at": place("1", -2, 110.0), "to": place("2", 1, 110.0)}
    model, result = mended(
        {"kind": "lane_width", "at": far, "width": 4.0},
        {"kind": "remove_crosswalk", "at": place("1", -1, 60.0)},
        {"kind": "add_turn", "at": place("1", 1, 60.0), "to": place("4", 1, 60.0)},
        {"kind": "remove_turn", **only},
        {"kind": "remove_turn", "at": only["at"], "to": place("3", 1, 110.0)},
        {"kind": "speed_limit", "at": place("4", 1, 60.0), "limit": 20},
    )
    fates = done(result)
    assert fates[0] == ("lost", "there is no such lane at x 900.0 m, y 900.0 m")
    assert re.match(r"there is no crosswalk within 6 m .*; the nearest is \d+ m away", fates[1][1])
    assert fates[2] == ("lost", "the first lane does not end at a junction")
    assert fates[3][0] == "repaired"
    assert fates[4] == ("lost", "it is the only way on from this lane")
    assert fates[5][0] == "repaired"
    assert model.roads[RoadId("4")].sections[0].lanes[1].speeds[0].max == pytest.approx(20 / 3.6)


def test_places_in_degrees_find_the_same_lane_where_the_map_has_another_origin() -> None:
    _, result = mended({"kind": "speed_limit", "at": place("2", 1, 60.0), "limit": 30})
    kept = json.loads(result.edits)["edits"][0]["at"]
    assert {"x", "y", "lat", "lon"} <= set(kept)
    # The same map with its origin 250 m further east: all x are less, as of another extract.
    moved = CROSSING.replace(b"+x_0=0", b"+x_0=-250")
    root = etree.fromstring(moved)
    for geometry in root.iter("geometry"):
        geometry.set("x", repr(float(geometry.get("x", "")) - 250.0))
    model, again = mended(*json.loads(result.edits)["edits"], content=etree.tostring(root))
    assert done(again) == done(result)
    assert model.roads[RoadId("2")].sections[0].lanes[1].speeds[0].max == pytest.approx(30 / 3.6)


@pytest.mark.slow
def test_a_mended_map_keeps_its_edits_holds_verify_and_has_them_again_from_a_new_file(
    tmp_path: Path,
) -> None:
    workspace = Workspace.open(tmp_path)
    file = next(path for path in shipped_maps() if path.stem == "signal_crossing")
    workspace.add_map(file, name="town")
    edits = [
        {"kind": "lane_width", "at": place("1", -2, 60.0), "width": 3.75},
        {"kind": "add_turn", "at": place("1", -1, 110.0), "to": place("3", 1, 110.0)},
        {"kind": "remove_turn", "at": place("1", -2, 110.0), "to": place("2", 1, 110.0)},
        {"kind": "add_crosswalk", "at": place("2", -1, 60.0)},
        {"kind": "add_island", "at": place("2", -1, 60.0, at=0.0)},
        {"kind": "speed_limit", "at": place("2", 1, 60.0), "limit": 30, "lanes": "road"},
    ]
    entry = workspace.mend_map("town", edits)
    assert [row["fate"] for row in entry.edit_rows()] == ["repaired"] * 6
    fidelity = entry.fidelity()
    assert [v.name for v in fidelity.verdicts if not v.ok] == []
    assert fidelity.crosswalks == 5
    road = parse(entry.read("xodr")).roads[RoadId("2")]
    assert {lane.speeds[0].max for lane in road.sections[0].lanes.values() if lane.id} == {30 / 3.6}
    # A later file of the same place under the same name, without the crosswalk of road 4.
    later = mend_map(
        CROSSING, check_edits([{"kind": "remove_crosswalk", "at": place("4", 1, 121.0)}])
    ).xodr
    again = workspace.add_map_content(later, file="later.xodr", name="town")
    assert [row["fate"] for row in again.edit_rows()] == ["repaired"] * 6
    assert again.fidelity().crosswalks == 4
    assert json.loads(again.importing.edits or "") == json.loads(entry.importing.edits or "")
    # Undo: without the last edit, in place of those that the map has.
    less = workspace.mend_map("town", edits[:-1], anew=True)
    assert len(less.edit_rows()) == 5
    road = parse(less.read("xodr")).roads[RoadId("2")]
    assert all(lane.speeds == () for lane in road.sections[0].lanes.values())
    assert workspace.mend_map("town", [], anew=True).read("xodr") == later


def test_roads_that_no_edit_touches_stay_as_the_file_has_them() -> None:
    marked = CROSSING.replace(b'id="4" junction="-1"', b'id="4" own="kept" junction="-1"')
    _, result = mended({"kind": "remove_crosswalk", "at": place("3", -1, 122.0)}, content=marked)
    before, after = etree.fromstring(marked), etree.fromstring(result.xodr)
    for old in before.findall("road"):
        (new,) = [road for road in after.findall("road") if road.get("id") == old.get("id")]
        parts = [[(e.tag, dict(e.attrib)) for e in road.iter()] for road in (old, new)]
        assert (parts[0] == parts[1]) == (old.get("id") != "3")
    assert mend_map(marked, read_edits(result.edits)).xodr == result.xodr


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("{", "this is neither JSON nor TOML"),
        ('[[edits]]\nkind = "lane_width"\nat = {x = 1, y = 2}\nwidth = 0\n',
         "edit 1 (lane_width) > width"),
        ('[[edits]]\nkind = "widen"\n', "edit 1 (widen)"),
        ('[[edits]]\nkind = "add_light"\nat = {x = 1}\n', "a place has x and y, or lat and lon"),
        ('format = "other"\n', "format 'other'"),
        ('edit = 1\n', "unknown key 'edit'"),
    ],
)  # fmt: skip
def test_wrong_edits_are_refused_with_edit_field_and_value(text: str, problem: str) -> None:
    with pytest.raises(InputError) as caught:
        read_edits(text)
    assert problem in str(caught.value)


@pytest.mark.slow
def test_a_newer_file_has_the_edits_of_a_map_under_another_name_and_the_map_stays(
    tmp_path: Path,
) -> None:
    workspace = Workspace.open(tmp_path)
    workspace.add_map_content(CROSSING, file="town.xodr", name="town")
    limit = {"kind": "speed_limit", "at": place("2", 1, 60.0), "limit": 30}
    before = workspace.mend_map("town", [limit]).read("xodr")
    gone = {"kind": "remove_crosswalk", "at": place("4", 1, 121.0)}
    newer = mend_map(CROSSING, check_edits([gone])).xodr
    renewed = workspace.renew_map("town", newer, file="newer.xodr", out="town-2")
    assert [row["fate"] for row in renewed.edit_rows()] == ["repaired"]
    model = parse(renewed.read("xodr"))
    assert model.roads[RoadId("2")].sections[0].lanes[1].speeds[0].max == pytest.approx(30 / 3.6)
    assert len(crosswalks(model, RoadTable.of(model))) == 3
    assert workspace.map("town").read("xodr") == before
    with pytest.raises(InputError):
        workspace.renew_map("town", b"no map", file="newer.xodr")
    assert workspace.map("town").read("xodr") == before


def test_of_a_mended_map_only_the_roads_that_are_new_are_read_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    known, read = ReadRoads(), []
    edit = {"kind": "lane_width", "at": place("1", -1, 60.0), "width": 4.0}
    xodr = mend_map(CROSSING, check_edits([edit]), known=known).xodr
    once = parse_module.parse_road
    monkeypatch.setattr(
        parse_module,
        "parse_road",
        lambda element, notes: read.append(element.get("id")) or once(element, notes),
    )
    again = parse(xodr, known=known)
    assert read == ["1"]
    assert again == parse(xodr)
    # What is skipped is counted as often.
    content = CROSSING.replace(b"</planView>", b"</planView><surface/>")
    assert parse(content, known=known).notes == parse(content, known=known).notes
    assert parse(content, known=known).notes == parse(content).notes
