import json
import math
import re
import subprocess
from pathlib import Path

import polars as pl
import pytest
import sumo

from odscen.runs.finished_run import Run
from tests.cli.conftest import odscen

GENERATE = ("generate", "--map", "signal_crossing", "--fill", "0.25", "--seed", "5", "--json")


@pytest.fixture(scope="module")
def scenario(workspace, tmp_path_factory):
    out = tmp_path_factory.mktemp("scenarios")
    done = odscen(*GENERATE, "--out", out, "--workspace", workspace)
    assert done.code == 0, done.err
    return done.json["scenarios"][0]["file"]


@pytest.fixture(scope="module")
def finished(workspace, scenario, tmp_path_factory):
    out = tmp_path_factory.mktemp("runs")
    done = odscen("run", scenario, "--out", out, "--json", "--workspace", workspace)
    assert done.code == 0, done.err
    return done.json


@pytest.mark.slow
def test_a_sampled_scenario_has_nothing_to_remark(workspace, scenario):
    done = odscen("check", scenario, "--json", "--workspace", workspace)
    assert done.code == 0
    assert done.json["problems"] == []


@pytest.mark.slow
def test_the_motion_of_a_run_is_checked_with_place_time_and_cause(workspace, finished):
    run = Path(finished["files"]["summary"]).parent
    done = odscen("check", "--run", run, "--json", "--workspace", workspace)
    found = done.json
    figures = json.loads((run / "summary.json").read_text())["figures"]
    assert found["implausible"] == figures["implausible_motion"]
    assert found["hard_braking"] == figures["hard_braking"]
    assert done.code == (1 if found["implausible"] else 0), done.err
    assert sum(row["findings"] for row in found["counts"]) == len(found["findings"])
    assert sum(row["counted"] for row in found["findings"]) == found["implausible"]
    trajectories = Run.open(run).trajectories()
    for row in found["findings"][:20]:
        there = trajectories.filter(
            (pl.col("id") == row["id"]) & pl.col("time").is_between(row["begin"], row["end"])
        )
        places = zip(there["x"], there["y"], strict=True)
        assert min(math.dist((row["x"], row["y"]), place) for place in places) < 0.01
        assert row["value"] > row["bound"]
    assert "Plausibility of motion" in (run / "report.html").read_text()
    done = odscen("check", "--run", run, "--workspace", workspace)
    assert f"{found['implausible']} findings of implausible motion" in done.err
    done = odscen("check", "--workspace", workspace)
    assert (done.code, "--run" in done.err) == (2, True)
    done = odscen("check", "--run", "nowhere", "--workspace", workspace)
    assert (done.code, "no run named 'nowhere'" in done.err) == (2, True)


@pytest.mark.slow
def test_a_report_is_written_anew_along_the_way_asked_for(workspace, finished, tmp_path):
    run, out = Path(finished["files"]["summary"]).parent, tmp_path / "again.html"
    places = json.loads((run / "figures.json").read_text())["movements"]
    first, _, last = max(places, key=lambda row: row["vehicles"])["movement"].split(">")
    options = ("--out", out, "--workspace", workspace)
    done = odscen("report", run, "--from", first, "--to", last, *options)
    assert done.code == 0, done.err
    text = out.read_text()
    assert re.search(r"From [^<]+ to [^<]+, \d+ m through 1 junction", text)
    done = odscen("report", run, "--corridor", f"{first},{last}", *options)
    assert done.code == 0, done.err
    done = odscen("report", run, "--corridor", "r9999", *options)
    assert (done.code, "r9999" in done.err) == (2, True)
    done = odscen("report", "nowhere", "--workspace", workspace)
    assert (done.code, "no run named 'nowhere'" in done.err) == (2, True)


@pytest.mark.slow
def test_a_run_without_a_report_has_the_same_records_and_gets_one_later(
    workspace, scenario, finished, tmp_path
):
    options = ("--json", "--workspace", workspace)
    done = odscen("run", scenario, "--no-report", "--out", tmp_path, *options)
    assert done.code == 0, done.err
    run = Path(done.json["folder"])
    assert "report" not in done.json["files"]
    assert not (run / "report.html").exists()
    for name in ("trajectories.parquet", "figures.json", "events.json", "actors.json"):
        assert (run / name).read_bytes() == Path(finished["folder"], name).read_bytes()
    assert odscen("report", run, *options).code == 0
    assert (run / "report.html").is_file()
    assert odscen("report", run, *options).code == 0, "its checksum is known"


@pytest.mark.slow
def test_several_runs_have_their_records_and_the_rest_when_they_are_opened(
    workspace, scenario, tmp_path
):
    options = ("--out", tmp_path, "--workspace", workspace)
    done = odscen("run", scenario, "--seeds", "2", "--until", "20", *options)
    assert done.code == 0, done.err
    runs = sorted(tmp_path.glob("*-seed-*"))
    assert len(runs) == 2
    for run in runs:
        assert f"its report: odscen report {run}" in done.err
        assert json.loads((run / "summary.json").read_text())["records_only"]
        assert (run / "trips.parquet").is_file()
        assert not (run / "figures.json").exists()
        assert not (run / "report.html").exists()
    assert odscen("report", runs[0], "--workspace", workspace).code == 0
    assert (runs[0] / "report.html").is_file()
    assert odscen("compare", *runs).code in (0, 1)
    for run in runs:
        summary = json.loads((run / "summary.json").read_text())
        assert "records_only" not in summary
        assert summary["figures"]["vehicle_km"] > 0.0


@pytest.mark.slow
def test_a_run_gives_what_scripts_rely_on(finished):
    assert list(finished)[2:4] == ["usable", "status"], "the verdict comes first"
    assert finished["usable"] == {"level": "usable", "headline": "usable", "reasons": []}
    assert finished["status"] == "completed"
    assert finished["sim_seconds"] > 10
    assert finished["real_time_factor"] > 1
    counts = finished["actors"]
    assert set(counts) >= {"planned", "inserted", "arrived", "teleported", "collided", "waiting"}
    assert counts["planned"] == counts["inserted"] > 10
    assert counts["waiting"] == 0
    assert finished["insertion_error_max"] < 0.1
    for path in finished["files"].values():
        assert Path(path).is_file()
    assert set(finished["files"]) >= {"summary", "events", "actors", "trajectories", "report"}
    assert finished["figures"]["co2_total"] > 0.0
    assert finished["figures"]["vehicle_km"] > 0.0


@pytest.mark.slow
def test_the_same_seed_gives_the_same_bytes_in_two_folders(workspace, scenario, finished, tmp_path):
    again = odscen(*GENERATE, "--out", tmp_path, "--workspace", workspace).json["scenarios"][0]
    assert _bytes(again["file"]) == _bytes(scenario)
    second = odscen(
        "run", again["file"], "--out", tmp_path, "--json", "--workspace", workspace
    ).json
    for name in ("trajectories", "events", "actors", "plan", "figures", "movements_figures"):
        assert _bytes(second["files"][name]) == _bytes(finished["files"][name]), name
    for name in ("routes.rou.xml", "scenario.sumocfg", "net.net.xml"):
        one, other = (f"{run['folder']}/sumo/{name}" for run in (finished, second))
        assert _bytes(one) == _bytes(other), name


@pytest.mark.slow
def test_another_seed_gives_another_scenario(workspace, scenario, tmp_path):
    arguments = [*GENERATE]
    arguments[arguments.index("5")] = "6"
    other = odscen(*arguments, "--out", tmp_path, "--workspace", workspace).json["scenarios"][0]
    assert _bytes(other["file"]) != _bytes(scenario)


@pytest.mark.slow
def test_a_failed_expectation_is_exit_code_1(workspace, scenario, tmp_path):
    w = ("--out", tmp_path, "--json", "--workspace", workspace)
    done = odscen("run", scenario, "--expect", "arrived>=0.9", "--expect", "collided>100", *w)
    assert done.code == 1
    assert [verdict["passed"] for verdict in done.json["expectations"]] == [True, False]
    assert "collided>100" in done.err
    done = odscen("run", scenario, "--expect", "arived>=0.9", *w)
    assert done.code == 2
    assert "did you mean arrived" in done.err


@pytest.mark.slow
def test_an_expectation_of_criticality_has_it_measured(workspace, scenario, tmp_path):
    w = ("--out", tmp_path, "--json", "--workspace", workspace)
    done = odscen("run", scenario, "--expect", "min_ttc >= 0.1 s", "--expect", "min_pet<0", *w)
    assert done.code == 1
    (ttc, pet) = done.json["expectations"]
    assert ttc["passed"]
    assert ttc["value"] == done.json["figures"]["min_ttc"]
    assert not pet["passed"]
    assert Path(done.json["files"]["conflicts"]).is_file()


@pytest.mark.slow
def test_several_scenarios_give_one_table(workspace, tmp_path):
    w = ("--workspace", workspace)
    odscen("generate", "--map", "t_junction_signs", "--count", 3, "--out", tmp_path / "s", *w)
    out = ("--out", tmp_path / "r", "--jobs", 2)
    done = odscen("run", tmp_path / "s", *out, "--json", *w)
    assert done.code == 0, done.err
    assert [run["status"] for run in done.json["runs"]] == ["completed"] * 3
    assert sorted(path.name for path in (tmp_path / "r").iterdir()) == [
        f"t_junction_signs-000{k}" for k in range(3)
    ]


@pytest.mark.slow
def test_exported_files_run_with_plain_sumo_and_give_the_same_trajectories(
    workspace, scenario, tmp_path
):
    # In shorter steps runs take gaps and keep lateral offsets, which plain SUMO does not.
    document = json.loads(Path(scenario).read_text())
    document["simulation"] = {**document.get("simulation", {}), "step_length": 1.0}
    scenario = tmp_path / "steps.scenario.json"
    scenario.write_text(json.dumps(document))
    ran = odscen("run", scenario, "--out", tmp_path / "r", "--json", "--workspace", workspace)
    assert ran.code == 0, ran.err
    finished = ran.json
    done = odscen("export", scenario, "--to", "sumo", "-o", tmp_path, "--workspace", workspace)
    assert done.code == 0, done.err
    binary = Path(sumo.SUMO_HOME) / "bin" / "sumo"
    subprocess.run([binary, "-c", tmp_path / "scenario.sumocfg"], check=True, capture_output=True)
    plain = pl.read_parquet(tmp_path / "trajectories.parquet")
    ours = pl.read_parquet(finished["files"]["trajectories"])
    assert plain.equals(ours)


@pytest.mark.slow
def test_the_graph_form_runs_like_the_document(workspace, scenario, finished, tmp_path):
    w = ("--json", "--workspace", workspace)
    graph = odscen("export", scenario, "--to", "graphml", "-o", tmp_path, *w).json["files"][0]
    assert graph.endswith(".graphml")
    done = odscen("run", graph, "--out", tmp_path, *w)
    assert done.json["actors"] == finished["actors"]


def test_bodies_stand_where_they_were_placed_by_the_recorded_trajectories(finished):
    """The insertion error once more, from the files alone: SUMO's bumper, the plan's centre."""
    plan = json.loads(_bytes(finished["files"]["plan"]))
    traces = pl.read_parquet(finished["files"]["trajectories"])
    prefix = "vehicle" if "vehicle_id" in traces.columns else "person"
    first = traces.filter(pl.col(f"{prefix}_id").is_not_null()).group_by(f"{prefix}_id").first()
    seen = {row[f"{prefix}_id"]: row for row in first.to_dicts()}
    off_x, off_y = plan["net_offset"]
    checked = 0
    for actor in plan["actors"]:
        row = seen[actor["id"]]
        if actor["category"] == "pedestrian":
            continue
        angle = math.radians(90 - row[f"{prefix}_angle"])
        half = actor["length"] / 2
        x = row[f"{prefix}_x"] - half * math.cos(angle) - off_x
        y = row[f"{prefix}_y"] - half * math.sin(angle) - off_y
        assert math.hypot(x - actor["x"], y - actor["y"]) < 0.1, actor["id"]
        checked += 1
    assert checked > 10


@pytest.mark.slow
def test_a_scenario_with_errors_is_not_run_and_all_of_them_are_shown(workspace, scenario, tmp_path):
    document = json.loads(_bytes(scenario))
    document["actors"][0]["spawn"] = "99.0.-1.0"
    document["actors"][1]["lateral_offset"] = 9.0
    bad = tmp_path / "bad.scenario.json"
    bad.write_text(json.dumps(document), encoding="utf-8")
    done = odscen("run", bad, "--out", tmp_path / "r", "--workspace", workspace)
    assert done.code == 2
    assert "actors[0].spawn" in done.err
    assert "actors[1].lateral_offset" in done.err
    assert not (tmp_path / "r").exists()
    assert odscen("check", bad, "--workspace", workspace).code == 2


@pytest.mark.slow
def test_a_scenario_on_a_missing_map_says_so(scenario, tmp_path):
    done = odscen("check", scenario, "--workspace", tmp_path)
    assert done.code == 2
    assert "no map named 'signal_crossing'" in done.err


@pytest.mark.slow
def test_generating_without_maps_says_how_to_add_one(tmp_path):
    done = odscen("generate", "--workspace", tmp_path)
    assert done.code == 2
    assert "odscen maps add" in done.err


def _bytes(path):
    return Path(path).read_bytes()


@pytest.mark.slow
def test_emissions_are_recorded_unless_they_are_not_wanted(workspace, scenario, tmp_path):
    options = ("--until", 30, "--workspace", workspace, "--json")
    with_them = odscen("run", scenario, "--out", tmp_path / "with", *options)
    without = odscen("run", scenario, "--out", tmp_path / "without", "--no-emissions", *options)
    lanes = [pl.read_parquet(done.json["files"]["lanes"]) for done in (with_them, without)]
    assert lanes[0]["co2"].sum() > 0.0
    assert "co2" not in lanes[1].columns
    assert lanes[0].select(lanes[1].columns).equals(lanes[1])


@pytest.mark.slow
def test_a_scenario_runs_with_several_seeds_that_redraw_it(workspace, scenario, tmp_path):
    out = tmp_path / "runs"
    options = ("--until", "60", "--json", "--workspace", workspace)
    drawn = ("--seeds", "1,3-4", "--redraw", "traffic")
    done = odscen("run", scenario, "--out", out, *drawn, *options)
    assert done.code == 0, done.err
    name = Path(scenario).name.removesuffix(".scenario.json")
    names = [f"{name}-seed-{seed}" for seed in (1, 3, 4)]
    assert sorted(path.name for path in out.iterdir() if path.is_dir()) == names
    assert [run["seed"] for run in done.json["runs"]] == [1, 3, 4]
    goals = [[one["goal"] for one in json.loads((out / name / "plan.json").read_text())["actors"]]
             for name in names]  # fmt: skip
    assert goals[0] != goals[1] != goals[2]
    again = odscen(
        "run", scenario, "--out", tmp_path / "again", "--seed", "3", *drawn[2:], *options
    )
    assert again.code == 0
    plan = (out / names[1] / "plan.json").read_bytes()
    assert (tmp_path / "again" / name / "plan.json").read_bytes() == plan
    compared = odscen("compare", out, out, "--json")
    assert compared.json["a"]["seeds"] == [1, 3, 4]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--seeds", "few"), "'few' are no seeds; write for example 10"),
        (("--seeds", "0"), "at least 1 and at most 1000 seeds"),
        (("--seeds", "1-2000"), "at least 1 and at most 1000 seeds"),
        (("--seeds", "3", "--seed", "4"), "give --seed or --seeds, not both"),
        (("--redraw", "all"), "redraw must be one of open, drivers, traffic, not 'all'"),
    ],
)
def test_seeds_and_redraws_that_are_none_are_refused(workspace, scenario, options, words):
    done = odscen("run", scenario, *options, "--workspace", workspace)
    assert (done.code, words in " ".join(done.err.split())) == (2, True), done.err


@pytest.mark.slow
def test_seeds_that_hardly_vary_are_warned_of(workspace, scenario, tmp_path):
    document = json.loads(Path(scenario).read_text())
    cars = [one for one in document["actors"] if one["category"] == "car"][:1]
    file = tmp_path / "alone.scenario.json"
    file.write_text(json.dumps(document | {"actors": cars, "flows": []}))
    done = odscen("run", file, "--seeds", "3", "--out", tmp_path, "--workspace", workspace)
    assert done.code == 0
    assert "the seeds hardly vary: mean_travel_time is" in done.err
