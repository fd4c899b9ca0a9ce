"""Writes docs/images/measure-*.svg: the measures that docs/measures.md shows, on their map.

``python -m tools.measure_pictures``. Each picture is of the example of that id in the document.
"""

from __future__ import annotations

import json
import re
import tempfile
from pathlib import Path

import numpy as np

from odscen.app.maps import LoadedMap, load_map
from odscen.base.markup import element
from odscen.drawing.svg_layers import LayerOptions, map_layers
from odscen.maps.store import Workspace
from odscen.reports.report_maps import fitted_view, measure_layer, scale_bar, view_box
from odscen.scenario.document.scenario_document import MapReference, Scenario
from odscen.sumo.realize.traffic_measures.measure_actions import measure_actions
from tools import map_style

ROOT = Path(__file__).parents[1]
DOCUMENT = ROOT / "docs" / "measures.md"
MAP = ROOT / "maps" / "town_5x5.xodr"
MARGIN = 60.0
"""Metres of map around a measure."""
STYLE = map_style.STYLE + (
    ".measures path{fill:none;stroke:#b45309;stroke-linecap:round;stroke-linejoin:round;"
    "opacity:.75}.measures text{fill:#b45309;dominant-baseline:middle}"
)


def examples(text: str) -> list[dict[str, object]]:
    """Measures in the fenced JSON of the document."""
    return [json.loads(block) for block in re.findall(r"```json\n(\{.*?\})\n```", text, re.DOTALL)]


def picture(loaded: LoadedMap, measure: dict[str, object]) -> str:
    """SVG of one measure with the map around it."""
    graph = loaded.sumo.graph
    scenario = Scenario.model_validate(
        {
            "name": "example",
            "map": MapReference(
                name=graph.map_name, sha256=graph.map_sha256, spacing=graph.lanes.spacing
            ),
            "roi": tuple(map(str, graph.segments.ids)),
            "measures": [measure],
        }
    )
    planned = measure_actions(scenario, loaded.sumo, until=2400.0).measures
    points = np.concatenate([np.array(line).reshape(-1, 2) for line in planned[0].lines])
    around = np.concatenate([points - MARGIN, points + MARGIN])
    bounds = fitted_view(around, None)
    assert bounds is not None
    layers = map_layers(
        loaded.drawing.clipped(bounds), LayerOptions(symbol_size=3.0, prefix="map-")
    )
    marks = measure_layer(planned, (bounds[2] - bounds[0]) / 150.0)
    svg = element(
        "svg",
        element("title", planned[0].words),
        element("style", STYLE),
        layers,
        marks,
        scale_bar(bounds),
        xmlns="http://www.w3.org/2000/svg",
        viewBox=view_box(bounds),
        width="720",
        role="img",
    )
    return str(svg) + "\n"


def main() -> None:
    """Write all pictures."""
    with tempfile.TemporaryDirectory() as name:
        workspace = Workspace.open(Path(name))
        loaded = load_map(workspace.add_map(MAP))
        for measure in examples(DOCUMENT.read_text(encoding="utf-8")):
            path = ROOT / "docs" / "images" / f"measure-{measure['id']}.svg"
            path.write_text(picture(loaded, measure), encoding="utf-8")


if __name__ == "__main__":
    main()
