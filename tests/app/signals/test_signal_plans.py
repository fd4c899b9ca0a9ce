"""Signal programs from and to SUMO's files."""

from __future__ import annotations

import json
import re
import subprocess
from typing import TYPE_CHECKING

import polars as pl
import pytest

from odscen.app.exchange.exports import export
from odscen.app.networks import bring_in
from odscen.app.running.runs import run
from odscen.app.scenarios import read_scenario, write_scenario
from odscen.app.signals.signal_plans import export_signals, import_signals, signal_programs
from odscen.base.errors import InputError, NotFoundError, ScenarioError
from odscen.convert.model.conversion_settings import ConversionSettings
from odscen.maps.netconvert import NetconvertLimits, run_netconvert
from odscen.maps.store import Workspace
from odscen.records.light_programs import programs_from_json, stage_spans
from odscen.runs.run_settings import RunSettings
from odscen.scenario.document.drivers_document import Drivers
from odscen.scenario.document.scenario_document import MapReference
from odscen.scenario.document.signals_document import JunctionTiming, Signals
from tests.signal_case import MAP, one_plan, program, scenario
from tests.sumo.conftest import BIN

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.scenario.document.scenario_document import Scenario

EVENING = 18.5 * 3600.0 - 200.0


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    store = Workspace.open(tmp_path_factory.mktemp("workspace"))
    store.add_map(MAP)
    return store


def placed(workspace: Workspace, one: Scenario) -> Scenario:
    """The scenario on the map of the workspace."""
    sha256 = workspace.map("signal_crossing").info["sha256"]
    return one.model_copy(update={"map": MapReference(name="signal_crossing", sha256=sha256)})


def plain(one: Scenario) -> Scenario:
    return one.model_copy(update={"signals": type(one.signals)()})


def taken(workspace: Workspace, one: Scenario, folder: Path) -> Scenario:
    """The same traffic with signals that were exported, and imported again."""
    file = folder / "signals.add.xml"
    file.write_text(export_signals(workspace, one))
    back, notes = import_signals(workspace, plain(one), file)
    assert notes == ()
    return back


@pytest.fixture(scope="module")
def by_netconvert(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    """The same map with a network that netconvert has written."""
    store = Workspace.open(tmp_path_factory.mktemp("netconvert"))
    store.add_map(MAP, settings=ConversionSettings(converter="netconvert"))
    return store


@pytest.mark.slow
@pytest.mark.parametrize("control", ["fixed", "actuated"])
def test_a_program_as_json_and_as_tllogic_gives_the_same_run(
    workspace: Workspace, tmp_path: Path, control: str
) -> None:
    own = placed(workspace, scenario(program(), control=control, clock=EVENING))
    # In shorter steps runs take gaps across oncoming traffic, which plain SUMO does not.
    steps = own.simulation.model_copy(update={"step_length": 1.0})
    # Who wants more than the limit slows down for bends in runs, and not in plain SUMO.
    calm = Drivers(shares={"cautious": 1.0})
    own = own.model_copy(update={"simulation": steps, "drivers": calm})
    back = taken(workspace, own, tmp_path)
    runs = [
        run(workspace, one, name=name, out=tmp_path / "runs")
        for name, one in (("own", own), ("back", back))
    ]
    assert [one.status for one in runs] == ["completed", "completed"]
    for file in ("trajectories.parquet", "events.json"):
        one, other = ((done.folder / file).read_bytes() for done in runs)
        assert one == other
    log = (runs[0].folder / "sumo.log").read_text()
    assert "tlLogic" not in log
    assert "detector" not in log
    plain_sumo(workspace, own, tmp_path)
    one, other = (
        folder / "trajectories.parquet" for folder in (tmp_path / "exported", runs[0].folder)
    )
    assert one.read_bytes() == other.read_bytes()


def plain_sumo(workspace: Workspace, one: Scenario, folder: Path) -> None:
    """Export a scenario and run it by ``sumo -c`` alone."""
    file = write_scenario(one, folder / "one.scenario.json")
    export(workspace, file, folder / "exported", to="sumo")
    subprocess.run(
        [BIN / "sumo", "-c", "scenario.sumocfg"],
        cwd=folder / "exported", check=True, capture_output=True,
    )  # fmt: skip


@pytest.mark.parametrize("called", [("4",), ("2", "3", "4")], ids=["people", "vehicles too"])
def test_groups_stages_calls_detectors_and_plans_come_back_as_they_were(
    workspace: Workspace, tmp_path: Path, called: tuple[str, ...]
) -> None:
    stages = [{**one, "on_call": one["id"] in called} for one in program()["stages"]]
    one = placed(workspace, scenario(program(stages=stages), control="actuated", clock=EVENING))
    (timing,) = taken(workspace, one, tmp_path).signals.junctions
    (own,) = one.signals.junctions
    assert timing.control == "actuated"
    assert [g.id for g in timing.groups] == [g.id for g in own.groups]
    assert [(s.id, set(s.groups), s.on_call) for s in timing.stages] == [
        (s.id, set(s.groups), s.on_call) for s in own.stages
    ]
    assert timing.intergreens == own.intergreens
    assert timing.detectors == own.detectors
    assert [(plan.id, plan.times) for plan in timing.plans] == [
        ("day", ("18:26:40",)), ("evening", ("18:30:00",)),
    ]  # fmt: skip
    assert timing.plans[0].offset == 12.0


@pytest.mark.parametrize(
    "own",
    [
        {},
        {"green": [20.0, 9.0], "offset": 12.0},
        {
            "detectors": [
                {"id": "D1", "at": "r1", "before": 25.0, "stages": ["1"], "gap": 2.5},
                {"id": "D2", "at": "r2", "before": 25.0, "stages": ["2"]},
            ]
        },
        {"bus_priority": True},
    ],
)
def test_an_actuated_light_with_the_stages_of_the_map_comes_back_as_it_was(
    workspace: Workspace, tmp_path: Path, own: dict[str, object]
) -> None:
    one = placed(workspace, scenario({"junction": "10001", "control": "actuated", **own}))
    back = taken(workspace, one, tmp_path)
    assert back.signals.junctions == one.signals.junctions
    assert export_signals(workspace, back) == export_signals(workspace, one)


@pytest.mark.parametrize("own", [{"offset": 7}, {"green": [18, 13], "offset": 7}])
def test_an_extended_light_comes_back_as_it_was(
    workspace: Workspace, tmp_path: Path, own: dict[str, object]
) -> None:
    one = placed(workspace, scenario({"junction": "10001", "control": "extended", **own}))
    back = taken(workspace, one, tmp_path)
    assert back.signals.junctions == one.signals.junctions
    assert export_signals(workspace, back) == export_signals(workspace, one)


def test_the_program_of_the_network_is_that_of_the_map(workspace: Workspace) -> None:
    one = placed(workspace, scenario(None))
    net = workspace.map("signal_crossing").path("net")
    back, notes = import_signals(workspace, one, net, junctions=["10001"])
    assert notes == ()
    (timing,) = back.signals.junctions
    assert (timing.control, timing.green, timing.stages) == ("extended", (), ())


def test_a_fixed_program_of_a_network_becomes_one_of_stages(
    workspace: Workspace, tmp_path: Path
) -> None:
    """Where vehicles begin before the crossings, they have a short stage of their own."""
    one = placed(workspace, scenario(None))
    lines = workspace.map("signal_crossing").path("net").read_text().splitlines()
    net = tmp_path / "fixed.net.xml"
    fixed = [line.replace('"actuated"', '"static"') for line in lines if '"odscen.' not in line]
    net.write_text("\n".join(fixed))
    back, notes = import_signals(workspace, one, net, junctions=["10001"])
    assert notes
    assert all("shows G for g: it has nothing to yield to" in note for note in notes)
    (timing,) = back.signals.junctions
    assert [group.movements for group in timing.groups] == [
        ("r1",), ("r2",), ("r3",), ("r4",), ("walk r1",), ("walk r2",), ("walk r3",), ("walk r4",),
    ]  # fmt: skip
    assert [(s.id, s.green) for s in timing.stages] == [
        ("1", 13.0), ("2", 1.0), ("3", 13.0), ("4", 1.0),
    ]  # fmt: skip
    assert timing.intergreens == ()
    before, after = (signal_programs(workspace, case)[0].plans[0].phases for case in (one, back))
    shown = [[(seconds, state.lower()) for seconds, state, *_ in case] for case in (before, after)]
    assert shown[0] == shown[1]


NETS = (
    "gGgGgrrrrrGgGggrrrrrrGrG", "yyyyyrrrrryyyyyrrrrrrrrr", "rrrrrrrrrrrrrrrrrrrrrrrr",
    "rrrrrgGgGgrrrrrgGgGgrrrr", "rrrrryyyyyrrrrryyyyyrrrr",
)  # fmt: skip


def written(folder: Path, phases: list[tuple[float, str]], **attributes: str) -> Path:
    lines = [f'<phase duration="{seconds}" state="{state}"/>' for seconds, state in phases]
    given = {"id": "J10001", "programID": "1", "type": "static", "offset": "0", **attributes}
    head = " ".join(f'{key}="{value}"' for key, value in given.items())
    file = folder / "own.tll.xml"
    file.write_text(f"<tlLogics><tlLogic {head}>{''.join(lines)}</tlLogic></tlLogics>")
    return file


@pytest.mark.parametrize(
    ("phases", "message"),
    [
        ([(30.0, "GGr"), (30.0, "rrG")], "3 letters, but the light of this map has 24 links"),
        ([(30.0, "G" * 23 + "x")], "letter 'x'"),
        ([(30.0, "r" * 24)], "nothing ever begins"),
    ],
)
def test_what_is_no_program_of_this_light_is_refused_with_its_place(
    workspace: Workspace, tmp_path: Path, phases: list[tuple[float, str]], message: str
) -> None:
    file = written(tmp_path, phases)
    with pytest.raises(InputError, match=message) as raised:
        import_signals(workspace, placed(workspace, scenario(None)), file, strict=True)
    assert "J10001" in str(raised.value)
    assert "own.tll.xml" in str(raised.value)


WRONG_PROGRAMS: dict[str, tuple[str, str, str]] = {
    "no XML": (r"(?s).*", "junction;group;begin", "not well-formed"),
    "cut off": (r"(?s)</tlLogic>.*", "", "not well-formed"),
    "no program": ("tlLogic", "busStop", "there is no <tlLogic>"),
    "of another light": (r' id="[^"]*"', ' id="nowhere"', "no program for 'J10001'"),
    "of no light": (r' id="[^"]*"', "", "no program for 'J10001'"),
    "no phases": (r"<phase [^>]*/>", "", "there are no phases"),
    "no states": (r'state="[^"]*"', "", "0 letters, but the light of this map has 24 links"),
    "no durations": (r'duration="[^"]*"', "", "phase 0: duration is None, not a number"),
    "duration of words": (r'duration="[^"]*"', 'duration="ten"', "'ten', not a number"),
    "duration that is no number": (r'duration="[^"]*"', 'duration="nan"', "'nan', not a number"),
    "duration of 0": (r'duration="[^"]*"', 'duration="0"', "phase 0: duration is '0', not above 0"),
    "duration below 0": (r'duration="[^"]*"', 'duration="-3"', "'-3', not above 0"),
    "another type": (r'type="[^"]*"', 'type="magic"', "type 'magic' is not static or actuated"),
    "offset of words": (r'offset="[^"]*"', 'offset="abc"', "offset is 'abc', not a number"),
}


@pytest.mark.parametrize("fault", WRONG_PROGRAMS)
def test_fourteen_wrong_programs_are_refused_with_their_place(
    workspace: Workspace, tmp_path: Path, fault: str
) -> None:
    pattern, instead, words = WRONG_PROGRAMS[fault]
    walks = [(30.0, "G" * 10 + "r" * 14), (3.0, "y" * 10 + "r" * 14), (8.0, "r" * 24)]
    file = written(tmp_path, walks)
    text, count = re.subn(pattern, instead, file.read_text())
    assert count
    file.write_text(text)
    with pytest.raises(InputError, match=words) as refused:
        import_signals(workspace, placed(workspace, scenario(None)), file)
    assert "own.tll.xml" in str(refused.value)


def test_a_tllogic_that_shows_a_stage_twice_in_a_cycle_is_refused(
    workspace: Workspace, tmp_path: Path
) -> None:
    first, yellow, red, second, end = NETS
    once = [(20.0, first[:20] + "rrrr"), (3.0, yellow), (5.0, red)]
    once += [(20.0, second), (3.0, end), (5.0, red)]
    with pytest.raises(InputError, match="comes twice in a cycle") as raised:
        import_signals(
            workspace,
            placed(workspace, scenario(None)),
            written(tmp_path, [*once, *once]),
            strict=True,
        )
    assert "J10001" in str(raised.value)


def test_a_tllogic_with_conflicting_greens_is_refused_with_both_movements(
    workspace: Workspace, tmp_path: Path
) -> None:
    walks = [(30.0, "G" * 10 + "r" * 14), (3.0, "y" * 10 + "r" * 14), (8.0, "r" * 24)]
    rest = [(30.0, "r" * 10 + "G" * 14), (12.0, "r" * 10 + "y" * 10 + "rrrr")]
    with pytest.raises(ScenarioError, match="which meet") as raised:
        import_signals(
            workspace,
            placed(workspace, scenario(None)),
            written(tmp_path, [*walks, *rest]),
            strict=True,
        )
    assert "cannot have green together" in str(raised.value)


def test_a_tllogic_with_short_intergreens_is_refused_with_both_times(
    workspace: Workspace, tmp_path: Path
) -> None:
    first, yellow, red, second, end = NETS
    first = first[:20] + "rrrr"
    phases = [(20.0, first), (3.0, yellow), (1.0, red), (20.0, second), (3.0, end), (9.0, red)]
    walking = [(6.0, "r" * 20 + "GGGG"), (12.0, red)]
    with pytest.raises(ScenarioError, match="is too short") as raised:
        import_signals(
            workspace,
            placed(workspace, scenario(None)),
            written(tmp_path, [*phases, *walking]),
            strict=True,
        )
    assert "4 s between group" in str(raised.value)
    assert "needs 8 s" in str(raised.value)


@pytest.mark.slow
def test_a_program_with_short_intergreens_runs_as_it_is_with_what_was_found(
    workspace: Workspace, tmp_path: Path
) -> None:
    first, yellow, red, second, end = NETS
    first = first[:20] + "rrrr"
    phases = [(20.0, first), (3.0, yellow), (1.0, red), (20.0, second), (3.0, end), (9.0, red)]
    phases += [(6.0, "r" * 20 + "GGGG"), (12.0, red)]
    made, notes = import_signals(
        workspace, placed(workspace, scenario(None)), written(tmp_path, phases)
    )
    (note,) = notes
    assert "runs as it is in the file" in note
    assert "4 s between group" in note
    assert not made.signals.junctions
    (light,) = signal_programs(workspace, made)
    (plan,) = light.plans
    assert [(phase.seconds, phase.state) for phase in plan.phases] == phases
    done = run(workspace, made, settings=RunSettings(until=160.0), name="in-force")
    assert done.status.value == "completed"
    log = pl.read_parquet(done.folder / "signal_states.parquet").sort("time")
    shown = dict(zip(log["time"].to_list(), log["state"].to_list(), strict=True))
    cycle = [state for seconds, state in phases for _ in range(int(seconds))]
    for second in range(1, 150):
        since = max(time for time in shown if time <= second)
        assert shown[since] == cycle[second % len(cycle)], second
    again, notes = import_signals(workspace, made, tmp_path / "own.tll.xml")
    assert again == made


def test_a_junction_without_a_light_is_answered_with_those_that_have_one(
    workspace: Workspace, tmp_path: Path
) -> None:
    file = written(tmp_path, [(30.0, "G" * 24)])
    with pytest.raises(NotFoundError, match="10001"):
        import_signals(workspace, placed(workspace, scenario(None)), file, junctions=["9"])


def test_there_is_nothing_to_export_where_all_lights_are_as_in_the_map(
    workspace: Workspace,
) -> None:
    for control in (None, "extended"):
        with pytest.raises(InputError, match="changes no traffic light"):
            export_signals(workspace, placed(workspace, scenario(None, control=control)))


def test_a_scenario_with_a_program_is_read_as_it_was_written(
    workspace: Workspace, tmp_path: Path
) -> None:
    one = placed(workspace, scenario(one_plan()))
    file = write_scenario(one, tmp_path / "one.scenario.json")
    assert read_scenario(file) == one
    assert json.loads(file.read_text())["signals"]["junctions"][0]["junction"] == "10001"


@pytest.mark.slow
@pytest.mark.parametrize("control", ["fixed", "actuated"])
def test_the_program_of_the_guide_runs_on_a_network_by_netconvert_too(
    by_netconvert: Workspace, tmp_path: Path, control: str
) -> None:
    one = placed(by_netconvert, scenario(program(), control=control, clock=EVENING))
    done = run(by_netconvert, one, name="guide", out=tmp_path / "runs")
    counts = done.summary["actors"]
    assert done.status == "completed"
    # Who is due just before the end may still wait for a gap to enter.
    assert counts["planned"] - 2 <= counts["inserted"] <= counts["planned"]
    assert counts["planned"] > 200
    assert counts["arrived"] > 0.8 * counts["planned"]
    assert (counts["teleported"], counts["collided"]) == (0, 0)
    log = (done.folder / "sumo.log").read_text()
    assert "tlLogic" not in log
    assert "detector" not in log
    back = taken(by_netconvert, one, tmp_path)
    (timing,), (own,) = back.signals.junctions, one.signals.junctions
    assert [set(group.movements) for group in timing.groups] == [
        set(group.movements) for group in own.groups
    ]


@pytest.mark.slow
@pytest.mark.parametrize(
    "signals",
    [
        Signals(control="actuated"),
        Signals(bus_priority=True),
        Signals(junctions=(JunctionTiming(junction="10001", green=(20.0, 12.0), offset=5.0),)),
    ],
)
def test_stages_by_netconvert_are_timed_anew_called_and_prolonged(
    by_netconvert: Workspace, tmp_path: Path, signals: Signals
) -> None:
    one = placed(by_netconvert, scenario(None)).model_copy(update={"signals": signals})
    done = run(by_netconvert, one, name="stages", out=tmp_path / "runs")
    assert done.status == "completed", done.summary["error"]
    log = (done.folder / "sumo.log").read_text()
    assert "tlLogic" not in log
    assert "etector" not in log
    (light,) = programs_from_json((done.folder / "signals.json").read_text())
    first, second = stage_spans(light.plans[0])
    if signals.control == "actuated":
        assert [(one.least, one.most) for one in (first, second)] == [(8.0, 70.0)] * 2
        loops = [one for one in light.detectors if not one.call]
        assert {one.stages for one in loops} == {("1",), ("2",)}
    if signals.junctions:
        assert (first.seconds, second.seconds, light.plans[0].offset) == (20.0, 12.0, 5.0)


@pytest.mark.slow
def test_lights_by_netconvert_show_movements_by_segments(by_netconvert: Workspace) -> None:
    """Lanes for bicycles, which our own network does not lead through the junction, included."""
    (light,) = signal_programs(by_netconvert, placed(by_netconvert, scenario(None)))
    assert sorted(name for group in light.groups for name in group.movements) == [
        "r1", "r2", "r3", "r4", "walk r1", "walk r2", "walk r3", "walk r4",
    ]  # fmt: skip


@pytest.mark.slow
def test_conflicting_greens_are_refused_on_a_network_by_netconvert_with_both_movements(
    by_netconvert: Workspace, tmp_path: Path
) -> None:
    first, *others = program()["stages"]
    first = {**first, "permissive": [*first["permissive"], "V2"]}
    design = one_plan(stages=[first, *others])
    with pytest.raises(ScenarioError) as raised:
        run(by_netconvert, placed(by_netconvert, scenario(design)), out=tmp_path)
    message = str(raised.value)
    assert "r1>r3 (group 'V1') and r2>r" in message or "r2>r4 (group 'V2') and r1>r" in message
    assert "which meet; they cannot have green together" in message


@pytest.mark.slow
def test_lights_of_a_town_by_netconvert_have_movements_and_crossings(tmp_path: Path) -> None:
    store = Workspace.open(tmp_path)
    entry = store.add_map(
        MAP.with_name("town_5x5.xodr"), settings=ConversionSettings(converter="netconvert")
    )
    reference = MapReference(name="town_5x5", sha256=entry.info["sha256"])
    lights = signal_programs(store, scenario(None).model_copy(update={"map": reference, "roi": ()}))
    assert len(lights) == 6
    for light in lights:
        names = {name for group in light.groups for name in group.movements}
        assert any(name.startswith("walk r") for name in names)
        assert all(name.removeprefix("walk ").startswith("r") for name in names)


@pytest.mark.slow
def test_the_program_of_the_guide_fits_a_network_that_netconvert_has_read_and_written(
    workspace: Workspace, tmp_path: Path
) -> None:
    store = Workspace.open(tmp_path / "workspace")
    net = store.add_map(MAP).path("net").read_bytes()
    file = tmp_path / "changed.net.xml"
    options = ["--sumo-net-file=ours.net.xml", "--precision=4"]
    limits = NetconvertLimits(20.0, 1 << 30)
    file.write_bytes(run_netconvert(options, files={"ours.net.xml": net}, limits=limits).net_xml)
    bring_in(store, "signal_crossing", file)
    one = placed(store, scenario(program(), clock=EVENING))
    back, ours = (_phases(export_signals(where, one)) for where in (store, workspace))
    assert back == ours != []


def _phases(text: str) -> list[str]:
    return re.findall(r"<phase [^>]*>|<param key=.odscen.group[^>]*>", text)


@pytest.mark.parametrize(
    ("params", "words"),
    [
        ({"coordinated": "true", "cycleTime": "0"}, "cycleTime is '0', not a number above 0"),
        ({"coordinated": "true", "cycleTime": "long"}, "cycleTime is 'long', not a number above 0"),
        ({"coordinated": "true", "cycleTime": "nan"}, "cycleTime is 'nan', not a number above 0"),
    ],
)
def test_parameters_of_a_program_that_are_no_numbers_are_refused(
    workspace: Workspace, tmp_path: Path, params: dict[str, str], words: str
) -> None:
    first, yellow, red, second, end = NETS
    once = [(20.0, first), (3.0, yellow), (5.0, red)]
    file = written(tmp_path, [*once, (20.0, second), (3.0, end), (5.0, red)])
    rows = "".join(f'<param key="{key}" value="{value}"/>' for key, value in params.items())
    file.write_text(file.read_text().replace("</tlLogic>", f"{rows}</tlLogic>"))
    with pytest.raises(InputError, match=words):
        import_signals(workspace, placed(workspace, scenario(None)), file)


@pytest.mark.parametrize("links", ["one 2", "9" * 5000, "-1", "0 0"])
def test_groups_of_our_own_file_that_name_no_links_are_those_of_the_light(
    workspace: Workspace, tmp_path: Path, links: str
) -> None:
    one = placed(workspace, scenario(one_plan()))
    file = tmp_path / "signals.add.xml"
    text = export_signals(workspace, one)
    changed = re.sub(r'(key="odscen\.group\.[^"]*" value=")[^"]*', rf"\g<1>{links}", text, count=1)
    assert changed != text
    file.write_text(changed)
    back, _ = import_signals(workspace, plain(one), file)
    before, after = one.signals.junctions[0], back.signals.junctions[0]
    assert len(after.groups) == len(before.groups)
