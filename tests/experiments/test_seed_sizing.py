import json
from dataclasses import replace

import pytest
from lxml import etree

from odscen.app.scenarios import read_scenario
from odscen.base.errors import InputError
from odscen.experiments.gates import Update, run_suite, with_longer_headway
from odscen.experiments.suite import read_suite
from odscen.experiments.suite_page import suite_page
from odscen.experiments.suite_runs import read_parts, results_json
from odscen.experiments.suite_words import headline, junit_xml, seed_words, suite_summary, to_dict
from odscen.scenario.document.drivers_document import Drivers
from tests.experiments.conftest import ROOT, copy_suite, write_tiny

pytestmark = pytest.mark.slow(together=True)

SEEDS = "seeds = [1, 2]"


def detecting(file, text, seeds=SEEDS):
    """The suite with what it is to catch, in place of its seeds."""
    file.write_text(file.read_text().replace(seeds, text))
    return file


@pytest.fixture(scope="module")
def chosen(store, tmp_path_factory):
    """A crossing with the seeds that are chosen to catch a large change; its suite and results."""
    folder = tmp_path_factory.mktemp("chosen")
    detect = 'detect = { change = "60 %", seeds_max = 8 }'
    text = f'redraw = "traffic"\nuntil = 60\nusable = false\n{detect}'
    file = detecting(copy_suite(folder, "left_hand_crossing"), text)
    file.write_text(file.read_text().replace("arrived >= 97 %", "arrived >= 1 %"))
    result = run_suite(store, read_suite(file), update=Update(True), out=folder / "runs")
    assert result.exit_code == 0, [case.problems for case in result.cases]
    return file, result


def parts_of(file, result):
    """What was run, as another job would have written it."""
    results = file.parent / "results.json"
    results.write_text(results_json(result, beside=file.parent))
    return read_parts([results])


def baseline_file(file):
    return file.parent / "baselines" / "left_hand_crossing.json"


def test_a_new_baseline_has_the_seeds_that_catch_the_change_and_says_what_they_catch(chosen):
    file, result = chosen
    (case,) = result.cases
    sizing = case.sizing
    assert sizing.seeds == sizing.needed == 8
    assert [run.seed for run in case.runs] == list(range(1, sizing.seeds + 1))
    assert case.notes[-1].endswith("catch a change of mean_delay by 60 % with probability 0.9")
    stored = json.loads(baseline_file(file).read_text())
    assert stored["seeds"] == list(range(1, sizing.seeds + 1))
    assert stored["detect"]["figure"] == "mean_delay"
    assert 0 < stored["detect"]["scatter"] < stored["detect"]["mean"]
    assert stored["detect"]["catches"] <= 0.6 * stored["detect"]["mean"]
    kept = {path.name for path in (file.parent / "runs" / case.name).iterdir()}
    assert kept == {f"seed-{seed}" for seed in stored["seeds"]}


def test_later_runs_have_the_seeds_of_the_baseline_and_reports_name_them(store, chosen):
    file, before = chosen
    result = run_suite(store, read_suite(file))
    (case,) = result.cases
    assert case.status == "passed"
    assert len(case.runs) == before.cases[0].sizing.seeds
    assert to_dict(result)["cases"][0]["detect"] == case.sizing.model_dump()
    properties = {
        one.get("name"): one.get("value")
        for one in etree.fromstring(junit_xml(result).encode()).find(".//testcase/properties")
    }
    assert properties["seeds"] == str(len(case.runs))
    assert properties["detect"] == case.sizing.words
    assert f"{len(case.runs)} seeds a scenario were chosen" in suite_summary(result)
    assert f"1-{len(case.runs)}" in suite_page(result)


def test_a_smaller_change_than_the_baseline_was_made_for_asks_for_a_new_one(store, chosen):
    file, before = chosen
    suite = read_suite(file)
    (case,) = suite.cases
    smaller = replace(suite, cases=(replace(case, detect=replace(case.detect, change="5 %")),))
    (judged,) = run_suite(store, smaller, parts=parts_of(file, before)).cases
    assert judged.status == "new"
    assert "was not made to catch a change of mean_delay by 5 %" in headline(judged)
    assert len(judged.runs) == before.cases[0].sizing.seeds


def test_seeds_that_are_given_go_before_chosen_ones_but_make_no_baseline(store, chosen):
    file, _ = chosen
    given = read_suite(file).with_seeds(tuple(range(101, 109)))
    (case,) = run_suite(store, given).cases
    assert case.exit_code == 0
    assert [run.seed for run in case.runs] == list(range(101, 109))
    with pytest.raises(InputError, match="chosen by its detect"):
        run_suite(store, given, update=Update(True))


def test_parts_that_chose_their_seeds_make_the_same_baseline_together(store, chosen):
    file, result = chosen
    written = baseline_file(file).read_bytes()
    parts = parts_of(file, result)
    merged = run_suite(store, read_suite(file), parts=parts, update=Update(True))
    assert merged.cases[0].updated
    assert baseline_file(file).read_bytes() == written
    unsized = {name: replace(part, sizing=None) for name, part in parts.items()}
    refused = run_suite(store, read_suite(file), parts=unsized, update=Update(True))
    assert "was run without --update-baseline" in headline(refused.cases[0])


def test_too_few_seeds_are_used_as_they_are_and_said_to_catch_less(store, tmp_path):
    text = 'usable = false\ndetect = { change = "0.1 %", seeds_max = 9 }'
    file = detecting(write_tiny(tmp_path, "one"), f'redraw = "traffic"\n{text}', "seeds = [1]")
    (case,) = run_suite(store, read_suite(file), update=Update(True)).cases
    assert case.updated
    assert len(case.runs) == 9 < case.sizing.needed
    assert not case.sizing.enough
    assert case.notes[-1].startswith("9 seeds, the most that the suite allows, catch a change of")


def test_a_run_that_dies_in_the_pilot_is_an_error_and_writes_nothing(store, tmp_path):
    text = 'time_limit = 0.001\ndetect = { change = "5 %", seeds_max = 8 }'
    file = detecting(write_tiny(tmp_path, "one"), text, "seeds = [1]")
    result = run_suite(store, read_suite(file), update=Update(True))
    assert result.exit_code == 3
    assert not (tmp_path / "baselines" / "one.json").exists()


def test_a_figure_that_the_runs_do_not_have_cannot_be_watched(store, tmp_path):
    text = 'detect = { change = "5 %", figure = "pedestrian_mean_delay", seeds_max = 8 }'
    file = detecting(write_tiny(tmp_path, "one"), text, "seeds = [1]")
    (case,) = run_suite(store, read_suite(file), update=Update(True)).cases
    assert case.exit_code == 2
    assert "0 of 8 pairs of runs" in headline(case)
    assert "have pedestrian_mean_delay" in headline(case)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('seeds = 8\ndetect = "5 %"', "give seeds or detect, not both"),
        ('detect = "5 apples"', "detect.change: "),
        ('detect = { change = "5 %", figure = "mean_delai" }', "detect.figure: no figure"),
        ('detect = { change = "5 %", power = 1 }', "detect.power: "),
        ('detect = { change = "5 %", seeds_max = 7 }', "detect.seeds_max: "),
        ('detect = "5 %"\ntolerance.mean_delay = "5 %"', "tolerance.mean_delay: detect sets"),
        ('detect = "0 %"', "is no change"),
    ],
)
def test_a_suite_that_cannot_catch_what_it_wants_is_refused(tmp_path, text, words):
    file = detecting(write_tiny(tmp_path, "one"), text, "seeds = [1]")
    with pytest.raises(InputError) as caught:
        read_suite(file)
    assert str(file) in str(caught.value)
    assert words in str(caught.value)


def test_detect_needs_baselines_and_gives_way_to_the_seeds_of_a_scenario(tmp_path):
    file = detecting(write_tiny(tmp_path, "one", "two"), 'detect = "5 %"', "seeds = [1]")
    entry = '\n[[scenario]]\nfile = "two.scenario.json"\nseeds = [4]\n'
    file.write_text(file.read_text() + entry)
    cases = {case.name: case for case in read_suite(file).cases}
    assert cases["one"].detect.words == "a change of mean_delay by 5 %"
    assert (cases["two"].detect, cases["two"].seeds) == (None, (4,))
    file.write_text(file.read_text().replace('baselines = "baselines"', ""))
    with pytest.raises(InputError, match="name their folder"):
        read_suite(file)


def test_the_pilot_has_a_longer_headway_however_the_scenario_gives_it():
    shipped = read_scenario(ROOT / "suites" / "scenarios" / "roundabout.scenario.json")
    longer = with_longer_headway(shipped, 0.5)
    assert longer.drivers.headway == pytest.approx(1.6)
    flow = shipped.model_copy(update={"drivers": Drivers(saturation_flow=1800)})
    changed = with_longer_headway(flow, 0.5).drivers
    assert changed.headway == pytest.approx(3600 / 1800 - 0.57 + 0.5)
    assert changed.saturation_flow is None
    far = shipped.model_copy(update={"drivers": Drivers(headway=4.9)})
    assert with_longer_headway(far, 1.5).drivers.headway == 5.0


def test_seeds_are_written_short():
    assert seed_words([1, 2, 3, 4, 5]) == "1-5"
    assert seed_words([9, 1, 2, 7, 8]) == "1, 2, 7-9"
    assert seed_words([]) == ""
