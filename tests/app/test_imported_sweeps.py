"""Parameters of OpenSCENARIO files as parameters, and their distributions as plans of sweeps."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import polars as pl
import pytest

from odscen.app.exchange.imports import import_file
from odscen.app.scenarios import read_scenario
from odscen.base.errors import InputError
from odscen.experiments.sweeps import sweep
from odscen.formats.openscenario_import.traced_numbers import TracedNumber
from odscen.maps.store import Workspace
from odscen.runs.finished_run import Run
from odscen.scenario.document.expressions import evaluate
from odscen.scenario.document.json_form import dumps, with_values
from odscen.scenario.sweeps.sweep_plan import Range, Table, plan_from_data
from tests.app.test_scenario_imports import FILE, SPEED, given

if TYPE_CHECKING:
    from odscen.app.exchange.imports import ImportedFile
    from odscen.scenario.sweeps.sweep_plan import SweepPlan

ALKS = Path(__file__).parents[2].parent / "shared" / "osc" / "alks"
DECLARED = '<ParameterDeclaration name="kph" parameterType="double" value="36"/>'
MORE = """<ParameterDeclaration name="kph" parameterType="double" value="36"><ConstraintGroup>
<ValueConstraint rule="greaterThan" value="0"/><ValueConstraint rule="lessOrEqual" value="90"/>
</ConstraintGroup></ParameterDeclaration>
<ParameterDeclaration name="half" parameterType="double" value="${$kph / 2}"/>
<ParameterDeclaration name="ahead" parameterType="double" value="40"><ConstraintGroup>
<ValueConstraint rule="lessThan" value="${$kph * 2}"/></ConstraintGroup></ParameterDeclaration>
<ParameterDeclaration name="model" parameterType="string" value="van"/>
<ParameterDeclaration name="unused" parameterType="double" value="1"/>"""
TEXT = (
    FILE.replace("ACTION", SPEED.replace('value="5"', 'value="${$half / 3.6}"'))
    .replace(DECLARED, MORE)
    .replace('ds="40"', 'ds="$ahead"')
    .replace('vehicleCategory="van"', 'vehicleCategory="$model"')
    .replace('value="2.5"', 'value="${$ahead / 16}"')
)


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    return Workspace.open(tmp_path_factory.mktemp("imported-sweeps"))


def varied(folder: Path, inside: str) -> Path:
    given(folder, TEXT)
    file = folder / "varied.xosc"
    file.write_text(
        '<OpenSCENARIO><FileHeader revMajor="1" revMinor="2" description="all of them"/>'
        f'<ParameterValueDistribution><ScenarioFile filepath="scene.xosc"/>{inside}'
        "</ParameterValueDistribution></OpenSCENARIO>"
    )
    return file


def of(name: str, inside: str) -> str:
    kind = "DeterministicSingleParameterDistribution"
    return f'<{kind} parameterName="{name}">{inside}</{kind}>'


def between(low: float, high: float, step: float) -> str:
    limits = f'<Range lowerLimit="{low}" upperLimit="{high}"/>'
    return f'<DistributionRange stepWidth="{step}">{limits}</DistributionRange>'


def plan_of(found: ImportedFile) -> SweepPlan:
    assert found.plan is not None
    return found.plan


def test_parameters_stay_with_bounds_and_formulas_and_the_rest_says_where_it_is_fixed(
    workspace: Workspace, tmp_path: Path
) -> None:
    found = import_file(workspace, given(tmp_path, TEXT))
    parameters = found.scenario.parameters
    assert list(parameters) == ["kph", "half", "ahead"]
    assert (parameters["kph"].value, parameters["kph"].min, parameters["kph"].max) == (36, 0, 90)
    assert (parameters["half"].value, parameters["ahead"].max) == (18, 72)
    written = json.loads(dumps(found.scenario))
    assert written["parameters"]["half"] == {"value": "$kph / 2"}
    assert written["parameters"]["ahead"] == {"value": 40.0, "max": "$kph * 2"}
    rules = {rule["id"]: rule["then"][0] for rule in written["rules"]}
    assert rules["cut-in"]["lane"]["over"] == "abs($ahead / 16)"
    assert rules["later"]["speed"]["to"] == "$half / 3.6"
    assert written["actors"][0]["initial_speed"] == "$kph / 3.6"
    fixed = {row.xpath.rpartition("/")[2]: row for row in found.lists["approximated"]}
    assert "RelativeLanePosition in line " in fixed["ParameterDeclaration[3]"].reason
    assert fixed["ParameterDeclaration[4]"].reason == "its value is put in where it is named"
    ignored = [row.xpath.rpartition("/")[2] for row in found.lists["ignored"]]
    assert "ParameterDeclaration[5]" in ignored


def test_ranges_sets_and_tables_make_a_grid_beside_the_scenario(
    workspace: Workspace, tmp_path: Path
) -> None:
    rows = "".join(
        '<ParameterValueSet><ParameterAssignment parameterRef="half" value="9"/>'
        f'<ParameterAssignment parameterRef="model" value="{model}"/></ParameterValueSet>'
        for model in ("car", "van")
    )
    many = "DeterministicMultiParameterDistribution"
    inside = (
        of("kph", between(20, 60, 10))
        + of("ahead", between(0, 25, 10))
        + of("model", '<DistributionSet><Element value="car"/></DistributionSet>')
        + f"<{many}><ValueSetDistribution>{rows}</ValueSetDistribution></{many}>"
    )
    file = varied(tmp_path, f"<Deterministic>{inside}</Deterministic>")
    found = import_file(workspace, file, out=tmp_path / "all.scenario.json")
    assert plan_of(found).axes == (
        Range("kph", 20, 60, 5),
        Table(("ahead",), ((0.0,), (10.0,), (20.0,))),
        Table(("half",), ((9.0,),)),
    )
    assert found.scenario.name == "varied"
    assert found.plan_file == tmp_path / "all.sweep.json"
    assert plan_from_data(json.loads(found.plan_file.read_text())) == found.plan
    kept = [r for r in found.lists["approximated"] if r.file == "varied.xosc"]
    assert {row.reason for row in kept} == {
        "no number of the scenario comes from it: it keeps its declared value"
    }


def test_draws_keep_to_their_distributions_and_their_seed(
    workspace: Workspace, tmp_path: Path
) -> None:
    range_ = '<Range lowerLimit="30" upperLimit="50"/>'
    draws = {
        "kph": f'<NormalDistribution expectedValue="40" variance="100">{range_}'
        "</NormalDistribution>",
        "half": '<Histogram><Bin weight="1"><Range lowerLimit="0" upperLimit="2"/></Bin>'
        '<Bin weight="3"><Range lowerLimit="8" upperLimit="9"/></Bin></Histogram>',
        "ahead": f'<PoissonDistribution expectedValue="38">{range_}</PoissonDistribution>',
    }
    parts = "".join(
        f'<StochasticDistribution parameterName="{name}">{inside}</StochasticDistribution>'
        for name, inside in draws.items()
    )
    text = f'<Stochastic numberOfTestRuns="2000" randomSeed="7">{parts}</Stochastic>'
    plan = plan_of(import_file(workspace, varied(tmp_path, text)))
    again = plan_of(import_file(workspace, varied(tmp_path, text)))
    assert plan == again
    kph, half, ahead = np.array([list(case.values()) for case in plan.cases()]).T
    assert len(kph) == 2000
    assert (kph.min() >= 30, kph.max() <= 50, abs(kph.mean() - 40) < 0.4) == (True,) * 3
    assert np.mean(half > 7.9) == pytest.approx(0.75, abs=0.04)
    assert set(ahead) <= set(range(30, 51))
    other = varied(tmp_path, text.replace('Seed="7"', 'Seed="8"'))
    assert plan_of(import_file(workspace, other)) != plan


@pytest.mark.parametrize(
    ("inside", "words"),
    [
        ("", "no Deterministic and no Stochastic"),
        (f"<Deterministic>{of('kph', between(9, 1, 1))}</Deterministic>", "no step of 1 leads"),
        (
            '<Stochastic numberOfTestRuns="0" randomSeed="1"/>',
            "0 test runs; 1 to 100,000 are possible",
        ),
    ],
)
def test_broken_distributions_say_what_is_wrong(
    workspace: Workspace, tmp_path: Path, inside: str, words: str
) -> None:
    with pytest.raises(InputError, match=words):
        import_file(workspace, varied(tmp_path, inside), out=tmp_path / "none.scenario.json")
    assert not (tmp_path / "none.scenario.json").exists()


@pytest.mark.skipif(not ALKS.is_dir(), reason="the ALKS scenarios are not here")
@pytest.mark.slow
def test_every_logical_scenario_of_alks_is_imported(workspace: Workspace, tmp_path: Path) -> None:
    files = sorted(ALKS.glob("*.xosc"))
    found = [import_file(workspace, file, out=tmp_path / "s.json") for file in files]
    cases = {f.stem: 0 if one.plan is None else len(one.plan.cases())
             for f, one in zip(files, found, strict=True)}  # fmt: skip
    assert len(cases) == 15
    assert cases["alks_scenario_4_1_1_free_driving_variation"] == 12
    assert cases["alks_scenario_4_6_2_lateral_detection_range_variation"] == 2  # beside its lane


@pytest.mark.skipif(not ALKS.is_dir(), reason="the ALKS scenarios are not here")
@pytest.mark.slow
def test_cases_of_the_alks_cut_in_differ_as_their_parameters_say(
    workspace: Workspace, tmp_path: Path
) -> None:
    out = tmp_path / "cut-in.scenario.json"
    found = import_file(
        workspace, ALKS / "alks_scenario_4_4_1_cut_in_no_collision_variation.xosc", out=out
    )
    ego, slower, gap = (
        "Ego_InitSpeed_Ve0_kph",
        "CutInVehicle_RelativeInitSpeed_Ve0_Vo0_kph",
        "CutInVehicle_HeadwayDistanceTrigger_dx0_m",
    )
    assert {ego, slower, gap} <= set(plan_of(found).names)
    table = [[60, -20, 30], [50, -30, 50]]
    plan = plan_from_data({"vary": [{"parameters": [ego, slower, gap], "table": table}]})
    done = sweep(workspace, read_scenario(out), plan, tmp_path / "sweep")
    assert done.table["status"].to_list() == ["completed"] * 2
    runs = [Run.open(done.folder / "runs" / case) for case in done.table["case"]]
    for run, (kph, less, metres) in zip(runs, table, strict=True):
        rows = run.trajectories().filter(pl.col("time").is_between(0.2, 1.0))
        motions = {key: one for (key,), one in rows.group_by("id", maintain_order=True)}
        first, other = motions["Ego"], motions["CutInVehicle"]
        assert first["speed"].to_numpy() == pytest.approx(kph / 3.6, abs=0.05)
        assert other["speed"].to_numpy() == pytest.approx((kph + less) / 3.6, abs=0.05)
        # The file: from reference point to reference point, closing at ``less`` since 0 s. The ego
        # starts on a node up to 1 m away, and what appears does so within a step, 1 m.
        ahead = metres - 10 * less / 3.6 + less / 3.6 * first["time"][0]
        assert other["x"][0] - first["x"][0] == pytest.approx(ahead, abs=2.0)


def test_what_a_sweep_places_appears_where_its_formulas_say(
    workspace: Workspace, tmp_path: Path
) -> None:
    inside = f"<Deterministic>{of('ahead', between(20, 60, 20))}</Deterministic>"
    found = import_file(workspace, varied(tmp_path, inside))
    (rule,) = (one for one in found.scenario.rules if one.id == "init-Other")
    appears = rule.then[0].appear
    assert appears is not None
    assert appears.at == (pytest.approx(88.6), pytest.approx(-5.25), 0.0)
    far = with_values(found.scenario, {"ahead": 60.0})
    (rule,) = (one for one in far.rules if one.id == "init-Other")
    assert rule.then[0].appear is not None
    assert rule.then[0].appear.at == (pytest.approx(108.6), pytest.approx(-5.25), 0.0)
    assert not any("RelativeLanePosition" in row.reason for row in found.lists["approximated"])


def test_traced_numbers_say_how_they_come_about() -> None:
    gap = TracedNumber.of(4.0, "$gap", frozenset())
    for number, formula in (
        (2 * gap + 1, "(2 * $gap) + 1"),
        (1 - gap / 2, "1 - ($gap / 2)"),
        (abs(-gap) * gap, "(abs(-$gap)) * $gap"),
        (0 + gap * 1.0 - 0.0, "$gap"),
        (3 / gap, "3 / $gap"),
    ):
        assert number.formula == formula
        assert evaluate(formula, {"gap": 4.0}) == number
    assert type(gap * 0) is float
    assert type(round(gap, 2)) is float


def test_entries_of_catalogs_know_their_parameters_and_those_of_the_file(
    workspace: Workspace, tmp_path: Path
) -> None:
    entry = SPEED.replace('value="5"', 'value="$mps"').replace('value="2"', 'value="$kph"')
    event = f'<Event name="later"><Action name="y"><PrivateAction>{entry}</PrivateAction></Action>'
    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "moves.xosc").write_text(
        '<OpenSCENARIO><FileHeader revMajor="1" revMinor="2"/><Catalog name="moves">'
        '<Maneuver name="faster"><ParameterDeclarations><ParameterDeclaration name="mps" '
        f'parameterType="double" value="1"/></ParameterDeclarations>{event}</Event></Maneuver>'
        "</Catalog></OpenSCENARIO>"
    )
    reference = (
        '<CatalogReference catalogName="moves" entryName="faster"><ParameterAssignments>'
        '<ParameterAssignment parameterRef="mps" value="${$kph / 4}"/></ParameterAssignments>'
        "</CatalogReference>"
    )
    places = '<CatalogLocations><ManeuverCatalog><Directory path="own"/></ManeuverCatalog>'
    text = re.sub(r"<Maneuver name.*</Maneuver>", reference, FILE, flags=re.DOTALL)
    text = text.replace("<RoadNetwork>", f"{places}</CatalogLocations><RoadNetwork>")
    found = import_file(workspace, given(tmp_path, text))
    rules = {rule["id"]: rule["then"] for rule in json.loads(dumps(found.scenario))["rules"]}
    assert rules["later"][0]["speed"] == {"to": "$kph / 4", "rate": "abs($kph)"}
