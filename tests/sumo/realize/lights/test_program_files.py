"""Timing of traffic lights: the file that SUMO gets, and what its lights then do."""

from __future__ import annotations

import subprocess
from dataclasses import dataclass
from functools import cache
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from lxml import etree

from odscen.base.errors import ScenarioError
from odscen.convert.building.network import build_network
from odscen.convert.lane_table.table import LaneTable
from odscen.convert.lane_table.table_json import table_from_json, table_to_json
from odscen.lanegraph.build_graphs import build_map_graph
from odscen.lanegraph.graphs import Relation
from odscen.lanegraph.query import node_id
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.parse import parse
from odscen.runs.run_settings import RunSettings
from odscen.scenario import edits
from odscen.scenario.document.signals_document import Signals
from odscen.sumo.realize.lights.light_realization import realized_lights
from odscen.sumo.realize.lights.light_views import scenario_lights
from odscen.sumo.realize.lights.program_files import signals_xml
from odscen.sumo.realize.realization import realize
from odscen.sumo.realize.sumo_map import SumoMap
from odscen.sumo.runner.prepare import prepare
from odscen.sumo.runner.run_folder import write_sumo_files
from odscen.sumo.runner.run_jobs import run_prepared
from tests.sumo.conftest import BIN

if TYPE_CHECKING:
    from odscen.scenario.document.scenario_document import Scenario

MAP = Path(__file__).parents[4] / "maps" / "signal_crossing.xodr"
JUNCTION = "10001"


def signals_text(**signals: Any) -> str | None:
    scenario = from_one_side().model_copy(update={"signals": Signals.model_validate(signals)})
    return signals_xml(realized_lights(scenario, crossing().sumo))


def logics(**signals: Any) -> list[etree._Element]:
    text = signals_text(**signals)
    assert text is not None
    return etree.fromstring(text.encode()).findall("tlLogic")


def phases(logic: etree._Element) -> list[tuple[str | None, ...]]:
    names = ("name", "duration", "minDur", "maxDur")
    return [tuple(phase.get(name) for name in names) for phase in logic.iterfind("phase")]


@pytest.mark.slow
def test_lights_are_known_by_their_junctions_and_their_movements_by_segments() -> None:
    (light,) = scenario_lights(crossing().sumo)
    assert light.names == (JUNCTION,)
    assert light.green == (13.0, 13.0)
    assert {one.name for one in light.movements if one.approach == "r1"} == {
        "r1>r2", "r1>r3", "r1>r4", "walk r1",
    }  # fmt: skip
    lanes = {one.exact_name for one in light.movements if one.name == "r1>r3"}
    assert lanes == {"1.1.-1>3.1.1", "1.1.-2>3.1.2"} or len(lanes) == 2


@pytest.mark.parametrize(
    "signals",
    [
        {},
        {"junctions": [{"junction": JUNCTION}]},
        {"control": "extended"},
        {"junctions": [{"junction": JUNCTION, "control": "extended", "green": [13, 13]}]},
        {"control": "actuated", "junctions": [{"junction": JUNCTION, "control": "extended"}]},
    ],
)
def test_what_the_network_does_anyway_is_not_written(signals: dict[str, Any]) -> None:
    assert signals_text(**signals) is None


@pytest.mark.parametrize(
    "signals",
    [
        {"control": "fixed"},
        {"junctions": [{"junction": JUNCTION, "control": "fixed"}]},
        {"junctions": [{"junction": JUNCTION, "green": [13, 13]}]},
    ],
)
def test_fixed_times_are_those_of_the_map(signals: dict[str, Any]) -> None:
    (logic,) = logics(**signals)
    (light,) = crossing().table.lights
    assert logic.get("type") == "static"
    assert phases(logic) == [(p.name, f"{p.duration:g}", None, None) for p in light.phases]


def test_other_greens_change_the_stages_and_nothing_else() -> None:
    (logic,) = logics(junctions=[{"junction": JUNCTION, "green": [33.5, 9], "offset": 12}])
    (light,) = crossing().table.lights
    assert dict(logic.attrib) == {
        "id": light.id, "type": "static", "programID": "scenario", "offset": "12",
    }  # fmt: skip
    greens = {"stage 1": 33.5, "stage 2": 9.0}
    assert phases(logic) == [
        (p.name, f"{greens.get(p.name, p.duration):g}", None, None) for p in light.phases
    ]
    assert [phase.get("state") for phase in logic.iterfind("phase")] == [
        p.state for p in light.phases
    ]
    params = {param.get("key"): param.get("value") for param in logic.iterfind("param")}
    assert params["linkSignalID:0"] == "1"


def test_greens_for_the_stages_of_a_former_network_leave_the_light_as_the_map_has_it() -> None:
    assert signals_text(junctions=[{"junction": JUNCTION, "green": [20, 9, 9, 9, 9, 9, 9]}]) is None


def test_actuated_lights_have_bounds_that_move_with_the_green() -> None:
    (logic,) = logics(control="actuated", junctions=[{"junction": JUNCTION, "green": [20, 6]}])
    assert logic.get("type") == "actuated"
    bounds = {phase for phase in phases(logic) if "stage" in str(phase[0])}
    assert {phase for phase in bounds if phase[1] != "1"} == {
        ("stage 1", "20", "8", "40"), ("stage 1", "20", "5", "40"),  # with crossings, without
        ("stage 2", "6", "6", "12"), ("stage 2", "6", "5", "12"),
    }  # fmt: skip
    # The main stage rests, is prolonged once another is called, or lets people begin to walk.
    assert {phase[2:] for phase in bounds if phase[1] == "1"} == {
        ("1", "3600"), ("1", "40"), (None, None),
    }  # fmt: skip
    assert all(low is None for name, _, low, _ in phases(logic) if "stage" not in str(name))


def test_extended_greens_are_those_of_the_map_at_least_and_share_what_is_left_of_two_minutes() -> (
    None
):
    (light,) = crossing().table.lights
    cycle = sum(phase.duration for phase in light.phases)
    stages = [phase for phase in light.phases if phase.most > phase.least]
    more = round((120.0 - cycle) / len(stages), 1)
    assert more > 10.0
    logic = etree.fromstring(crossing().net_xml).find("tlLogic")
    assert logic.get("type") == "actuated"
    assert {row.get("key"): row.get("value") for row in logic.iterfind("param")}["max-gap"] == "2"
    assert phases(logic) == [
        (p.name, f"{p.duration:g}", f"{p.duration:g}", f"{p.duration + more:g}")
        if p in stages
        else (p.name, f"{p.duration:g}", None, None)
        for p in light.phases
    ]


def test_buses_that_have_priority_prolong_greens_by_themselves() -> None:
    assert signals_text(control="extended", bus_priority=True) == signals_text(bus_priority=True)


@dataclass(frozen=True, eq=False)
class Built:
    sumo: SumoMap
    table: LaneTable
    net_xml: bytes


@cache
def crossing() -> Built:
    odr = parse(MAP.read_bytes(), file=MAP.name)
    roads = RoadTable.of(odr)
    graph = build_map_graph(odr, name="signal_crossing", sha256="0" * 64, table=roads)
    network = build_network(odr, roads, graph.walks)
    return Built(SumoMap.of(graph, network.table), network.table, network.net_xml)


def net_file(folder: Path) -> Path:
    net = folder / "crossing.net.xml"
    net.write_bytes(crossing().net_xml)
    return net


@dataclass(frozen=True)
class Turn:
    """Nodes well before and far behind a link; its place in states."""

    spawn: int
    goal: int
    link: int


@cache
def way_on() -> Turn:
    """A way straight on, whose cars SUMO hears.

    A lane counts for a stage only where one of its links has the green that gives way to nobody.
    """
    sumo = crossing().sumo
    links = list(etree.fromstring(crossing().net_xml).iterfind("connection[@tl]"))
    lanes = [
        sumo.net.edge_lanes[one.get("from", "")][int(one.get("fromLane", ""))] for one in links
    ]
    link, lane = next(
        (link, lane)
        for link, lane in zip(links, lanes, strict=True)
        if link.get("dir") == "s" and lane.allows("passenger")
    )
    target = sumo.net.edge_lanes[link.get("to", "")][int(link.get("toLane", ""))]
    before, behind = (
        int(np.flatnonzero(sumo.lane_places.lane == sumo.lane_places.lanes.index(one.id))[0])
        for one in (lane, target)
    )
    index = int(link.get("linkIndex", ""))
    return Turn(walked(before, back=True, steps=30), walked(behind, back=False, steps=1000), index)


def walked(node: int, *, back: bool, steps: int) -> int:
    """Node so many steps further along the lanes, or the last one."""
    lanes = crossing().sumo.graph.lanes
    follows = lanes.relation == Relation.SUCCESSOR
    ends = (lanes.target, lanes.source) if back else (lanes.source, lanes.target)
    following = dict(zip(*(end[follows].tolist() for end in ends), strict=True))
    for _ in range(steps):
        node = following.get(node, node)
    return node


def from_one_side() -> Scenario:
    """Cars that go straight on from one side, and nobody anywhere else."""
    graph = crossing().sumo.graph
    turn = way_on()
    return edits.add_flow(
        edits.new_scenario(graph, name="lights", roi=graph.segments.ids),
        graph,
        spawn=node_id(graph, turn.spawn),
        goal=node_id(graph, turn.goal),
        per_hour=900,
        end=600.0,
    )


def timed(**fields: Any) -> Scenario:
    lights = scenario_lights(crossing().sumo)
    return edits.set_timing(from_one_side(), lights, JUNCTION, **fields)


def states(folder: Path, one: Scenario, *, until: float) -> list[tuple[str, str]]:
    """Program and state of the light in each second, from plain SUMO on the exported files."""
    prepared = prepare(
        one, crossing().sumo, net_file(folder), settings=RunSettings(until=until, step_length=1.0)
    )
    write_sumo_files(prepared.sumo_files, prepared.net, folder, link=False)
    (light,) = crossing().table.lights
    watch = f'<timedEvent type="SaveTLSStates" source="{light.id}" dest="states.xml"/>'
    (folder / "watch.add.xml").write_text(f"<additional>{watch}</additional>")
    added = [name for name in prepared.sumo_files if name.endswith(".add.xml")]
    files = ",".join([*added, "watch.add.xml"])
    done = subprocess.run(
        [BIN / "sumo", "-c", "scenario.sumocfg", "--additional-files", files],
        cwd=folder, check=True, capture_output=True, text=True,
    )  # fmt: skip
    assert "rror" not in done.stderr
    rows = etree.parse(folder / "states.xml").getroot().iterfind("tlsState")
    return [(row.get("programID", ""), row.get("state", "")) for row in rows]


def lengths(seen: list[tuple[str, str]]) -> list[tuple[str, int]]:
    """States one after the other, with their seconds."""
    return [(state, len(list(same))) for (_, state), same in groupby(seen)]


def test_the_table_keeps_the_lights_that_the_network_has() -> None:
    (light,) = crossing().table.lights
    (logic,) = etree.fromstring(crossing().net_xml).findall("tlLogic")
    assert light.id == logic.get("id")
    assert light.junctions == (JUNCTION,)
    assert [p.state for p in light.phases] == [p.get("state") for p in logic.iterfind("phase")]
    assert len(light.signals) == len(light.phases[0].state)
    assert table_from_json(table_to_json(crossing().table)).lights == crossing().table.lights


def test_the_light_shows_each_stage_as_long_as_the_scenario_says(tmp_path: Path) -> None:
    (light,) = crossing().table.lights
    stages = [phase for phase in light.phases if phase.is_stage]
    greens = (23.0, *(phase.duration for phase in stages[1:]))
    cycle = sum(phase.duration for phase in light.phases) - stages[0].duration + 23.0
    seen = states(tmp_path, timed(green=greens), until=cycle + 30.0)
    assert {program for program, _ in seen} == {"scenario"}
    wanted = [(p.state, 23.0 if p is stages[0] else p.duration) for p in light.phases]
    assert lengths(seen)[: len(wanted)] == wanted
    assert lengths(seen)[len(wanted)] == wanted[0]


def test_an_offset_lets_the_first_stage_begin_later(tmp_path: Path) -> None:
    (light,) = crossing().table.lights
    before, first = lengths(states(tmp_path, timed(offset=1), until=30.0))[:2]
    assert before == (light.phases[-1].state, 1)
    assert first == (light.phases[0].state, light.phases[0].duration)


@pytest.mark.slow
def test_traffic_from_one_side_gets_more_green_where_the_light_is_actuated(tmp_path: Path) -> None:
    green: dict[str, float] = {}
    for control in ("fixed", "actuated"):
        folder = tmp_path / control
        folder.mkdir()
        seen = [state for _, state in states(folder, timed(control=control), until=600.0)]
        assert len(seen) > 500
        green[control] = float(np.mean([state[way_on().link] == "G" for state in seen]))
    assert green["actuated"] > 1.3 * green["fixed"]


@pytest.mark.slow
def test_an_extended_green_lasts_longer_only_while_vehicles_follow_each_other(
    tmp_path: Path,
) -> None:
    (light,) = crossing().table.lights
    planned = {p.state: p.duration for p in light.phases if p.is_stage}
    seen = [state for _, state in states(tmp_path, timed(control="extended"), until=600.0)]
    runs = [(state, len(list(same))) for state, same in groupby(seen)][1:-1]
    own = {state for state in planned if state[way_on().link] == "G"}
    mine = [seconds - planned[state] for state, seconds in runs if state in own]
    others = [seconds - planned[state] for state, seconds in runs if state in {*planned} - own]
    assert min(mine) >= 0.0
    assert max(mine) > 5.0
    assert set(others) == {0.0}  # nobody comes there


@pytest.mark.slow
def test_a_run_has_the_file_only_where_the_scenario_changes_something(tmp_path: Path) -> None:
    plain = prepare(from_one_side(), crossing().sumo, net_file(tmp_path))
    changed = prepare(timed(control="actuated"), crossing().sumo, net_file(tmp_path))
    again = prepare(timed(control="actuated"), crossing().sumo, net_file(tmp_path))
    assert "signals.add.xml" not in plain.sumo_files
    assert "signals" not in plain.sumo_files["scenario.sumocfg"]
    assert changed.sumo_files == again.sumo_files
    config = changed.sumo_files["scenario.sumocfg"]
    assert '<additional-files value="signals.add.xml,' in config
    assert config.replace("signals.add.xml,", "") == plain.sumo_files["scenario.sumocfg"]
    result = run_prepared(changed, tmp_path / "run")
    assert result.status == "completed"
    assert result.summary["files"]["signals"] == "sumo/signals.add.xml"


def test_timing_that_is_not_possible_is_refused_before_anything_is_written() -> None:
    timing = {"junction": "nowhere", "green": [1]}
    wrong = Signals.model_validate({"junctions": [timing]})
    with pytest.raises(ScenarioError, match="there is no traffic light in junction 'nowhere'"):
        realize(from_one_side().model_copy(update={"signals": wrong}), crossing().sumo)
