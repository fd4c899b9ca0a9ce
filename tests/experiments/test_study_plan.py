"""Plans of studies: what they may say, and which runs they are."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from odscen.base.errors import ConflictError, InputError, ScenarioError
from odscen.experiments.plan import StudyPlan, found_sources, grid_of, read_study_plan, refuse_other
from odscen.experiments.studies import begin_study
from odscen.scenario.document.problems import validated
from tests.experiments.study_case import WARM, place, plan_file

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.experiments.plan import StudyGrid

VARY = [{"parameter": "per_minute", "values": [2, 4]}]


def plan(**parts: Any) -> StudyPlan:
    return validated(StudyPlan, {"name": "n", "scenarios": ["a"], **parts})


def grid(folder: Path, **parts: Any) -> StudyGrid:
    read = read_study_plan(plan_file(folder, **parts))
    return grid_of(read, found_sources(read, place(), beside=folder))


@pytest.mark.parametrize(
    ("given", "seeds"),
    [(3, (1, 2, 3)), ([7, 2], (7, 2)), ("101-103", (101, 102, 103))],
)
def test_seeds_are_a_count_a_list_or_a_range(given: Any, seeds: tuple[int, ...]) -> None:
    assert plan(seeds=given).seeds == seeds


@pytest.mark.parametrize(
    ("parts", "words"),
    [
        ({"scenarios": []}, "nothing is run"),
        ({"seeds": [1, 1]}, "a seed twice"),
        ({"seeds": 0}, "seeds"),
        ({"seedz": 3}, "seedz: Extra inputs"),
        ({"variant": [{"name": "as-designed", "edits": [{"kind": "x"}]}]}, "name of its own"),
        ({"variant": [{"name": "a/b", "edits": [{"kind": "x"}]}]}, r"variant\[0\].*name"),
        ({"only_variants": True}, "there must be one"),
        ({"samples": 3}, "nothing is varied"),
        ({"vary": [{"parameter": "gap", "from": 1, "to": 2}]}, "number of steps"),
        (
            {"vary": [{"parameter": "gap", "from": 1, "to": 2, "steps": 3e7}]},
            "gap has 30,000,000 values",
        ),
        ({"run": {"meso": True, "criticality": True}}, "cannot be measured in meso"),
        ({"keep": "some"}, "keep"),
    ],
)
def test_a_wrong_plan_is_refused_with_its_place(parts: dict[str, Any], words: str) -> None:
    with pytest.raises(ScenarioError, match=words):
        plan(**parts)


@pytest.mark.parametrize(
    ("name", "text"),
    [("a.toml", "name = \n"), ("a.json", r'{"scenarios": ["a.json"], "\ud800": 1}')],
)
def test_a_file_that_is_no_plan_is_named(tmp_path: Path, name: str, text: str) -> None:
    """Half of a pair of surrogates is no character."""
    file = tmp_path / name
    file.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=rf"{name}: not a plan"):
        read_study_plan(file)


def test_runs_are_scenarios_times_variants_times_cases_times_seeds(tmp_path: Path) -> None:
    found = grid(tmp_path, variant=[WARM], vary=VARY, seeds=[5, 3])
    names = [run.name for run in found.runs()]
    assert found.count == len(names) == len(set(names)) == 8
    assert names[:3] == [
        "crossing/as-designed/case-1/seed-5",
        "crossing/as-designed/case-1/seed-3",
        "crossing/as-designed/case-2/seed-5",
    ]
    assert names[-1] == "crossing/slow/case-2/seed-3"
    assert found.values(2) == {"per_minute": 4.0}


def test_scenarios_are_sampled_on_each_map_that_matches(tmp_path: Path) -> None:
    sample = [{"maps": ["signal*"], "count": 3, "seed": 4, "fill": 0.2}]
    found = grid(tmp_path, scenarios=[], sample=sample)
    assert list(found.sources) == [f"signal_crossing-000{seed}" for seed in (4, 5, 6)]
    with pytest.raises(InputError, match="no map matches 'nowhere'"):
        grid(tmp_path, scenarios=[], sample=[{"maps": ["nowhere"]}])


@pytest.mark.parametrize(
    ("parts", "words"),
    [
        ({"scenarios": ["*.nothing"]}, r"no file matches '\*\.nothing'"),
        ({"vary": [{"parameter": "gap", "values": [1]}]}, "no parameter 'gap'; it has per_minute"),
        ({"scenarios": ["crossing*", "crossing.scenario.json"]}, "are called 'crossing'"),
        ({"seeds": "1-1000000", "variant": [WARM]}, "2,000,000 runs; at most 1,000,000"),
        (
            {"scenarios": [], "sample": [{"maps": ["*"], "count": 10**6}] * 9},
            r"runs; at most 1,000,000 .*scenarios: [0-9]*,000,000, variants: 1",
        ),
    ],
)
def test_what_cannot_be_found_is_refused(tmp_path: Path, parts: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        grid(tmp_path, **parts)


@pytest.mark.parametrize(
    ("new", "words"),
    [
        ({"seeds": [2, 3]}, "seed 1 of the study is not in the plan"),
        ({"variant": []}, "variant 'slow'"),
        ({"variant": [{**WARM, "edits": [{"kind": "set_seed", "seed": 4}]}]}, "variant 'slow'"),
        ({"only_variants": True}, "as designed"),
        ({"vary": [{"parameter": "per_minute", "values": [4, 2]}]}, "varies other values"),
        ({"run": {"until": 5}}, "run differs"),
        ({"keep": "all"}, "keep differs"),
    ],
)
def test_a_study_can_be_extended_and_not_changed(
    tmp_path: Path, new: dict[str, Any], words: str
) -> None:
    own = {"variant": [WARM], "vary": VARY}
    old = grid(tmp_path, **own)
    more = [{"parameter": "per_minute", "values": [2, 4, 8]}]
    refuse_other(old, grid(tmp_path, **{**own, "seeds": 3, "vary": more}))
    with pytest.raises(ConflictError, match=words):
        refuse_other(old, grid(tmp_path, **{**own, **new}))


def test_a_scenario_that_has_changed_is_another_study(tmp_path: Path) -> None:
    old = grid(tmp_path)
    file = tmp_path / "crossing.scenario.json"
    file.write_text(file.read_text("utf-8").replace("15.0", "16.0"), encoding="utf-8")
    with pytest.raises(ConflictError, match="'crossing' has changed"):
        refuse_other(old, grid(tmp_path))


def test_an_absolute_pattern_is_of_files_as_a_relative_one_is(tmp_path: Path) -> None:
    pattern = f"{tmp_path}/cross*.scenario.json"
    assert list(grid(tmp_path, scenarios=[pattern]).sources) == ["crossing"]
    with pytest.raises(InputError, match="no file matches"):
        grid(tmp_path, scenarios=[f"{tmp_path}/none*.json"])


@pytest.mark.parametrize("pattern", ["**x/*.json", "a/../**b"])
def test_what_is_no_pattern_is_named(pattern: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="is no pattern of files"):
        grid(tmp_path, scenarios=[pattern])


@pytest.mark.parametrize("pattern", [".", "./", "/"])
def test_patterns_that_no_file_can_match_are_refused_in_words(tmp_path: Path, pattern: str) -> None:
    with pytest.raises(InputError, match="scenarios: no file matches"):
        begin_study(place(), plan_file(tmp_path, scenarios=[pattern]), tmp_path / "study")
