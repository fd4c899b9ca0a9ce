"""Edits that lead borders and roads elsewhere, move what stands on them and join junctions."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from odscen.base.ids import JunctionId, RoadId
from odscen.maps.edited_map import EditedMap
from odscen.maps.map_edits import check_edits, mend_map, try_edit
from odscen.maps.shipped import shipped_maps
from odscen.maps.store import Workspace
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.objects import is_stop_line
from odscen.opendrive.parse import parse
from odscen.opendrive.topology import lane_successors
from tests.maps.test_map_edits import BEFORE, TABLE, done, lane_widths, mended, place

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.opendrive.road_model import OpenDrive

TOWN = next(path for path in shipped_maps() if path.stem == "town_5x5").read_bytes()


def aside(at: dict[str, float], *, ahead: float = 0.0, left: float = 0.0) -> dict[str, float]:
    """A place so many metres ahead and to the left of another in its direction of driving."""
    cos, sin = math.cos(at["hdg"]), math.sin(at["hdg"])
    return {"x": at["x"] + ahead * cos - left * sin, "y": at["y"] + ahead * sin + left * cos}


def largest_gap(model: OpenDrive) -> float:
    """Metres between the borders of lanes that follow each other, the largest of the map."""
    table = RoadTable.of(model)
    pairs = [
        (table.lane_index[key], table.lane_index[follower])
        for key, followers in lane_successors(model).items()
        for follower in followers
    ]
    before, after = np.array(pairs).T
    end = np.where(table.lane_forward[before], table.lane_s1[before], table.lane_s0[before])
    start = np.where(table.lane_forward[after], table.lane_s0[after], table.lane_s1[after])
    gaps = []
    for at in (0.0, 1.0):
        here = table.lane_points(before, end, at=at)
        there = table.lane_points(after, start, at=at)
        gaps.append(np.hypot(here.x - there.x, here.y - there.y).max())
    return float(max(gaps))


def test_a_lane_border_is_bent_and_its_neighbours_stay() -> None:
    border = place("1", -1, 60.0, at=1.0)
    bend = {"kind": "bend_border", "at": border, "to": aside(border, left=1.0)}
    model, result = mended(bend)
    assert done(result) == [("repaired", "led 1.00 m to the left at s 60.0 m")]
    stations = [30.0, 40.0, 50.0, 60.0, 70.0, 80.0]
    gain = np.array([0.0, 0.0, 0.5, 1.0, 0.5, 0.0])
    assert lane_widths(model, "1", -1, stations) == pytest.approx(3.25 - gain)
    assert lane_widths(model, "1", -2, stations) == pytest.approx(3.25 + gain)
    assert largest_gap(model) < 1e-4
    # The line in the middle of the road parts the lanes of its two sides.
    middle = place("1", -1, 60.0, at=0.0)
    model, _ = mended({"kind": "bend_border", "at": middle, "to": aside(middle, left=0.5)})
    assert lane_widths(model, "1", -1, [60.0]) == pytest.approx([3.75])
    assert lane_widths(model, "1", 1, [60.0]) == pytest.approx([2.75])
    table, row = RoadTable.of(model), TABLE.road_index[RoadId("1")]
    assert table.lane_offset(np.array([row]), np.array([60.0]))[0] == pytest.approx(
        TABLE.lane_offset(np.array([row]), np.array([60.0]))[0] + 0.5
    )
    # 3 m would leave 0.25 m, and near the end there is no room.
    far = {**bend, "to": aside(border, left=3.0)}
    end = place("1", -1, 129.0, at=1.0)
    _, result = mended(far, {"kind": "bend_border", "at": end, "to": aside(end, left=0.5)})
    assert done(result) == [
        ("lost", "lane -1 would be 0.25 m wide"),
        ("lost", "the second place is within 2 m of an end of its lane section"),
    ]


def test_a_road_is_bent_through_a_place_and_what_stands_behind_stays_there() -> None:
    at = place("1", -1, 60.0)
    model, result = mended(
        {"kind": "bend_road", "at": at, "to": aside(at, left=3.0), "length": 80.0}
    )
    assert done(result) == [("repaired", "led 3.00 m to the left at s 60.0 m")]
    road, old = model.roads[RoadId("1")], BEFORE.roads[RoadId("1")]
    gained = road.length - old.length
    assert 0.2 < gained < 0.4
    table = RoadTable.of(model)
    row = np.array([table.road_index[road.id]])
    was = TABLE.reference(row, np.array([60.0]))
    now = table.reference(row, np.array([60.0 + gained / 2.0]))
    assert np.hypot(now.x - was.x, now.y - was.y)[0] == pytest.approx(3.0, abs=0.01)
    for signal, before in zip(road.signals, old.signals, strict=True):
        assert signal.s == pytest.approx(before.s + gained)
        points = [t.points(row, np.array([i.s]), np.array([i.t])) for t, i in
                  ((table, signal), (TABLE, before))]  # fmt: skip
        assert np.hypot(points[0][0] - points[1][0], points[0][1] - points[1][1])[0] < 0.001
    assert largest_gap(model) < 1e-4
    tight = {"kind": "bend_road", "at": at, "to": aside(at, left=12.0), "length": 25.0}
    near = place("1", -1, 125.0)
    _, result = mended(tight, {"kind": "bend_road", "at": near, "to": aside(near, left=1.0)})
    assert "at least 8 m are needed" in done(result)[0][1]
    assert done(result)[1][1] == "it is within 10 m of an end of the road: move that end"


def test_the_end_of_a_road_is_moved_and_the_junction_follows() -> None:
    at = place("1", -1, 125.0)
    model, result = mended(
        {"kind": "move_road_end", "at": at, "to": aside(at, ahead=-2.0, left=3.0)}
    )
    assert done(result) == [("repaired", "end moved by 3.61 m; roads that follow it: 8")]
    table, row = RoadTable.of(model), np.array([TABLE.road_index[RoadId("1")]])
    was = TABLE.reference(row, np.array([130.0]))
    now = table.reference(row, np.array([model.roads[RoadId("1")].length]))
    assert np.hypot(now.x - was.x, now.y - was.y)[0] == pytest.approx(math.hypot(2, 3), abs=0.001)
    assert math.cos(now.hdg[0] - was.hdg[0]) == pytest.approx(1.0)
    assert largest_gap(model) < 1e-4
    middle = place("1", -1, 60.0)
    _, result = mended({"kind": "move_road_end", "at": middle, "to": aside(middle, left=1.0)})
    assert done(result) == [("lost", "the end of its road is 60 m away")]


def test_stop_lines_signs_and_islands_are_moved_to_a_place() -> None:
    (line,) = [o for o in BEFORE.roads[RoadId("3")].objects if is_stop_line(o)]
    there = place("3", -1, 40.0)
    model, result = mended(
        {"kind": "move_stop_line", "at": place("3", -1, line.s), "to": place("3", -1, line.s - 4)},
        {"kind": "add_sign", "at": place("1", 1, 40.0), "type": "274", "value": 30, "unit": "km/h"},
        {"kind": "move_sign", "at": place("1", 2, 40.0, at=1.0), "to": place("1", 2, 50.0, at=1.2)},
        {"kind": "add_island", "at": place("3", -1, 60.0)},
        {"kind": "move_island", "at": place("3", -1, 60.0), "to": there},
    )
    assert [row[0] for row in done(result)] == ["repaired"] * 5
    road = model.roads[RoadId("3")]
    assert [o.s for o in road.objects if is_stop_line(o)] == pytest.approx([line.s - 4])
    (island,) = [o for o in road.objects if o.type == "trafficIsland"]
    row = np.array([TABLE.road_index[road.id]])
    x, y, _ = TABLE.points(row, np.array([island.s]), np.array([island.t]))
    assert (x[0], y[0]) == pytest.approx((there["x"], there["y"]), abs=0.001)
    (sign,) = [s for s in model.roads[RoadId("1")].signals if s.type == "274"]
    assert sign.s == pytest.approx(50.0, abs=0.01)
    _, result = mended(
        {"kind": "add_island", "at": place("3", -1, 60.0)},
        {"kind": "remove_island", "at": place("3", -1, 60.0)},
        {"kind": "remove_island", "at": place("3", -1, 60.0)},
    )
    assert [row[0] for row in done(result)] == ["repaired", "repaired", "lost"]


def joining(model: OpenDrive, road: str) -> dict[str, Any]:
    table, row = RoadTable.of(model), model.roads[RoadId(road)]
    rows = np.full(2, table.road_index[row.id])
    x, y, _ = table.points(rows, np.array([0.0, row.length]), np.zeros(2))
    at, to = ({"x": float(a), "y": float(b)} for a, b in zip(x, y, strict=True))
    return {"kind": "join_junctions", "at": at, "to": to}


def test_two_junctions_are_joined_and_each_way_through_both_becomes_a_turn() -> None:
    before = parse(TOWN)
    # Road 14 leads 46 m from a junction of three roads to one of four.
    first, second = JunctionId("10008"), JunctionId("10017")
    edit = joining(before, "14")
    result = mend_map(TOWN, check_edits([edit]))
    ((fate, words),) = done_rows(result.entries)
    assert (fate, words) == (
        "repaired",
        "joined with junction 10017; turns drawn: 8, signals removed: 2, crosswalks removed: 2",
    )
    model = parse(result.xodr)
    assert model.notes == before.notes
    assert RoadId("14") not in model.roads
    assert second not in model.junctions
    assert set(model.junctions[first].controllers) <= set(model.controllers)
    assert largest_gap(model) < 1e-4
    # Who could drive over road 14 to a lane behind it still can.
    after, still = lane_successors(before), lane_successors(model)
    inside = {r.id for r in before.roads.values() if r.junction in (first, second)} | {RoadId("14")}
    for start in after:
        if start.road in inside:
            continue
        reached, left = set(), [key for key in after[start] if key.road in inside]
        while left:
            key = left.pop()
            for follower in after[key]:
                if follower.road in inside:
                    left.append(follower)
                elif follower.road != start.road:
                    reached.add(follower)
        now = {key for through in still[start] for key in still[through]}
        assert reached <= now
    far = mend_map(TOWN, check_edits([joining(before, "53")]))
    assert done_rows(far.entries)[0][1].endswith("m are between the junctions, more than 100 m")
    same = mend_map(TOWN, check_edits([{**edit, "to": edit["at"]}]))
    assert done_rows(same.entries) == [("lost", "both places are at junction 10008")]


def done_rows(entries: Any) -> list[tuple[str, str]]:
    return [(str(row.outcome), row.reason) for row in entries]


@pytest.mark.slow
def test_maps_with_bends_and_joined_junctions_hold_verify(tmp_path: Path) -> None:
    workspace = Workspace.open(tmp_path)
    for name in ("signal_crossing", "town_5x5"):
        file = next(path for path in shipped_maps() if path.stem == name)
        workspace.add_map(file, name=name)
    border, road, end = (
        place("1", -1, s, at=a) for s, a in ((90.0, 1.0), (50.0, 0.5), (125.0, 0.5))
    )
    bent = workspace.mend_map(
        "signal_crossing",
        [
            {"kind": "bend_border", "at": border, "to": aside(border, left=0.5)},
            {"kind": "move_road_end", "at": end, "to": aside(end, left=2.0)},
            {"kind": "bend_road", "at": road, "to": aside(road, left=2.0), "length": 80.0},
        ],
    )  # fmt: skip
    joined = workspace.mend_map("town_5x5", [joining(parse(TOWN), "14")])
    for entry in (bent, joined):
        assert {row["fate"] for row in entry.edit_rows()} == {"repaired"}
        assert [v.name for v in entry.fidelity().verdicts if not v.ok] == []


def test_an_edit_is_tried_on_a_map_that_stays_as_it_is() -> None:
    bench = EditedMap(BEFORE)
    border = place("1", -1, 60.0, at=1.0)
    bend = {"kind": "bend_border", "at": border, "to": aside(border, left=1.0)}
    line = {"kind": "add_stop_line", "at": place("3", 1, 50.0)}
    far = {"kind": "add_stop_line", "at": {"x": 900.0, "y": 900.0}}
    (bent, lanes), (_, marks), (lost, nothing) = (
        try_edit(bench, edit) for edit in check_edits([bend, line, far])
    )
    assert (str(bent.outcome), str(lost.outcome)) == ("repaired", "lost")
    assert len(lanes) == len(BEFORE.roads[RoadId("1")].sections[0].lanes) - 1
    assert ([len(ring) // 2 for ring in marks], nothing) == ([4], [])
    assert bench.map.roads == BEFORE.roads
