"""``odscen demand`` as a user calls it."""

import json
from pathlib import Path

import pytest

from tests.cli.conftest import odscen
from tools.parking_example import TOWN, with_rows


@pytest.fixture
def scenario(workspace, tmp_path):
    """A few actors on the whole of a small map."""
    done = odscen(
        *("generate", "--map", "signal_crossing", "--fill", "0.02", "--roi-segments", "30"),
        *("--out", tmp_path, "--json", "--workspace", workspace),
    )
    assert done.code == 0, done.err
    return done.json["scenarios"][0]["file"]


def roads(scenario):
    document = json.loads(Path(scenario).read_text(encoding="utf-8"))
    return sorted(name for name in document["roi"] if name.startswith("r"))


@pytest.mark.slow
def test_tables_are_read_into_the_scenario_and_the_fit_is_printed(workspace, scenario, tmp_path):
    one, other = roads(scenario)[:2]
    junction = "j10001"
    zones, trips, counts = (tmp_path / f"{name}.csv" for name in ("zones", "trips", "counts"))
    zones.write_text(f"zone,segment\nhere,{one}\n")
    trips.write_text(f"from,to,trips\nhere,{other},20\n")
    counts.write_text(
        f"place,begin,end,count\n{one}>{junction}>{other},0,600,40\n{one}>{junction},0,600,90\n"
    )
    done = odscen(
        *("demand", "import", scenario, "--zones", zones, "--od", trips, "--counts", counts),
        *("--mix", "car=4,van=1", "--json", "--workspace", workspace),
    )
    assert done.code == 0, done.err
    assert {k: done.json[k] for k in ("zones", "trips", "counts")} == {
        "zones": 1, "trips": 20, "counts": 2,
    }  # fmt: skip
    for table in (zones, trips, counts):
        table.unlink()
    assert odscen("check", scenario, "--workspace", workspace).code == 0
    fit = odscen("demand", "fit", scenario, "--json", "--workspace", workspace)
    assert fit.code == 0, fit.err
    assert [row["met"] for row in fit.json["rows"]] == [True, True]
    assert fit.json["observations"] == 130
    assert fit.json["share_met"] == 1.0
    shown = odscen("demand", "fit", scenario, "--all", "--workspace", workspace)
    assert f"{one}>{junction}>{other}" in shown.out
    assert "2 of 2 counts within GEH 5" in shown.err


@pytest.mark.slow
def test_a_wrong_table_is_refused_with_file_and_line_and_changes_nothing(
    workspace, scenario, tmp_path
):
    before = Path(scenario).read_bytes()
    table = tmp_path / "trips.csv"
    table.write_text("from,to,trips\nr1,r2,few\n")
    done = odscen("demand", "import", scenario, "--od", table, "--workspace", workspace)
    assert done.code == 2
    assert "trips.csv: line 2: trips must be a number from 0 on, not 'few'" in done.err
    table.write_text("from,to,trips\nr1,nowhere,3\n")
    done = odscen("demand", "import", scenario, "--od", table, "--workspace", workspace)
    assert done.code == 2
    told = "trips.csv: line 2, column 'to': 'nowhere' is neither a zone nor a segment"
    assert told in done.err
    table.write_text("from,to,trips\nr1,r2,3\n\nr7,r8,1\nr1,r2,4\n")
    done = odscen("demand", "import", scenario, "--od", table, "--workspace", workspace)
    assert "line 4, column 'from': 'r7' is neither" in done.err
    assert "line 4, column 'to': 'r8' is neither" in done.err
    assert "line 5: trips from 'r1' to 'r2' are given 2 times" in done.err
    assert Path(scenario).read_bytes() == before


@pytest.mark.slow
def test_background_traffic_is_added_and_a_scenario_without_counts_has_no_fit(workspace, scenario):
    done = odscen(
        *("demand", "add", scenario, "--per-km", "5", "--day", "weekend"),
        *("--json", "--workspace", workspace),
    )
    assert done.code == 0, done.err
    assert done.json["background"] == 1
    fit = odscen("demand", "fit", scenario, "--workspace", workspace)
    assert fit.code == 2
    assert "has no counts" in fit.err


@pytest.mark.slow
def test_a_day_of_a_whole_map_says_what_its_junctions_carry(workspace, tmp_path):
    out = tmp_path / "day.scenario.json"
    done = odscen(
        *("demand", "weekday", "--map", "signal_crossing", "--trips", "2000", "-o", out),
        *("--json", "--workspace", workspace),
    )
    assert done.code == 0, done.err
    assert 0 < done.json["trips"] <= 2000
    assert done.json["volume"] <= 0.71 * done.json["capacity"]
    assert done.json["trials"][-1]["usable"]
    assert "its busiest hour is usable with 2 seeds" in done.err
    assert odscen("check", out, "--workspace", workspace).code == 0
    call = ("demand", "weekday", "--map", "signal_crossing", "--trips", "2000", "--no-trial")
    proposed = odscen(*call, "-o", out, "--json", "--workspace", workspace)
    assert "trials" not in proposed.json


@pytest.mark.slow
def test_background_traffic_is_sized_by_runs(workspace, scenario):
    call = ("demand", "add", scenario, "--trips", "4000", "--sized", "--id", "all")
    done = odscen(*call, "--json", "--workspace", workspace)
    assert done.code == 0, done.err
    assert "not usable: more than 20 % had no room to depart" in done.err
    (part,) = json.loads(Path(scenario).read_text(encoding="utf-8"))["demand"]["background"]
    assert 0 < part["trips"] < 4000
    again = odscen("demand", "size", scenario, "--id", "all", "--json", "--workspace", workspace)
    assert again.code == 0, again.err
    assert (again.json["share"], again.json["trips"]) == (1.0, part["trips"])
    wrong = odscen("demand", "size", scenario, "--id", "none", "--workspace", workspace)
    assert wrong.code == 2
    assert "'none'" in wrong.err


@pytest.mark.slow
@pytest.mark.parametrize("trips", ["1e8", "9" * 30])
def test_a_day_of_endless_trips_is_refused_at_once(workspace, tmp_path, trips):
    call = ("demand", "weekday", "--map", "signal_crossing", "--trips", trips)
    done = odscen(*call, "-o", tmp_path / "day.json", "--workspace", workspace)
    assert done.code == 2
    assert "trips must be above 0 and at most 1e+07" in done.err
    assert not (tmp_path / "day.json").exists()


@pytest.mark.slow
def test_vehicles_from_outside_are_added_where_they_can_enter(workspace, scenario, tmp_path):
    listed = odscen("demand", "entries", scenario, "--json", "--workspace", workspace)
    assert listed.code == 0, listed.err
    entry = listed.json["entries"][0]
    place = ("--segment", entry["segment"], "--direction", entry["direction"])
    done = odscen(
        *("demand", "inflow", scenario, *place, "--per-hour", 450, "--mix", "car=9,truck=1"),
        *("--json", "--workspace", workspace),
    )
    assert done.code == 0, done.err
    assert done.json["inputs"] == 1
    table = tmp_path / "inputs.csv"
    table.write_text(f"segment,direction,0,300\n{entry['segment']},{entry['direction']},20,30\n")
    more = odscen(
        *("demand", "import", scenario, "--inputs", table, "--id", "counted", "--json"),
        *("--workspace", workspace),
    )
    assert more.code == 0, more.err
    document = json.loads(Path(scenario).read_text(encoding="utf-8"))
    inputs = document["demand"]["inputs"]
    assert [one["id"] for one in inputs] == ["input-1", "counted-1"]
    assert inputs[1]["volumes"] == [20, 30]
    assert inputs[1]["interval"] == 300
    wrong = odscen(
        *("demand", "inflow", scenario, "--segment", "j10001", "--per-hour", 10),
        *("--workspace", workspace),
    )
    assert wrong.code == 2
    assert "no lane leads into the region of interest on 'j10001'" in wrong.err


@pytest.mark.slow
def test_a_feed_without_its_tables_is_refused_and_changes_nothing(workspace, scenario, tmp_path):
    before = Path(scenario).read_bytes()
    (tmp_path / "stops.txt").write_text("stop_id,stop_lat,stop_lon\n")
    done = odscen("transit", "import", scenario, tmp_path, "--workspace", workspace)
    assert done.code == 2
    assert "the feed has no routes.txt" in done.err
    wrong = odscen(
        *("transit", "import", scenario, tmp_path, "--day", "tomorrow", "--workspace", workspace)
    )
    assert "a day is written as 2026-11-23" in wrong.err
    assert Path(scenario).read_bytes() == before


@pytest.mark.slow
def test_a_matrix_is_corrected_by_counts_and_its_page_shows_them(workspace, scenario, tmp_path):
    one, other = roads(scenario)[:2]
    trips, counts = (tmp_path / f"{name}.csv" for name in ("trips", "counts"))
    trips.write_text(f"from,to,trips\n{one},{other},60\n")
    counts.write_text(f"place,begin,end,count\n{one}>j10001>{other},0,600,120\n")
    done = odscen(
        *("demand", "import", scenario, "--od", trips, "--counts", counts),
        *("--workspace", workspace),
    )
    assert done.code == 0, done.err
    page, out = tmp_path / "fit.html", tmp_path / "corrected.json"
    done = odscen(
        *("demand", "correct", scenario, "--trust", "0.01", "--out", out, "--page", page),
        *("--json", "--workspace", workspace),
    )
    assert done.code == 0, done.err
    assert (done.json["before"]["met"], done.json["after"]["met"]) == (0, 1)
    assert done.json["trips_after"] > 110
    assert json.loads(out.read_text())["demand"]["counts"][0]["use"] == "compare"
    assert "Corrected matrix" in page.read_text()
    fit = odscen("demand", "fit", out, "--json", "--workspace", workspace)
    assert fit.json["vehicles"] < 140


@pytest.mark.slow
def test_how_trips_choose_routes_is_set_and_kept(workspace, scenario):
    done = odscen(
        *("demand", "routes", scenario, "--by", "travel_time", "--informed", "0.3"),
        *("--json", "--workspace", workspace),
    )
    assert done.code == 0, done.err
    assert done.json["routes"]["by"] == "travel_time"
    document = json.loads(Path(scenario).read_text(encoding="utf-8"))
    assert document["demand"]["routes"] == {"by": "travel_time", "informed": 0.3}
    wrong = odscen("demand", "routes", scenario, "--by", "beauty", "--workspace", workspace)
    assert wrong.code == 2
    assert "by" in wrong.err


def test_parking_is_refused_where_the_map_has_none(workspace, scenario):
    before = Path(scenario).read_text(encoding="utf-8")
    refused = odscen("demand", "parking", scenario, "--end", "0.3", "--workspace", workspace)
    assert refused.code == 2
    assert "no parking places" in refused.err
    assert Path(scenario).read_text(encoding="utf-8") == before


@pytest.mark.slow
def test_which_trips_park_is_set_and_kept(tmp_path, workspace):
    town = tmp_path / "parking_town.xodr"
    town.write_text(with_rows(TOWN.read_text(encoding="utf-8")), encoding="utf-8")
    assert odscen("maps", "add", town, "--workspace", workspace).code == 0
    made = odscen(
        *("generate", "--map", "parking_town", "--fill", "0.01", "--roi-segments", "500"),
        *("--out", tmp_path, "--json", "--workspace", workspace),
    )
    assert made.code == 0, made.err
    file = Path(made.json["scenarios"][0]["file"])
    done = odscen(
        *("demand", "parking", file, "--begin", "0.1", "--end", "0.3", "--stay", "600"),
        *("--json", "--workspace", workspace),
    )
    assert done.code == 0, done.err
    assert (done.json["parking"]["begin"], done.json["parking"]["end"]) == (0.1, 0.3)
    document = json.loads(file.read_text(encoding="utf-8"))
    assert document["demand"]["parking"]["stay"] == 600
