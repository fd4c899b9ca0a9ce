"""SUMO projects: opened whole, run as ``sumo -c`` runs them, and written as they were."""

from __future__ import annotations

import gzip
import math
import os
import re
import shutil
import subprocess
from collections import Counter
from pathlib import Path
from typing import NamedTuple

import polars as pl
import pytest
import sumo
from lxml import etree

from odscen.app.exchange.exports import export
from odscen.app.exchange.imports import ImportedFile, import_file
from odscen.app.exchange.sent_files import SentFile, read_sent_scenario
from odscen.app.maps import load_map
from odscen.app.running.runs import run
from odscen.base.errors import InputError, OdscenError
from odscen.base.xml_reading import read_xml
from odscen.convert.model.net import NORMAL
from odscen.maps.store import Workspace
from odscen.runs.finished_run import Run
from odscen.runs.recorded import read_lanes, read_light_states, read_visits
from odscen.scenario import edits
from odscen.scenario.document.json_form import dumps, loads
from odscen.scenario.document.measures_document import RoadClosure
from odscen.scenario.document.scenario_document import Scenario
from odscen.scenario.document.sumo_document import SumoFile
from odscen.sumo.realize.project_files import _neutralise_paths, allowed_options

BIN = Path(sumo.SUMO_HOME) / "bin"
PROJECTS = Path(
    os.environ.get("ODSCEN_TEST_PROJECTS", Path(__file__).parents[3] / "shared" / "projects")
)
CONFIG = """<sumoConfiguration><input><net-file value="grid.net.xml"/>
<route-files value="sub/cars.rou.xml,people.rou.xml"/><additional value="things.add.xml"/></input>
<output><summary-output value="/tmp/summary.xml"/></output>
<time><begin value="100"/><end value="1200"/></time>
<processing><time-to-teleport value="150"/><max-depart-delay value="600"/></processing>
<gui_only><gui-settings-file value="missing.xml"/></gui_only></sumoConfiguration>"""
CARS = """<routes><vType id="slow" maxSpeed="8" length="7.5" vClass="truck"/>
<vType id="b" sigma="0.2"/><vTypeDistribution id="mix" vTypes="a b" probabilities="0.5 0.5"/>
<route id="r" edges="A0B0 B0C0"/>
<vehicle id="v1" type="slow" route="r" depart="100"/>
<vehicle id="v2" type="mix" depart="0:01:50"><route edges="A1B1 B1C1"/>
 <stop busStop="bs" duration="10"/></vehicle>
<trip id="t1" type="mix" depart="112" from="A0A1" to="C1C2"/>
<flow id="f" type="mix" begin="120" end="1020" period="9" from="A2B2" to="C0C1"/>
<flow id="g" begin="120" end="1020" probability="0.05" from="C2B2" to="A1A0"/>
</routes>"""
PEOPLE = """<routes><person id="p1" depart="105"><walk edges="A0B0 B0C0"/></person>
<person id="p2" depart="106">
<walk from="A1B1" busStop="bs"/><ride busStop="bs2" lines="L"/></person>
<vehicle id="bus" line="L" depart="130"><route edges="A1B1 B1C1"/>
<stop busStop="bs" duration="20"/><stop busStop="bs2" duration="20"/></vehicle>
<vType id="w" vClass="pedestrian"/></routes>"""
THINGS = """<additional><vType id="a"/>
<busStop id="bs" lane="A1B1_1" startPos="50" endPos="70"/>
<busStop id="bs2" lane="B1C1_1" startPos="50" endPos="70"/>
<parkingArea id="pa" lane="B0C0_1" startPos="20" endPos="60" roadsideCapacity="3"/>
<inductionLoop id="loop 1" lane="A2B2_1" pos="-20" period="300" file="../../loops.xml"/>
<laneAreaDetector id="e2" lane="A2B2_1" pos="10" endPos="50" period="300" file="e2.xml"/>
<taz id="west" edges="A0B0 A1B1"/>
<variableSpeedSign id="vss" lanes="A2B2_1"><step time="0" speed="9"/></variableSpeedSign>
<rerouter id="re" edges="A0A1"><interval begin="0" end="1e5"><closingReroute id="B2C2"/></interval>
</rerouter>
<calibrator id="cal" edge="B2B1" pos="0" output="cal.xml"><flow begin="100" end="900" route="cr"
 vehsPerHour="400" speed="12" type="a"/></calibrator>
<route id="cr" edges="B2B1 B1B0"/>
<tlLogic id="B1" type="static" programID="day" offset="7">PHASES</tlLogic>
<tlLogic id="B1" type="static" programID="night" offset="0">PHASES</tlLogic>
<tlLogic id="nowhere" type="static" programID="x" offset="0">
<phase duration="5" state="G"/></tlLogic>
<WAUT id="w" refTime="0" startProg="day"><wautSwitch time="700" to="night"/></WAUT>
<wautJunction wautID="w" junctionID="B1"/>
</additional>"""


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A grid with lights and sidewalks, far from the origin."""
    folder = tmp_path_factory.mktemp("project")
    (folder / "sub").mkdir()
    command = [
        BIN / "netgenerate", "--grid", "--grid.number", "3", "--grid.length", "150", "-L", "1",
        "--sidewalks.guess", "--crossings.guess", "--default-junction-type", "traffic_light",
        "--offset.x", "5000", "--offset.y", "-300", "-o", "grid.net.xml",
    ]  # fmt: skip
    subprocess.run(command, cwd=folder, check=True, capture_output=True)
    net = etree.parse(folder / "grid.net.xml")
    logic = next(x for x in net.iter("tlLogic") if x.get("id") == "B1")
    phases = "".join(etree.tostring(p, encoding="unicode") for p in logic.iter("phase"))
    (folder / "run.sumocfg").write_text(CONFIG)
    (folder / "sub" / "cars.rou.xml").write_text(CARS)
    (folder / "people.rou.xml").write_text(PEOPLE)
    (folder / "things.add.xml").write_text(THINGS.replace("PHASES", phases))
    return folder


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    return Workspace.open(tmp_path_factory.mktemp("store"))


@pytest.fixture(scope="module")
def imported(store: Workspace, project: Path) -> ImportedFile:
    return import_file(store, project / "run.sumocfg")


@pytest.fixture(scope="module")
def scenario(imported: ImportedFile) -> Scenario:
    assert imported.scenario is not None
    return imported.scenario


@pytest.mark.slow
def test_a_project_opens_with_a_map_that_has_its_network(
    store: Workspace, project: Path, scenario: Scenario
) -> None:
    entry = store.map("grid")
    assert scenario.map.sha256 == entry.sha256
    assert scenario.name == "grid"  # the file is only called run
    edges = {edge for edge in entry.lane_table().edges if not edge.startswith(":")}
    net = etree.parse(project / "grid.net.xml").getroot()
    assert edges == {e.get("id") for e in net.iter("edge") if e.get("function") is None}
    assert entry.lane_table().intervals


@pytest.mark.parametrize("cells", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_a_grid_is_put_where_it_is_although_its_offset_puts_it_on_itself(
    tmp_path: Path, cells: int
) -> None:
    command = [
        BIN / "netgenerate", "--grid", "--grid.number", "4", "--grid.length", "150",
        "--offset.x", str(-150 * cells), "-o", "grid.net.xml",
    ]  # fmt: skip
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
    store = Workspace.open(tmp_path / "store")
    made = import_file(store, tmp_path / "grid.net.xml")
    assert made.scenario is not None
    lanes = store.map("grid").lane_table()
    assert lanes.net_offset == (0.0, 0.0)
    roads = {
        row for row, lane in enumerate(lanes.lane_list)
        if lanes.edges[lane.edge].function == NORMAL
    }  # fmt: skip
    assert len(roads) == 48
    assert roads <= {interval.sumo for interval in lanes.intervals}


def test_what_is_taken_and_what_runs_on_is_listed(imported: ImportedFile) -> None:
    taken = {row.xpath: row.reason for row in imported.lists["taken"]}
    assert "runs on as SUMO's own file" in taken["things.add.xml: 1 x calibrator"]
    assert taken["inductionLoop loop 1"] == "detector loop-1 of the study"
    assert taken["taz west"] == "zone west"
    assert taken["tlLogic B1, program day"].endswith("the program in force of the map's network")
    assert taken["option max-depart-delay"] == "600, handed on to SUMO"
    ignored = {row.xpath: row.reason for row in imported.lists["ignored"]}
    assert imported.problems == ()
    assert set(ignored) == {
        "tlLogic nowhere", "option summary-output", "option gui-settings-file",
    }  # fmt: skip


def test_the_document_has_times_seed_and_parts(scenario: Scenario) -> None:
    assert (scenario.simulation.duration, scenario.simulation.step_length) == (1200.0, 1.0)
    assert scenario.simulation.teleport_after == 150.0
    assert scenario.study.warm_up == 100.0
    assert scenario.seed == 23423
    assert scenario.sumo is not None
    assert scenario.sumo.begin == 100.0
    assert [file.name for file in scenario.sumo.files] == [
        "things.add.xml", "cars.rou.xml", "people.rou.xml",
    ]  # fmt: skip
    assert loads(dumps(scenario)) == scenario


class Original(NamedTuple):
    """What ``sumo -c`` alone does.

    Attributes
    ----------
    trips
        Departure and duration, s, of those who have arrived.
    flows
        Vehicles by edge and hour.
    lights
        States of each light by second; each from one change to the next.
    """

    trips: dict[str, tuple[float, float]]
    flows: dict[tuple[str, int], float]
    lights: dict[str, list[tuple[float, str]]]


def run_of_sumo(folder: Path, config: str, *additional: str, net: str) -> Original:
    """Run a project by SUMO alone, with flows and lights written."""
    lights = {logic.get("id") for logic in etree.parse(folder / net).iter("tlLogic")}
    events = "".join(
        f'<timedEvent type="SaveTLSStates" source="{light}" dest="tls.xml"/>'
        for light in sorted(map(str, lights))
    )
    (folder / "measured.add.xml").write_text(
        f'<additional><edgeData id="e" period="3600" file="edges.xml"/>{events}</additional>'
    )
    subprocess.run(
        [
            BIN / "sumo", "-c", config, "-a", ",".join((*additional, "measured.add.xml")),
            "--tripinfo-output", "trips.xml", "--precision", "4", "--stop-output", "stops.xml",
        ],
        cwd=folder, check=True, capture_output=True,
    )  # fmt: skip
    trips = {
        str(t.get("id")): (float(t.get("depart", "")), float(t.get("duration", "")))
        for t in etree.parse(folder / "trips.xml").iter("tripinfo")
        if float(t.get("arrival", "-1")) >= 0
    }
    flows = Counter[tuple[str, int]]()
    for edge in etree.parse(folder / "edges.xml").iter("edge"):
        interval = edge.getparent()
        assert interval is not None
        hour = int(float(interval.get("begin", "")) // 3600)
        number = int(edge.get("entered", "0")) + int(edge.get("departed", "0"))
        flows[str(edge.get("id")), hour] += number
    shown: dict[str, list[tuple[float, str]]] = {}
    for row in etree.parse(folder / "tls.xml").iter("tlsState") if lights else ():
        own = shown.setdefault(str(row.get("id")), [])
        if not own or own[-1][1] != row.get("state"):
            own.append((float(row.get("time", "")), str(row.get("state"))))
    return Original(trips, {key: n for key, n in flows.items() if n}, shown)


def assert_agrees(done: Run, original: Original) -> None:
    """Flows by edge and hour, mean travel time, and lights by second."""
    lanes = read_lanes(done.folder)
    assert lanes is not None
    hours = lanes.group_by("edge", hour=(pl.col("begin") // 3600).cast(pl.Int64)).agg(
        (pl.col("entered") + pl.col("departed")).sum().alias("vehicles")
    )
    mine = {(edge, hour): n for edge, hour, n in hours.rows() if n and not edge.startswith(":")}
    geh = [
        math.sqrt(2 * (mine.get(key, 0) - n) ** 2 / (mine.get(key, 0) + n))
        for key, n in original.flows.items()
    ]
    assert sum(value < 5 for value in geh) >= 0.95 * len(geh)
    assert not mine.keys() - original.flows.keys()
    arrived = done.events().filter(
        pl.col("kind") == "arrived", pl.col("actor").is_in(list(original.trips))
    )
    assert len(arrived) == pytest.approx(len(original.trips), rel=0.01)
    mean = sum(seconds for _, seconds in original.trips.values()) / len(original.trips)
    assert arrived["travel_time"].mean() == pytest.approx(mean, rel=0.05)
    states = read_light_states(done.folder)
    assert states is not None
    end = states["time"].max()  # odscen ends a run when nobody is left, SUMO goes on
    for light, rows in original.lights.items():
        own = states.filter(pl.col("light") == light).select("time", "state").rows()
        changes = [row for n, row in enumerate(own) if not n or own[n - 1][1] != row[1]]
        assert changes[1:] == [row for row in rows[1:] if row[0] <= end], light
        assert len(changes) > 5


@pytest.fixture(scope="module")
def original(project: Path) -> Original:
    text = CONFIG.replace("missing.xml", "").replace("/tmp/summary.xml", "summary.xml")
    text = text.replace('<gui_only><gui-settings-file value=""/></gui_only>', "")
    (project / "plain.sumocfg").write_text(text)
    things = (project / "things.add.xml").read_text().replace("../../", "")
    start, _, rest = things.partition('<tlLogic id="nowhere"')
    (project / "plain.add.xml").write_text(start + rest.partition("</tlLogic>")[2])
    return run_of_sumo(project, "plain.sumocfg", "plain.add.xml", net="grid.net.xml")


@pytest.fixture(scope="module")
def finished(store: Workspace, scenario: Scenario) -> Run:
    return run(store, scenario)


@pytest.mark.slow
def test_the_run_is_that_of_sumo_alone(finished: Run, original: Original) -> None:
    assert_agrees(finished, original)
    rows = {row["id"]: row for row in finished.actors().to_dicts()}
    assert (rows["v1"]["category"], rows["v1"]["status"]) == ("truck", "arrived")
    assert Counter(row["flow"] for row in rows.values())["f"] == 100
    assert {"p1", "p2", "bus", "t1"} <= rows.keys()


@pytest.mark.slow
@pytest.mark.skipif(not PROJECTS.is_dir(), reason="projects of others are not here")
def test_bologna_runs_as_sumo_runs_it_with_its_seven_programs(
    store: Workspace, tmp_path: Path
) -> None:
    shutil.copytree(PROJECTS / "acosta", tmp_path / "acosta")
    config = tmp_path / "acosta" / "run.sumocfg"
    files = etree.parse(config).find("input/additional-files").get("value").split(",")
    settings = tmp_path / "acosta" / "settings.gui.xml"
    settings.write_text("<viewsettings/>")  # which the configuration names, and nobody has
    alone = run_of_sumo(tmp_path / "acosta", config.name, *files, net="acosta_buslanes.net.xml")
    assert len(alone.lights) == 7
    made = import_file(store, config)
    assert made.scenario is not None
    done = run(store, made.scenario, name="bologna")
    assert_agrees(done, alone)
    assert not done.events().filter(pl.col("kind") == "route_changed").height


@pytest.mark.slow
def test_whom_sumo_ignores_in_a_route_file_is_named_and_not_planned(
    store: Workspace, project: Path
) -> None:
    (project / "late.rou.xml").write_text(
        '<routes><route id="late" edges="A0B0 B0C0"/>'
        '<vehicle id="a" route="late" depart="110"/><flow id="f" route="late" begin="100" end="130"'
        ' period="10"/><vehicle id="b" route="late" depart="105"/>'
        '<vehicle id="c" route="late" depart="110"/></routes>'
    )
    (project / "late.sumocfg").write_text(
        '<configuration><input><net-file value="grid.net.xml"/><route-files value="late.rou.xml"/>'
        '</input><time><begin value="100"/><end value="300"/></time></configuration>'
    )
    made = import_file(store, project / "late.sumocfg")
    assert made.scenario is not None
    done = run(store, made.scenario, name="late")
    assert sorted(done.actors()["id"]) == ["a", "c"]
    assert set(done.actors()["status"]) == {"arrived"}
    assert [note for note in done.summary["notes"] if "late.rou" in note] == [
        "late.rou.xml: SUMO ignores 2 that depart before those above them, flow 'f' the first; "
        "sort the file by departure, for example with sort_routes.py"
    ]


@pytest.mark.slow
def test_whom_a_calibrator_removes_as_they_depart_ends_no_run(
    store: Workspace, project: Path
) -> None:
    (project / "few.rou.xml").write_text(
        '<routes><route id="few" edges="A0B0 B0C0"/>'
        '<flow id="f" route="few" begin="0" end="200" period="5"/></routes>'
    )
    (project / "few.add.xml").write_text(
        '<additional><route id="own" edges="A0B0 B0C0"/><calibrator id="c" lane="A0B0_1" pos="5" '
        'period="30" output="c.xml"><flow begin="0" end="200" route="own" vehsPerHour="100" '
        'speed="10"/></calibrator></additional>'
    )
    (project / "few.sumocfg").write_text(
        '<configuration><net-file value="grid.net.xml"/><route-files value="few.rou.xml"/>'
        '<additional-files value="few.add.xml"/><end value="300"/></configuration>'
    )
    alone = run_of_sumo(project, "few.sumocfg", "few.add.xml", net="grid.net.xml")
    made = import_file(store, project / "few.sumocfg")
    assert made.scenario is not None
    done = run(store, made.scenario, name="few")
    arrived = done.events().filter(pl.col("kind") == "arrived")
    assert 0.0 in {duration for _, duration in alone.trips.values()}  # who was removed at once
    assert len(arrived) == len(alone.trips)


@pytest.mark.slow
def test_who_departs_before_the_simulation_begins_is_left_out_as_in_sumo(
    store: Workspace, project: Path
) -> None:
    (project / "early.rou.xml").write_text(
        '<routes><route id="early" edges="A0B0 B0C0"/><vehicle id="a" route="early" depart="40"/>'
        '<person id="p" depart="60"><walk edges="A0B0 B0C0"/></person>'
        '<flow id="f" route="early" begin="70" end="130" period="10"/>'
        '<vehicle id="b" route="early" depart="110"/></routes>'
    )
    (project / "early.sumocfg").write_text(
        '<configuration><input><net-file value="grid.net.xml"/><route-files value="early.rou.xml"/>'
        '</input><time><begin value="100"/><end value="400"/></time></configuration>'
    )
    alone = run_of_sumo(project, "early.sumocfg", net="grid.net.xml")
    assert sorted(alone.trips) == ["b", "f.0", "f.1", "f.2"]
    made = import_file(store, project / "early.sumocfg")
    assert made.scenario is not None
    done = run(store, made.scenario, name="early")
    assert sorted(done.actors()["id"]) == sorted(alone.trips)
    assert set(done.actors()["status"]) == {"arrived"}
    (note,) = (note for note in done.summary["notes"] if "before it begins" in note)
    assert note == "SUMO leaves out 2 that depart before it begins at 100 s, 'a' the first"


def test_rails_alone_are_refused_in_words(store: Workspace, tmp_path: Path) -> None:
    (tmp_path / "rails.nod.xml").write_text(
        '<nodes><node id="a" x="0" y="0"/><node id="b" x="800" y="0"/>'
        '<node id="c" x="1600" y="40"/></nodes>'
    )
    (tmp_path / "rails.edg.xml").write_text(
        '<edges><edge id="ab" from="a" to="b" allow="rail" speed="30"/>'
        '<edge id="bc" from="b" to="c" allow="rail" speed="30"/></edges>'
    )
    subprocess.run(
        [BIN / "netconvert", "-n", "rails.nod.xml", "-e", "rails.edg.xml", "-o", "rails.net.xml"],
        cwd=tmp_path, check=True, capture_output=True,
    )  # fmt: skip
    with pytest.raises(InputError, match="the network has no road: odscen has rails and"):
        import_file(store, tmp_path / "rails.net.xml")


def test_nothing_is_written_outside_the_run(finished: Run) -> None:
    for name in ("loops.xml", "e2.xml", "cal.xml"):
        assert (finished.folder / name).is_file(), name
    assert not Path("/tmp/summary.xml").exists()


def test_exported_files_are_those_that_came(
    store: Workspace, scenario: Scenario, tmp_path: Path
) -> None:
    export(store, scenario, tmp_path, to="sumo")
    assert (tmp_path / "cars.rou.xml").read_text() == CARS
    assert (tmp_path / "people.rou.xml").read_text() == PEOPLE
    done = subprocess.run(
        [BIN / "sumo", "-c", "scenario.sumocfg"],
        check=False,
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
def test_a_closure_of_the_scenario_leads_vehicles_of_the_project_around(
    store: Workspace, scenario: Scenario
) -> None:
    sumo_map = load_map(store.map("grid")).sumo
    graph = sumo_map.graph
    node = sumo_map.edge_ends["B0C0"][1]
    closed = str(graph.segments.ids[int(graph.lanes.segment[node])])
    measure = RoadClosure(id="closed", kind="closure", places=(closed,), begin=0.0, end=1200.0)
    done = run(store, edits.set_measure(scenario, graph, measure=measure))
    rows = {row["id"]: row for row in done.actors().to_dicts()}
    assert rows["v1"]["status"] == "stranded"  # its goal is behind the closure
    assert rows["v2"]["status"] == "arrived"


def test_the_network_alone_is_a_map_and_an_empty_scenario(store: Workspace, project: Path) -> None:
    made = import_file(store, project / "grid.net.xml")
    assert made.scenario is not None
    assert made.scenario.sumo is None


def test_of_a_network_in_pieces_the_largest_is_the_region(tmp_path: Path) -> None:
    (tmp_path / "n.nod.xml").write_text(
        '<nodes><node id="a" x="0" y="0"/><node id="b" x="300" y="0"/><node id="c" x="0" y="90"/>'
        '<node id="d" x="40" y="90"/></nodes>'
    )
    (tmp_path / "n.edg.xml").write_text(
        '<edges><edge id="long" from="a" to="b"/><edge id="short" from="c" to="d"/></edges>'
    )
    command = [BIN / "netconvert", "-n", "n.nod.xml", "-e", "n.edg.xml", "-o", "n.net.xml"]
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
    made = import_file(Workspace.open(tmp_path / "store"), tmp_path / "n.net.xml")
    assert made.scenario is not None
    assert [problem.code for problem in made.problems] == ["no_actors"]
    assert len(made.scenario.roi) == 3
    assert "1 of 4 segments are not connected" in made.lists["approximated"][0].reason


@pytest.mark.slow
def test_files_that_are_sent_together_are_a_project(project: Path, tmp_path: Path) -> None:
    store = Workspace.open(tmp_path)
    names = ["run.sumocfg", "grid.net.xml", "sub/cars.rou.xml", "people.rou.xml", "things.add.xml"]
    sent = [SentFile(Path(name).name, (project / name).read_bytes()) for name in names]
    read = read_sent_scenario(store, sent, of="sumo", progress=lambda *_: None)
    assert read.added
    assert read.scenario.map.name == "grid"
    assert read.scenario.sumo is not None
    assert len(read.scenario.sumo.files) == 3
    again = read_sent_scenario(store, sent, of="sumo", progress=lambda *_: None)
    assert not again.added
    assert again.scenario == read.scenario
    with pytest.raises(InputError, match=r"needs the file 'people\.rou\.xml'"):
        read_sent_scenario(
            store,
            [file for file in sent if file.name != "people.rou.xml"],
            of="sumo",
            progress=lambda *_: None,
        )


def test_options_that_change_what_happens_are_handed_on_or_said_not_to_be(
    store: Workspace, project: Path
) -> None:
    (project / "options.sumocfg").write_text(
        "<configuration><net-file>grid.net.xml</net-file><end>900</end><processing>"
        '<default.departspeed value="max"/><device.toc.manualType value="car"/>'
        '<device.stationfinder.rescueAction value="tow"/><no-internal-links value="true"/>'
        '<collision.check-junctions.mingap value="0.5"/>'
        '<tls.delay_based.detector-range value="80"/>'
        '</processing><mesosim value="true"/><meso-tauff value="1.2"/><load-state value="s.xml"/>'
        '<remote-port value="8813"/><device.ssm.probability value="1"/>'
        '<weight-files value="w.xml"/>'
        '<device.toc.file value="toc.xml"/></configuration>'
    )
    made = import_file(store, project / "options.sumocfg")
    assert made.scenario is not None
    assert made.scenario.simulation.duration == 900.0
    assert made.scenario.sumo is not None
    assert made.scenario.sumo.options == {
        "default.departspeed": "max", "device.toc.manualType": "car",
        "device.stationfinder.rescueAction": "tow", "no-internal-links": "true",
        "collision.check-junctions.mingap": "0.5", "tls.delay_based.detector-range": "80",
    }  # fmt: skip
    said = {row.xpath: row.reason for row in made.lists["approximated"]}
    assert "microscopic model" in said["option mesosim"]
    assert "begins with an empty road" in said["option load-state"]
    assert "by TraCI does not happen" in said["option remote-port"]
    assert "travel times of files are not read" in said["option weight-files"]
    assert {row.xpath for row in made.lists["ignored"]} == {
        "option meso-tauff", "option device.ssm.probability", "option device.toc.file",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("files", "words"),
    [
        (
            {"x.sumocfg": "<configuration><n value='n'/><end value='noon'/></configuration>"},
            r"end: 'noon' is no time",
        ),
        (
            {"x.sumocfg": "<configuration><net-file value='n'/><seed value='x'/></configuration>"},
            r"seed: 'x' is no whole number",
        ),
        ({"x.sumocfg": "<routes/>"}, "open the .sumocfg that names this file"),
        ({"x.sumocfg": "<duarouterConfiguration/>"}, "another program of SUMO"),
        ({"x.sumocfg": "<configuration><input/></configuration>"}, "names no net-file"),
        (
            {"x.sumocfg": "<configuration><net-file value='n.net.xml'/></configuration>"},
            "n.net.xml",
        ),
        ({"x.sumocfg": "<configuration"}, "not well-formed"),
        (
            {
                "x.sumocfg": "<configuration><net-file value='n.net.xml'/><route-files "
                "value='r.xml'/></configuration>",
                "r.xml": "<routes><vehicle></routes>",
            },
            r"r\.xml.*not well-formed",
        ),
        (
            {
                "x.sumocfg": "<configuration><net-file value='n.net.xml'/></configuration>",
                "n.net.xml": "<nodes/>",
            },
            "netconvert|SUMO network",
        ),
        (
            {
                "x.sumocfg": "<configuration><net-file value='n.net.xml'/><a value='a.xml'/>"
                "</configuration>",
                "a.xml": "<additional><include href='a.xml'/></additional>",
            },
            "include each other without an end",
        ),
    ],
)
def test_wrong_projects_are_refused_with_file_and_reason(
    store: Workspace, tmp_path: Path, files: dict[str, str], words: str
) -> None:
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    with pytest.raises(OdscenError, match=words):
        import_file(store, tmp_path / "x.sumocfg")


NETWORK_FAULTS: dict[str, tuple[str, str, str]] = {
    "no place": (r"<location[^>]*/>", "", "<location> is missing"),
    "shape of words": (r' shape="[^"]*"', ' shape="a,b c,d"', "'shape' .* Invalid Number Format"),
    "shape that is no number": (r' shape="[^"]*"', ' shape="nan,nan 1,1"', "no usable shape"),
    "no shape": (r'(<lane [^>]*) shape="[^"]*"', r"\1", "'shape' is missing"),
    "length of words": (r'length="[^"]*"', 'length="long"', "'long'"),
    "speed of words": (r'speed="[^"]*"', 'speed="fast"', "'speed' .* fast"),
    "speed below 0": (
        r'speed="[^"]*"',
        'speed="-3"',
        "no usable length, speed or width|netconvert crashed",
    ),
    "no lanes": (r"<lane [^>]*/>", "", "Invalid lane index"),
    "lane number of words": (r'index="0"', 'index="x"', "'x'"),
    "no junctions": (r"(?s)<junction .*?</junction>", "", "from-node .* is not known"),
    "offset of words": (
        r'netOffset="[^"]*"',
        'netOffset="a"',
        "'netOffset' .* not a valid position",
    ),
    "edge that is not there": (
        "</net>",
        '<connection from="A0B0" to="nope" fromLane="0" toLane="0" dir="s" state="M"/></net>',
        "Unknown edge 'nope'",
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("fault", NETWORK_FAULTS)
def test_twelve_wrong_networks_are_refused_with_file_and_reason(
    project: Path, tmp_path: Path, fault: str
) -> None:
    pattern, instead, words = NETWORK_FAULTS[fault]
    text, count = re.subn(pattern, instead, (project / "grid.net.xml").read_text())
    assert count
    (tmp_path / "wrong.net.xml").write_text(text)
    (tmp_path / "x.sumocfg").write_text(
        "<configuration><net-file value='wrong.net.xml'/></configuration>"
    )
    store = Workspace.open(tmp_path / "store")
    with pytest.raises(OdscenError, match=f"wrong.net.xml.*({words})"):
        import_file(store, tmp_path / "x.sumocfg")
    assert store.map_names() == []


def test_a_document_cannot_make_sumo_write_elsewhere() -> None:
    text = '<additional><edgeData id="x" file="/etc/passwd"/><a output="host:99"/></additional>'
    harmless = read_xml(_neutralise_paths(read_xml(text), text))
    assert [e.get("file", e.get("output")) for e in harmless] == ["passwd", "host_99"]
    assert allowed_options({"fcd-output": "x", "device.emissions.probability": "1"}) == {
        "device.emissions.probability": "1"
    }
    with pytest.raises(InputError, match="cannot be unpacked"):
        _ = SumoFile(name="a.xml", kind="routes", packed="aGVsbG8=").text


TYPES = """<additional><vType id="car"/><vType id="van" vClass="delivery" length="6"/>
<vTypeDistribution id="mix"><vType id="x" maxSpeed="12" probability="0.3"/>
<vType id="y" lcStrategic="2" probability="0.7"/></vTypeDistribution></additional>"""
PLACES = """<additional><include href="inc/types.xml"/><route id="r1" edges="A0B0 B0C0"/>
<route id="r2" edges="A0B0 B0B1"/><routeDistribution id="rd" routes="r1 r2" probabilities="4 6"/>
<taz id="w" edges="A0A1 A1A2"/><taz id="e"><tazSource id="B2C2" weight="1"/>
<tazSink id="B2C2" weight="1"/></taz><busStop id="s1" lane="A1B1_1" startPos="40" endPos="60"/>
<busStop id="s2" lane="B1C1_1" startPos="40" endPos="60"/>
<parkingArea id="pa" lane="A2B2_1" startPos="20" endPos="80" roadsideCapacity="4"/></additional>"""
ACTS = """<additional><rerouter id="rr" edges="A0B0"><interval begin="200" end="500">
<destProbReroute id="C0C1" probability="1"/></interval></rerouter>
<calibrator id="c" edge="C2C1" pos="0"><route id="cr" edges="C2C1 C1C0"/>
<flow begin="0" end="600" route="cr" vehsPerHour="300" speed="10" type="car"/></calibrator>
<variableSpeedSign id="v" lanes="B1C1_1"><step time="100" speed="7"/></variableSpeedSign>
<entryExitDetector id="e3" period="100" file="e3.xml"><detEntry lane="A1B1_1" pos="10"/>
<detExit lane="B1C1_1" pos="20"/></entryExitDetector><routeProbe id="p" edge="A0B0" period="100"
 file="probe.xml"/><poi id="p" x="0" y="0"/></additional>"""
DRAWN = """<routes><trip id="t0" type="mix" depart="0" fromTaz="w" toTaz="e"/>
<flow id="ft" type="mix" begin="0" end="600" number="60" fromTaz="w" toTaz="e"/>
<flow id="fd" type="car" begin="0" end="600" period="exp(0.1)" from="A2B2" to="C2C1"/>
<vehicle id="vd" type="van" route="rd" depart="20"/>
<flow id="fr" route="rd" begin="30" end="500" vehsPerHour="200" type="car" departLane="best"/>
<trip id="pk" type="car" depart="30" from="A2B2" to="C2C1">
<stop parkingArea="pa" duration="60"/></trip></routes>"""
RIDERS = """<routes><vType id="bus" vClass="bus"/>
<personFlow id="pf" begin="0" end="300" period="10">
<walk from="A0A1" busStop="s1"/><ride busStop="s2" lines="L1"/><walk to="C1C2"/></personFlow>
<person id="pt" depart="5"><personTrip from="A0A1" to="C1C2" modes="public"/></person>
<person id="drv" depart="10"><walk edges="B0B1" arrivalPos="40"/><ride from="B0B1" to="B1B2"
 lines="own"/></person><vehicle id="own" type="car" depart="triggered"><route edges="B0B1 B1B2"/>
</vehicle><flow id="bus" line="L1" type="bus" begin="40" end="700" period="120">
<route edges="A1B1 B1C1 C1C2"/><stop busStop="s1" duration="15" until="100"/>
<stop busStop="s2" duration="15" until="160"/></flow></routes>"""
ODD = """<sumoConfiguration><input><net-file value="../grid.net.xml.gz"/>
<route-files value="drawn.rou.xml.gz, riders.rou.xml"/>
<additional-files value="places.add.xml, acts.add.xml"/></input>
<time><end value="0:15:00"/><step-length value="0.5"/></time><processing>
<lateral-resolution value="0.8"/><scale value="1.3"/><ignore-route-errors value="true"/>
</processing><random_number><seed value="7"/></random_number></sumoConfiguration>"""


@pytest.fixture(scope="module")
def odd_project(project: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Packed files, an included one, a network above, and what is drawn or rides."""
    above = tmp_path_factory.mktemp("above")
    folder = above / "odd"
    (folder / "inc").mkdir(parents=True)
    shutil.copy(project / "grid.net.xml", above)
    net = (above / "grid.net.xml").read_bytes()
    # As SUMO's tools write it: each part of a packed file is a member of its own.
    parts = (net[start : start + 65_536] for start in range(0, len(net), 65_536))
    (above / "grid.net.xml.gz").write_bytes(b"".join(map(gzip.compress, parts)))
    (folder / "drawn.rou.xml.gz").write_bytes(gzip.compress(DRAWN.encode()))
    for name, text in {
        "inc/types.xml": TYPES, "places.add.xml": PLACES, "acts.add.xml": ACTS,
        "riders.rou.xml": RIDERS, "odd.sumocfg": ODD,
    }.items():  # fmt: skip
        (folder / name).write_text(text)
    return folder


@pytest.fixture(scope="module")
def odd_run(store: Workspace, odd_project: Path) -> Run:
    made = import_file(store, odd_project / "odd.sumocfg")
    assert made.scenario is not None
    assert made.problems == ()
    return run(store, made.scenario)


@pytest.fixture(scope="module")
def odd_alone(odd_project: Path) -> Original:
    command = ["places.add.xml", "acts.add.xml"]
    return run_of_sumo(odd_project, "odd.sumocfg", *command, net="../grid.net.xml")


@pytest.mark.slow
def test_packed_included_and_drawn_traffic_runs_as_in_sumo(
    odd_run: Run, odd_alone: Original
) -> None:
    assert_agrees(odd_run, odd_alone)
    assert len(odd_alone.trips) > 150


@pytest.mark.slow
def test_no_passenger_is_lost_and_stops_loads_and_delays_are_those_of_sumo(
    odd_run: Run, odd_alone: Original, odd_project: Path
) -> None:
    assert odd_alone.trips
    persons = {
        str(e.get("id")): float(e.get("duration", ""))
        for e in etree.parse(odd_project / "trips.xml").iter("personinfo")
    }
    arrived = odd_run.events().filter(pl.col("kind") == "arrived")
    mine = dict(arrived.select("actor", "travel_time").rows())
    assert len(persons) > 40
    assert {name: mine.get(name) for name in persons} == persons
    own = {row["id"]: row["status"] for row in odd_run.actors().to_dicts()}
    assert all(own[f"pf.{k}"] == "arrived" for k in range(30))
    visits = read_visits(odd_run.folder)
    assert visits is not None
    theirs = [
        (
            e.get("id"), e.get("busStop"), float(e.get("started", "")), float(e.get("ended", "")),
            float(e.get("ended", "")) - float(e.get("delay", "")),
            *(int(e.get(f"{kind}Persons", "")) for kind in ("initial", "loaded", "unloaded")),
        )
        for e in etree.parse(odd_project / "stops.xml").iter("stopinfo")
        if e.get("busStop")
    ]  # fmt: skip
    assert sorted(visits.rows()) == sorted(theirs)
    assert visits["boarded"].sum() == visits["alighted"].sum() == 39
    report = (odd_run.folder / "report.html").read_text()
    assert "On board on arrival" in report


def test_files_may_be_named_by_variables_of_the_environment(
    store: Workspace, project: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    config = tmp_path / "elsewhere.sumocfg"
    config.write_text(
        '<configuration><input><net-file value="${NETWORKS}/grid.net.xml"/>'
        '<route-files value="~/sub/cars.rou.xml"/></input></configuration>'
    )
    monkeypatch.delenv("NETWORKS", raising=False)
    monkeypatch.setenv("HOME", str(project))
    with pytest.raises(InputError, match="the environment has no variable NETWORKS") as refused:
        import_file(store, config)
    assert str(config) in str(refused.value)
    monkeypatch.setenv("NETWORKS", str(project))
    made = import_file(store, config).scenario
    assert made is not None
    assert made.sumo is not None
    assert [file.name for file in made.sumo.files] == ["cars.rou.xml"]
