"""The example of docs/parking.md: the shipped town with parking places, run, and its picture.

``python -m tools.parking_example`` writes ``docs/images/parking.svg`` and prints what areas had.
"""

from __future__ import annotations

import json
import tempfile
from pathlib import Path

import numpy as np

from odscen.app.maps import LoadedMap, load_map
from odscen.app.running.runs import carry_out, check_run, prepare_run
from odscen.base.markup import element, path_data
from odscen.drawing.svg_layers import LayerOptions, map_layers
from odscen.maps.store import Workspace
from odscen.reports.report_maps import fitted_view, parking_layer, scale_bar, view_box
from odscen.runs.measured import read_parking
from odscen.scenario.document.scenario_document import MapReference, Scenario
from odscen.sumo.realize.transit.parking_places import parking_positions, planned_parking

ROOT = Path(__file__).parents[1]
TOWN = ROOT / "maps" / "town_5x5.xodr"
ROADS = (1, 4, 7)
PLACES = 4
"""In each row."""
ROW = """<object id="{id}" type="parkingSpace" name="" s="{s}" t="{t}" zOffset="0" hdg="0"
 orientation="none" length="5.5" width="2"><repeat s="{s}" length="{length}" distance="6"
 tStart="{t}" tEnd="{t}" heightStart="0" heightEnd="0" zOffsetStart="0" zOffsetEnd="0"/></object>
"""
"""A row of places, 6 m each, parallel to the road."""
MARGIN = 12.0
"""Metres of map around the places of the picture."""
DEMAND = {
    "background": [{"id": "city", "trips": 300, "end": 3000}],
    "parking": {
        "begin": 0.1,
        "end": 0.3,
        "stay": {"kind": "uniform", "low": 300, "high": 1200},
    },
}
STYLE = (
    ".places{fill:#dbe7fb;stroke:#1c4fa0;stroke-width:12}.parking-areas{font-weight:700;"
    "font-family:sans-serif}.scale path{fill:none;stroke:#333}"
    ".scale text{fill:#333;font-family:sans-serif}"
)


def with_rows(text: str, roads: tuple[int, ...] = ROADS) -> str:
    """Text of the town with a row of places on both sides of some roads."""
    for road in roads:
        start = text.index(f' id="{road}" junction="-1"')
        at = text.index("</objects>", start)
        rows = [
            ROW.format(id=9000 + 2 * road + side, s=22, t=t, length=6 * PLACES)
            for side, t in enumerate((-4.4, 4.4))
        ]
        text = text[:at] + "".join(rows) + text[at:]
    return text


def scenario_on(loaded: LoadedMap) -> Scenario:
    """Traffic in the whole town, of which some trips park."""
    graph = loaded.sumo.graph
    return Scenario.model_validate(
        {
            "name": "parking",
            "map": MapReference(name=graph.map_name, sha256=graph.map_sha256),
            "seed": 1,
            "roi": tuple(map(str, graph.segments.ids)),
            "demand": DEMAND,
            "simulation": {"duration": 3600.0},
        }
    )


def picture(loaded: LoadedMap) -> str:
    """SVG of the areas of one street with the map around them."""
    sumo = loaded.sumo
    everywhere = np.ones(len(sumo.graph.lanes.x), dtype=np.bool_)
    areas = planned_parking(parking_positions(sumo, everywhere).values(), sumo)
    rings = loaded.drawing.parking_spaces
    first = np.concatenate(rings.each[: 2 * PLACES])  # of one street; the others look the same
    bounds = fitted_view(np.concatenate([first - MARGIN, first + MARGIN]), None)
    assert bounds is not None
    layers = map_layers(
        loaded.drawing.clipped(bounds), LayerOptions(symbol_size=3.0, prefix="map-")
    )
    svg = element(
        "svg",
        element("title", "Parking areas of the example"),
        element("style", STYLE),
        layers,
        element(
            "path", d=path_data(rings.xy * (1.0, -1.0), rings.start, closed=True), class_="places"
        ),
        parking_layer(areas[:2], (bounds[2] - bounds[0]) / 150.0),
        scale_bar(bounds),
        xmlns="http://www.w3.org/2000/svg",
        viewBox=view_box(bounds),
        width="720",
        style="background:#f2efe8",
        role="img",
    )
    return str(svg) + "\n"


def main() -> None:
    """Run the example, write its picture, print its figures."""
    with tempfile.TemporaryDirectory() as name:
        workspace = Workspace.open(Path(name) / "workspace")
        file = Path(name) / "parking_town.xodr"
        file.write_text(with_rows(TOWN.read_text(encoding="utf-8")), encoding="utf-8")
        loaded = load_map(workspace.add_map(file))
        (ROOT / "docs" / "images" / "parking.svg").write_text(picture(loaded), encoding="utf-8")
        checked = check_run(workspace, scenario_on(loaded), name="parking")
        done = carry_out(checked, prepare_run(checked))
        parking = read_parking(done.folder, end=3600.0)
        assert parking is not None
        for area in parking.areas:
            print(area.id, area.segment, *parking.use(area.id))
        print("all", *parking.use())
        print(json.dumps(done.summary["figures"]), done.summary["actors"], done.summary["problems"])


if __name__ == "__main__":
    main()
