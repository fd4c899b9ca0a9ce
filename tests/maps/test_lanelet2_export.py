"""Maps as Lanelet2: read by lanelet2 itself, and back in again."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from typing import TYPE_CHECKING

import numpy as np
import pytest
import shapely

from odscen.base.errors import InputError
from odscen.convert.model.conversion_report import ElementOutcome
from odscen.maps.importers.lanelet2.importer import Lanelet2Importer
from odscen.maps.lanelet2_export import export_lanelet2
from odscen.maps.shipped import shipped_maps
from odscen.opendrive.parse import parse
from tests.maps.importers.test_lanelet2 import (
    NEAR,
    border_lines,
    fork_file,
    imported,
    lane_reach,
    model_of,
)

if TYPE_CHECKING:
    from pathlib import Path


@pytest.mark.slow
def test_a_map_goes_out_and_comes_in_again_with_the_same_borders_and_relations() -> None:
    first = model_of(imported(bytes(fork_file()[0])))
    out = export_lanelet2(first)
    again = model_of(Lanelet2Importer().to_opendrive(out.osm, {"origin": "", "traffic": "auto"}))
    borders = [np.asarray(line.coords) for line in border_lines(first).geoms]
    tree = shapely.STRtree(list(border_lines(again).geoms))
    points = shapely.points(np.concatenate(borders))
    _, apart = tree.query_nearest(points, return_distance=True, all_matches=False)
    # Corners of a bound are rounded by what is left out of both files.
    assert np.quantile(apart, 0.99) < NEAR
    assert apart.max() < 0.05
    assert sorted(map(len, lane_reach(again).values())) == sorted(
        map(len, lane_reach(first).values())
    )
    assert len(again.junctions) == len(first.junctions)


def test_lights_and_stop_lines_are_regulatory_elements_that_lanelets_name() -> None:
    file, ids = fork_file()
    head = file.way([(41, -4, 5), (41, -5, 5)], type="traffic_light")
    line = file.way([(19, 0), (19, -3.5)], type="stop_line")
    light = file.regulatory("traffic_light", [("way", "refers", head), ("way", "ref_line", line)])
    file.refer(ids["approach"], light)
    root = ET.fromstring(export_lanelet2(model_of(imported(bytes(file)))).osm)
    relations = {relation.get("id"): relation for relation in root.iter("relation")}
    (element,) = [
        relation
        for relation in relations.values()
        if any(tag.get("v") == "regulatory_element" for tag in relation.iter("tag"))
    ]
    assert {member.get("role") for member in element.iter("member")} == {"refers", "ref_line"}
    named = [
        relation
        for relation in relations.values()
        for member in relation.iter("member")
        if member.get("role") == "regulatory_element" and member.get("ref") == element.get("id")
    ]
    assert len(named) == 1


def test_a_map_without_a_projection_says_where_it_was_put() -> None:
    text = b"""<OpenDRIVE><header revMajor="1" revMinor="6"/>
<road id="1" length="50" junction="-1"><planView><geometry s="0" x="0" y="0" hdg="0" length="50">
<line/></geometry></planView><lanes><laneSection s="0"><center><lane id="0" type="none"/></center>
<right><lane id="-1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>
<lane id="-2" type="tram"><width sOffset="0" a="3" b="0" c="0" d="0"/></lane></right>
</laneSection></lanes></road></OpenDRIVE>"""
    out = export_lanelet2(parse(text))
    assert [row.outcome for row in out.entries] == [ElementOutcome.LOST, ElementOutcome.GUESSED]
    assert "'tram'" in out.entries[0].reason
    root = ET.fromstring(export_lanelet2(parse(text), origin="49,8").osm)
    latitudes = [float(node.get("lat", "")) for node in root.iter("node")]
    assert max(latitudes) == pytest.approx(49.0, abs=1e-5)
    with pytest.raises(InputError, match="LATITUDE,LONGITUDE"):
        export_lanelet2(parse(text), origin="somewhere")


def test_a_shipped_map_is_read_by_lanelet2_without_an_error(tmp_path: Path) -> None:
    lanelet2 = pytest.importorskip("lanelet2", reason="the package lanelet2 is not installed")
    (path,) = (path for path in shipped_maps() if path.stem == "t_junction_signs")
    odr = parse(path.read_bytes())
    out = export_lanelet2(odr, origin="49,8.4")
    path = tmp_path / "map.osm"
    path.write_bytes(out.osm)
    projector = lanelet2.projection.UtmProjector(lanelet2.io.Origin(49.0, 8.4))
    found, problems = lanelet2.io.loadRobust(str(path), projector)
    assert not list(problems)
    assert len(found.laneletLayer) == out.osm.count(b'v="lanelet"')
