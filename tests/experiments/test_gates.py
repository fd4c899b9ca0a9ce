import json
import re
import shutil
from pathlib import Path

import pytest
from lxml import etree

from odscen.base.errors import InputError
from odscen.experiments.annotations import code_quality, github_annotations
from odscen.experiments.baseline import fingerprint
from odscen.experiments.dataset_plan import DatasetPlan
from odscen.experiments.gates import (
    Update,
    _with_fields,
    keep_scenario,
    run_suite,
    scenario_changes_since,
)
from odscen.experiments.plan import StudyPlan, found_sources
from odscen.experiments.suite import read_suite
from odscen.experiments.suite_page import suite_page
from odscen.experiments.suite_runs import load_cases, read_parts, results_json
from odscen.experiments.suite_words import (
    NOWHERE,
    headline,
    junit_xml,
    lines,
    suite_summary,
    to_dict,
)
from odscen.experiments.verdict import causes_between
from odscen.maps.store import Workspace
from odscen.runs.run_settings import RunSettings
from odscen.scenario.document.json_form import dumps, loads
from tests.experiments.conftest import ROOT, copy_suite, edit_json, write_tiny


def run(store, file, **options):
    return run_suite(store, read_suite(file), processes=2, **options)


def case(result, name):
    return next(case for case in result.cases if case.case.name == name)


def edit_scenario(file, name, **fields):
    edit_json(file.parent / f"{name}.scenario.json", **fields)


def statuses(result):
    return {case.name: case.status.value for case in result.cases}


@pytest.mark.slow
def test_an_unchanged_rerun_passes_and_writes_the_same_baseline(store, suite):
    before = {path.name: path.read_bytes() for path in suite.parent.glob("baselines/*.*")}
    assert len(before) == 2
    assert len(list(suite.parent.glob("baselines/maps/*.xodr.gz"))) == 2
    result = run(store, suite)
    assert result.exit_code == 0
    assert [lines(case) for case in result.cases] == [[], []]
    run(store, suite, update=Update(True))
    assert {path.name: path.read_bytes() for path in suite.parent.glob("baselines/*.*")} == before


@pytest.mark.slow
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


@pytest.mark.slow
def test_a_lower_speed_limit_fails_naming_the_segment(store, suite):
    path = suite.parent / "maps" / "t_junction_signs.xodr"
    text = path.read_text()
    road = re.search(r'<road name="Main Road" id="2".*?</road>', text, re.DOTALL)[0]
    slower = re.sub(r'<speed max="\d+"', '<speed max="20"', road)
    assert slower != road
    path.write_text(text.replace(road, slower))
    failed = case(run(store, suite), "t_junction_signs")
    assert failed.status == "failed"
    slower_roads = "the map: limit of road 2, s 0 to 120 m: 50 km/h -> 20 km/h"
    assert failed.changed_inputs == (slower_roads,)
    assert headline(failed).startswith(f"{slower_roads}: ")
    assert f'message="{slower_roads.replace(">", "&gt;")}: ' in junit_xml(run(store, suite))
    changes = {change.key[1:]: change.difference for change in failed.verdict.places}
    assert changes["r2", "free_speed"].relative < -0.3
    told = next(line for line in lines(failed) if line.startswith("most changed"))
    assert "segment r2: free_speed is" in told


@pytest.mark.slow
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


@pytest.mark.slow
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
    (line,) = lines(case(result, "signal_crossing"))
    words = "changed since the baseline: the scenario's signals (signals, junction 10001: {"
    assert line.startswith(words)
    start = r", which starts on segment r\d at \d+ s$"
    assert re.search(rf"; most at actor \S+: travel_time is .*{start}", line)


@pytest.mark.slow
def test_without_a_baseline_it_fails_and_says_how_to_write_one(store, suite):
    (suite.parent / "baselines" / "t_junction_signs.json").unlink()
    result = run(store, suite)
    assert result.exit_code == 1
    assert "--update-baseline" in lines(case(result, "t_junction_signs"))[0]


@pytest.mark.slow
def test_a_seed_that_the_baseline_does_not_have_fails(store, suite):
    suite.write_text(suite.read_text().replace("[1, 2]", "[1, 7]"))
    result = run(store, suite)
    found = result.cases[0]
    assert found.status == "missing"
    assert "the baseline has seed 2, which was not run" in found.problems[0]
    assert "the baseline has no seed 7" in found.problems[1]


@pytest.mark.slow
def test_expectations_are_held_against_every_seed(store, suite):
    suite.write_text(suite.read_text().replace('"teleported == 0"', '"mean_delay <= 1 s"'))
    result = run(store, suite)
    told = case(result, "signal_crossing").problems
    assert [line.split(":")[0] for line in told] == ["seed 1", "seed 2"]
    assert "expected mean_delay <= 1 s, but it is" in told[0]
    assert headline(case(result, "signal_crossing")).startswith("behaviour: seed 1: expected")


@pytest.mark.slow
def test_a_run_that_is_not_usable_fails_as_its_own_cause_unless_the_suite_says_otherwise(
    store, suite
):
    timing = {"junction": "10001", "green": [5, 600]}
    edit_scenario(suite, "signal_crossing", signals={"junctions": [timing]})
    result = run(store, suite)
    failed = case(result, "signal_crossing")
    assert headline(failed).startswith("usable: seed 1: not usable: ")
    assert to_dict(result)["cases"][0]["cause"] == "usable"
    assert [line.split(":")[1] for line in failed.unusable] == [" not usable"] * 2
    assert case(result, "t_junction_signs").status == "passed"
    suite.write_text("usable = false\n" + suite.read_text())
    without = case(run(store, suite), "signal_crossing")
    assert without.unusable == ()
    assert headline(without).startswith("signals: ")


@pytest.mark.slow
def test_a_run_that_dies_is_an_error_not_a_difference(store, suite):
    suite.write_text("time_limit = 0.001\n" + suite.read_text())
    result = run(store, suite)
    assert result.exit_code == 3
    assert {case.status for case in result.cases} == {"error"}


@pytest.mark.slow
def test_maps_of_the_same_name_in_the_workspace_are_left_alone(store, suite):
    path = suite.parent / "maps" / "t_junction_signs.xodr"
    before = store.add_map(path).sha256
    run(store, suite)
    path.write_text(path.read_text() + "<!-- other -->\n")
    same = "the map is written otherwise, but means the same"
    assert case(run(store, suite), "t_junction_signs").changed_inputs == (same,)
    assert store.map("t_junction_signs").sha256 == before


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("seeds = [1, 2]", "seeds = [1, -2]", "seeds[1]: "),
        ("seeds = [1, 2]", "seed = [1]", "seed: Extra inputs"),
        ("arrived >= 97 %", "arived >= 97 %", "did you mean arrived"),
        ("teleported == 0", "mean_delay <= 40 m", "mean_delay is written in s"),
        ("maps/*.xodr", "maps/x*.xodr", "maps: there is no file 'maps/x*.xodr'"),
        ("name =", "tolerance.mine = '5 %'\nname =", "tolerance.mine: no figure"),
        ("name =", "figures.mine.function = 'a.py'\nname =", "figures.mine.function: "),
        ("name =", "figures.mean_delay.function = 'a.py:f'\nname =", "is a figure of odscen"),
        (
            "name =",
            "figures.mine = {function = 'a.py:f', tolerance = '5 apples'}\nname =",
            "figures.mine.tolerance: ",
        ),
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


@pytest.mark.slow
def test_each_scenario_that_cannot_be_used_is_one_error_and_the_others_run(store, tiny):
    suite = tiny("good", "misfit", "unreadable", "elsewhere", "spoilt")
    folder = suite.parent
    actors = json.loads((folder / "misfit.scenario.json").read_text())["actors"]
    edit_scenario(suite, "misfit", actors=[actors[0] | {"spawn": "9.9.9.9"}])
    (folder / "unreadable.scenario.json").write_text("{")
    reference = {"name": "no_such_map", "sha256": "0" * 64, "spacing": 2.0}
    edit_scenario(suite, "elsewhere", map=reference)
    (folder / "baselines" / "spoilt.json").write_text('{"format": "odscen-baseline", "version": 9}')
    result = run(store, suite)
    assert statuses(result) == {
        "elsewhere": "error",
        "good": "passed",
        "misfit": "error",
        "spoilt": "error",
        "unreadable": "error",
    }
    assert result.exit_code == 2
    assert "'9.9.9.9'" in headline(case(result, "misfit"))
    assert "unreadable.scenario.json" in headline(case(result, "unreadable"))
    assert "no map named 'no_such_map'" in headline(case(result, "elsewhere"))
    assert "version 9" in headline(case(result, "spoilt"))


@pytest.mark.slow
def test_a_map_that_cannot_be_built_is_an_error_of_its_scenarios_only(store, tiny):
    suite = tiny("good", "on_broken")
    maps = suite.parent / "maps"
    (maps / "broken.xodr").write_text("<OpenDRIVE><road/></OpenDRIVE>")
    reference = json.loads((suite.parent / "good.scenario.json").read_text())["map"]
    edit_scenario(suite, "on_broken", map=reference | {"name": "broken"})
    result = run(store, suite)
    assert statuses(result) == {"good": "passed", "on_broken": "error"}
    assert "broken.xodr" in headline(case(result, "on_broken"))


@pytest.mark.slow
def test_a_scenario_or_map_that_is_named_and_not_there_is_an_error_of_its_own(store, tiny):
    suite = tiny("good")
    text = suite.read_text().replace('"maps/*.xodr"', '"maps/t_junction_signs.xodr"')
    suite.write_text(text + '[[scenario]]\nfile = "gone.scenario.json"\n')
    result = run(store, suite)
    assert statuses(result) == {"good": "passed", "gone": "error"}
    (suite.parent / "maps" / "t_junction_signs.xodr").unlink()
    result = run(store, suite)
    assert statuses(result) == {"good": "error", "gone": "error"}
    assert "maps/t_junction_signs.xodr" in headline(case(result, "good"))


@pytest.mark.slow
def test_a_map_that_is_not_there_and_that_no_scenario_needs_refuses_the_suite(store, tiny):
    suite = tiny("good")
    suite.write_text(suite.read_text().replace("maps/*.xodr", "maps/typo.xodr"))
    with pytest.raises(InputError, match=r"tiny\.toml: maps: there is no file .*typo\.xodr"):
        run(store, suite)


@pytest.mark.slow
def test_what_the_baseline_has_and_the_suite_has_not_is_missing(store, tiny, tiny_baseline):
    suite = tiny("here")
    folder = suite.parent / "baselines"
    (folder / "gone.json").write_bytes(tiny_baseline.read_bytes())
    two = json.loads(tiny_baseline.read_text())
    two["seeds"] = [1, 2]
    for row in two["rows"]:
        row.update({key: value * 2 for key, value in row.items() if isinstance(value, list)})
    (folder / "here.json").write_text(json.dumps(two))
    result = run(store, suite)
    assert statuses(result) == {"here": "missing", "gone": "missing"}
    assert "the baseline has seed 2, which was not run" in headline(case(result, "here"))
    assert "gone.json" in headline(case(result, "gone"))
    assert result.exit_code == 1


@pytest.mark.slow
def test_baselines_of_scenarios_that_fall_short_are_left_unless_forced(store, tiny):
    suite = tiny("one", "other")
    folder = suite.parent / "baselines"
    (folder / "other.json").unlink()
    before = (folder / "one.json").read_bytes()
    suite.write_text('expect = ["mean_speed >= 200 km/h"]\n' + suite.read_text())
    edit_scenario(suite, "one", actors=[])
    result = run(store, suite, update=Update(True))
    assert statuses(result) == {"one": "failed", "other": "failed"}
    assert result.exit_code == 1
    assert (folder / "one.json").read_bytes() == before
    assert not (folder / "other.json").exists()
    assert "is left as it was" in lines(case(result, "one"))[-1]
    assert "is not written" in lines(case(result, "other"))[-1]
    result = run(store, suite, update=Update(True, force=True))
    assert [case.updated for case in result.cases] == [True, True]
    assert result.exit_code == 1
    assert (folder / "one.json").read_bytes() != before


@pytest.mark.slow
def test_a_better_figure_is_a_change_and_fails_only_where_the_suite_says_so(store, tiny):
    suite = tiny("one")
    path = suite.parent / "baselines" / "one.json"
    data = json.loads(path.read_text())
    row = next(row for row in data["rows"] if row.get("figure") == "mean_speed")
    row["values"] = [value / 2 for value in row["values"]]
    path.write_text(json.dumps(data))
    result = run(store, suite)
    (better,) = result.cases[0].verdict.better
    assert better.difference.relative == pytest.approx(1.0, abs=1e-3)
    assert (result.cases[0].label, result.exit_code) == ("changed (better)", 0)
    assert headline(result.cases[0]).startswith("better: mean_speed is")
    suite.write_text('better = "fail"\n' + suite.read_text())
    result = run(store, suite)
    assert (statuses(result), result.exit_code) == ({"one": "failed"}, 1)


@pytest.mark.slow
def test_a_changed_map_fails_where_the_suite_says_so(store, tiny):
    suite = tiny("one")
    path = suite.parent / "maps" / "t_junction_signs.xodr"
    path.write_text(path.read_text() + "<!-- other -->\n")
    result = run(store, suite)
    assert (statuses(result), result.exit_code) == ({"one": "changed"}, 0)
    # The map of this baseline is not kept beside it.
    assert headline(result.cases[0]) == "changed since the baseline: the map"
    assert result.touched == {"the map t_junction_signs": ("one",)}
    suite.write_text('map = "fail"\n' + suite.read_text())
    result = run(store, suite)
    assert (statuses(result), result.exit_code) == ({"one": "failed"}, 1)
    assert headline(result.cases[0]) == f"the map: this suite allows no change of map; {NOWHERE}"


@pytest.mark.slow
def test_a_narrower_lane_fails_by_default_and_passes_where_the_suite_says_so(store, tiny):
    """A width acts on no traffic in SUMO; the gate names lane, place and both values."""
    suite = tiny("one")
    run(store, suite, update=Update(True))
    path = suite.parent / "maps" / "t_junction_signs.xodr"
    text = path.read_text()
    pattern = r'(<lane id="-1" type="driving".*?<width [^>]*?\ba=")[\d.]+'
    narrower = re.sub(pattern, r"\g<1>2.4", text, count=1, flags=re.DOTALL)
    assert narrower != text
    path.write_text(narrower)
    result = run(store, suite)
    assert result.exit_code == 1
    words = (
        r"the map: width of lane -1 of road \d+, s 0 to \d+ m: \S+ m -> 2\.4 m: this suite allows"
    )
    assert re.match(words, headline(result.cases[0])), headline(result.cases[0])
    annotation = github_annotations(result)
    file, line = re.match(
        r"::error file=([^,]+),line=(\d+),title=one%3A failed::", annotation
    ).groups()
    road = re.search(r"of road (\d+)", headline(result.cases[0]))[1]
    assert f'id="{road}"' in Path(file).read_text().splitlines()[int(line) - 1]
    (entry,) = json.loads(code_quality(result))
    assert entry["severity"] == "major"
    assert entry["location"] == {"path": file, "lines": {"begin": int(line)}}
    suite.write_text('map = "report"\n' + suite.read_text())
    (reported,) = run(store, suite).cases
    assert reported.causes[0].name == "map"
    assert not any("allows no change" in words for words in reported.problems)


FIELDS = {
    "style": (("actors", 0, "style"), "sporty", r"actors: actor \S+, style: \S+ -> \"sporty\""),
    "desired speed": (("actors", 0, "speed"), 9.5, r"actors: actor \S+, speed: \S+ -> 9\.5"),
    "step of a rule": (
        ("rules", 0, "then", 0, "speed", "to"), 3.0,
        r"rules: rule slow, then 1, speed, to: 6\.0 -> 3\.0",
    ),
    "trigger of a rule": (
        ("rules", 0, "when", "time", "after"), 9.0,
        r"rules: rule slow, when, time, after: 2\.0 -> 9\.0",
    ),
    "step length": (
        ("simulation", "step_length"), 0.4, r"settings: simulation, step length: 0\.5 -> 0\.4",
    ),
}  # fmt: skip


def test_the_field_of_a_scenario_that_has_changed_is_named_with_both_values(tmp_path):
    """Style, speed, step and trigger of a rule, settings: from what is kept beside the baseline."""
    write_tiny(tmp_path / "suite", "one")
    document = json.loads((tmp_path / "suite" / "one.scenario.json").read_text())
    actor = document["actors"][0]
    actor["style"] = "normal"
    step = {"speed": {"to": 6.0, "over": 2.0}}
    document["rules"] = [
        {"id": "slow", "actor": actor["id"], "when": {"time": {"after": 2.0}}, "then": [step]}
    ]
    before = loads(json.dumps(document))
    settings = RunSettings()
    made_of = fingerprint(before, "0" * 64, settings)
    keep_scenario(tmp_path, "one", before, made_of)
    for place, value, words in FIELDS.values():
        changed = json.loads(dumps(before))
        *path, last = place
        at = changed
        for key in path:
            at = at.setdefault(key, {}) if isinstance(at, dict) else at[key]
        at[last] = value
        after = loads(json.dumps(changed))
        fields = scenario_changes_since(tmp_path, "one", made_of, after)
        causes = causes_between(made_of, fingerprint(after, "0" * 64, settings))
        (cause,) = (_with_fields(cause, fields) for cause in causes)
        assert re.match(words, f"{cause.name}: {cause.details}"), cause
    assert scenario_changes_since(tmp_path, "one", made_of, before) == ()
    other = made_of | {"scenario.actors": "0" * 16}
    assert scenario_changes_since(tmp_path, "one", other, after) == ()  # of another baseline


@pytest.mark.slow
def test_a_map_that_is_only_written_otherwise_is_said_to_mean_the_same(store, tiny):
    suite = tiny("one")
    run(store, suite, update=Update(True))
    path = suite.parent / "maps" / "t_junction_signs.xodr"
    path.write_text(path.read_text() + "<!-- other -->\n")
    (changed,) = run(store, suite).cases
    same = "the map is written otherwise, but means the same"
    assert headline(changed) == f"changed since the baseline: {same}"


@pytest.mark.slow
def test_demand_per_km_that_follows_a_changed_limit_is_put_down_to_the_map(store, tmp_path):
    suite = write_tiny(tmp_path / "suite", "one")
    background = {"id": "all", "mix": {"car": 1}, "per_km": 6}
    edit_scenario(suite, "one", actors=[], demand={"background": [background]})
    suite.write_text(suite.read_text().replace("until = 20", "until = 60"))
    assert run(store, suite, update=Update(True)).exit_code == 0
    path = suite.parent / "maps" / "t_junction_signs.xodr"
    path.write_text(re.sub(r'<speed max="\d+"', '<speed max="8"', path.read_text()))
    (found,) = run(store, suite).cases
    assert [cause.name for cause in found.causes] == ["map"]
    assert headline(found).startswith("the map: limit of road ")
    (planned,) = [one for one in found.verdict.figures if one.key.figure == "planned"]
    assert planned.difference.difference < 0
    note = "the number of road users follows the map: all is given per km"
    assert any(note in line for line in lines(found))


def test_the_shards_of_a_suite_have_each_scenario_once(tiny, tiny_baseline):
    suite = tiny("a", "b", "c", "d")
    (suite.parent / "baselines" / "gone.json").write_bytes(tiny_baseline.read_bytes())
    whole = read_suite(suite)
    shards = [whole.shard(number, 3) for number in (1, 2, 3)]
    names = [[case.name for case in shard.cases] for shard in shards]
    assert names == [["a", "d"], ["b"], ["c"]]
    assert [[path.stem for path in shard.missing] for shard in shards] == [[], ["gone"], []]


FIGURES = """
def longest_stop(run):
    return max(run.actors()["waiting_time"])

def wrong(run):
    return "much"
"""


@pytest.mark.slow
def test_a_figure_of_the_suites_own_is_expected_and_held_against_the_baseline(store, tiny):
    suite = tiny("one")
    (suite.parent / "figures.py").write_text(FIGURES)
    own = '[figures.longest_stop]\nfunction = "figures.py:longest_stop"\nunit = "s"\n'
    own += 'better = "lower"\ntolerance = "1 s"\n'
    text = suite.read_text()
    suite.write_text('expect = ["longest_stop <= 60 s"]\n' + text + own)
    assert run(store, suite, update=Update(True)).exit_code == 0
    path = suite.parent / "baselines" / "one.json"
    data = json.loads(path.read_text())
    (row,) = [row for row in data["rows"] if row.get("figure") == "longest_stop"]
    (stop,) = row["values"]
    row["values"] = [stop - 7]
    path.write_text(json.dumps(data))
    (failed,) = run(store, suite).cases
    (change,) = failed.verdict.failing
    assert change.words.startswith(f"longest_stop is {stop:.2f} s, was {stop - 7:.2f} s (+7.00 s")
    row["values"] = [stop + 7]
    path.write_text(json.dumps(data))
    assert run(store, suite).cases[0].label == "changed (better)"
    suite.write_text(text + own.replace("figures.py:longest_stop", "figures.py:wrong"))
    (broken,) = run(store, suite).cases
    assert (broken.status, broken.exit_code) == ("error", 2)
    assert "figures.longest_stop: figures.py:wrong returned 'much'" in headline(broken)


@pytest.mark.parametrize("count", [8, pytest.param(100, marks=pytest.mark.slow)])
def test_a_large_suite_with_everything_in_it_is_reported_whole(store, tiny, count):
    names = [f"s{number:03d}" for number in range(count)]
    suite = tiny(*names)
    folder = suite.parent
    broken, deleted, new, slow = names[1], names[2], names[3], names[4]
    edit_scenario(suite, broken, actors=[{"id": "a", "category": "car", "spawn": "9.9.9.9"}])
    (folder / f"{deleted}.scenario.json").unlink()
    (folder / "baselines" / f"{new}.json").unlink()
    limit = f'[[scenario]]\nfile = "{slow}.scenario.json"\ntime_limit = 0.001\n'
    suite.write_text(suite.read_text() + limit)
    result = run(store, suite)
    expected = dict.fromkeys(names, "passed") | {
        broken: "error",
        deleted: "missing",
        new: "new",
        slow: "error",
    }
    assert statuses(result) == expected
    assert [case.exit_code for case in result.worst_first[:5]] == [2, 3, 1, 1, 0]
    assert result.exit_code == 3
    root = etree.fromstring(junit_xml(result).encode())
    # Of each scenario a test case, and of each that could be run one for its seed.
    assert root.attrib["tests"] == str(count + count - 2)
    assert (root.attrib["errors"], root.attrib["failures"]) == ("3", "2")
    assert {one.get("name") for one in root.iter("testcase")} >= set(names)
    page = suite_page(result)
    assert all(f">{name}<" in page for name in names)
    assert f"4 of {count} scenarios do not pass" in page
    assert f"2 error, 1 missing, 1 new, {count - 4} passed" in suite_summary(result)


@pytest.mark.slow
def test_a_changed_map_of_a_suite_is_none_to_choose_or_sample_from(tmp_path):
    own = Workspace.open(tmp_path / "own")
    own.add_map(ROOT / "maps" / "t_junction_signs.xodr")
    suite = read_suite(write_tiny(tmp_path / "suite", "one"))
    changed = tmp_path / "suite" / "maps" / "t_junction_signs.xodr"
    changed.write_text(changed.read_text().replace('<speed max="50"', '<speed max="20"'))
    (case_,) = load_cases(own, suite, with_baseline=False)
    entry = case_.run.entry
    assert entry.name == f"t_junction_signs-{entry.sha256[:8]}-odscen"
    assert own.map_names() == ["t_junction_signs"]
    assert [one.name for one in own.maps()] == ["t_junction_signs"]
    sample = {"sample": [{"maps": ["*"], "count": 2}]}
    plan = StudyPlan.model_validate({"name": "n", **sample})
    sources = found_sources(plan, own, beside=tmp_path)
    assert set(sources) == {"t_junction_signs-0000", "t_junction_signs-0001"}
    parts = {"licence": "MIT", "splits": {"train": ["t_junction_signs"]}, "study": sample}
    dataset = DatasetPlan.model_validate({"name": "n", **parts})
    dataset.refuse_without_split({source.map_name for source in sources.values()})
    # It is found again by what it is, by the next test and by a run of this one.
    (again,) = load_cases(own, suite, with_baseline=False)
    assert again.run.entry.folder == entry.folder
    assert own.map_for("t_junction_signs", entry.sha256).folder == entry.folder


@pytest.mark.slow
def test_a_suite_can_test_networks_by_netconvert_with_baselines_of_their_own(store, tmp_path):
    file = copy_suite(tmp_path, "signal_crossing")
    text = file.read_text().replace('name = "small"', 'name = "small"\nconverter = "netconvert"')
    file.write_text(text)
    written = run_suite(store, read_suite(file), update=Update(True))
    assert written.exit_code == 0
    (case_,) = run_suite(store, read_suite(file)).cases
    assert (case_.status, case_.changed_inputs) == ("passed", ())
    assert case_.entry.converter == "netconvert"
    file.write_text(text.replace('converter = "netconvert"', 'converter = "odscen"'))
    (case_,) = run_suite(store, read_suite(file)).cases
    assert case_.changed_inputs == ("the network",)
    assert case_.entry.converter == "odscen"


@pytest.mark.slow
def test_seeds_redraw_placed_traffic_and_their_scatter_decides(store, tiny):
    suite = tiny("one")
    text = suite.read_text().replace("seeds = [1]", 'seeds = 8\nredraw = "traffic"')
    suite.write_text(text)
    written = run(store, suite, update=Update(True))
    assert written.exit_code == 0
    path = suite.parent / "baselines" / "one.json"
    before = path.read_bytes()
    data = json.loads(before)
    assert data["tolerance"] == "scatter"
    assert data["seeds"] == [1, 2, 3, 4, 5, 6, 7, 8]
    (row,) = [row for row in data["rows"] if row.get("figure") == "mean_travel_time"]
    # Times of arrival are whole steps of half a second.
    assert len(set(row["values"])) >= 4
    again = run(store, suite, update=Update(True))
    assert path.read_bytes() == before
    (note,) = again.cases[0].notes
    assert re.fullmatch(
        r"to tell a change of mean_delay by 5 % from chance takes \d+ seeds, not 8", note
    )
    unchanged = run(store, suite).cases[0]
    assert (unchanged.status, lines(unchanged)) == ("passed", [])
    others = run_suite(store, read_suite(suite).with_seeds(tuple(range(101, 110))))
    assert (statuses(others), others.exit_code) == ({"one": "passed"}, 0)
    suite.write_text(text.replace('redraw = "traffic"', ""))
    (changed,) = run(store, suite).cases
    assert changed.causes[0].name == "settings"
    assert changed.changed_inputs == ("redraw traffic -> open",)


@pytest.mark.slow
def test_other_seeds_than_those_of_the_baseline_need_its_scatter(store, tiny):
    suite = read_suite(tiny("one")).with_seeds((7, 8))
    (found,) = run_suite(store, suite).cases
    assert found.status == "missing"
    assert found.problems == (
        "the baseline has seed 1, which was not run; write it with --update-baseline",
        "the baseline has no seed 7, 8; write it with --update-baseline",
    )


@pytest.mark.slow
def test_seeds_that_hardly_vary_are_warned_of_in_every_test(store, tiny):
    suite = tiny("one")
    document = json.loads((suite.parent / "one.scenario.json").read_text())
    alone = [document["actors"][0] | {"speed": 8.0}]
    edit_scenario(suite, "one", actors=alone)
    text = suite.read_text().replace("seeds = [1]", "seeds = 3")
    suite.write_text(text.replace("until = 20", "until = 60"))
    run(store, suite, update=Update(True))
    (same,) = run(store, suite).cases
    assert same.status == "passed"
    (warning,) = lines(same)
    assert warning.startswith("the seeds hardly vary: mean_travel_time is ")
    assert warning.endswith('redraw = "traffic" makes them vary')


@pytest.fixture
def in_parts(store, tiny, tmp_path):
    """A suite of three with one broken and one changed, and the results of its three parts."""
    suite = tiny("a", "b", "c")
    actors = json.loads((suite.parent / "a.scenario.json").read_text())["actors"]
    edit_scenario(suite, "a", actors=[actors[0] | {"spawn": "9.9.9.9"}])
    edit_scenario(suite, "b", actors=[actor | {"speed": 3.0} for actor in actors])
    files = []
    for part in (1, 2, 3):
        folder = tmp_path / "parts" / str(part)
        result = run_suite(store, read_suite(suite).shard(part, 3), out=folder / "runs")
        files.append(folder / "results.json")
        folder.mkdir(parents=True, exist_ok=True)
        files[-1].write_text(results_json(result, beside=folder))
    return suite, files


@pytest.mark.slow
def test_parts_are_judged_together_as_if_they_had_run_here(store, in_parts, tmp_path):
    suite, _ = in_parts
    (tmp_path / "elsewhere").mkdir()
    shutil.move(tmp_path / "parts", tmp_path / "elsewhere" / "parts")
    merged = run_suite(store, read_suite(suite), parts=read_parts([tmp_path / "elsewhere"]))
    here = run(store, suite)
    assert statuses(merged) == statuses(here) == {"a": "error", "b": "failed", "c": "passed"}
    assert [lines(case) for case in merged.cases] == [lines(case) for case in here.cases]
    assert merged.exit_code == here.exit_code == 2
    times = re.compile(r' time="[\d.]+"|\s*<property name="artefact.*')
    assert times.sub("", junit_xml(merged)) == times.sub("", junit_xml(here))
    page = suite_page(merged, workspace=store, beside=tmp_path)
    assert 'href="elsewhere/parts/2/runs/b/seed-1/report.html"' in page
    assert "2 of 3 scenarios do not pass" in page


@pytest.mark.slow
def test_a_part_that_is_not_there_is_the_error_of_its_scenarios(store, in_parts):
    suite, files = in_parts
    merged = run_suite(store, read_suite(suite), parts=read_parts(files[:2]))
    assert statuses(merged) == {"a": "error", "b": "failed", "c": "error"}
    assert "none of the parts has run it" in headline(case(merged, "c"))


@pytest.mark.slow
def test_a_part_from_other_inputs_is_refused_for_what_has_changed(store, in_parts):
    suite, files = in_parts
    edit_scenario(suite, "c", environment={"preset": "WetNoon"})
    merged = run_suite(store, read_suite(suite), parts=read_parts(files))
    assert case(merged, "c").status == "error"
    words = "with other inputs than are here: the scenario's environment"
    assert words in headline(case(merged, "c"))


@pytest.mark.slow
def test_parts_that_do_not_fit_together_or_to_the_suite_are_refused(store, in_parts):
    suite, files = in_parts
    with pytest.raises(InputError, match=r"results\.json: b is in .*2/results\.json as well"):
        read_parts([files[1], files[1]])
    with pytest.raises(InputError, match=r"no results\.json in this folder"):
        read_parts([suite.parent])
    files[0].write_text('{"format": "odscen-baseline", "version": 1}')
    with pytest.raises(InputError, match="is not results of a suite"):
        read_parts(files)
    (suite.parent / "b.scenario.json").unlink()
    with pytest.raises(InputError, match="the suite has no scenario 'b', which was run here"):
        run_suite(store, read_suite(suite), parts=read_parts(files[1:]))


@pytest.mark.slow
def test_baselines_are_written_from_parts(store, in_parts):
    suite, files = in_parts
    merged = run_suite(store, read_suite(suite), parts=read_parts(files), update=Update(True))
    assert [one.updated for one in merged.cases] == [False, True, True]
    assert run(store, suite).exit_code == 2
    assert case(run(store, suite), "b").status == "passed"
