"""Pedestrians that another program moves: drivers brake for them, and they are not the run's."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

from odscen.maps.store import Workspace

CROSSING = Path(__file__).parents[4] / "maps" / "signal_crossing.xodr"

# libsumo is one global simulation, so this runs in a process of its own.
SCRIPT = """
import json, math, sys
from odscen.sumo.worker.protocol import ForeignUser
from odscen.sumo.worker.simulation.libsumo_import import import_libsumo
from odscen.sumo.worker.simulation.session import open_session
with open_session(["-n", sys.argv[1], "--step-length", "0.1", "--no-step-log"]) as session:
    sumo = import_libsumo()
    sumo.route.add("r", [sys.argv[2]])
    sumo.vehicle.add("car", "r", departLane="first", departPos="5", departSpeed="5")
    session.step()
    x, y = sumo.vehicle.getPosition("car")
    angle = sumo.vehicle.getAngle("car")
    px, py = x + 45 * math.sin(math.radians(angle)), y + 45 * math.cos(math.radians(angle))
    foreign = session.foreign_traffic()
    person = ForeignUser("7", "pedestrian", px, py, angle + 90, 0.0, 0.4, 0.5)
    speeds, places, happened = [], [], []
    for step in range(140):
        foreign.show([person] if step < 100 else [])
        session.step()
        speeds.append(sumo.vehicle.getSpeed("car"))
        places += [sumo.vehicle.getPosition(name) for name in sumo.vehicle.getIDList()[1:]]
        lists = session.happened()
        if step == 99:
            left = math.dist(sumo.vehicle.getPosition("car"), (px, py))
        happened += [] if lists is None else [*lists.departed_persons, *lists.arrived_persons]
    print(json.dumps({
        "speeds": speeds, "off": max(math.dist(place, (px, py)) for place in places),
        "shown": len(places), "left": left, "happened": happened,
        "expected": session.expected(), "running": session.running(),
    }))
"""


def test_drivers_brake_for_a_pedestrian_of_another_program_until_it_is_gone(tmp_path: Path) -> None:
    workspace = Workspace.open(tmp_path)
    entry = workspace.add_map(CROSSING)
    net = next(entry.folder.rglob("net.net.xml"))
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, str(net), "1.0.b"],
        capture_output=True, text=True, timeout=180, check=True,
    )  # fmt: skip
    told = json.loads(done.stdout.splitlines()[-1])
    assert told["shown"] == 100
    assert told["off"] < 1e-6
    assert max(told["speeds"][:60]) > 8.0
    assert max(told["speeds"][80:100]) < 0.5
    assert told["left"] > 0.5, "metres to the pedestrian"
    assert told["speeds"][-1] > 3.0, "it drives on when the road is free"
    assert told["happened"] == []
    assert (told["expected"], told["running"]) == (1, 1)
