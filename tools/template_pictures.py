"""Writes the pictures of templates: each on a shipped map, at the instant of its trigger.

``python -m tools.template_pictures``. Lines are where the bodies were led in a run, from the
trigger on; the bodies are where they were then. The page and docs/templates.md show the same files.
"""

from __future__ import annotations

import json
import math
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import polars as pl
from markupsafe import Markup

from odscen.app.maps import load_map
from odscen.app.template_scenarios import template_scenario
from odscen.base.markup import element
from odscen.drawing.svg_layers import LayerOptions, map_layers
from odscen.maps.store import Workspace
from odscen.records.run_plan import Plan
from odscen.reports.report_maps import scale_bar, view_box
from odscen.runs.recorded import read_trajectories
from odscen.runs.run_settings import RunSettings
from odscen.sumo.runner.prepare import prepare
from odscen.sumo.runner.run_jobs import run_prepared
from tools import map_style

if TYPE_CHECKING:
    from odscen.app.maps import LoadedMap
    from odscen.scenario.document.scenario_document import Scenario

ROOT = Path(__file__).parents[1]
PAGE, DOCS = ROOT / "frontend" / "public" / "templates", ROOT / "docs" / "images"
SHOWN = {
    "cut-in": ("motorway_weave", "cut-in"),
    "lead-brakes": ("rural_hills", "brake"),
    "hidden-child": ("town_5x5", "cross"),
    "mid-block": ("town_5x5", "cross"),
    "red-light": ("signal_crossing", "run"),
    "oncoming": ("rural_hills", "overtake"),
    "bus-leaves": ("motorway_weave", "leave"),
}
"""Map and rule of each template's picture."""
SECONDS = 5.0
"""Of the lines."""
MARGIN = 10.0
EGO, OTHER = "#1d4ed8", "#b45309"
STYLE = map_style.STYLE + (".way{fill:none;stroke-linecap:round;stroke-linejoin:round;opacity:.55}")


def _run(loaded: LoadedMap, scenario: Scenario, folder: Path) -> tuple[pl.DataFrame, Plan, float]:
    """Trajectories and plan of a run, and the instant of the picture."""
    net = loaded.entry.checked("net")
    run_prepared(prepare(scenario, loaded.sumo, net, settings=RunSettings()), folder)
    found = read_trajectories(folder)
    assert found is not None
    events = json.loads((folder / "events.json").read_text(encoding="utf-8"))
    rule = SHOWN[scenario.name][1]
    instant = next(
        one["time"]
        for one in (events["events"] if isinstance(events, dict) else events)
        if one["kind"] == "rule_started" and one.get("rule") == rule
    )
    plan = Plan.from_json((folder / "plan.json").read_text(encoding="utf-8"))
    return found.rows, plan, float(instant)


def picture(loaded: LoadedMap, scenario: Scenario, folder: Path) -> str:
    """SVG of a template where it has been placed."""
    rows, plan, instant = _run(loaded, scenario, folder)
    prefix = next(p for p in ("vehicle_", "person_", "") if f"{p}x" in rows.columns)
    after = rows.sort("timestep_time").filter(
        pl.col("timestep_time").is_between(instant - 0.05, instant + SECONDS)
    )
    ways, names, points = [], [], []
    for actor in plan.actors:
        one = after.filter(pl.col(f"{prefix}id") == actor.id)
        if not len(one):
            continue
        x, y, angle = (one[f"{prefix}{name}"].cast(pl.Float64).to_numpy() for name in (
            "x", "y", "angle"
        ))  # fmt: skip
        hdg = np.radians(90.0 - angle)
        x = x - plan.net_offset[0] - np.cos(hdg) * actor.length / 2.0
        y = y - plan.net_offset[1] - np.sin(hdg) * actor.length / 2.0
        points.append(np.stack([x, y], axis=1))
        colour = EGO if actor.id == "ego" else OTHER
        ways += _way(x, y, float(hdg[0]), colour, actor.length, max(actor.width, 0.5))
        names.append((actor.id, float(x[0]), float(y[0]), colour))
    bounds = _bounds(np.concatenate(points))
    size = (bounds[2] - bounds[0]) / 34.0
    labels = [
        element(
            "text", name, x=f"{x:.2f}", y=f"{size * (1.7 if n % 2 else -0.8) - y:.2f}", fill=colour
        )
        for n, (name, x, y, colour) in enumerate(names)
    ]
    layers = map_layers(
        loaded.drawing.clipped(bounds), LayerOptions(symbol_size=3.0, prefix="map-")
    )
    svg = element(
        "svg",
        element("title", scenario.description.partition(". ")[0]),
        element("style", STYLE + f".names{{font-size:{size:.2f}px}}"),
        layers,
        element("g", Markup("").join(ways), transform="scale(100)"),
        element("g", Markup("").join(labels), class_="names", transform="scale(100)"),
        scale_bar(bounds),
        xmlns="http://www.w3.org/2000/svg",
        viewBox=view_box(bounds),
        width="720",
        height="405",
        role="img",
    )
    return str(svg) + "\n"


def _bounds(points: np.ndarray) -> tuple[float, float, float, float]:
    """Sixteen by nine around points, shape ``(N, 2)``."""
    low, high = points.min(axis=0) - MARGIN, points.max(axis=0) + MARGIN
    wide = max(float(high[0] - low[0]), float(high[1] - low[1]) * 16.0 / 9.0)
    x, y = ((low + high) / 2.0).tolist()
    return x - wide / 2.0, y - wide * 9.0 / 32.0, x + wide / 2.0, y + wide * 9.0 / 32.0


def _way(
    x: np.ndarray, y: np.ndarray, hdg: float, colour: str, length: float, width: float
) -> list[Markup]:
    """Line of a body's centre, and the body at its beginning."""
    line = " ".join(f"{a:.2f},{-b:.2f}" for a, b in zip(x[::3], y[::3], strict=True))
    body = element(
        "rect", x=f"{-length / 2:.2f}", y=f"{-width / 2:.2f}", width=f"{length:.2f}",
        height=f"{width:.2f}", fill=colour, rx="0.3",
        transform=f"translate({x[0]:.2f} {-y[0]:.2f}) rotate({-math.degrees(hdg):.1f})",
    )  # fmt: skip
    way = element("polyline", points=line, class_="way", stroke=colour, stroke_width="0.6")
    return [way, body]


def main() -> None:
    """Write all pictures."""
    with tempfile.TemporaryDirectory() as name:
        workspace = Workspace.open(Path(name))
        for map_name in sorted({map_name for map_name, _ in SHOWN.values()}):
            workspace.add_map(ROOT / "maps" / f"{map_name}.xodr")
        for template, (map_name, _) in SHOWN.items():
            loaded = load_map(workspace.map(map_name))
            scenario = template_scenario(workspace, template, map_name, name=template)
            svg = picture(loaded, scenario, Path(name) / template)
            for path in (PAGE / f"{template}.svg", DOCS / f"template-{template}.svg"):
                path.write_text(svg, encoding="utf-8")


if __name__ == "__main__":
    main()
