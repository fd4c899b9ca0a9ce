"""Eight regressions, put in one at a time: each is caught, and named by cause and place."""

import json
import os
import re
import shutil

import pytest
from lxml import etree

from odscen.experiments.gates import Update, run_suite
from odscen.experiments.suite import read_suite
from odscen.experiments.suite_words import NOWHERE, junit_xml
from tests.experiments.conftest import ROOT

SLOW = os.environ.get("ODSCEN_SLOW") == "all"
SAMPLED = ("signal_crossing", "motorway_weave")
NAMES = tuple(sorted(path.stem for path in (ROOT / "maps").glob("*.xodr"))) if SLOW else SAMPLED
RERUNS = 10 if SLOW else 2


def write_suite(folder):
    for part in ("maps", "scenarios"):
        (folder / part).mkdir(parents=True)
    for name in NAMES:
        shutil.copy(ROOT / "maps" / f"{name}.xodr", folder / "maps")
        scenario = ROOT / "suites" / "scenarios" / f"{name}.scenario.json"
        shutil.copy(scenario, folder / "scenarios")
    text = (ROOT / "suites" / "shipped.toml").read_text().replace("../maps", "maps")
    file = folder / "suite.toml"
    file.write_text(text.replace("seeds = [1, 2, 3]", 'seeds = [1]\ninputs = "fail"'))
    return file


@pytest.fixture(scope="module")
def before(store, tmp_path_factory):
    """The shipped scenarios with baselines of one seed, in a suite that allows no other inputs."""
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


def test_a_longer_stage_of_a_signal_is_caught_at_its_junction(store, suite):
    keep_only(suite, "signal_crossing")
    timing = {"junction": "10001", "green": [60, 8]}
    edit_scenarios(suite, lambda document: document.update(signals={"junctions": [timing]}))
    (found,) = first_lines(store, suite).values()
    words = (
        r"signals: signals, junction 10001: added \(.*60.*\): .* is "
        r".*most at junction j10001: waiting_time is"
    )
    assert (found[0], bool(re.match(words, found[1]))) == ("failure", True), found[1]


def sporty(document):
    for actor in document["actors"]:
        actor["style"] = "normal" if actor["category"] == "pedestrian" else "sporty"


def slower(document):
    for actor in document["actors"]:
        actor["speed"] = round(0.9 * actor["speed"], 2)


def more(document):
    for flow in document["flows"]:
        flow["per_hour"] *= 1.1


def finer(document):
    document["simulation"]["step_length"] = 0.4


@pytest.mark.slow
@pytest.mark.parametrize(
    ("edit", "cause"),
    [(sporty, "actors"), (slower, "actors"), (more, "demand"), (finer, "settings")],
    ids=["sporty drivers", "desired speeds -10 %", "demand +10 %", "step length"],
)
def test_a_change_of_traffic_is_caught_by_every_scenario_with_its_cause_and_place(
    store, suite, edit, cause
):
    edit_scenarios(suite, edit)
    found = first_lines(store, suite)
    assert set(found) == set(NAMES)
    place = r"(segment|junction|actor) \S+: \w+ is "
    somewhere = 0
    for outcome, words in found.values():
        assert outcome == "failure"
        assert re.match(rf"{cause}: .* -> .*({place}|{NOWHERE}$)", words), words
        somewhere += bool(re.search(place, words))
    # A setting acts everywhere alike: in one scenario no place may stand out.
    assert somewhere > len(NAMES) / 2 - (cause == "settings")


@pytest.mark.slow
def test_reruns_without_a_change_pass(store, suite):
    results = [run_suite(store, read_suite(suite), processes=2) for _ in range(RERUNS)]
    verdicts = {case.status.value for result in results for case in result.cases}
    assert verdicts == {"passed"}
