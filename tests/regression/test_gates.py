import json
import re

import pytest
from lxml import etree

from odscen.base.errors import InputError
from odscen.regression.gates import run_suite
from odscen.regression.junit import junit_xml
from odscen.regression.suite import read_suite
from odscen.regression.suite_page import suite_page
from odscen.regression.suite_words import lines, to_dict
from tests.regression.conftest import copy_suite


def run(store, file, **options):
    return run_suite(store, read_suite(file), processes=2, **options)


def case(result, name):
    return next(case for case in result.cases if case.case.name == name)


def edit_scenario(file, name, **fields):
    path = file.parent / f"{name}.scenario.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | fields))


def test_an_unchanged_rerun_passes_and_writes_the_same_baseline(store, suite):
    before = {path.name: path.read_bytes() for path in suite.parent.glob("baselines/*")}
    assert len(before) == 2
    result = run(store, suite)
    assert result.exit_code == 0
    assert [lines(case) for case in result.cases] == [[], []]
    run(store, suite, update_baseline=True)
    assert {path.name: path.read_bytes() for path in suite.parent.glob("baselines/*")} == before


def test_a_longer_green_fails_naming_figure_junction_size_and_input(store, suite):
    timing = {"junction": "10001", "green": [60, 8]}
    edit_scenario(suite, "signal_crossing", signals={"junctions": [timing]})
    result = run(store, suite)
    assert result.exit_code == 1
    failed = case(result, "signal_crossing")
    told = "\n".join(lines(failed))
    assert re.search(r"mean_delay is \d+\.\d\d s, was \d+\.\d\d s \(\+\d+\.\d\d s, \+", told)
    assert "junction j10001: waiting_time is" in told
    assert failed.changed_inputs == ("the scenario's signals",)
    assert case(result, "t_junction_signs").status == "passed"
    delay = next(c for c in failed.verdict.figures if c.key.figure == "mean_delay")
    assert delay.difference.difference > 5.0


def test_a_lower_speed_limit_fails_naming_the_segment(store, suite):
    path = suite.parent / "maps" / "t_junction_signs.xodr"
    text = path.read_text()
    road = re.search(r'<road name="Main Road" id="2".*?</road>', text, re.DOTALL)[0]
    slower = re.sub(r'<speed max="\d+"', '<speed max="20"', road)
    assert slower != road
    path.write_text(text.replace(road, slower))
    failed = case(run(store, suite), "t_junction_signs")
    assert failed.status == "failed"
    assert failed.changed_inputs == ("the map",)
    changes = {change.key[1:]: change.difference for change in failed.verdict.places}
    assert changes["r2", "free_speed"].relative < -0.3
    told = next(line for line in lines(failed) if line.startswith("most changed"))
    assert "segment r2: free_speed is" in told


def test_a_changed_figure_without_a_changed_input_is_a_changed_behaviour(store, suite):
    path = suite.parent / "baselines" / "t_junction_signs.json"
    data = json.loads(path.read_text())
    row = next(row for row in data["rows"] if row.get("figure") == "mean_speed")
    row["values"] = [value * 1.5 for value in row["values"]]
    path.write_text(json.dumps(data))
    failed = case(run(store, suite), "t_junction_signs")
    assert [change.key.figure for change in failed.verdict.failing] == ["mean_speed"]
    assert failed.verdict.failing[0].difference.relative == pytest.approx(-1 / 3, abs=1e-3)
    assert lines(failed)[-1].endswith("the behaviour has changed")


def test_a_tolerance_of_the_suite_lets_it_pass(store, suite):
    edit = {"junction": "10001", "green": [30, 15]}
    edit_scenario(suite, "signal_crossing", signals={"junctions": [edit]})
    assert run(store, suite).exit_code == 1
    figures = json.loads((suite.parent / "baselines" / "signal_crossing.json").read_text())["rows"]
    names = [row["figure"] for row in figures if "figure" in row]
    rows = [f'{name} = "1000 %"' for name in names]
    rows += [f'segment.{name} = "1000 %"' for name in ("vehicles", "mean_speed", "free_speed")]
    rows += [f'junction.{name} = "1000 %"' for name in ("vehicles", "waiting_time")]
    suite.write_text(suite.read_text() + "\n[tolerance]\n" + "\n".join(rows))
    result = run(store, suite)
    assert result.exit_code == 0
    assert lines(case(result, "signal_crossing")) == [
        "changed since the baseline: the scenario's signals"
    ]


def test_without_a_baseline_it_fails_and_says_how_to_write_one(store, suite):
    (suite.parent / "baselines" / "t_junction_signs.json").unlink()
    result = run(store, suite)
    assert result.exit_code == 1
    assert "--update-baseline" in lines(case(result, "t_junction_signs"))[0]


def test_a_seed_that_the_baseline_does_not_have_fails(store, suite):
    suite.write_text(suite.read_text().replace("[1, 2]", "[1, 7]"))
    result = run(store, suite)
    assert "no seed 7" in lines(result.cases[0])[0]


def test_expectations_are_held_against_every_seed(store, suite):
    suite.write_text(suite.read_text().replace('"teleported == 0"', '"mean_delay <= 1 s"'))
    result = run(store, suite)
    told = lines(case(result, "signal_crossing"))
    assert [line.split(":")[0] for line in told[:2]] == ["seed 1", "seed 2"]
    assert "expected mean_delay <= 1 s, but it is" in told[0]


def test_a_run_that_dies_is_an_error_not_a_difference(store, suite):
    suite.write_text("time_limit = 0.01\n" + suite.read_text())
    result = run(store, suite)
    assert result.exit_code == 3
    assert {case.status for case in result.cases} == {"error"}


def test_reports_say_what_failed(store, suite):
    edit_scenario(suite, "signal_crossing", flows=[])
    result = run(store, suite)
    root = etree.fromstring(junit_xml(result).encode())
    assert root.attrib["tests"] == "2"
    assert root.attrib["failures"] == "1"
    failure = root.find(".//testcase[@name='signal_crossing']/failure")
    assert "planned is" in failure.text
    assert "the scenario's flows" in failure.text
    page = suite_page(result)
    assert "1 of 2 scenarios failed" in page
    assert ">road users planned</th>" in page
    data = to_dict(result)
    assert data["exit_code"] == 1
    change = next(c for c in data["cases"][0]["changes"] if c["figure"] == "planned")
    assert change["difference"] == change["value"] - change["baseline"] < 0


def test_maps_of_the_same_name_in_the_workspace_are_left_alone(store, suite):
    path = suite.parent / "maps" / "t_junction_signs.xodr"
    run(store, suite)
    before = store.map("t_junction_signs").sha256
    path.write_text(path.read_text() + "<!-- other -->\n")
    assert case(run(store, suite), "t_junction_signs").changed_inputs == ("the map",)
    assert store.map("t_junction_signs").sha256 == before


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("seeds = [1, 2]", "seeds = [1, -2]", "seeds[1]: "),
        ("seeds = [1, 2]", "seed = [1]", "seed: Extra inputs"),
        ("arrived >= 97 %", "arived >= 97 %", "did you mean arrived"),
        ("teleported == 0", "mean_delay <= 40 m", "mean_delay is written in s"),
        ("maps/*.xodr", "maps/x.xodr", "maps: there is no file 'maps/x.xodr'"),
        ("name =", "tolerance.mean_delay = '5 apples'\nname =", "tolerance.mean_delay: "),
        ("name =", "tolerance.mean_delai = '5 %'\nname =", "tolerance.mean_delai: no figure"),
        ("name =", "tolerance.segment.fast = '5 %'\nname =", "tolerance.segment.fast: no figure"),
        ("name =", "name", "the suite cannot be read"),
    ],
)
def test_a_bad_suite_is_refused_with_file_key_and_value(suite, old, new, words):
    suite.write_text(suite.read_text().replace(old, new))
    with pytest.raises(InputError) as caught:
        read_suite(suite)
    assert str(suite) in str(caught.value)
    assert words in str(caught.value)


def test_a_file_that_is_no_baseline_is_refused_before_anything_runs(store, suite):
    path = suite.parent / "baselines" / "signal_crossing.json"
    path.write_text('{"format": "odscen-baseline", "version": 9}')
    with pytest.raises(InputError, match=r"signal_crossing\.json.*version 9"):
        run(store, suite)


def test_a_suite_can_test_networks_by_netconvert_with_baselines_of_their_own(store, tmp_path):
    file = copy_suite(tmp_path, "signal_crossing")
    text = file.read_text().replace('name = "small"', 'name = "small"\nconverter = "netconvert"')
    file.write_text(text)
    written = run_suite(store, read_suite(file), update_baseline=True)
    assert written.exit_code == 0
    (case_,) = run_suite(store, read_suite(file)).cases
    assert (case_.status, case_.changed_inputs) == ("passed", ())
    assert store.map(case_.map_name).converter == "netconvert"
    file.write_text(text.replace('converter = "netconvert"', 'converter = "odscen"'))
    (case_,) = run_suite(store, read_suite(file)).cases
    assert case_.changed_inputs == ("the network",)
    assert store.map(case_.map_name).converter == "odscen"
