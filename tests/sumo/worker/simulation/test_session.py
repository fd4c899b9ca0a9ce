from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import sumo
from lxml import etree

from odscen.sumo.worker.protocol import EgoPose
from odscen.sumo.worker.simulation.session import Session

# libsumo is one global simulation, so each of these runs in a process of its own.
PRELUDE = """
import json, sys
from pathlib import Path
from odscen.base.errors import SimulationError
from odscen.sumo.worker.output_capture import captured_output
from odscen.sumo.worker.simulation.session import open_session
net = sys.argv[1]
"""


def run_script(body: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", PRELUDE + body, *arguments],
        capture_output=True,
        text=True,
        timeout=180,
        check=False,
    )


@pytest.mark.slow
def test_a_second_session_is_refused_and_the_first_lives_on(grid: Path) -> None:
    result = run_script(
        """
with open_session(["-n", net, "--xml-validation", "never"]) as session:
    session.step()
    try:
        with open_session(["-n", net]):
            pass
    except SimulationError as error:
        refused = str(error)
    session.step()
    print(json.dumps({"refused": refused, "time": session.time}))
""",
        str(grid),
    )
    said = json.loads(result.stdout)
    assert "already" in said["refused"]
    assert said["time"] == 2.0


@pytest.mark.slow
def test_a_session_can_follow_one_that_was_closed_by_an_error(grid: Path) -> None:
    result = run_script(
        """
try:
    with open_session(["-n", net, "--xml-validation", "never"]) as session:
        session.step()
        raise ValueError("ours")
except ValueError:
    pass
with open_session(["-n", net, "--xml-validation", "never"]) as session:
    print(json.dumps(session.time))
""",
        str(grid),
    )
    assert json.loads(result.stdout) == 0.0


@pytest.mark.slow
def test_a_refused_start_is_a_simulation_error_and_sumos_words_are_in_the_log(
    tmp_path: Path,
) -> None:
    log = tmp_path / "sumo.log"
    result = run_script(
        """
with captured_output(Path(sys.argv[2])) as stdout:
    try:
        with open_session(["-n", net]):
            pass
    except SimulationError as error:
        stdout.write(json.dumps(str(error)))
""",
        str(tmp_path / "missing.net.xml"),
        str(log),
    )
    assert "refused to start" in json.loads(result.stdout)
    assert result.stderr == ""
    assert "missing.net.xml" in log.read_text()


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="descriptors are checked through /bin/sh")
def test_output_of_child_programs_is_captured_too_and_restored_afterwards(tmp_path: Path) -> None:
    log = tmp_path / "log"
    result = run_script(
        """
import os
with captured_output(Path(net)) as stdout:
    os.system("echo from below; echo and below >&2")
    stdout.write("message\\n")
os.system("echo after")
""",
        str(log),
    )
    assert result.stdout == "message\nafter\n"
    assert log.read_text() == "from below\nand below\n"


def test_importing_libsumo_prints_nothing_to_stdout_even_where_it_would(tmp_path: Path) -> None:
    (tmp_path / "libsumo").mkdir()
    (tmp_path / "libsumo" / "__init__.py").write_text("import os\nos.write(1, b'Warning!')\n")
    result = run_script(
        """
sys.path.insert(0, sys.argv[1])
from odscen.sumo.worker.simulation.libsumo_import import import_libsumo
import_libsumo()
print("clean")
""",
        str(tmp_path),
    )
    assert result.stdout == "clean\n"
    assert result.stderr == "Warning!"


@pytest.mark.slow
def test_somebody_who_waits_for_a_lane_change_long_before_the_turn_has_that_as_the_reason(
    tmp_path: Path,
) -> None:
    """Lanes may be changed on ``ab`` only; ``ab`` leads on, but only its left lane to ``ce``."""
    (tmp_path / "n.nod.xml").write_text(
        '<nodes><node id="a" x="0" y="0"/><node id="b" x="100" y="0"/><node id="c" x="140" y="0"/>'
        '<node id="d" x="240" y="0"/><node id="e" x="140" y="100"/></nodes>'
    )
    fixed = "".join(
        f'<lane index="{k}" changeLeft="emergency" changeRight="emergency"/>' for k in (0, 1)
    )
    (tmp_path / "e.edg.xml").write_text(
        '<edges><edge id="ab" from="a" to="b" numLanes="2"/>'
        f'<edge id="bc" from="b" to="c" numLanes="2">{fixed}</edge>'
        '<edge id="cd" from="c" to="d"/><edge id="ce" from="c" to="e"/></edges>'
    )
    (tmp_path / "c.con.xml").write_text(
        '<connections><connection from="ab" to="bc" fromLane="0" toLane="0"/>'
        '<connection from="ab" to="bc" fromLane="1" toLane="1"/>'
        '<connection from="bc" to="cd" fromLane="0" toLane="0"/>'
        '<connection from="bc" to="ce" fromLane="1" toLane="0"/></connections>'
    )
    files = ("-n", "n.nod.xml", "-e", "e.edg.xml", "-x", "c.con.xml", "-o", "net.xml")
    netconvert = Path(sumo.SUMO_HOME) / "bin" / "netconvert"
    subprocess.run([netconvert, *files], cwd=tmp_path, check=True, capture_output=True)
    parked = "".join(
        f'<vehicle id="p{x}" depart="0" departLane="1" departPos="{x}" insertionChecks="none">'
        f'<route edges="ab bc ce"/><stop lane="ab_1" endPos="{x + 0.1}" duration="900"/></vehicle>'
        for x in range(10, 96, 6)
    )
    (tmp_path / "r.rou.xml").write_text(
        f'<routes>{parked}<vehicle id="one" depart="0" departLane="0" departPos="60">'
        '<route edges="ab bc ce"/></vehicle></routes>'
    )
    result = run_script(
        """
with open_session(["-n", net, "-r", sys.argv[2], "--xml-validation", "never"]) as session:
    while session.time < 60:
        session.step()
    ((lane, _),) = session.vehicle_places(["one"])
    print(json.dumps([lane, *session.stopped.ahead("one")]))
""",
        str(tmp_path / "net.xml"),
        str(tmp_path / "r.rou.xml"),
    )
    lane, onwards, *_, beside = json.loads(result.stdout)
    assert (lane, onwards, beside) == ("ab_0", False, True)


@pytest.mark.slow
def test_who_stands_in_a_junction_is_ahead_of_those_whose_way_is_crossed(
    grid: Path, tmp_path: Path
) -> None:
    (tmp_path / "r.rou.xml").write_text(
        '<routes><vType id="slow" maxSpeed="3"/><vehicle id="foe" type="slow" depart="0"'
        ' departPos="80"><route edges="B0B1 B1B2"/></vehicle>'
        '<vehicle id="one" depart="12" departPos="20"><route edges="A1B1 B1C1"/></vehicle></routes>'
    )
    result = run_script(
        """
with open_session(["-n", net, "-r", sys.argv[2], "--xml-validation", "never"]) as session:
    import libsumo
    libsumo.trafficlight.setRedYellowGreenState("B1", "G" * len(
        libsumo.trafficlight.getRedYellowGreenState("B1")
    ))
    stopped = False
    while session.time < 60:
        session.step()
        if not stopped and session.vehicle_front("foe").y > 119.0:  # the middle of B1 is at 120
            libsumo.vehicle.setSpeed("foe", 0.0)
            stopped = True
    ahead = session.stopped.ahead
    print(json.dumps([stopped, ahead("one").leader, ahead("foe").onwards]))
""",
        str(grid),
        str(tmp_path / "r.rou.xml"),
    )
    assert result.stdout, result.stderr
    assert json.loads(result.stdout) == [True, "foe", True]


@pytest.mark.slow
def test_lanes_for_vehicles_are_told_by_edge_and_those_inside_junctions_are_known(
    grid: Path,
) -> None:
    result = run_script(
        """
with open_session(["-n", net, "--xml-validation", "never"]) as session:
    print(json.dumps([session.lanes.lengths(), sorted(session.lanes.internal)]))
""",
        str(grid),
    )
    lengths, inside = json.loads(result.stdout)
    edges = list(etree.parse(grid).getroot().iterfind("edge"))
    driven = {
        edge.get("id"): {
            lane.get("id"): float(lane.get("length"))
            for lane in edge.iterfind("lane")
            if lane.get("allow") != "pedestrian"
        }
        for edge in edges
    }
    assert lengths == {edge: lanes for edge, lanes in driven.items() if lanes}
    internal = [edge for edge in edges if edge.get("function") == "internal"]
    assert inside == sorted(lane for edge in internal for lane in driven[edge.get("id")])
    assert len(inside) > 4


def test_a_lane_is_looked_for_near_the_place_and_not_all_over_the_map() -> None:
    """SUMO looks within 100 m by itself, which costs three to four times as much."""
    asked: list[tuple[Any, ...]] = []
    vehicle = SimpleNamespace(
        setSpeed=lambda *_: None,
        moveToXY=lambda *given: asked.append(given),
        getRoute=lambda _: (),
        getRouteIndex=lambda _: -1,
    )
    session = Session.__new__(Session)
    session._sumo, session._errors = SimpleNamespace(vehicle=vehicle), (RuntimeError,)
    assert session.place("a", EgoPose(1.0, 2.0, 3.0, 4.0), again=True)
    [(*_, keep_route, radius)] = asked
    assert keep_route == 2
    assert 3.0 <= radius <= 10.0
