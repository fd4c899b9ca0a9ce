"""Paths for persons: a lane for each direction is a ring in SUMO, and lanes may be parallel."""

from __future__ import annotations

import math
import os
import subprocess
import xml.etree.ElementTree as ET
from collections import Counter
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import sumo

from odscen.convert.verify.fidelity import verify
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.parse import parse
from tests.convert.maps import Converted, converted, each_map, of_model, shape
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


def parallel_lanes() -> bytes:
    """A sidewalk that is three lanes wide for 100 m, between two of one lane."""

    def part(number: int, lanes: int) -> str:
        others = {1: 1, 2: 3, 3: 1}
        links = [
            f'<{end} elementType="road" elementId="{other}" contactPoint="{at}"/>'
            for end, other, at in (
                ("predecessor", number - 1, "end"), ("successor", number + 1, "start")
            )
            if other in others
        ]  # fmt: skip
        own = "".join(
            f'<lane id="{-k}" type="sidewalk"><link>'
            + "".join(
                f'<{end} id="{-min(k, others[other])}"/>'
                for end, other in (("predecessor", number - 1), ("successor", number + 1))
                if other in others
            )
            + '</link><width sOffset="0" a="2" b="0" c="0" d="0"/></lane>'
            for k in range(1, lanes + 1)
        )
        return (
            f'<road id="{number}" length="100" junction="-1"><link>{"".join(links)}</link>'
            f'<planView><geometry s="0" x="{100 * number}" y="0" hdg="0" length="100"><line/>'
            '</geometry></planView><lanes><laneSection s="0"><center><lane id="0" type="none"/>'
            f"</center><right>{own}</right></laneSection></lanes></road>"
        )

    return document(part(1, 1), part(2, 3), part(3, 1))


def areas_of_edges(made: Converted) -> dict[str, frozenset[str]]:
    """The walking areas that each edge for persons leads to."""
    found: dict[str, set[str]] = {}
    for link in made.xml.iter("connection"):
        ends = link.get("from", ""), link.get("to", "")
        for one, other in (ends, ends[::-1]):
            if one.startswith(":") and "_w" in one:
                found.setdefault(other, set()).add(one)
    return {edge: frozenset(areas) for edge, areas in found.items()}


def test_a_person_who_turns_back_on_the_lane_beside_does_not_jump(tmp_path: Path) -> None:
    made = of_model(parse(parallel_lanes()))
    net, routes, places = tmp_path / "net.net.xml", tmp_path / "r.rou.xml", tmp_path / "fcd.xml"
    net.write_bytes(made.network.net_xml)
    shapes = {e.get("id", ""): shape(e[0]) for e in made.xml.iter("edge") if not e.get("function")}
    # From the middle of one of the wide lanes over its end to the lane beside, 10 m back.
    beside = sorted(
        (name for name, line in shapes.items() if line[:, 0].max() > 195.0 > line[:, 0].min()),
        key=lambda name: -shapes[name][-1, 1],
    )
    assert len(beside) == 3
    ends_last = shapes[beside[1]][-1, 0] > shapes[beside[1]][0, 0]
    assert ends_last
    length = float(np.ptp(shapes[beside[1]][:, 0]))
    routes.write_text(
        f'<routes><person id="p" depart="0" departPos="20"><walk edges="{beside[0]} {beside[1]}"'
        f' arrivalPos="{length - 10.0}"/></person></routes>',
        encoding="utf-8",
    )
    command = [SUMO, "-n", net, "-r", routes, "--fcd-output", places, "--no-step-log"]
    env = {**os.environ, "SUMO_HOME": sumo.SUMO_HOME}
    subprocess.run(command, env=env, check=True, capture_output=True)
    walked_over = [
        (float(p.get("x", "nan")), float(p.get("y", "nan")))
        for p in ET.parse(places).getroot().iter("person")
    ]
    assert len(walked_over) > 20
    assert max(math.dist(a, b) for a, b in pairwise(walked_over)) < 2.5


@each_map()
def test_no_two_ways_join_the_same_two_walking_areas(path: Path) -> None:
    made = converted(path)
    joined = Counter(areas for areas in areas_of_edges(made).values() if len(areas) == 2)
    assert [areas for areas, count in joined.items() if count > 1] == []
