"""Paths for persons alone, a lane for each direction: rings in SUMO, divided in three."""

from __future__ import annotations

import os
import subprocess
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
import sumo

from odscen.convert.verify.fidelity import verify
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.parse import parse
from tests.convert.maps import Converted, of_model
from tests.opendrive.snippets import document, lane, road, section

SUMO = Path(sumo.SUMO_HOME) / "bin" / "sumo"


def path_of(length: float) -> bytes:
    """A path with a lane of a metre for each direction."""
    lanes = section(lane(1, kind="sidewalk", width=1.0), lane(-1, kind="sidewalk", width=1.0))
    plan = f'<geometry s="0" x="0" y="0" hdg="0" length="{length}"><line/></geometry>'
    return document(road(plan=plan, length=length, lanes=lanes))


def walked(made: Converted, folder: Path) -> float:
    """Seconds of a person in SUMO from 1 m of the first part of the ring to 5 m of the second."""
    net, routes, trips = folder / "net.net.xml", folder / "walk.rou.xml", folder / "trips.xml"
    net.write_bytes(made.network.net_xml)
    walks = [e.get("id") for e in made.xml.iter("edge") if e.get("function") is None]
    routes.write_text(
        f'<routes><person id="p" depart="0" departPos="1"><walk from="{walks[0]}"'
        f' to="{walks[1]}" arrivalPos="5"/></person></routes>',
        encoding="utf-8",
    )
    command = [SUMO, "-n", net, "-r", routes, "--tripinfo-output", trips, "--no-step-log"]
    env = {**os.environ, "SUMO_HOME": sumo.SUMO_HOME}
    subprocess.run(command, env=env, check=True, capture_output=True)
    walk = ET.parse(trips).getroot().find("personinfo/walk")
    assert walk is not None
    return float(walk.get("duration", "nan"))


@pytest.mark.parametrize("length", [10.0, 33.0, 300.0])
def test_no_metre_of_a_path_is_lost_where_its_ring_is_divided(length: float) -> None:
    odr = parse(path_of(length))
    made = of_model(odr)
    fidelity = verify(made.network.net_xml, odr, RoadTable.of(odr))
    assert fidelity.sidewalks.length == pytest.approx(2.0 * length)
    assert fidelity.sidewalks.share == 1.0


def test_persons_walk_over_what_divides_a_ring(tmp_path: Path) -> None:
    seconds = walked(of_model(parse(path_of(33.0))), tmp_path)
    assert seconds == pytest.approx(26.0 / 1.39, rel=0.15)
