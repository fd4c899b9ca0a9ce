"""Eight regressions, put in one at a time, with the suite that ships as it is.

Each is caught, and its first line names the field, both of its values, and the place; what has not
changed is no false alarm, on a busy machine neither.
"""

import json
import os
import re
import shutil
import subprocess
import sys

import pytest
from lxml import etree

from odscen.experiments.gates import Update, run_suite
from odscen.experiments.suite import read_suite
from odscen.experiments.suite_words import headline, junit_xml
from tests.experiments.conftest import ROOT

SLOW = os.environ.get("ODSCEN_SLOW") == "all"
SAMPLED = ("signal_crossing", "motorway_weave")
SHIPPED = (ROOT / "suites" / "scenarios").glob("*.scenario.json")
NAMES = tuple(sorted(path.name.split(".")[0] for path in SHIPPED)) if SLOW else SAMPLED
RERUNS, BUSY_RERUNS = (10, 5) if SLOW else (2, 1)


def write_suite(folder):
    for part in ("maps", "scenarios"):
        (folder / part).mkdir(parents=True)
    for name in NAMES:
        shutil.copy(ROOT / "maps" / f"{name}.xodr", folder / "maps")
        scenario = ROOT / "suites" / "scenarios" / f"{name}.scenario.json"
        shutil.copy(scenario, folder / "scenarios")
    text = (ROOT / "suites" / "shipped.toml").read_text().replace("../maps", "maps")
    file = folder / "suite.toml"
    file.write_text(text)
    return file


@pytest.fixture(scope="module")
def before(store, tmp_path_factory):
    """The suite that ships, with baselines of here and now."""
    file = write_suite(tmp_path_factory.mktemp("before") / "suite")
    assert run_suite(store, read_suite(file), update=Update(True), processes=2).exit_code == 0
    return file


@pytest.fixture
def suite(before, tmp_path):
    shutil.copytree(before.parent, tmp_path / "suite")
    return tmp_path / "suite" / before.name


def edit_road(file, name, road, pattern, new):
    """Change all that is like a pattern on one road of a map."""
    path = file.parent / "maps" / f"{name}.xodr"
    text = path.read_text()
    old = re.search(rf'<road name="[^"]*" id="{road}".*?</road>', text, re.DOTALL)[0]
    changed = re.sub(pattern, new, old, flags=re.DOTALL)
    assert changed != old
    path.write_text(text.replace(old, changed))


def edit_scenarios(file, edit):
    for path in (file.parent / "scenarios").iterdir():
        document = json.loads(path.read_text())
        edit(document)
        path.write_text(json.dumps(document))


def keep_only(file, name):
    for path in (*file.parent.glob("scenarios/*"), *file.parent.glob("baselines/*.json")):
        if path.name.split(".")[0] != name:
            path.unlink()


def first_lines(store, file):
    """Verdict and first line in JUnit of each scenario."""
    root = etree.fromstring(junit_xml(run_suite(store, read_suite(file), processes=2)).encode())
    found = {}
    for case in root.iter("testcase"):
        for outcome in case:
            if outcome.tag in ("failure", "error") and "[seed-" not in case.get("name"):
                found[case.get("name")] = outcome.tag, outcome.get("message")
    return found


@pytest.mark.slow
@pytest.mark.parametrize(
    ("pattern", "new", "outcome", "words"),
    [
        pytest.param(
            r'(<lane id="-1" type="driving">.*?<width a=")3\.25',
            r"\g<1>2.4",
            "failure",
            r"the map: width of lane -1 of road 3, s 0 to 130 m: 3\.25 m -> 2\.4 m",
            id="a lane narrowed",
        ),
        pytest.param(
            r'<lane id="-2" type="driving">.*?</lane>\s*',
            "",
            "error",
            r"the map: lane -2 of road 3, s 0 to 130 m: removed \(driving\): .*'van-6' starts on",
            id="a lane removed",
        ),
        pytest.param(
            r'<speed max="50"',
            '<speed max="20"',
            "failure",
            r"the map: limit of road 3, s 0 to 130 m: 50 km/h -> 20 km/h: .*travel_time is .*"
            r"most at segment r3: free_speed is",
            id="the limit of one road",
        ),
    ],
)
def test_a_change_of_the_map_is_caught_and_said_road_by_road(
    store, suite, pattern, new, outcome, words
):
    keep_only(suite, "signal_crossing")
    edit_road(suite, "signal_crossing", 3, pattern, new)
    (found,) = first_lines(store, suite).values()
    assert found[0] == outcome
    assert re.match(words, found[1]), found[1]


@pytest.mark.parametrize("given", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_a_longer_stage_of_a_signal_is_caught_at_its_junction(store, suite, given):
    """Of a light that has the map's times, and of one that has times of its own."""
    keep_only(suite, "signal_crossing")

    def set_green(seconds):
        timing = {"junction": "10001", "green": [seconds, 8]}
        edit_scenarios(suite, lambda document: document.update(signals={"junctions": [timing]}))

    if given:
        set_green(20)
        run_suite(store, read_suite(suite), update=Update(True), processes=2)
    set_green(60)
    (found,) = first_lines(store, suite).values()
    field = (
        r"green: \[20\.0, 8\.0\] -> \[60\.0, 8\.0\]: "
        if given
        else r'{"green": \[\d+\.\d, \d+\.\d\]} of the map -> {"green": \[60\.0, 8\.0\]}: '
    )
    words = rf"signals: signals, junction 10001(, |: ){field}.* is .*most at junction j10001: "
    assert (found[0], bool(re.match(words, found[1]))) == ("failure", True), found[1]


def sporty(document):
    for actor in document["actors"]:
        actor["style"] = "normal" if actor["category"] == "pedestrian" else "sporty"


def slower(document):
    for actor in document["actors"]:
        actor["speed"] = round(0.9 * actor["speed"], 2)


def more(document):
    for flow in document["flows"]:
        flow["per_hour"] = round(1.1 * flow["per_hour"], 2)


def finer(document):
    document["simulation"]["step_length"] = 0.4


@pytest.mark.slow
@pytest.mark.parametrize(
    ("edit", "field"),
    [
        pytest.param(
            sporty, r'actors: actor \S+, style: "\w+" -> "(sporty|normal)"', id="sporty drivers"
        ),
        pytest.param(
            slower, r"actors: actor \S+, speed: [\d.]+ -> [\d.]+", id="desired speeds -10 %"
        ),
        pytest.param(more, r"demand: flow stream-1, per hour: [\d.]+ -> [\d.]+", id="demand +10 %"),
        pytest.param(finer, r"settings: simulation, step length: 0\.5 -> 0\.4", id="step length"),
    ],
)
def test_a_change_of_traffic_is_caught_and_every_scenario_says_field_values_and_place(
    store, suite, edit, field
):
    edit_scenarios(suite, edit)
    result = run_suite(store, read_suite(suite), processes=2)
    assert result.exit_code == 1
    assert {case.name for case in result.cases} == set(NAMES)
    place = r".* at (segment|junction|actor) \S+: \w+ is .*, was "
    for case in result.cases:
        words = headline(case)
        if case.status == "failed":
            assert re.match(field + place, words), words
        else:  # what has become better fails nothing, but says the same
            assert case.status == "changed"
            values = field.partition(": ")[2]
            assert re.search(rf"changed since the baseline: .*{values}{place}", words), words


@pytest.mark.slow
def test_reruns_without_a_change_pass(store, suite):
    assert verdicts_of(store, suite, RERUNS) == {"passed"}


@pytest.mark.slow
def test_reruns_on_a_busy_machine_pass(store, suite):
    """Six processes that never rest."""
    command = [sys.executable, "-c", "while True: pass"]
    busy = [subprocess.Popen(command) for _ in range(6)]
    try:
        assert verdicts_of(store, suite, BUSY_RERUNS) == {"passed"}
    finally:
        for process in busy:
            process.kill()
            process.wait()


def verdicts_of(store, file, reruns):
    results = [run_suite(store, read_suite(file), processes=2) for _ in range(reruns)]
    return {case.status.value for result in results for case in result.cases}
