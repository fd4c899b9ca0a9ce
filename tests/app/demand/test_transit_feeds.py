"""Lines of a GTFS feed on a map with a georeference."""

from __future__ import annotations

import math
import zipfile
from datetime import date
from pathlib import Path

import pyproj
import pytest

from odscen.app.demand.transit_feeds import import_transit
from odscen.app.maps import load_map
from odscen.base.errors import InputError
from odscen.base.ids import LaneKey, RoadId
from odscen.lanegraph.query import node_id
from odscen.maps.store import Workspace
from odscen.scenario import edits
from odscen.scenario.checks.scenario_checks import check
from odscen.scenario.document.scenario_document import Scenario
from odscen.scenario.placing.region import Region, place_of
from tests.app.conftest import CROSSING

CRS = "+proj=tmerc +lat_0=48 +lon_0=11 +k=1 +x_0=0 +y_0=0 +datum=WGS84 +units=m +no_defs"
MONDAY = date(2026, 11, 23)

CALENDAR = (
    "service_id,monday,tuesday,wednesday,thursday,friday,saturday,sunday,start_date,end_date\n"
    "work,1,1,1,1,1,0,0,20260101,20261231\nweekend,0,0,0,0,0,1,1,20260101,20261231\n"
)


@pytest.fixture
def scenario(workspace: Workspace) -> Scenario:
    graph = load_map(workspace.map(CROSSING)).sumo.graph
    one = edits.new_scenario(graph, name="buses", roi=graph.segments.ids)
    one = edits.set_simulation(one, duration=3600)
    return edits.set_clock(one, clock=7 * 3600.0)


def two_nodes(workspace: Workspace) -> tuple[int, int]:
    """On outer lanes, 40 m after the beginning of an arm, and 50 m behind the junction."""
    graph = load_map(workspace.map(CROSSING)).sumo.graph
    lanes, keys = graph.lanes, graph.lanes.lanes.keys
    begins = {key: int(lanes.lanes.first_node[row]) for row, key in enumerate(keys)}
    first = begins[LaneKey(RoadId("1"), 0, -2)] + 20
    reached = Region.of(graph, graph.segments.ids).router.reachable(first)
    behind = next(
        node + 25
        for key, node in begins.items()
        if lanes.lanes.junctions[lanes.lane[node]] is None
        and key.road != "1"
        and reached[node + 25]
        and lanes.right_lane[node + 25] < 0
    )
    return first, behind


def feed(workspace: Workspace, folder: Path, **tables: str) -> Path:
    """Two stops 3 m beside two outer lanes, one far away; five trips, two of them not by bus."""
    graph = load_map(workspace.map(CROSSING)).sumo.graph
    back = pyproj.Transformer.from_crs(CRS, "EPSG:4326", always_xy=True)
    rows = ["stop_id,stop_name,stop_lat,stop_lon"]
    for name, node in zip(("a b", "c"), two_nodes(workspace), strict=True):
        hdg = float(graph.lanes.hdg[node])
        x = float(graph.lanes.x[node]) + 3.0 * math.sin(hdg)
        y = float(graph.lanes.y[node]) - 3.0 * math.cos(hdg)
        lon, lat = back.transform(x, y)
        rows.append(f"{name},Stop {name},{lat:.8f},{lon:.8f}")
    rows.append("far,Far away,49.0,11.0")
    times = ["trip_id,arrival_time,departure_time,stop_id,stop_sequence"]
    for trip, start in (("t1", 15), ("t2", 35), ("t3", 35), ("tram", 20), ("late", 135)):
        hour, minute = 7 + start // 60, start % 60
        times.append(f"{trip},,{hour:02}:{minute:02}:00,a b,1")
        times.append(f"{trip},,{hour:02}:{minute + 1:02}:30,c,2")
        times.append(f"{trip},,{hour:02}:{minute + 9:02}:00,far,3")
    written = {
        "stops.txt": "\n".join(rows),
        "routes.txt": "route_id,route_short_name,route_type\nr7,7,3\nr8,T8,0\n",
        "trips.txt": (
            "route_id,service_id,trip_id\nr7,work,t1\nr7,work,t2\nr7,weekend,t3\n"
            "r8,work,tram\nr7,work,late\n"
        ),
        "stop_times.txt": "\n".join(times),
        "calendar.txt": CALENDAR,
        **{name.replace("_txt", ".txt"): text for name, text in tables.items()},
    }
    file = folder / "feed.zip"
    with zipfile.ZipFile(file, "w") as archive:
        for name, text in written.items():
            archive.writestr(f"feed/{name}", text)
    return file


def test_bus_trips_of_the_day_become_a_line_with_their_times(
    workspace: Workspace, scenario: Scenario, tmp_path: Path
) -> None:
    changed, placed = import_transit(workspace, scenario, feed(workspace, tmp_path), day=MONDAY)
    graph = load_map(workspace.map(CROSSING)).sumo.graph
    (line,) = changed.transit.lines
    assert line.id == "line-7"
    assert [one.stop for one in line.stops] == ["a-b", "c"]
    nodes = [node_id(graph, node) for node in two_nodes(workspace)]
    assert [stop.node for stop in changed.transit.stops] == nodes
    assert [stop.name for stop in changed.transit.stops] == ["Stop a b", "Stop c"]
    first, second = (one.after or 0.0 for one in line.stops)
    assert second - first == 90.0
    assert [depart + first for depart in line.departures] == [15 * 60.0, 35 * 60.0]
    assert placed.left_out == {
        "trips of other modes": 1,
        "stops away from the region": 1,
        "trips outside the time of the run": 1,
    }
    assert check(changed, graph) == ()


def test_trips_set_off_where_vehicles_enter_and_reach_their_first_stop_in_time(
    workspace: Workspace, scenario: Scenario, tmp_path: Path
) -> None:
    changed, _ = import_transit(workspace, scenario, feed(workspace, tmp_path), day=MONDAY)
    graph = load_map(workspace.map(CROSSING)).sumo.graph
    (line,) = changed.transit.lines
    place = place_of(graph, line.start)
    assert place is not None
    assert graph.lanes.offset[place.node] < 2.0
    assert line.stops[0].after == pytest.approx(20.0 + 40.0 / 8.0, abs=1.5)


def test_the_weekend_has_its_own_trips(
    workspace: Workspace, scenario: Scenario, tmp_path: Path
) -> None:
    file = feed(workspace, tmp_path)
    changed, _ = import_transit(workspace, scenario, file, day=date(2026, 11, 22))
    assert [len(line.departures) for line in changed.transit.lines] == [1]
    exception = "service_id,date,exception_type\nweekend,20261122,2\nwork,20261122,1\n"
    file = feed(workspace, tmp_path, calendar_dates_txt=exception)
    changed, _ = import_transit(workspace, scenario, file, day=date(2026, 11, 22))
    assert [len(line.departures) for line in changed.transit.lines] == [2]


@pytest.mark.parametrize(
    ("tables", "message"),
    [
        ({"stop_times_txt": "trip_id\n"}, r"stop_times.txt.*there is no column stop_id"),
        ({"stops_txt": "stop_id,stop_lat,stop_lon\na b,north,11\n"}, r"stops.txt.*line 2.*north"),
        ({"trips_txt": "route_id,service_id,trip_id\nr9,work,t1\n"}, "'?r9'? is not in routes.txt"),
    ],
)
def test_a_feed_that_cannot_be_used_is_refused_with_its_place(
    workspace: Workspace, scenario: Scenario, tmp_path: Path, tables: dict[str, str], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        import_transit(workspace, scenario, feed(workspace, tmp_path, **tables), day=MONDAY)


def test_a_feed_needs_a_day_and_an_archive_that_is_whole(
    workspace: Workspace, scenario: Scenario, tmp_path: Path
) -> None:
    file = feed(workspace, tmp_path)
    with pytest.raises(InputError, match="has a calendar; name a day"):
        import_transit(workspace, scenario, file)
    whole = file.read_bytes()
    file.write_bytes(whole[:300])
    with pytest.raises(InputError, match="no zip archive that can be read"):
        import_transit(workspace, scenario, file, day=MONDAY)
    # as after a loss of 21 bytes: members begin before the file does
    at = whole.rindex(b"PK\x05\x06") + 16
    begin = int.from_bytes(whole[at : at + 4], "little") + 21
    file.write_bytes(whole[:at] + begin.to_bytes(4, "little") + whole[at + 4 :])
    with pytest.raises(InputError, match="no zip archive that can be read"):
        import_transit(workspace, scenario, file, day=MONDAY)


@pytest.mark.parametrize("value", ["1e308", "-90.1", "nan", "inf", "48_0", "north", "4 8"])
def test_stops_that_are_nowhere_on_earth_are_refused_with_their_line(
    workspace: Workspace, scenario: Scenario, tmp_path: Path, value: str
) -> None:
    table = f"stop_id,stop_name,stop_lat,stop_lon\na b,A,{value},11.0\nc,C,48.0,11.0\n"
    with pytest.raises(InputError, match=r"stops\.txt: line 2, column stop_lat: .* is not"):
        import_transit(workspace, scenario, feed(workspace, tmp_path, stops_txt=table), day=MONDAY)


def test_stops_for_which_the_projection_has_no_place_are_away_from_the_region(
    workspace: Workspace, scenario: Scenario, tmp_path: Path
) -> None:
    table = "stop_id,stop_name,stop_lat,stop_lon\na b,A,0.0,-79.0\nc,C,-48.0,-169.0\n"
    _, placed = import_transit(
        workspace, scenario, feed(workspace, tmp_path, stops_txt=table), day=MONDAY
    )
    assert placed.transit.stops == ()
    assert placed.left_out["stops away from the region"] == 2
