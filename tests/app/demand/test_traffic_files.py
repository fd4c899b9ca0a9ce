"""Files of any program put on a map: where stations and zones are, and what is reported."""

from __future__ import annotations

from pathlib import Path

import pytest

from odscen.app.demand.map_stations import StationFinder
from odscen.app.demand.traffic_files import import_traffic
from odscen.app.maps import LoadedMap, load_map
from odscen.base.errors import InputError
from odscen.formats.office.traffic_file import ReadingOptions, StationPlace
from odscen.maps.store import Workspace
from odscen.scenario import edits
from odscen.scenario.document.scenario_document import Scenario
from tests.app.conftest import CROSSING


@pytest.fixture(scope="module")
def loaded(workspace: Workspace) -> LoadedMap:
    return load_map(workspace.map(CROSSING))


@pytest.fixture(scope="module")
def scenario(loaded: LoadedMap) -> Scenario:
    graph = loaded.sumo.graph
    made = edits.new_scenario(graph, name="office", roi=graph.segments.ids)
    return edits.set_simulation(made, duration=3600)


@pytest.fixture(scope="module")
def approaches(loaded: LoadedMap) -> dict[str, str]:
    """SUMO edges that lead to the junction, with their places."""
    finder = StationFinder(loaded)
    net = loaded.sumo.net
    (junction,) = {str(i) for i, k in segments(loaded) if k == "junction"}
    found: dict[str, str] = {}
    for edge, lanes in net.edge_lanes.items():
        if not lanes[0].internal and any(lane.allows("passenger") for lane in lanes):
            place = finder.of_edge(edge).place
            if place.endswith(f">{junction}"):
                found[place] = edge  # of edges one behind the other the last
    return {edge: place for place, edge in found.items()}


def segments(loaded: LoadedMap) -> list[tuple[str, str]]:
    own = loaded.sumo.graph.segments
    return list(zip(own.ids, own.kinds, strict=True))


def write(folder: Path, name: str, text: str) -> Path:
    file = folder / name
    file.write_text(text, encoding="utf-8")
    return file


def test_edges_of_all_legs_are_approaches_of_the_junction(approaches: dict[str, str]) -> None:
    assert len(approaches) == len(set(approaches.values())) == 4


def test_edge_data_becomes_counts_of_approaches(
    workspace: Workspace, scenario: Scenario, approaches: dict[str, str], tmp_path: Path
) -> None:
    rows = "".join(f'<edge id="{edge}" entered="{100 + n}"/>' for n, edge in enumerate(approaches))
    rows += '<edge id="gone" entered="3"/>'
    text = f'<meandata><interval begin="0" end="900">{rows}</interval></meandata>'
    changed, report = import_traffic(
        workspace, scenario, write(tmp_path, "e.xml", text), use="compare"
    )
    (counts,) = changed.demand.counts
    assert counts.use == "compare"
    assert {row[0]: row[3] for row in counts.rows} == {
        place: 100.0 + n for n, place in enumerate(approaches.values())
    }
    assert report.taken == 4
    assert list(report.unplaced) == ["gone"]
    assert (
        "no segment, SUMO edge" in report.unplaced["gone"] or "no edge" in report.unplaced["gone"]
    )
    assert ("1 rows", "their stations are not on the map") in report.left_out


def test_a_table_starts_the_run_at_its_first_count(
    workspace: Workspace, scenario: Scenario, approaches: dict[str, str], tmp_path: Path
) -> None:
    edge = next(iter(approaches))
    table = write(tmp_path, "c.csv", "Zst;Zeit;Kfz\nA;07:00;120\nA;07:15;900\nA;07:30;118\n")
    places = write(tmp_path, "p.csv", f"station;edge\nA;{edge}\n")
    changed, report = import_traffic(workspace, scenario, table, stations=places)
    assert changed.demand.clock == 25200.0
    place = approaches[edge]
    assert changed.demand.counts[0].rows == (
        (place, 0.0, 900.0, 120.0), (place, 900.0, 1800.0, 900.0), (place, 1800.0, 2700.0, 118.0),
    )  # fmt: skip
    assert report.doubts == [f"{place} at 07:15: 900 vehicles between 120 and 118"]
    assert report.placed == {"A": place}


def test_lanes_of_one_edge_are_added_and_a_missing_one_is_told(
    workspace: Workspace,
    loaded: LoadedMap,
    scenario: Scenario,
    approaches: dict[str, str],
    tmp_path: Path,
) -> None:
    edge = max(approaches, key=lambda name: len(loaded.sumo.net.edge_lanes[name]))
    lanes = [x for x in loaded.sumo.net.edge_lanes[edge] if x.allows("passenger")]
    defined = "".join(f'<e1Detector id="d{x.index}" lane="{x.id}" pos="-5"/>' for x in lanes)
    places = write(tmp_path, "d.add.xml", f"<additional>{defined}</additional>")
    rows = "".join(
        f'<interval begin="0" end="600" id="d{x.index}" nVehContrib="{10 + x.index}"/>'
        for x in lanes
    )
    output = write(tmp_path, "o.xml", f"<detector>{rows}</detector>")
    changed, report = import_traffic(workspace, scenario, output, stations=places)
    total = sum(10.0 + x.index for x in lanes)
    assert changed.demand.counts[0].rows == ((approaches[edge], 0.0, 600.0, total),)
    assert report.taken == len(lanes)
    changed, report = import_traffic(workspace, scenario, places)
    assert [x.id for x in changed.study.detectors] == [f"d{x.index}" for x in lanes]
    if len(lanes) > 1:
        row = f'<interval begin="0" end="600" id="d{lanes[0].index}" nVehContrib="7"/>'
        part = f"<detector>{row}</detector>"
        _, report = import_traffic(
            workspace, scenario, write(tmp_path, "part.xml", part), stations=places
        )
        walks = len(loaded.sumo.net.edge_lanes[edge]) - len(lanes)
        assert walks >= 0
        assert f"{approaches[edge]}: 1 of {len(lanes)} lanes have a detector" in report.doubts


def test_stations_are_found_by_coordinates_and_direction(
    loaded: LoadedMap, approaches: dict[str, str]
) -> None:
    import math

    finder = StationFinder(loaded)
    graph = loaded.sumo.graph.lanes
    for edge, place in approaches.items():
        node = finder.of_edge(edge).node
        x, y, hdg = (float(v[node]) for v in (graph.x, graph.y, graph.hdg))
        bearing = (90.0 - math.degrees(hdg)) % 360.0
        found = finder.locate("?", StationPlace(point=(x, y), bearing=bearing))
        assert found.place == place
        back = finder.locate("?", StationPlace(point=(x, y), bearing=(bearing + 180.0) % 360.0))
        assert back.place != place
    with pytest.raises(InputError, match="no road within 40 m"):
        finder.locate("?", StationPlace(point=(1e5, 1e5)))


def test_turns_come_from_counts_and_from_shares_of_the_approach(
    workspace: Workspace,
    scenario: Scenario,
    loaded: LoadedMap,
    approaches: dict[str, str],
    tmp_path: Path,
) -> None:
    net = loaded.sumo.net
    edge = next(iter(approaches))
    lanes = {x.id for x in net.edge_lanes[edge]}
    exits = sorted(
        {
            net.lanes[link.target].edge
            for link in net.links
            if link.source in lanes and net.lanes[link.target].allows("passenger")
        }
    )
    relations = "".join(f'<edgeRelation from="{edge}" to="{x}" probability="1"/>' for x in exits)
    file = write(
        tmp_path, "t.xml", f'<data><interval begin="0" end="900">{relations}</interval></data>'
    )
    with pytest.raises(InputError, match="import counts of the approaches first"):
        import_traffic(workspace, scenario, file)
    counted = edits.set_counts(
        scenario, loaded.sumo.graph, counts="c", rows=((approaches[edge], 0.0, 900.0, 60.0),)
    )
    changed, report = import_traffic(workspace, counted, file)
    rows = changed.demand.counts[-1].rows
    assert report.taken == len(exits) == len(rows)
    assert sum(row[3] for row in rows) == pytest.approx(60.0)
    assert all(row[0].startswith(approaches[edge] + ">") for row in rows)


def test_zones_of_taz_then_a_visum_matrix(
    workspace: Workspace, scenario: Scenario, approaches: dict[str, str], tmp_path: Path
) -> None:
    one, other = list(approaches)[:2]
    matrix = write(tmp_path, "m.mtx", "$O;D2\n6.00 8.00\n1.00\n1 2 40\n2 1 20\n1 9 3\n")
    with pytest.raises(InputError, match=r"VISUM matrix in format O with 3 zones.*first import"):
        import_traffic(workspace, scenario, matrix)
    zones = write(
        tmp_path,
        "taz.xml",
        f'<additional><taz id="1" edges="{one}"/><taz id="2" edges="{other}"/>'
        '<taz id="3" edges="gone"/></additional>',
    )
    changed, report = import_traffic(workspace, scenario, zones)
    assert [zone.id for zone in changed.demand.zones] == ["1", "2"]
    assert report.unplaced == {"3": "none of its edges is on the map"}
    changed = edits.set_clock(changed, clock=7 * 3600.0)
    changed, report = import_traffic(workspace, changed, matrix, name="commuters")
    (part,) = changed.demand.matrices
    assert (part.id, part.begin, part.end) == ("commuters", 0.0, 3600.0)
    assert part.trips == (("1", "2", 20.0), ("2", "1", 10.0))
    assert report.left_out == [("row 6 of the file", "zone 9 is not on the map")]
    assert "of the trips from 06:00 to 08:00 the 50% after the start" in report.notes[0]


def test_columns_that_were_said_are_kept(
    workspace: Workspace, scenario: Scenario, approaches: dict[str, str], tmp_path: Path
) -> None:
    edge = next(iter(approaches))
    table = write(tmp_path, "a.csv", f"aa;bb;cc\n{edge};0;3\n{edge};900;4\n")
    with pytest.raises(InputError, match="no column was recognised"):
        import_traffic(workspace, scenario, table)
    columns = {"station": "aa", "time": "bb", "count": "cc"}
    import_traffic(workspace, scenario, table, options=ReadingOptions(columns=columns))
    again = write(tmp_path, "b.csv", f"aa;bb;cc\n{edge};0;5\n{edge};900;6\n")
    changed, _ = import_traffic(workspace, scenario, again)
    assert [row[3] for row in changed.demand.counts[0].rows] == [5.0, 6.0]


def test_nothing_is_changed_by_a_file_of_which_nothing_is_on_the_map(
    workspace: Workspace, scenario: Scenario, tmp_path: Path
) -> None:
    table = write(tmp_path, "x.csv", "station,time,count\nAtlantis,07:00,3\nAtlantis,07:15,4\n")
    with pytest.raises(InputError, match=r"x\.csv.*none of its stations was found.*--stations"):
        import_traffic(workspace, scenario, table)
